"""Masks as COCO's run lengths: how many pixels in a row are outside, then inside, and so on, column by column."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int

from ars_web.errors import BadInput
from ars_web.geometry import run_kernels


@dataclass(frozen=True, eq=False)
class RunLengths:
    """A mask of h x w pixels.

    Attributes:
        size: (h, w), the order of COCO's files.
        counts: (k,) lengths of runs down the first column, then the second: outside first (0 where the first pixel is
            inside), then inside, by turns.
    """

    size: tuple[int, int]
    counts: Int[np.ndarray, "k"]

    def __post_init__(self) -> None:
        """Raises BadInput where the runs are not as long as the mask, or one is negative."""
        counts = np.array(self.counts, dtype=np.int64)
        height, width = self.size
        if height < 0 or width < 0 or (counts < 0).any() or int(counts.sum()) != height * width:
            raise BadInput(
                f"the runs of a mask of {width} x {height} pixels must add up to {height * width} and none be"
                f" negative; these add up to {int(counts.sum())}"
            )
        counts.flags.writeable = False
        object.__setattr__(self, "counts", counts)

    @property
    def area(self) -> int:
        """Pixels inside."""
        return int(self.counts[1::2].sum())


def rle_of(
    mask: Bool[np.ndarray, "k l"], *, row: int = 0, column: int = 0, size: tuple[int, int] | None = None
) -> RunLengths:
    """The run lengths of a mask, or of an image of `size` (h, w) with the mask in it from `row` and `column` on and
    nothing round it.

    Raises:
        BadInput: the mask reaches out of the image.
    """
    rows, columns = mask.shape
    height, width = (rows, columns) if size is None else size
    if row < 0 or column < 0 or row + rows > height or column + columns > width:
        raise BadInput(
            f"a mask of {columns} x {rows} pixels from column {column} and row {row} on is not within an image of"
            f" {width} x {height}"
        )
    return RunLengths((height, width), run_kernels.runs(np.ascontiguousarray(mask), row, column, height, width))


def mask_of(rle: RunLengths) -> Bool[np.ndarray, "h w"]:
    """The mask that run lengths tell."""
    inside = np.arange(len(rle.counts)) % 2 == 1
    height, width = rle.size
    return np.ascontiguousarray(np.repeat(inside, rle.counts).reshape(width, height).T)


def compressed(rle: RunLengths) -> str:
    """COCO's short form of the counts: each, from the fourth on less the one before the last, in groups of five bits,
    the lowest first, with a sixth that says whether more follow, as characters from "0" on (cocoapi, maskApi.c)."""
    return run_kernels.packed(rle.counts).tobytes().decode("ascii")


def from_compressed(text: str, size: tuple[int, int]) -> RunLengths:
    """The run lengths of a mask of `size` (h, w) from their short form.

    Raises:
        BadInput: `text` is not one, or not of a mask of this size.
    """
    packed = np.frombuffer(text.encode("utf-8"), dtype=np.uint8)
    if len(packed) and (packed.min() < 48 or packed.max() > 111):
        raise BadInput(f"compressed run lengths hold characters from '0' to 'o' only, not {text[:40]!r}")
    counts = run_kernels.unpacked(packed)
    if len(packed) and packed[-1] - 48 & 32:
        raise BadInput(f"compressed run lengths end in the middle of a number: {text[-40:]!r}")
    return RunLengths(size, counts)
