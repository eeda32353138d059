"""Labels of closed meshes in images: where an object's hull appears in a frame, in the manner of `labels.py`."""

import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int

from ars_web.errors import BadInput
from ars_web.geometry import cloud_kernels, contour_kernels, lens_kernels, region_kernels
from ars_web.geometry.camera import Camera
from ars_web.geometry.frame_blocks import over_blocks
from ars_web.geometry.labels import ALLOWED_AT_BORDERS, FINEST_TOLERANCE, NEAR, BoxLabels
from ars_web.geometry.lens import LensTables, lens_tables
from ars_web.geometry.mesh import Mesh

BLOCK = 256
"""Frames that are worked on at once."""

RIM = 1.0 - 1e-9
"""Of the lens's valid radius: what is cut there is then within it, however it was rounded."""


def labels_of_meshes(
    camera: Camera, Ts_world_camera: Float[np.ndarray, "n 4 4"], meshes: Sequence[Mesh], *, tolerance: float = 0.05
) -> BoxLabels:
    """Labels of every mesh in every frame, as exact as `labels.labels_of_boxes`.

    Raises:
        BadInput: `tolerance` is below FINEST_TOLERANCE.
    """
    check_tolerance(tolerance)
    n, b, tables = len(Ts_world_camera), len(meshes), lens_tables(camera)
    found = BoxLabels(np.full((n, b, 4), np.nan), np.full((n, b, 4), np.nan), np.ones((n, b)))

    def label(frames: slice) -> None:
        Ts = np.array(Ts_world_camera[frames], dtype=np.float64, order="C")
        for column, mesh in enumerate(meshes):
            bbox, amodal, truncated = _whole_boxes(tables, Ts, mesh, tolerance)
            unsettled = np.isnan(truncated)
            _settle(tables, Ts, mesh, unsettled, tolerance, bbox, amodal, truncated)
            found.bbox[frames, column], found.bbox_amodal[frames, column] = bbox, amodal
            found.truncated[frames, column] = truncated

    over_blocks(label, n, block=BLOCK)
    return found


def _whole_boxes(
    tables: LensTables, Ts_world_camera: Float[np.ndarray, "n 4 4"], mesh: Mesh, tolerance: float
) -> tuple[Float[np.ndarray, "n 4"], Float[np.ndarray, "n 4"], Float[np.ndarray, "n"]]:
    """A mesh's labels as far as its vertices on the contour tell them: `bbox`, `bbox_amodal` and `truncated`, which is
    NaN where the near plane, the lens's rim or the image's border may cut the mesh. There `bbox` is NaN, and where
    either of the first two may, `bbox_amodal` too."""
    lens = tables.lens
    n, (centre, radius) = len(Ts_world_camera), mesh.sphere
    depth = np.einsum("nj,nj->n", centre - Ts_world_camera[:, :3, 3], Ts_world_camera[:, :3, 2])
    x, y, ends, on_edges, first_row, first_edge, nearest, furthest = cloud_kernels.cast_clouds(
        Ts_world_camera, mesh.vertices_world, mesh.edges, mesh.planes
    )
    nearest, furthest = nearest[:n], furthest[:n]
    u, v, amodal = np.empty_like(x), np.empty_like(x), np.empty((n, 4))
    lens_kernels.bend_points(lens, x, y, u, v)
    # Where a mesh is cut, what is found here means nothing and is not used.
    whole = (depth - radius > NEAR) & (furthest < (RIM * lens.rim) ** 2) & np.isfinite(nearest)
    bends = np.where(whole, tables.bends_within(np.sqrt(furthest)), 0.0)
    pieces, frames = cloud_kernels.boxes_of_clouds(
        x,
        y,
        u,
        v,
        ends,
        on_edges,
        first_row,
        first_edge,
        mesh.edge_lengths,
        nearest,
        furthest,
        bends,
        tolerance,
        amodal,
    )
    points, lengths = lens_kernels.curves_of_edges(lens, tables.bends, pieces, tolerance)
    cloud_kernels.grow_boxes(points, lengths, frames, amodal)
    amodal[~whole] = np.nan
    nowhere = depth + radius < NEAR
    size = np.array([lens.width, lens.height])
    with np.errstate(invalid="ignore"):
        outside = whole & ((amodal[:, :2] >= size) | (amodal[:, 2:] <= 0.0)).any(axis=1)
        inside = whole & ((amodal[:, :2] >= 0.0) & (amodal[:, 2:] <= size)).all(axis=1)
        inside &= (amodal[:, :2] < amodal[:, 2:]).all(axis=1)
    bbox = np.where(inside[:, None], amodal, np.nan)
    return bbox, amodal, np.select([inside, outside | nowhere], [0.0, 1.0], np.nan)


def _settle(
    tables: LensTables,
    Ts_world_camera: Float[np.ndarray, "n 4 4"],
    mesh: Mesh,
    unsettled: Bool[np.ndarray, "n"],
    tolerance: float,
    bbox: Float[np.ndarray, "n 4"],
    amodal: Float[np.ndarray, "n 4"],
    truncated: Float[np.ndarray, "n"],
) -> None:
    """Label a mesh from its contour in the frames that are `unsettled`, in place."""
    lens = tables.lens
    truncated[unsettled] = 1.0
    for fineness in (tolerance, max(tolerance / 8.0, FINEST_TOLERANCE), FINEST_TOLERANCE):
        points, lengths, counts = curves_of_mesh(tables, Ts_world_camera, mesh, unsettled, fineness)
        rough = np.zeros(len(unsettled), dtype=np.bool_)
        region_kernels.label_regions(
            lens.width,
            lens.height,
            points,
            lengths,
            counts,
            fineness,
            ALLOWED_AT_BORDERS * tolerance,
            bbox,
            amodal,
            truncated,
            rough,
        )
        unsettled = rough
        if not rough.any():
            break


def curves_of_mesh(
    tables: LensTables,
    Ts_world_camera: Float[np.ndarray, "n 4 4"],
    mesh: Mesh,
    wanted: Bool[np.ndarray, "n"],
    tolerance: float,
) -> tuple[Float[np.ndarray, "k 2"], Int[np.ndarray, "m"], Int[np.ndarray, "n"]]:
    """The mesh's contours in image coordinates: the points of all their curves, the curves' lengths, and how many
    curves each frame has."""
    lens = tables.lens
    quarter = math.ceil(min(0.5 * math.pi * math.sqrt(lens.rim_bend / (8.0 * tolerance)), lens_kernels.LONGEST_QUARTER))
    pieces, counts = contour_kernels.contours(
        Ts_world_camera,
        mesh.vertices_world,
        mesh.faces,
        mesh.edges,
        mesh.planes,
        wanted,
        NEAR,
        RIM * lens.rim,
        max(quarter, 1),
    )
    points, lengths = lens_kernels.curves_of_edges(lens, tables.bends, pieces, tolerance)
    return points, lengths, counts


def check_tolerance(tolerance: float) -> None:
    """Raises BadInput for a tolerance below FINEST_TOLERANCE."""
    if not tolerance >= FINEST_TOLERANCE:
        raise BadInput(f"a tolerance must be at least {FINEST_TOLERANCE} pixels, not {tolerance}")
