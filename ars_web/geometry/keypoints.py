"""Named points on an object, at the same place in every box of its class."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ars_web.errors import BadInput
from ars_web.geometry.box import CORNER_SIGNS, Box
from ars_web.geometry.rigid_transform import transform_points

MOST_KEYPOINTS = 64
"""Of one class."""

LONGEST_KEYPOINT_NAME = 60
"""Characters."""

FARTHEST_KEYPOINT = 2.0
"""Box sizes from the box's centre. A corner is at half a size; a point far outside is a mistake in the unit."""


@dataclass(frozen=True)
class Keypoint:
    """One point of an object.

    Attributes:
        name: not empty, unique in its class.
        place: along the box's axes in units of its sizes, from its centre: a corner is at +-0.5.
    """

    name: str
    place: tuple[float, float, float]

    def __post_init__(self) -> None:
        """Raises BadInput for a name that cannot be shown, or a place that is not three numbers within
        FARTHEST_KEYPOINT."""
        if not self.name.strip() or self.name != self.name.strip() or len(self.name) > LONGEST_KEYPOINT_NAME:
            raise BadInput(
                f"a keypoint's name must have 1 to {LONGEST_KEYPOINT_NAME} characters and no space at its ends,"
                f" not {self.name!r}"
            )
        if not self.name.isprintable() or "," in self.name:
            raise BadInput(f"a keypoint's name must be printable and without a comma, not {self.name!r}")
        place = np.asarray(self.place, dtype=np.float64)
        if place.shape != (3,) or not (np.abs(place) <= FARTHEST_KEYPOINT).all():
            raise BadInput(
                f"keypoint {self.name!r} must be three numbers from -{FARTHEST_KEYPOINT:g} to {FARTHEST_KEYPOINT:g} in"
                f" units of the box's sizes (a corner is at 0.5), not {place.tolist()}"
            )
        x, y, z = (place + 0.0).tolist()
        object.__setattr__(self, "place", (x, y, z))


_CORNERS: tuple[tuple[float, float, float], ...] = tuple(
    (float(x) / 2, float(y) / 2, float(z) / 2) for x, y, z in CORNER_SIGNS
)

DEFAULT_KEYPOINTS: tuple[Keypoint, ...] = (
    Keypoint("centre", (0.0, 0.0, 0.0)),
    *(Keypoint(f"corner {i}", place) for i, place in enumerate(_CORNERS)),
)
"""Of a class that names none: the centre, then the corners in the order of `box.CORNER_SIGNS`."""


def checked_keypoints(keypoints: Iterable[Keypoint]) -> tuple[Keypoint, ...]:
    """The keypoints of a class.

    Raises:
        BadInput: there are more than MOST_KEYPOINTS, or two of one name.
    """
    checked = tuple(keypoints)
    if len(checked) > MOST_KEYPOINTS:
        raise BadInput(f"a class can have at most {MOST_KEYPOINTS} keypoints, not {len(checked)}")
    seen: set[str] = set()
    for keypoint in checked:
        if keypoint.name in seen:
            raise BadInput(f"there are two keypoints called {keypoint.name!r}: give each its own name")
        seen.add(keypoint.name)
    return checked


def keypoints_world(box: Box, keypoints: Sequence[Keypoint]) -> Float[np.ndarray, "k 3"]:
    """(k, 3) world coordinates in metres of the keypoints of the object in `box`."""
    places = np.array([keypoint.place for keypoint in keypoints], dtype=np.float64).reshape(-1, 3)
    return transform_points(box.T_world_box, places * box.size)
