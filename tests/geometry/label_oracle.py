"""The slow, readable version of `labels.py`: what it must answer, found by trying many points.

It shares no step with the fast one. There is no silhouette, no hull and no bound on how a lens bends: the border of
a box's image is the image of its edges, of the section that the near plane makes through it, of the lens's rim where
rays meet the box, and of the image's own border where rays meet the box. All of these are sampled.
"""

from dataclasses import dataclass

import numpy as np

from ars_web.geometry import camera as cameras
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import EDGES, Box
from ars_web.geometry.camera import Camera


@dataclass(frozen=True)
class Label:
    """As in `labels.BoxLabels`, for one box in one frame."""

    bbox: np.ndarray
    bbox_amodal: np.ndarray
    truncated: float


def label(camera: Camera, T_world_camera: np.ndarray, box: Box, *, near: float, step: float = 0.05) -> Label:
    """The label of a box, from points along every border `step` pixels apart."""
    nothing = np.full(4, np.nan)
    lines = plane_lines(T_world_camera, box, near=near)
    if not lines:
        return Label(nothing, nothing, 1.0)
    count = int(4 * (camera.width + camera.height) / step)
    t = np.linspace(0.0, 1.0, count)[:, None]
    edges = [(1 - t) * a + t * b for a, b in (within(line, camera.valid_radius) for line in lines) if a is not None]
    angle = np.linspace(0.0, 2 * np.pi, count)
    rim = (1 - 1e-12) * camera.valid_radius * np.column_stack([np.cos(angle), np.sin(angle)])
    rim = rim[rays_meet(rim, T_world_camera, box, near=near)]
    plane = np.concatenate([*edges, rim])
    if len(plane) == 0:
        return Label(nothing, nothing, 1.0)
    image = cameras.image_from_pixels(cameras.pixels_from_normalised(camera, plane * (1 - 1e-12)))
    amodal = np.concatenate([image.min(axis=0), image.max(axis=0)])

    border_pixels = cameras.image_border_pixels(camera, samples=int(max(camera.width, camera.height) / step))
    border = cameras.normalised_from_pixels(camera, border_pixels)
    met = rays_meet(border, T_world_camera, box, near=near)
    inside = (image >= 0).all(axis=1) & (image <= [camera.width, camera.height]).all(axis=1)
    seen = np.concatenate([image[inside], cameras.image_from_pixels(border_pixels[met])])
    if len(seen) == 0 or (np.ptp(seen, axis=0) == 0).any():
        return Label(nothing, amodal, 1.0)
    return Label(
        np.concatenate([seen.min(axis=0), seen.max(axis=0)]),
        amodal,
        truncation(camera, T_world_camera, box, plane, near=near),
    )


def plane_lines(T_world_camera: np.ndarray, box: Box, *, near: float) -> list[np.ndarray]:
    """The edges (2, 2) on the normalised plane of what is in front of the near plane, its section included."""
    corners = rigid_transform.transform_points(rigid_transform.invert(T_world_camera), box.corners_world)
    lines, section = [], []
    for i, j in EDGES:
        a, b = corners[i], corners[j]
        if a[2] < near and b[2] < near:
            continue
        if (a[2] < near) != (b[2] < near):
            cut = a + (near - a[2]) / (b[2] - a[2]) * (b - a)
            section.append(cut)
            a, b = (cut, b) if a[2] < near else (a, cut)
        lines.append(np.array([a[:2] / a[2], b[:2] / b[2]]))
    # The section's own edges are among the lines between any two of its corners, and those are all within it.
    lines += [np.array([a[:2], b[:2]]) / near for i, a in enumerate(section) for b in section[:i]]
    return lines


def within(line: np.ndarray, radius: float) -> tuple[np.ndarray | None, np.ndarray | None]:
    """The ends of the part of a line that lies in a disc round the origin."""
    a, d = line[0], line[1] - line[0]
    roots = np.roots([d @ d, 2 * a @ d, a @ a - radius**2]) if d @ d > 0 else np.array([])
    if len(roots) < 2 or np.iscomplex(roots).any():
        return None, None
    low, high = max(roots.real.min(), 0.0), min(roots.real.max(), 1.0)
    return (a + low * d, a + high * d) if low < high else (None, None)


def rays_meet(plane: np.ndarray, T_world_camera: np.ndarray, box: Box, *, near: float) -> np.ndarray:
    """Whether the rays (x, y, 1) meet the box beyond the near plane; rays that are NaN do not."""
    entry, leave = depths(plane, T_world_camera, box)
    return (entry <= leave) & (leave >= near)


def depths(plane: np.ndarray, T_world_camera: np.ndarray, box: Box) -> tuple[np.ndarray, np.ndarray]:
    """Depths at which the lines through the rays (x, y, 1) enter and leave a box; a miss enters after it leaves."""
    T_box_camera = rigid_transform.invert(box.T_world_box) @ T_world_camera
    origin = T_box_camera[:3, 3]
    rays = np.concatenate([plane, np.ones((*plane.shape[:-1], 1))], axis=-1) @ T_box_camera[:3, :3].T
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (-box.size / 2 - origin) / rays, (box.size / 2 - origin) / rays
    return np.minimum(a, b).max(axis=-1), np.maximum(a, b).min(axis=-1)


def truncation(
    camera: Camera, T_world_camera: np.ndarray, box: Box, plane: np.ndarray, *, near: float, side: int = 500
) -> float:
    """The share of the amodal outline's area outside the image, from a grid of rays over the outline, each of which
    stands for as much of the image as the lens makes of its cell."""
    low, high = plane.min(axis=0), plane.max(axis=0)
    x, y = (low[i] + (np.arange(side) + 0.5) / side * (high[i] - low[i]) for i in range(2))
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    grid = grid[rays_meet(grid, T_world_camera, box, near=near)]
    h = 1e-6 * camera.valid_radius
    across = cameras.pixels_from_normalised(camera, grid + np.array([h, 0.0])) - cameras.pixels_from_normalised(
        camera, grid
    )
    down = cameras.pixels_from_normalised(camera, grid + np.array([0.0, h])) - cameras.pixels_from_normalised(
        camera, grid
    )
    area = np.nan_to_num(across[:, 0] * down[:, 1] - across[:, 1] * down[:, 0])
    inside = cameras.in_image(camera, cameras.pixels_from_normalised(camera, grid))
    return float(1 - area[inside].sum() / area.sum())
