"""Snapping of lengths and angles."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ars_web.errors import BadInput
from ars_web.scene.snapping import snapped, snapped_change, snapped_size

steps = st.sampled_from([0.0, 0.0002, 0.001, 0.005, 0.01, 0.3, math.radians(5)])
lengths = st.floats(-50, 50)


@given(lengths, steps)
def test_a_snapped_value_is_the_nearest_multiple_and_stays(value: float, step: float) -> None:
    to = snapped(value, step=step)
    assert abs(to - value) <= step / 2 + 1e-12
    if step > 0:
        assert abs(to / step - round(to / step)) < 1e-6
    assert snapped(to, step=step) == to


def test_a_decimal_step_gives_the_decimal_number_itself() -> None:
    assert [snapped(n * 1e-3 + 2e-4, step=1e-3) for n in (85, 123, 1001)] == [0.085, 0.123, 1.001]
    assert snapped_change(np.array([0.0304, -0.0596, 0.0]), step=0.01).tolist() == [0.03, -0.06, 0.0]


@given(st.floats(0.001, 3), st.floats(-0.5, 0.5), steps)
def test_a_side_snaps_to_multiples_or_back_to_where_it_was(start: float, change: float, step: float) -> None:
    to = snapped_size(start + change, start=start, step=step, least=0.001)
    assert to >= 0.001
    if start + change >= 0.001 + step:
        assert abs(to - (start + change)) <= step / 2 + 1e-12
    assert snapped_size(start, start=start, step=step, least=0.001) == start


def test_a_side_keeps_its_least_length_on_the_grid() -> None:
    assert snapped_size(-3.0, start=0.085, step=0.01, least=0.001) == 0.01
    assert snapped_size(-3.0, start=0.085, step=0.0, least=0.001) == 0.001


@pytest.mark.parametrize("step", [-0.001, math.nan, math.inf])
def test_a_step_that_is_none_is_refused(step: float) -> None:
    with pytest.raises(BadInput, match="snap"):
        snapped(1.0, step=step)
