import math

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from ars_web.datasets.writers.digits import put_bytes, put_decimal, put_integer, scaled

INTEGERS = st.integers(-(10**17), 10**17)


@settings(deadline=None)
@given(INTEGERS)
@example(0)
@example(9)
@example(10)
@example(-1)
def test_integers_are_written_as_python_writes_them(value: int) -> None:
    buffer = np.zeros(40, dtype=np.uint8)
    end = put_integer(buffer, 3, value)
    assert buffer[3:end].tobytes() == str(value).encode()
    assert not buffer[end:].any()


@settings(deadline=None)
@given(INTEGERS, st.sampled_from([2, 4, 6]))
@example(-5, 2)
@example(99, 2)
@example(1_000_000, 6)
def test_decimals_are_written_as_text_says_them(value: int, decimals: int) -> None:
    buffer = np.zeros(40, dtype=np.uint8)
    end = put_decimal(buffer, 0, value, decimals)
    whole, fraction = divmod(abs(value), 10**decimals)
    assert buffer[:end].tobytes().decode() == f"{'-' if value < 0 else ''}{whole}.{fraction:0{decimals}d}"


@settings(deadline=None)
@given(st.floats(-1e9, 1e9), st.sampled_from([1e2, 1e4, 1e6]))
@example(0.0000005, 1e6)
@example(-0.005, 1e2)
@example(-0.0, 1e2)
def test_scaling_rounds_to_the_nearest_integer_halves_up(value: float, scale: float) -> None:
    found = scaled(value, scale)
    assert found == math.floor(value * scale + 0.5)
    assert abs(found - value * scale) <= 0.5 + 1e-6


def test_bytes_are_copied() -> None:
    buffer = np.zeros(8, dtype=np.uint8)
    assert put_bytes(buffer, 2, np.frombuffer(b"abc", dtype=np.uint8)) == 5
    assert buffer.tobytes() == b"\0\0abc\0\0\0"
