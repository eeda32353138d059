"""What a label function draws in one frame of a session: what the page lays over a photo, and pictures show."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ars_web.datasets.label_functions import Marks, label_function
from ars_web.datasets.samples import LabelTable, labels_of_shapes
from ars_web.datasets.shapes import PosedShapes, check_shape, posed_shapes
from ars_web.errors import NotFound
from ars_web.sessions.model import SessionSnapshot


@dataclass(frozen=True, eq=False)
class MarkedPoint:
    """A named point of an object in an image.

    Attributes:
        at: image coordinates, anywhere; None where it is behind the camera or beyond what the lens can show.
        state: `label_functions.UNSEEN`, `HIDDEN` or `SEEN`.
    """

    name: str
    at: tuple[float, float] | None
    state: int


@dataclass(frozen=True, eq=False)
class FrameMark:
    """What is drawn of one object in one frame; image coordinates.

    Attributes:
        rings: none closed, holes after the ring they are in; none where no part of the object is in the image.
    """

    box_id: int
    class_id: int
    rings: tuple[Float[np.ndarray, "k 2"], ...]
    points: tuple[MarkedPoint, ...]


@dataclass(frozen=True, eq=False)
class FrameShapes:
    """The shapes of a session's boxes, by ascending id, in one frame, and their labels."""

    shapes: PosedShapes
    table: LabelTable

    def marks(self, function: str) -> Marks:
        """What a label function draws of every object that is in the image."""
        return label_function(function).draw(self.shapes, self.table, ~np.isnan(self.table.bbox[..., 0]))


def frame_shapes(snapshot: SessionSnapshot, index: int, *, shape: str | None = None) -> FrameShapes:
    """The session's shapes as frame `index` sees them.

    Raises:
        NotFound: the session has no such frame.
        BadInput: there is no such shape, or the session has none of it.
    """
    check_shape(shape, [snapshot])
    if not 0 <= index < len(snapshot.frames):
        raise NotFound(f"session {snapshot.id} has no frame {index}; its frames are 0 to {len(snapshot.frames) - 1}")
    shapes = posed_shapes(snapshot, [index], shape=shape)
    return FrameShapes(shapes, labels_of_shapes(shapes))


def frame_marks(snapshot: SessionSnapshot, index: int, *, function: str, shape: str | None = None) -> list[FrameMark]:
    """What a label function draws of each of the session's objects in frame `index`, by ascending box id.

    Raises:
        NotFound: the session has no such frame.
        BadInput: there is no such function or shape.
    """
    boxes = [box for _, box in sorted(snapshot.state.boxes.items())]
    marks = frame_shapes(snapshot, index, shape=shape).marks(function)
    found: list[FrameMark] = []
    for column, box in enumerate(boxes):
        names = [point.name for point in snapshot.state.keypoints_of(box.class_id)]
        points = zip(names, marks.points[0, column].tolist(), marks.states[0, column].tolist(), strict=False)
        found.append(
            FrameMark(
                box_id=box.id,
                class_id=box.class_id,
                rings=tuple(marks.rings.of(column)),
                points=tuple(
                    MarkedPoint(name, None if np.isnan(x) else (x, y), state) for name, (x, y), state in points
                ),
            )
        )
    return found
