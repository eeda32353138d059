"""The slow, readable version of `mesh_labels.py`: what it must answer, found by trying many points.

It shares no step with the fast one. There is no contour, no facing and no winding number: the border of a mesh's
image lies among the images of its triangles' edges, of the section that the near plane makes through each triangle,
of the lens's rim where rays meet the mesh, and of the image's own border where rays meet the mesh. All of these are
sampled.
"""

from dataclasses import dataclass

import numpy as np

from ars_web.geometry import camera as cameras
from ars_web.geometry import rigid_transform
from ars_web.geometry.camera import Camera
from ars_web.geometry.mesh import Mesh


@dataclass(frozen=True)
class Label:
    """As in `labels.BoxLabels`, for one mesh in one frame."""

    bbox: np.ndarray
    bbox_amodal: np.ndarray
    truncated: float


def label(camera: Camera, T_world_camera: np.ndarray, mesh: Mesh, *, near: float, step: float = 0.1) -> Label:
    """The label of a mesh, from points along every border about `step` pixels apart."""
    nothing = np.full(4, np.nan)
    vertices = rigid_transform.transform_points(rigid_transform.invert(T_world_camera), mesh.vertices_world)
    triangles = vertices[mesh.faces]
    lines = plane_lines(triangles, near=near)
    if len(lines) == 0:
        return Label(nothing, nothing, 1.0)
    edges = sampled(lines, camera, step=step)
    angle = np.linspace(0.0, 2 * np.pi, int(2 * (camera.width + camera.height) / step))
    rim = (1 - 1e-12) * camera.valid_radius * np.column_stack([np.cos(angle), np.sin(angle)])
    rim = rim[rays_meet(rim, triangles, near=near)]
    plane = np.concatenate([edges, rim])
    if len(plane) == 0:
        return Label(nothing, nothing, 1.0)
    image = cameras.image_from_pixels(cameras.pixels_from_normalised(camera, plane * (1 - 1e-12)))
    amodal = np.concatenate([image.min(axis=0), image.max(axis=0)])

    border_pixels = cameras.image_border_pixels(camera, samples=int(max(camera.width, camera.height) / step))
    met = rays_meet(cameras.normalised_from_pixels(camera, border_pixels), triangles, near=near)
    inside = (image >= 0).all(axis=1) & (image <= [camera.width, camera.height]).all(axis=1)
    seen = np.concatenate([image[inside], cameras.image_from_pixels(border_pixels[met])])
    if len(seen) == 0 or (np.ptp(seen, axis=0) == 0).any():
        return Label(nothing, amodal, 1.0)
    share = truncation(camera, triangles, plane, near=near)
    return Label(np.concatenate([seen.min(axis=0), seen.max(axis=0)]), amodal, share)


def plane_lines(triangles: np.ndarray, *, near: float) -> np.ndarray:
    """(k, 2, 2) the sides on the normalised plane of what of each triangle (f, 3, 3) is in front of the near plane."""
    lines = []
    for triangle in triangles:
        kept = []
        for i in range(3):
            a, b = triangle[i - 1], triangle[i]
            if (a[2] < near) != (b[2] < near):
                kept.append(a + (near - a[2]) / (b[2] - a[2]) * (b - a))
            if b[2] >= near:
                kept.append(b)
        flat = [p[:2] / p[2] for p in kept]
        lines += [(flat[i - 1], flat[i]) for i in range(len(flat))]
    return np.array(lines).reshape(-1, 2, 2)


def sampled(lines: np.ndarray, camera: Camera, *, step: float) -> np.ndarray:
    """Points along the parts of lines that lie within the valid radius, `step` pixels apart where the lens neither
    stretches nor shrinks, their ends included."""
    starts, along = lines[:, 0], lines[:, 1] - lines[:, 0]
    a, b = (along**2).sum(axis=1), (starts * along).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(b * b - a * ((starts**2).sum(axis=1) - camera.valid_radius**2))
        low, high = np.maximum((-b - root) / a, 0.0), np.minimum((-b + root) / a, 1.0)
    found = [np.zeros((0, 2))]
    for start, direction, first, last in zip(starts, along, low, high, strict=True):
        if first < last:
            pixels = np.linalg.norm(direction) * (last - first) * max(camera.fx, camera.fy)
            found.append(start + np.linspace(first, last, int(np.clip(pixels / step, 2, 20_000)))[:, None] * direction)
    return np.concatenate(found)


def rays_meet(plane: np.ndarray, triangles: np.ndarray, *, near: float) -> np.ndarray:
    """Whether the rays (x, y, 1) meet a triangle (f, 3, 3) beyond the near plane; rays that are NaN do not."""
    a, b, c = (triangles[:, i] for i in range(3))
    volume = np.einsum("fi,fi->f", a, np.cross(b, c))
    sides = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)])
    met = np.zeros(len(plane), dtype=bool)
    candidates = np.arange(len(plane))
    if (triangles[..., 2] > 0).all():
        flat = (triangles[..., :2] / triangles[..., 2:]).reshape(-1, 2)
        candidates = np.flatnonzero(((plane >= flat.min(axis=0)) & (plane <= flat.max(axis=0))).all(axis=1))
    for start in range(0, len(candidates), 1024):
        some = candidates[start : start + 1024]
        part = plane[some]
        shares = np.column_stack([part, np.ones(len(part))]) @ sides.transpose(0, 2, 1)
        through = (shares >= 0).all(axis=0) | (shares <= 0).all(axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            met[some] = (through & (volume / shares.sum(axis=0) >= near)).any(axis=1)
    return met


def truncation(camera: Camera, triangles: np.ndarray, plane: np.ndarray, *, near: float, side: int = 150) -> float:
    """The share of the amodal outline's area outside the image, from a grid of rays over the outline, each of which
    stands for as much of the image as the lens makes of its cell."""
    low, high = plane.min(axis=0), plane.max(axis=0)
    x, y = (low[i] + (np.arange(side) + 0.5) / side * (high[i] - low[i]) for i in range(2))
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    grid = grid[rays_meet(grid, triangles, near=near)]
    _, jacobian = cameras.distorted_with_jacobian(camera, grid)
    area = np.where(np.linalg.norm(grid, axis=1) <= camera.valid_radius, np.linalg.det(jacobian), 0.0)
    inside = cameras.in_image(camera, cameras.pixels_from_normalised(camera, grid))
    return float(1 - area[inside].sum() / area.sum())
