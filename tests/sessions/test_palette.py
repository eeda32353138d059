"""Classes get colours that can be told apart."""

import pytest

from ars_web.errors import BadInput
from ars_web.sessions.palette import OKABE_ITO, PALETTE, checked_color, next_color


def test_the_first_seven_are_okabe_and_itos_and_all_differ():
    assert PALETTE[:7] == OKABE_ITO
    assert len(set(PALETTE)) == len(PALETTE) == 35
    assert [checked_color(color) for color in PALETTE] == list(PALETTE)


def test_the_next_colour_is_the_first_that_nobody_has():
    assert next_color([]) == "#56b4e9"
    assert next_color(["#56b4e9", "#009e73", "#123456"]) == "#e69f00"
    assert next_color(PALETTE) == PALETTE[0]
    assert next_color([*PALETTE, PALETTE[0]]) == PALETTE[1]


@pytest.mark.parametrize("color", ["red", "#fff", "#12345g", "#1234567", "#123456;x", "", "#123456\n"])
def test_what_is_no_colour_is_refused(color: str):
    with pytest.raises(BadInput, match="#rrggbb"):
        checked_color(color)


def test_colours_are_kept_in_lower_case():
    assert checked_color("#ABCDEF") == "#abcdef"
