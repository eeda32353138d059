"""What looks wrong when manual and automatic labels are compared, and what to do about it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ars_web.studies.agreement import Offsets, RectangleAgreement
from ars_web.studies.hidden_bands import HiddenBand

FEW_PAIRS = 30
"""Of which shares and means say little."""

LOOSE = 0.8
"""IoU below which rectangles of what is wholly seen are not one rectangle, drawn twice."""

SHIFT = 0.4
"""Pixels by which sides may be off in the median: half a pixel is a convention, less is how people draw."""


@dataclass(frozen=True)
class UncomparedClass:
    """A class that only one side has.

    Attributes:
        class_name: of the class.
        labels: how many it has in the frames that are compared.
        often: the class of the other side whose labels without a partner lie where its own do most often; None: none.
        times: how often.
    """

    class_name: str
    labels: int
    often: str | None
    times: int


def comparison_warnings(
    agreement: RectangleAgreement,
    bands: Sequence[HiddenBand],
    never_by_hand: Sequence[UncomparedClass],
    unknown: Sequence[UncomparedClass],
) -> Iterator[str]:
    """One text for each thing.

    Args:
        agreement: by the rectangles in the image.
        bands: the pairs by how much is hidden, those of which nothing is first.
        never_by_hand: the session's classes that have labels and no manual one.
        unknown: manual classes that the session has not.
    """
    for one in unknown:
        hint = (
            ""
            if one.often is None
            else (
                f" Where they lie the session has {one.often!r} {_times(one.times)}: is it --classes"
                f" {one.class_name}={one.often}?"
            )
        )
        yield (
            f"The session has no class {one.class_name!r}: its {_labels(one.labels, 'manual')} are in no number.{hint}"
        )
    for one in never_by_hand:
        hint = "" if one.often is None else f" Where they lie people wrote {one.often!r} {_times(one.times)}."
        yield (
            f"Class {one.class_name!r} was never labelled by hand: its {_labels(one.labels, 'automatic')} in these"
            f" frames are in no number. Label it, or take it as not judged.{hint}"
        )
    total = agreement.total
    if not total.manual:
        yield "No manual label is of a class that is compared: there is nothing to judge by."
    elif total.matched < FEW_PAIRS:
        yield f"Only {total.matched} labels have a partner: shares and means of so few say little. Label more frames."
    unhidden = bands[0]
    if unhidden.matched >= FEW_PAIRS and unhidden.in_image is not None and unhidden.in_image < LOOSE:
        yield (
            f"Labels of objects that nothing hides overlap by {unhidden.in_image:.2f} only, in the mean, so it is not"
            " what is hidden: a box round what is no box has too wide a rectangle. Give objects hulls, by outlining"
            " them, or meshes; and look whether boxes sit tightly and poses are right."
        )
    if agreement.offsets is not None and total.matched >= FEW_PAIRS:
        yield from _shifts(agreement.offsets)


def _shifts(offsets: Offsets) -> Iterator[str]:
    """Of both directions in which all rectangles seem moved, and of sides that only one convention would move."""
    for first, second, way, back in (
        (offsets.left, offsets.right, "right", "left"),
        (offsets.top, offsets.bottom, "down", "up"),
    ):
        least = min(first, second, key=abs)
        if first * second > 0 and abs(least) >= SHIFT:
            yield (
                f"Automatic labels lie {abs((first + second) / 2):.1f} px further {way if least > 0 else back} than"
                " manual ones, in the median: were the manual ones drawn on images of another size or crop, or do they"
                " count pixels from another corner? If not, look at the poses."
            )
    if min(offsets.left, offsets.top) >= SHIFT > max(abs(offsets.right), abs(offsets.bottom)):
        yield (
            f"Manual labels begin {min(offsets.left, offsets.top):.1f} px further left and up, and end where automatic"
            " ones do: is it a VOC file that counts pixels from 0?"
        )


def _labels(count: int, what: str) -> str:
    return f"{count} {what} label{'' if count == 1 else 's'}"


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"
