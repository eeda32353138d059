"""Labels of boxes in images: the one place that decides where a virtual box appears in a frame."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from ars_web.errors import BadInput
from ars_web.geometry import cut_kernels, lens_kernels, shadow_kernels
from ars_web.geometry.box import EDGES, Box, stack
from ars_web.geometry.camera import Camera
from ars_web.geometry.frame_blocks import over_blocks
from ars_web.geometry.lens import lens_tables
from ars_web.geometry.rigid_transform import Transform
from ars_web.geometry.silhouette_rings import silhouette_rings

NEAR = 0.01
"""Metres. Edges are clipped here before they are projected."""

FINEST_TOLERANCE = 1e-3
"""Pixels. Below it the curves would need more points than the loops have room for."""

ALLOWED_AT_BORDERS = 1.8
"""Tolerances. The ring of a box whose label may be off by more is drawn again, finer."""

RINGS = silhouette_rings()

BOX_FRAMES = 4096
"""Boxes times frames that are worked on at once: their shadows stay in the processor's cache."""

CutRings = tuple[Float[np.ndarray, "_ 2"], Int[np.ndarray, "_"]]
"""The points of rings one after the other, and how many each has."""


@dataclass(frozen=True, eq=False)
class BoxLabels:
    """Labels of b boxes in n frames of one camera, image coordinates (x0, y0, x1, y1).

    Attributes:
        bbox: (n, b, 4) of the part in the image; NaN where no part is in it.
        bbox_amodal: (n, b, 4) of all that is in front of the camera and within the lens's valid radius,
            unclipped; NaN where nothing is.
        truncated: (n, b) share of the amodal outline's area that lies outside the image; 1 where bbox is NaN.
    """

    bbox: Float[np.ndarray, "n b 4"]
    bbox_amodal: Float[np.ndarray, "n b 4"]
    truncated: Float[np.ndarray, "n b"]


def labels_of_boxes(
    camera: Camera, Ts_world_camera: Float[np.ndarray, "n 4 4"], boxes: Sequence[Box], *, tolerance: float = 0.05
) -> BoxLabels:
    """Labels of every box in every frame, exact to `tolerance` pixels, and where the image's border cuts a box
    aslant to ALLOWED_AT_BORDERS times that.

    Far from the image the amodal box may be off by more: 0.02 pixels at 1,000, 0.4 at 10,000, a thousandth at most.

    Raises:
        BadInput: `tolerance` is below FINEST_TOLERANCE.
    """
    return labels_of_stacked(camera, Ts_world_camera, *stack(list(boxes)), tolerance=tolerance)


def labels_of_stacked(
    camera: Camera,
    Ts_world_camera: Float[np.ndarray, "n 4 4"],
    Ts_world_box: Float[np.ndarray, "b 4 4"],
    sizes: Float[np.ndarray, "b 3"],
    *,
    tolerance: float = 0.05,
) -> BoxLabels:
    """The same for boxes as `box.stack` gives them; they are not checked."""
    _check_tolerance(tolerance)
    n, b, tables = len(Ts_world_camera), len(sizes), lens_tables(camera)
    found = BoxLabels(np.empty((n, b, 4)), np.empty((n, b, 4)), np.empty((n, b)))

    def label(frames: slice) -> None:
        polygons, corners = _shadows(Ts_world_camera[frames], Ts_world_box, sizes)
        bbox, amodal, truncated = found.bbox[frames], found.bbox_amodal[frames], found.truncated[frames]
        unsettled = np.empty(corners.shape, dtype=np.bool_)
        lens_kernels.boxes_of_shadows(
            tables.lens, tables.bends, polygons, corners, tolerance, bbox, amodal, truncated, unsettled
        )
        for fineness in (tolerance, max(tolerance / 8.0, FINEST_TOLERANCE), FINEST_TOLERANCE):
            points, lengths, missed = lens_kernels.rings_of_shadows(
                tables.lens, tables.bends, polygons, corners, unsettled, fineness
            )
            rough = np.zeros(corners.shape, dtype=np.bool_)
            cut_kernels.label_rings(
                tables.lens.width,
                tables.lens.height,
                points,
                lengths,
                missed,
                fineness,
                ALLOWED_AT_BORDERS * tolerance,
                bbox.reshape(-1, 4),
                amodal.reshape(-1, 4),
                truncated.reshape(-1),
                rough.reshape(-1),
            )
            # Few are: those that the image's border cuts at a small angle, at a corner of what is left of them.
            unsettled = rough
            if not rough.any():
                break

    over_blocks(label, n, block=_block(b))
    return found


def outlines(
    camera: Camera,
    Ts_world_camera: Float[np.ndarray, "n 4 4"],
    boxes: Sequence[Box],
    wanted: Bool[np.ndarray, "n b"],
    *,
    tolerance: float = 0.1,
) -> tuple[Float[np.ndarray, "k 2"], Int[np.ndarray, "n*b+1"]]:
    """The rings of `outline` for every box in every frame that is `wanted`, row by row.

    Returns:
        All rings' points (k, 2), and `offsets` (n * b + 1,): the ring of box j in frame i is
        `points[offsets[i * b + j] : offsets[i * b + j + 1]]`, empty where it is not wanted or not in the image.

    Raises:
        BadInput: `tolerance` is below FINEST_TOLERANCE.
    """
    return outlines_of_stacked(camera, Ts_world_camera, *stack(list(boxes)), wanted, tolerance=tolerance)


def outlines_of_stacked(
    camera: Camera,
    Ts_world_camera: Float[np.ndarray, "n 4 4"],
    Ts_world_box: Float[np.ndarray, "b 4 4"],
    sizes: Float[np.ndarray, "b 3"],
    wanted: Bool[np.ndarray, "n b"],
    *,
    tolerance: float = 0.1,
) -> tuple[Float[np.ndarray, "k 2"], Int[np.ndarray, "n*b+1"]]:
    """The same for boxes as `box.stack` gives them; they are not checked."""
    lens = lens_tables(camera).lens

    def cut(points: Float[np.ndarray, "_ 2"], lengths: Int[np.ndarray, "_"]) -> CutRings:
        return cut_kernels.cut_rings(lens.width, lens.height, points, lengths)

    found = rings_in_frames(camera, Ts_world_camera, Ts_world_box, sizes, wanted, cut, tolerance=tolerance)
    points = np.concatenate([np.zeros((0, 2)), *(ring for ring, _ in found)])
    lengths = np.concatenate([np.zeros(1, np.int64), *(lengths for _, lengths in found)])
    return points, np.cumsum(lengths)


def rings_in_frames(
    camera: Camera,
    Ts_world_camera: Float[np.ndarray, "n 4 4"],
    Ts_world_box: Float[np.ndarray, "b 4 4"],
    sizes: Float[np.ndarray, "b 3"],
    wanted: Bool[np.ndarray, "n b"],
    cut: Callable[[Float[np.ndarray, "_ 2"], Int[np.ndarray, "_"]], CutRings],
    *,
    tolerance: float,
) -> list[CutRings]:
    """What `cut` makes of the whole rings of boxes, row by row, a block of frames after the other: it is given the
    points of all rings of a block, and how many each has.

    Raises:
        BadInput: `tolerance` is below FINEST_TOLERANCE.
    """
    _check_tolerance(tolerance)
    n, b, tables = len(Ts_world_camera), len(sizes), lens_tables(camera)

    def rings(frames: slice) -> CutRings:
        polygons, corners = _shadows(Ts_world_camera[frames], Ts_world_box, sizes)
        points, lengths, _ = lens_kernels.rings_of_shadows(
            tables.lens, tables.bends, polygons, corners, np.ascontiguousarray(wanted[frames]), tolerance
        )
        return cut(points, lengths)

    return over_blocks(rings, n, block=_block(b))


def outline(camera: Camera, T_world_camera: Transform, box: Box, *, tolerance: float = 0.1) -> Float[np.ndarray, "k 2"]:
    """The ring round the part of a box that lies in the image, image coordinates; (0, 2) where none does.

    Counter-clockwise as seen in the image (y down), not closed; clipped to the image. Where the lens bends the box
    out of the image and back in, its parts stay joined along the image's border.

    Raises:
        BadInput: `tolerance` is below FINEST_TOLERANCE.
    """
    ring, _ = outlines(camera, T_world_camera[None], [box], np.ones((1, 1), dtype=bool), tolerance=tolerance)
    return ring


def wireframe(
    camera: Camera, T_world_camera: Transform, box: Box, *, tolerance: float = 0.1
) -> list[Float[np.ndarray, "k 2"]]:
    """The box's edges as polylines within the image, image coordinates: an edge bends with the lens, and is cut
    where it leaves the image, passes behind the camera or beyond the valid radius.

    Raises:
        BadInput: `tolerance` is below FINEST_TOLERANCE.
    """
    _check_tolerance(tolerance)
    edges = np.empty((len(EDGES), 2, 2))
    T = np.array(T_world_camera, dtype=np.float64, order="C")
    n = shadow_kernels.cast_edges(T, np.array(box.T_world_box), box.size / 2, NEAR, edges)
    tables = lens_tables(camera)
    curves = lens_kernels.curves_of_edges(tables.lens, tables.bends, edges[:n], tolerance)
    points, lengths = cut_kernels.cut_curves(tables.lens.width, tables.lens.height, *curves)
    return np.split(points, np.cumsum(lengths)[:-1]) if len(lengths) else []


def _shadows(
    Ts_world_camera: Float[np.ndarray, "n 4 4"],
    Ts_world_box: Float[np.ndarray, "b 4 4"],
    sizes: Float[np.ndarray, "b 3"],
) -> tuple[Float[np.ndarray, "n b corners 2"], Int[np.ndarray, "n b"]]:
    """The boxes' shadows on each frame's normalised plane, and each one's number of corners."""
    n, b = len(Ts_world_camera), len(sizes)
    polygons, corners = np.empty((n, b, shadow_kernels.MOST_CORNERS, 2)), np.empty((n, b), dtype=np.int64)
    # A copy, so that the compiled loop never meets an array of another order or one that may only be read.
    Ts = np.array(Ts_world_camera, dtype=np.float64, order="C")
    shadow_kernels.cast_shadows(Ts, Ts_world_box, sizes / 2, NEAR, RINGS, polygons, corners)
    return polygons, corners


def _block(boxes: int) -> int:
    """Frames that are worked on at once."""
    return max(BOX_FRAMES // max(boxes, 1), 1)


def _check_tolerance(tolerance: float) -> None:
    if not tolerance >= FINEST_TOLERANCE:
        raise BadInput(f"a tolerance must be at least {FINEST_TOLERANCE} pixels, not {tolerance}")
