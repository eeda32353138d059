"""One ring for each shape in each frame, whichever camera took it and whether the shape is a box or a mesh."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from ars_web.datasets.shapes import PosedShapes
from ars_web.geometry.mesh import Mesh

RingsOf = Callable[[Any, np.ndarray, Sequence[Any], np.ndarray], tuple[np.ndarray, np.ndarray]]
"""From a camera, `Ts_world_camera` (n, 4, 4), b shapes and (n, b) those that are wanted to points (k, 2) and offsets
(n * b + 1,) of a ring each, as `geometry.labels.outlines` and `geometry.mesh_outlines.mesh_outlines` answer."""


def rings_of_shapes(
    shapes: PosedShapes, wanted: Bool[np.ndarray, "n b"], *, of_boxes: RingsOf, of_meshes: RingsOf
) -> tuple[Float[np.ndarray, "m 2"], Int[np.ndarray, "k"]]:
    """The rings of those labels (n, b) that are wanted: their points (m, 2), and (n * b + 1,) where each begins."""
    if not wanted.any():
        return np.zeros((0, 2)), np.zeros(wanted.size + 1, dtype=np.int64)
    lengths = np.zeros(wanted.shape, dtype=np.int64)
    solids, plain = columns_of(shapes.meshes)
    of_kinds = ((plain, [shapes.boxes[i] for i in plain], of_boxes), (list(solids), list(solids.values()), of_meshes))
    found: list[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]] = []
    for camera, rows in shapes.by_camera():
        for columns, things, rings_of in of_kinds:
            if columns:
                place = np.ix_(rows, np.array(columns))
                points, offsets = rings_of(camera, shapes.Ts_world_camera[rows], things, wanted[place])
                found.append((rows, np.array(columns), points, offsets))
                lengths[place] = np.diff(offsets).reshape(len(rows), len(columns))
    starts = np.concatenate([[0], np.cumsum(lengths)])
    joined = np.empty((starts[-1], 2))
    for rows, columns, points, offsets in found:
        # Where each ring's points go: as far from its start there as from its start here.
        at = starts[:-1].reshape(wanted.shape)[np.ix_(rows, columns)].ravel()
        joined[np.repeat(at - offsets[:-1], np.diff(offsets)) + np.arange(len(points))] = points
    return joined, starts


def columns_of(meshes: Sequence[Mesh | None]) -> tuple[dict[int, Mesh], list[int]]:
    """The meshes by their column, and the columns of those that are their boxes."""
    solids = {i: mesh for i, mesh in enumerate(meshes) if mesh is not None}
    return solids, [i for i in range(len(meshes)) if i not in solids]
