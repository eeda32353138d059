"""BOP's objects: one geometry each. Boxes of a class that are alike share one, others get one of their own."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ars_web.datasets.planned import PlannedSession
from ars_web.geometry.box import CORNER_SIGNS
from ars_web.geometry.rigid_transform import invert, transform_points

ALIKE = 1e-4
"""Metres by which sizes and corners of one object may differ: a tenth of a millimetre."""

_FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
     [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)  # fmt: skip
"""Triangles of a box's corners as `CORNER_SIGNS` orders them, counter-clockwise seen from outside, two a side."""


@dataclass(frozen=True, eq=False)
class BopObject:
    """A model and the boxes that have it.

    Attributes:
        id: BOP's, from 1.
        class_place: of its class in the dataset.
        shape: what it is drawn round: `box`, `hull` or `mesh`.
        size: (3,) metres, of the first of its boxes.
        vertices_box: (v, 3) metres, in the box's frame.
        faces: (f, 3) counter-clockwise seen from outside.
        boxes: (place of the session, place of the box in it) of each of its boxes.
    """

    id: int
    class_place: int
    shape: str
    size: Float[np.ndarray, "3"]
    vertices_box: Float[np.ndarray, "v 3"]
    faces: Int[np.ndarray, "f 3"]
    boxes: list[tuple[int, int]]


def objects_of(sessions: Sequence[PlannedSession]) -> list[BopObject]:
    """The objects, by class, and within one in the order of the sessions and their boxes."""
    found: dict[int, list[BopObject]] = {}
    for session_place, session in enumerate(sessions):
        for box_place, (box, mesh, class_place) in enumerate(
            zip(session.boxes, session.meshes, session.class_of_box, strict=True)
        ):
            if mesh is None:
                vertices, faces = CORNER_SIGNS * box.size / 2, _FACES
            else:
                vertices, faces = transform_points(invert(box.T_world_box), mesh.vertices_world), mesh.faces
            alike = found.setdefault(class_place, [])
            for candidate in alike:
                if _same(candidate, box.size, vertices, faces):
                    candidate.boxes.append((session_place, box_place))
                    break
            else:
                shape = session.drawn_round[box_place]
                place = [(session_place, box_place)]
                alike.append(BopObject(0, class_place, shape, box.size, vertices, faces, place))
    ordered = [an_object for _, alike in sorted(found.items()) for an_object in alike]
    return [
        BopObject(number, o.class_place, o.shape, o.size, o.vertices_box, o.faces, o.boxes)
        for number, o in enumerate(ordered, start=1)
    ]


def _same(
    candidate: BopObject,
    size: Float[np.ndarray, "3"],
    vertices: Float[np.ndarray, "v 3"],
    faces: Int[np.ndarray, "f 3"],
) -> bool:
    return (
        candidate.vertices_box.shape == vertices.shape
        and np.array_equal(candidate.faces, faces)
        and float(np.abs(candidate.size - size).max()) <= ALIKE
        and float(np.abs(candidate.vertices_box - vertices).max()) <= ALIKE
    )


def object_ids(objects: Sequence[BopObject], session_place: int, count: int) -> Int[np.ndarray, "b"]:
    """(b,) the object of each of the `count` boxes of a session."""
    found = np.zeros(count, dtype=np.int64)
    for an_object in objects:
        for session, box in an_object.boxes:
            if session == session_place:
                found[box] = an_object.id
    return found
