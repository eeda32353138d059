"""Convex outlines in images: one ring round the convex hull of the part of an object that lies in the image."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int

from ars_web.geometry import convex_kernels, lens_kernels
from ars_web.geometry.box import Box, stack
from ars_web.geometry.camera import Camera
from ars_web.geometry.frame_blocks import over_blocks
from ars_web.geometry.labels import FINEST_TOLERANCE, NEAR, rings_in_frames
from ars_web.geometry.lens import LensTables, lens_tables
from ars_web.geometry.mesh import Mesh
from ars_web.geometry.mesh_labels import BLOCK, RIM, check_tolerance, curves_of_mesh

Hulls = tuple[Float[np.ndarray, "_ 2"], Int[np.ndarray, "_"]]
"""The points of rings one after the other, and how many each has."""

FINER = 8
"""Of the tolerance, for contours: few of their edges need more chords for it, and where the image's border cuts one
aslant, it is cut as much nearer to where it should be."""


def convex_outlines(
    camera: Camera,
    Ts_world_camera: Float[np.ndarray, "n 4 4"],
    meshes: Sequence[Mesh],
    wanted: Bool[np.ndarray, "n b"],
    *,
    tolerance: float = 0.1,
) -> tuple[Float[np.ndarray, "k 2"], Int[np.ndarray, "n*b+1"]]:
    """The convex hull, in the image, of the part of every mesh that lies in the image, in every frame where it is
    wanted; row by row, image coordinates.

    Rings run counter-clockwise as seen in the image (y down) from their leftmost corner, not closed. They are exact to
    `tolerance` pixels; what the image's border cuts aslant to more of them, along the border.

    Returns:
        All rings' points (k, 2), and `offsets` (n * b + 1,): the ring of mesh j in frame i is
        `points[offsets[i * b + j] : offsets[i * b + j + 1]]`, empty where it is not wanted or makes no area in the
        image.

    Raises:
        BadInput: `tolerance` is below FINEST_TOLERANCE.
    """
    check_tolerance(tolerance)
    tables = lens_tables(camera)

    def rings(frames: slice) -> Hulls:
        Ts = np.array(Ts_world_camera[frames], dtype=np.float64, order="C")
        columns: list[Hulls] = []
        for column, mesh in enumerate(meshes):
            asked = np.ascontiguousarray(wanted[frames, column])
            points, lengths, settled = _of_whole_meshes(tables, Ts, mesh, asked, tolerance)
            columns.append((points, lengths))
            if (asked & ~settled).any():
                curves = curves_of_mesh(tables, Ts, mesh, asked & ~settled, max(tolerance / FINER, FINEST_TOLERANCE))
                others = convex_kernels.hulls_of_curves(tables.lens.width, tables.lens.height, *curves)
                columns[-1] = _either(columns[-1], others)
        return _row_by_row(columns, len(Ts))

    return _one_after_the_other(over_blocks(rings, len(Ts_world_camera), block=BLOCK))


def convex_outlines_of_boxes(
    camera: Camera,
    Ts_world_camera: Float[np.ndarray, "n 4 4"],
    boxes: Sequence[Box],
    wanted: Bool[np.ndarray, "n b"],
    *,
    tolerance: float = 0.1,
) -> tuple[Float[np.ndarray, "k 2"], Int[np.ndarray, "n*b+1"]]:
    """The same for boxes, whose rings a lens may bend inwards; at the image's border they are as `labels.outlines`.

    Raises:
        BadInput: `tolerance` is below FINEST_TOLERANCE.
    """
    lens = lens_tables(camera).lens

    def hulls(points: Float[np.ndarray, "_ 2"], lengths: Int[np.ndarray, "_"]) -> Hulls:
        return convex_kernels.hulls_of_rings(lens.width, lens.height, points, lengths)

    found = rings_in_frames(camera, Ts_world_camera, *stack(list(boxes)), wanted, hulls, tolerance=tolerance)
    return _one_after_the_other(found)


def _of_whole_meshes(
    tables: LensTables,
    Ts_world_camera: Float[np.ndarray, "n 4 4"],
    mesh: Mesh,
    wanted: Bool[np.ndarray, "n"],
    tolerance: float,
) -> tuple[Float[np.ndarray, "k 2"], Int[np.ndarray, "n"], Bool[np.ndarray, "n"]]:
    """The hulls of a mesh as far as the corners of its own convex hull tell them, and (n,) where they do.

    There the mesh is in front of the camera and wholly in the image or wholly outside. A mesh lies within the hull of
    its corners on the normalised plane, and the lens bends no side of that further out than the side's sagitta.
    """
    lens = tables.lens
    plane, lengths, longest, furthest = convex_kernels.shadow_hulls(
        Ts_world_camera, mesh.hull_vertices_world, wanted, NEAR, RIM * lens.rim
    )
    image = np.empty_like(plane)
    lens_kernels.bend_points(lens, plane[None, :, 0], plane[None, :, 1], image[None, :, 0], image[None, :, 1])
    sagitta = tables.bends_across_within(np.sqrt(furthest)) * longest / 8.0
    settled = (lengths > 0) & (sagitta <= tolerance)
    frames = np.repeat(np.arange(len(lengths)), lengths)
    image, frames = image[settled[frames]], frames[settled[frames]]
    starts = np.flatnonzero(np.diff(frames, prepend=-1))
    lows, highs = np.zeros((len(lengths), 2)), np.zeros((len(lengths), 2))
    if len(starts):
        lows[settled], highs[settled] = np.minimum.reduceat(image, starts), np.maximum.reduceat(image, starts)
    size = np.array([lens.width, lens.height])
    inside = settled & ((lows >= tolerance) & (highs <= size - tolerance)).all(axis=1)
    outside = settled & ((highs < -tolerance) | (lows > size + tolerance)).any(axis=1)
    image = np.ascontiguousarray(image[inside[frames]])
    points, lengths = convex_kernels.hulls_of_rings(lens.width, lens.height, image, np.where(inside, lengths, 0))
    return points, lengths, inside | outside


def _either(one: Hulls, other: Hulls) -> Hulls:
    """Rings of the same frames, of which each has at most one that is not empty."""
    lengths = one[1] + other[1]
    points = np.empty((lengths.sum(), 2))
    for some, counts in (one, other):
        points[np.repeat(counts > 0, lengths)] = some
    return points, lengths


def _row_by_row(columns: list[Hulls], n: int) -> Hulls:
    """Rings of each mesh in n frames as rings of each frame."""
    lengths = np.zeros((n, len(columns)), dtype=np.int64)
    for column, (_, counts) in enumerate(columns):
        lengths[:, column] = counts
    ends = np.cumsum(lengths.ravel()).reshape(lengths.shape)
    points = np.empty((lengths.sum(), 2))
    for column, (some, counts) in enumerate(columns):
        # Where each ring's points go: as far from its start there as from its start here.
        shift = (ends[:, column] - counts) - (np.cumsum(counts) - counts)
        points[np.repeat(shift, counts) + np.arange(len(some))] = some
    return points, lengths.ravel()


def _one_after_the_other(blocks: list[Hulls]) -> Hulls:
    points = np.concatenate([np.zeros((0, 2)), *(points for points, _ in blocks)])
    lengths = np.concatenate([np.zeros(1, np.int64), *(lengths for _, lengths in blocks)])
    return points, np.cumsum(lengths)
