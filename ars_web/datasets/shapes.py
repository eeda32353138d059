"""Shapes: what the labels of a session's boxes are drawn round, and where they are seen from."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ars_web.errors import BadInput, BadOption
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.keypoints import Keypoint, keypoints_world
from ars_web.geometry.mesh import Mesh
from ars_web.sessions.model import SessionSnapshot

SHAPES: tuple[str, ...] = ("box", "hull", "mesh")
"""What labels can be drawn round. A box that has neither hull nor mesh is itself its shape, whatever was asked for."""


@dataclass(frozen=True, eq=False)
class PosedShapes:
    """b shapes as n frames see them, everything in the world, metres.

    Attributes:
        cameras: by id.
        camera_ids: (n,) keys into `cameras`.
        Ts_world_camera: (n, 4, 4).
        boxes: b of them.
        meshes: what the labels of each box are drawn round; None: the box.
        keypoints_world: (b, k, 3) named points of each object, NaN beyond those that it has.
    """

    cameras: Mapping[int, Camera]
    camera_ids: Int[np.ndarray, "n"]
    Ts_world_camera: Float[np.ndarray, "n 4 4"]
    boxes: Sequence[Box]
    meshes: Sequence[Mesh | None]
    keypoints_world: Float[np.ndarray, "b k 3"]

    def by_camera(self) -> Iterator[tuple[Camera, Int[np.ndarray, "m"]]]:
        """Each camera that occurs, with the rows of its frames."""
        yield from by_camera(self.cameras, self.camera_ids)


def stacked_keypoints(boxes: Sequence[Box], keypoints: Sequence[Sequence[Keypoint]]) -> Float[np.ndarray, "b k 3"]:
    """The keypoints of each box in the world, NaN beyond those that it has."""
    most = max((len(points) for points in keypoints), default=0)
    found = np.full((len(boxes), most, 3), np.nan)
    for row, (box, points) in enumerate(zip(boxes, keypoints, strict=True)):
        found[row, : len(points)] = keypoints_world(box, points)
    return found


def by_camera(
    cameras: Mapping[int, Camera], camera_ids: Int[np.ndarray, "n"]
) -> Iterator[tuple[Camera, Int[np.ndarray, "m"]]]:
    """Each camera that occurs, with the rows of its frames."""
    for camera_id in np.unique(camera_ids).tolist():
        yield cameras[camera_id], np.flatnonzero(camera_ids == camera_id)


def shape_kinds(snapshot: SessionSnapshot, *, shape: str | None) -> list[str]:
    """Which of SHAPES the labels of each box are drawn round, by ascending box id.

    `shape` is the export option of that name: for `box` it is always the box; for None and `hull` the stored hull
    where there is one; for `mesh` the mesh of the box or its class, where there is none the hull.
    """
    kinds: list[str] = []
    for _, box in sorted(snapshot.state.boxes.items()):
        if shape == "mesh" and snapshot.state.mesh_of(box) is not None:
            kinds.append("mesh")
        else:
            kinds.append("hull" if shape != "box" and box.has_hull else "box")
    return kinds


def meshes_of(snapshot: SessionSnapshot, *, shape: str | None) -> list[Mesh | None]:
    """What labels are drawn round, by ascending box id, as `shape_kinds` says; None: the box itself."""
    found: list[Mesh | None] = []
    boxes = (box for _, box in sorted(snapshot.state.boxes.items()))
    for box, kind in zip(boxes, shape_kinds(snapshot, shape=shape), strict=True):
        digest = snapshot.state.mesh_of(box) if kind == "mesh" else box.hull if kind == "hull" else None
        if digest is None:
            found.append(None)
        elif kind == "mesh":
            found.append(Mesh(*snapshot.meshes[digest].in_world(box.box)))
        else:
            found.append(Mesh(*snapshot.hulls[digest].in_world(box.box)))
    return found


def posed_shapes(snapshot: SessionSnapshot, indices: Sequence[int], *, shape: str | None) -> PosedShapes:
    """The shapes of a session's boxes, by ascending box id, as the frames at `indices` see them."""
    rows, state = np.asarray(indices, dtype=np.int64), snapshot.state
    boxes = [box for _, box in sorted(state.boxes.items())]
    keypoints = [state.keypoints_of(box.class_id) for box in boxes]
    return PosedShapes(
        cameras=snapshot.cameras,
        camera_ids=snapshot.frames.camera_ids[rows],
        Ts_world_camera=snapshot.frames.Ts_world_camera[rows],
        boxes=[box.box for box in boxes],
        meshes=meshes_of(snapshot, shape=shape),
        keypoints_world=stacked_keypoints([box.box for box in boxes], keypoints),
    )


def check_shape(shape: str | None, snapshots: Sequence[SessionSnapshot]) -> None:
    """Raises BadInput for a label shape that is none, or that no object of the sessions has."""
    if shape is not None and shape not in SHAPES:
        raise BadInput(f"shape {shape!r} is unknown; known are {', '.join(SHAPES)}")
    boxes = [(snapshot, box) for snapshot in snapshots for box in snapshot.state.boxes.values()]
    if shape == "mesh" and boxes and all(snapshot.state.mesh_of(box) is None for snapshot, box in boxes):
        raise BadOption(
            "shape 'mesh' needs a mesh, and no class or box here has one; "
            "give a class its mesh, or use 'box' or 'hull'",
            "shape",
        )
