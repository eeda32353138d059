"""Which points in space a camera sees: whether a shape lies between."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float, Int

from ars_web.errors import BadInput
from ars_web.geometry import segment_kernels
from ars_web.geometry.box import Box
from ars_web.geometry.frame_blocks import over_blocks
from ars_web.geometry.mesh import Mesh
from ars_web.geometry.segment_kernels import Trees
from ars_web.geometry.shape_stack import ShapeStack, stack_shapes

CLEARANCE = 1e-3
"""Of a shape's size: what its own surface may be before a point of it by, without hiding it."""

LEAF = 4
"""Triangles that are tried one by one."""

BLOCK = 512
"""Frames that a thread takes at once."""


def hidden(
    Ts_world_camera: Float[np.ndarray, "n 4 4"],
    points_world: Float[np.ndarray, "b k 3"],
    boxes: Sequence[Box],
    meshes: Sequence[Mesh | None],
    owners: Int[np.ndarray, "b"],
) -> Bool[np.ndarray, "n b k"]:
    """Whether a shape lies between the camera's centre and a point; the point's own shape is one of them.

    Shape i is `meshes[i]`, and where that is None `boxes[i]`; `owners` says which of them each row of points belongs
    to. The last CLEARANCE of the own shape's size (the diagonal of its bound) before the point are not looked at, so
    that a point on a surface is not hidden by rounding. A shape with the camera inside hides nothing. Where the camera
    looks does not matter: a point behind it may be told to be seen.

    Raises:
        BadInput: there are not as many meshes as boxes, or an owner is none of them.
    """
    stack = stack_shapes(boxes, meshes)
    wrong = owners[(owners < 0) | (owners >= len(boxes))]
    if len(wrong):
        raise BadInput(f"points belong to shape {wrong[0]}; the shapes are 0 to {len(boxes) - 1}")
    if len(owners) != len(points_world):
        raise BadInput(f"each row of points needs an owner: {len(points_world)} rows and {len(owners)} owners")
    trees = _trees(stack)
    clearances = CLEARANCE * 2 * np.linalg.norm(stack.halves, axis=1)[owners]
    points = np.array(points_world, dtype=np.float64, order="C")
    found = np.empty((len(Ts_world_camera), *points.shape[:2]), dtype=np.bool_)

    def look(frames: slice) -> None:
        # Copies, because threads that count the users of one array stand in each other's way.
        own = Trees(*(array.copy() for array in trees))
        centres = np.array(Ts_world_camera[frames, :3, 3], dtype=np.float64, order="C")
        segment_kernels.hidden(centres, points, clearances, own, found[frames])

    over_blocks(look, len(Ts_world_camera), block=BLOCK)
    return found


@lru_cache(maxsize=4)
def _trees(stack: ShapeStack) -> Trees:
    """Each shape's triangles in a tree of boxes, halved at the median along the longest side of their centres."""
    corners = stack.vertices[stack.faces]
    centres, low, high = corners.mean(axis=1), corners.min(axis=1), corners.max(axis=1)
    order: list[np.ndarray] = []
    bounds: list[np.ndarray] = []
    links: list[tuple[int, int, int]] = []
    first_node = [0]
    placed = 0

    def grow(some: np.ndarray) -> None:
        """Nodes in the order of a walk: each node's first child follows it; its link leads past all it holds."""
        nonlocal placed
        node = len(links)
        bounds.append(np.concatenate([low[some].min(axis=0), high[some].max(axis=0)]))
        links.append((0, 0, 0))
        if len(some) <= LEAF:
            order.append(some)
            links[node] = (len(links), placed, placed + len(some))
            placed += len(some)
            return
        axis = int(np.argmax(np.ptp(centres[some], axis=0)))
        some = some[np.argsort(centres[some, axis], kind="stable")]
        grow(some[: len(some) // 2])
        grow(some[len(some) // 2 :])
        links[node] = (len(links), 0, 0)

    for first, end in zip(stack.first_face[:-1].tolist(), stack.first_face[1:].tolist(), strict=True):
        grow(np.arange(first, end))
        first_node.append(len(links))
    faces = np.concatenate(order) if order else np.zeros(0, np.int64)
    return Trees(
        np.ascontiguousarray(corners[faces]),
        np.array(bounds).reshape(-1, 6),
        np.array(links, dtype=np.int64).reshape(-1, 3),
        np.array(first_node),
    )
