"""Outlines that people draw: polygons with holes, in image coordinates of the original image."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ars_web.errors import BadInput


@dataclass(frozen=True, eq=False)
class Polygon:
    """One ring with its holes; what is inside is told by the even-odd rule, over all rings of a mask together.

    Attributes:
        outer: (k, 2) k >= 3 corners, image coordinates (0, 0 is the image's top left corner), not closed; may cross
            itself.
        holes: rings like it.
    """

    outer: Float[np.ndarray, "k 2"]
    holes: tuple[Float[np.ndarray, "_ 2"], ...] = ()

    def __post_init__(self) -> None:
        """Raises BadInput for a ring of fewer than three corners, or one that is not finite."""
        object.__setattr__(self, "outer", _ring(self.outer))
        object.__setattr__(self, "holes", tuple(_ring(hole) for hole in self.holes))

    @property
    def rings(self) -> tuple[Float[np.ndarray, "_ 2"], ...]:
        """The outer ring, then the holes."""
        return (self.outer, *self.holes)


def _ring(points: Float[np.ndarray, "k 2"]) -> Float[np.ndarray, "k 2"]:
    ring = np.array(points, dtype=np.float64)
    if ring.ndim != 2 or ring.shape[1] != 2 or len(ring) < 3:
        raise BadInput(f"a ring needs at least three corners of two coordinates, not shape {list(ring.shape)}")
    if not np.isfinite(ring).all():
        raise BadInput(f"a ring's corners must be finite numbers: {ring[~np.isfinite(ring).all(axis=1)][0].tolist()}")
    ring.flags.writeable = False
    return ring
