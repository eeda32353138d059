"""Masks as files write them: runs of pixels outside and inside in turns, the first outside, column by column (COCO) or
row by row in a rectangle (CVAT)."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Int

from ars_web.errors import BadInput
from ars_web.geometry.mask_regions import polygons_from_mask
from ars_web.geometry.polygon import Polygon
from ars_web.recordings.image_header import MAX_IMAGE_PIXELS


def mask_from_columns(runs: Sequence[int] | str, *, width: int, height: int) -> Bool[np.ndarray, "h w"]:
    """A COCO mask: its runs go down each column, as numbers or as COCO's text of them.

    Raises:
        BadInput: the runs do not add up to the image, or are no such text.
    """
    counts = _from_text(runs) if isinstance(runs, str) else np.array(runs, dtype=np.int64)
    return _filled(counts, width, height).reshape(width, height).T


def mask_from_rows(runs: Sequence[int], *, width: int, height: int) -> Bool[np.ndarray, "h w"]:
    """A CVAT mask: its runs go along each row of its rectangle.

    Raises:
        BadInput: the runs do not add up to the rectangle.
    """
    return _filled(np.array(runs, dtype=np.int64), width, height).reshape(height, width)


def outline_of(mask: Bool[np.ndarray, "h w"], *, left: int = 0, top: int = 0) -> tuple[Polygon, ...]:
    """The outline of a mask whose first pixel is the image's at (left, top); none where it is empty."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not len(rows):
        return ()
    # Following borders costs the area that is looked at, and objects are small.
    polygons = polygons_from_mask(mask[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1])
    corner = np.array([left + columns[0], top + rows[0]], dtype=np.float64)
    return tuple(Polygon(p.outer + corner, tuple(hole + corner for hole in p.holes)) for p in polygons)


def _filled(counts: Int[np.ndarray, "k"], width: int, height: int) -> Bool[np.ndarray, "n"]:
    if width < 1 or height < 1 or width * height > MAX_IMAGE_PIXELS:
        raise BadInput(f"a mask of {width} x {height} pixels cannot be one of an image")
    if counts.ndim != 1 or (counts < 0).any() or (counts > width * height).any():
        raise BadInput("the runs of a mask must be whole numbers of pixels, none negative")
    if counts.sum() != width * height:
        raise BadInput(
            f"the runs of a mask add up to {counts.sum()} pixels, not to {width} x {height} = {width * height}"
        )
    return np.repeat(np.arange(len(counts)) % 2 == 1, counts)


def _from_text(text: str) -> Int[np.ndarray, "k"]:
    """COCO's compressed runs: five bits a character, the sixth says that more follow, and from the third run on what is
    written is the difference to the run before the last.

    Source: https://github.com/cocodataset/cocoapi/blob/master/common/maskApi.c (rleFrString)
    """
    counts: list[int] = []
    value = shift = 0
    for character in text:
        six = ord(character) - 48
        if not 0 <= six < 64 or shift > 30:
            raise BadInput(f"the runs of a mask hold {character!r}, which COCO's text of them cannot")
        value |= (six & 31) << shift
        shift += 5
        if six & 32:
            continue
        if six & 16:
            value -= 1 << shift
        value += counts[-2] if len(counts) > 2 else 0
        if not 0 <= value <= MAX_IMAGE_PIXELS:
            raise BadInput(f"the runs of a mask hold {value}, which no run of an image's pixels is")
        counts.append(value)
        value = shift = 0
    if shift:
        raise BadInput("the runs of a mask end within a number")
    return np.array(counts, dtype=np.int64)
