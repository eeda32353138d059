"""Outlines of closed meshes in images: rings round the part of an object's hull that lies in the image, or one."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int
from manifold3d import CrossSection, FillRule

from ars_web.geometry import cut_kernels, region_kernels
from ars_web.geometry.camera import Camera
from ars_web.geometry.frame_blocks import over_blocks
from ars_web.geometry.lens import lens_tables
from ars_web.geometry.mesh import Mesh
from ars_web.geometry.mesh_labels import BLOCK, check_tolerance, curves_of_mesh
from ars_web.geometry.rigid_transform import Transform
from ars_web.geometry.rings import Rings, rings_of


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
    regions = _regions(camera, Ts_world_camera, meshes, wanted, tolerance)
    rings = [joined(region) for region in regions]
    lengths = [len(ring) for ring in rings]
    return np.concatenate([np.zeros((0, 2)), *rings]), np.cumsum([0, *lengths])


def mesh_regions(
    camera: Camera,
    Ts_world_camera: Float[np.ndarray, "n 4 4"],
    meshes: Sequence[Mesh],
    wanted: Bool[np.ndarray, "n b"],
    *,
    tolerance: float = 0.1,
) -> Rings:
    """The same parts as separate rings: of each piece the ring round it, counter-clockwise as seen in the image
    (y down), then those round its holes, clockwise; the largest piece comes first, and of its holes the largest.

    Raises:
        BadInput: `tolerance` is below FINEST_TOLERANCE.
    """
    return rings_of(_regions(camera, Ts_world_camera, meshes, wanted, tolerance))


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


def _regions(
    camera: Camera,
    Ts_world_camera: Float[np.ndarray, "n 4 4"],
    meshes: Sequence[Mesh],
    wanted: Bool[np.ndarray, "n b"],
    tolerance: float,
) -> list[list[Float[np.ndarray, "_ 2"]]]:
    """The rings of each mesh in each frame, row by row, as `mesh_regions` orders them."""
    check_tolerance(tolerance)
    n, b = len(Ts_world_camera), len(meshes)
    regions: list[list[Float[np.ndarray, "_ 2"]]] = [[] for _ in range(n * b)]
    Ts = np.array(Ts_world_camera, dtype=np.float64, order="C")
    for column, mesh in enumerate(meshes):
        rows = np.flatnonzero(wanted[:, column])

        def find(some: slice, rows: Int[np.ndarray, "_"] = rows, mesh: Mesh = mesh, column: int = column) -> None:
            found = _regions_of_mesh(camera, Ts[rows[some]], mesh, tolerance)
            for row, region in zip(rows[some].tolist(), found, strict=True):
                regions[row * b + column] = region

        over_blocks(find, len(rows), block=BLOCK)
    return regions


def _regions_of_mesh(
    camera: Camera, Ts_world_camera: Float[np.ndarray, "n 4 4"], mesh: Mesh, tolerance: float
) -> list[list[Float[np.ndarray, "_ 2"]]]:
    # Half of the tolerance for the chords of bent edges, half for points left out.
    tables, every = lens_tables(camera), np.ones(len(Ts_world_camera), dtype=np.bool_)
    curves = curves_of_mesh(tables, Ts_world_camera, mesh, every, tolerance / 2)
    points, lengths, counts = region_kernels.join_loops(*curves)
    # Cut one by one, loops still run round each point of the image as often.
    points, lengths = cut_kernels.cut_rings(tables.lens.width, tables.lens.height, points, lengths)
    starts = np.cumsum([0, *lengths.tolist()]).tolist()
    ends = np.cumsum([0, *counts.tolist()]).tolist()
    pieces: list[list[Float[np.ndarray, "_ 2"]]] = []
    owners: list[int] = []
    for frame in range(len(counts)):
        loops = [points[starts[i] : starts[i + 1]] for i in range(ends[frame], ends[frame + 1]) if lengths[i] >= 3]
        found = _pieces(loops, tolerance / 2)
        pieces += found
        owners += [frame] * len(found)
    return _sorted_regions(pieces, owners, len(counts), tolerance / 2)


def _pieces(loops: list[Float[np.ndarray, "_ 2"]], tolerance: float) -> list[list[Float[np.ndarray, "_ 2"]]]:
    """What loops enclose, without points that make less than `tolerance` of difference: the rings of each piece, that
    round it first."""
    if not loops:
        return []
    # Clipper's positive is clockwise as seen with y down, so all is turned round before and after.
    region = CrossSection([loop[::-1] for loop in loops], FillRule.Positive).simplify(tolerance)
    if region.num_contour() <= 1:
        return [[ring[::-1]] for ring in region.to_polygons()]
    return [[ring[::-1] for ring in piece.to_polygons()] for piece in region.decompose()]


def _sorted_regions(
    pieces: list[list[Float[np.ndarray, "_ 2"]]], owners: list[int], n: int, tolerance: float
) -> list[list[Float[np.ndarray, "_ 2"]]]:
    """The rings of each of n frames, largest pieces first, from the pieces and the frame that each is in."""
    areas, perimeters = _sizes([ring for piece in pieces for ring in piece])
    # What rounding leaves between two curves that meet is thinner than the tolerance all along.
    slivers = areas < 0.5 * tolerance * perimeters
    regions: list[list[tuple[float, list[Float[np.ndarray, "_ 2"]]]]] = [[] for _ in range(n)]
    at = 0
    for frame, piece in zip(owners, pieces, strict=True):
        if not slivers[at]:
            kept = [i for i in range(1, len(piece)) if not slivers[at + i]]
            kept.sort(key=lambda i, at=at: -areas[at + i])
            regions[frame].append((areas[at], [piece[0], *(piece[i] for i in kept)]))
        at += len(piece)
    for region in regions:
        region.sort(key=lambda piece: -piece[0])
    return [[ring for _, piece in region for ring in piece] for region in regions]


def _sizes(rings: list[Float[np.ndarray, "_ 2"]]) -> tuple[Float[np.ndarray, "r"], Float[np.ndarray, "r"]]:
    """The area and the perimeter of each ring."""
    if not rings:
        return np.zeros(0), np.zeros(0)
    lengths = np.array([len(ring) for ring in rings])
    starts = np.cumsum(lengths) - lengths
    points = np.concatenate(rings)
    points -= np.repeat(points[starts], lengths, axis=0)
    following = np.arange(1, len(points) + 1)
    following[starts + lengths - 1] = starts
    (x, y), (u, v) = points.T, points[following].T
    return np.abs(np.add.reduceat(x * v - u * y, starts)) / 2, np.add.reduceat(np.hypot(u - x, v - y), starts)


def joined(rings: list[Float[np.ndarray, "_ 2"]]) -> Float[np.ndarray, "m 2"]:
    """Rings as one, which goes from each to the nearest corner of the next and comes back the same way; (0, 2) for
    none."""
    if not rings:
        return np.zeros((0, 2))
    if len(rings) == 1:
        return rings[0]
    rings = sorted(rings, key=lambda ring: -_area(ring))
    whole, left = rings[0], rings[1:]
    while left:
        gaps = [((whole[:, None] - ring[None]) ** 2).sum(axis=2) for ring in left]
        nearest = min(range(len(left)), key=lambda i: gaps[i].min())
        i, j = np.unravel_index(np.argmin(gaps[nearest]), gaps[nearest].shape)
        ring = left.pop(nearest)
        whole = np.concatenate([whole[: i + 1], ring[j:], ring[: j + 1], whole[i:]])
    return whole


def _area(ring: Float[np.ndarray, "k 2"]) -> float:
    x, y = (ring - ring[0]).T
    return float(abs(x[:-1] @ y[1:] - x[1:] @ y[:-1]) / 2)
