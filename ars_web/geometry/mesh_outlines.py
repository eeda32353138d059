"""Outlines of closed meshes in images: one ring round the part of an object's hull that lies in the image."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int
from manifold3d import CrossSection, FillRule

from ars_web.geometry import cut_kernels, region_kernels
from ars_web.geometry.camera import Camera
from ars_web.geometry.lens import lens_tables
from ars_web.geometry.mesh import Mesh
from ars_web.geometry.mesh_labels import check_tolerance, curves_of_mesh
from ars_web.geometry.rigid_transform import Transform


def mesh_outlines(
    camera: Camera,
    Ts_world_camera: Float[np.ndarray, "n 4 4"],
    meshes: Sequence[Mesh],
    wanted: Bool[np.ndarray, "n b"],
    *,
    tolerance: float = 0.1,
) -> tuple[Float[np.ndarray, "k 2"], Int[np.ndarray, "n*b+1"]]:
    """The rings of `mesh_outline` for every mesh in every frame that is `wanted`, row by row.

    Returns:
        All rings' points (k, 2), and `offsets` (n * b + 1,): the ring of mesh j in frame i is
        `points[offsets[i * b + j] : offsets[i * b + j + 1]]`, empty where it is not wanted or not in the image.

    Raises:
        BadInput: `tolerance` is below FINEST_TOLERANCE.
    """
    check_tolerance(tolerance)
    n, b = len(Ts_world_camera), len(meshes)
    rings: list[Float[np.ndarray, "k 2"]] = [np.zeros((0, 2))] * (n * b)
    Ts = np.array(Ts_world_camera, dtype=np.float64, order="C")
    for column, mesh in enumerate(meshes):
        rows = np.flatnonzero(wanted[:, column])
        for row, ring in zip(rows.tolist(), _rings(camera, Ts[rows], mesh, tolerance), strict=True):
            rings[row * b + column] = ring
    lengths = [len(ring) for ring in rings]
    return np.concatenate([np.zeros((0, 2)), *rings]), np.cumsum([0, *lengths])


def mesh_outline(
    camera: Camera, T_world_camera: Transform, mesh: Mesh, *, tolerance: float = 0.1
) -> Float[np.ndarray, "k 2"]:
    """The ring round the part of a mesh that lies in the image, image coordinates; (0, 2) where none does.

    Counter-clockwise as seen in the image (y down), not closed. Where the part has holes or several pieces the ring
    goes to each of them and back on one line, which encloses nothing: by any rule of filling, and by the formula for
    a polygon's area, the ring is exactly the part. Holes are run round clockwise.

    Raises:
        BadInput: `tolerance` is below FINEST_TOLERANCE.
    """
    ring, _ = mesh_outlines(camera, T_world_camera[None], [mesh], np.ones((1, 1), dtype=bool), tolerance=tolerance)
    return ring


def _rings(
    camera: Camera, Ts_world_camera: Float[np.ndarray, "n 4 4"], mesh: Mesh, tolerance: float
) -> list[Float[np.ndarray, "k 2"]]:
    # Half of the tolerance for the chords of bent edges, half for points left out.
    tables, every = lens_tables(camera), np.ones(len(Ts_world_camera), dtype=np.bool_)
    curves = curves_of_mesh(tables, Ts_world_camera, mesh, every, tolerance / 2)
    points, lengths, counts = region_kernels.join_loops(*curves)
    # Cut one by one, loops still run round each point of the image as often.
    points, lengths = cut_kernels.cut_rings(tables.lens.width, tables.lens.height, points, lengths)
    loops = np.split(points, np.cumsum(lengths)[:-1]) if len(lengths) else []
    ends = np.cumsum([0, *counts.tolist()]).tolist()
    return [_ring(loops[ends[i] : ends[i + 1]], tolerance / 2) for i in range(len(counts))]


def _ring(loops: list[Float[np.ndarray, "k 2"]], tolerance: float) -> Float[np.ndarray, "k 2"]:
    """The ring round what loops enclose, without points that make less than `tolerance` of difference."""
    # Clipper's positive is clockwise as seen with y down, so all is turned round before and after.
    turned = [loop[::-1] for loop in loops if len(loop) >= 3]
    if not turned:
        return np.zeros((0, 2))
    found = [ring[::-1] for ring in CrossSection(turned, FillRule.Positive).simplify(tolerance).to_polygons()]
    return joined([ring for ring in found if not _is_sliver(ring, tolerance)])


def joined(rings: list[Float[np.ndarray, "k 2"]]) -> Float[np.ndarray, "m 2"]:
    """Rings as one, which goes from each to the nearest corner of the next and comes back the same way; (0, 2) for
    none."""
    if not rings:
        return np.zeros((0, 2))
    rings = sorted(rings, key=lambda ring: -_area(ring))
    whole, left = rings[0], rings[1:]
    while left:
        gaps = [((whole[:, None] - ring[None]) ** 2).sum(axis=2) for ring in left]
        nearest = min(range(len(left)), key=lambda i: gaps[i].min())
        i, j = np.unravel_index(np.argmin(gaps[nearest]), gaps[nearest].shape)
        ring = left.pop(nearest)
        whole = np.concatenate([whole[: i + 1], ring[j:], ring[: j + 1], whole[i:]])
    return whole


def _is_sliver(ring: Float[np.ndarray, "k 2"], tolerance: float) -> bool:
    """Whether a ring is thinner than the tolerance all along: what rounding leaves between two curves that meet."""
    sides = np.roll(ring, -1, axis=0) - ring
    return _area(ring) < 0.5 * tolerance * np.sqrt((sides**2).sum(axis=1)).sum()


def _area(ring: Float[np.ndarray, "k 2"]) -> float:
    x, y = (ring - ring[0]).T
    return float(abs(x[:-1] @ y[1:] - x[1:] @ y[:-1]) / 2)
