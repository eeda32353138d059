"""The colours that classes get unless told otherwise, told apart by colour-blind eyes as far as colours can be."""

import re
from collections.abc import Iterable

from ars_web.errors import BadInput

OKABE_ITO = ("#56b4e9", "#e69f00", "#009e73", "#cc79a7", "#0072b2", "#d55e00", "#f0e442")
"""Okabe and Ito, Color Universal Design, without black."""

LIGHTNESS_STEPS = (0.0, 0.4, -0.35, 0.65, -0.6)
"""Mixed with that share of white (positive) or black (negative), one round of the seven after another."""

PALETTE = tuple(
    "#"
    + "".join(
        f"{round(int(color[i : i + 2], 16) * (1 - abs(step)) + (255 * step if step > 0 else 0)):02x}" for i in (1, 3, 5)
    )
    for step in LIGHTNESS_STEPS
    for color in OKABE_ITO
)


def next_color(taken: Iterable[str]) -> str:
    """The first colour of the palette that the fewest of `taken` have."""
    counts = dict.fromkeys(PALETTE, 0)
    for color in taken:
        if color in counts:
            counts[color] += 1
    return min(PALETTE, key=lambda color: counts[color])


def checked_color(color: str) -> str:
    """`color` in lower case.

    Raises:
        BadInput: it is not `#rrggbb`.
    """
    if not re.fullmatch(r"#[0-9a-fA-F]{6}", color):
        raise BadInput(f"a colour is written #rrggbb, such as {OKABE_ITO[0]}, not {color!r}")
    return color.lower()
