"""The slow, readable version of visibility among shapes: every ray against every triangle.

Nothing is bent, sorted or cut: each ray is asked on which sides of a triangle's corners it passes. Whether the camera
is inside a mesh is told by how often a ray in a direction of no meaning leaves it.
"""

from dataclasses import dataclass

import numpy as np

from ars_web.geometry import camera as cameras
from ars_web.geometry import rigid_transform
from ars_web.geometry.camera import Camera
from ars_web.geometry.mesh import Mesh


@dataclass(frozen=True)
class Layer:
    """A shape alone: its depth along the optical axis for each ray, infinity where it is not met; whether the camera is
    inside."""

    depth: np.ndarray
    inside: bool


def hits(origin: np.ndarray, directions: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(m, f) lengths along directions (m, 3) at which they meet triangles (f, 3, 3), infinity where they do not, and
    whether from outside."""
    a, u, v = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    p = np.cross(directions[:, None], v[None])
    det = (u * p).sum(axis=2)
    s = origin - a
    q = np.cross(s, u)
    with np.errstate(divide="ignore", invalid="ignore"):
        first = (s * p).sum(axis=2) / det
        second = directions @ q.T / det
        length = (v * q).sum(axis=1) / det
        met = (first >= -1e-12) & (second >= -1e-12) & (first + second <= 1 + 1e-12) & (length > 0)
    return np.where(met, length, np.inf), det > 0


def is_inside(origin: np.ndarray, triangles: np.ndarray) -> bool:
    lengths, entering = hits(origin, np.array([[0.412, -0.377, 0.829]]), triangles)
    met = np.isfinite(lengths[0])
    return bool((met & ~entering[0]).sum() > (met & entering[0]).sum())


def layer(rays: np.ndarray, T_world_camera: np.ndarray, mesh: Mesh, *, near: float) -> Layer:
    """What rays (m, 2) of the normalised plane meet of a mesh beyond the near plane."""
    points = rigid_transform.transform_points(rigid_transform.invert(T_world_camera), mesh.vertices_world)
    triangles = points[mesh.faces]
    inside = is_inside(np.zeros(3), triangles)
    depth, candidates = np.full(len(rays), np.inf), np.arange(len(rays))
    if (points[:, 2] > 0).all():
        flat = points[:, :2] / points[:, 2:]
        candidates = np.flatnonzero(((rays >= flat.min(axis=0)) & (rays <= flat.max(axis=0))).all(axis=1))
    a, b, c = (triangles[:, i] for i in range(3))
    volume = np.einsum("fi,fi->f", a, np.cross(b, c))
    sides = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)])
    for start in range(0, len(candidates), 1024):
        some = candidates[start : start + 1024]
        passed = np.column_stack([rays[some], np.ones(len(some))]) @ sides.transpose(0, 2, 1)
        through = (passed >= 0).all(axis=0) | (passed <= 0).all(axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            at = volume / passed.sum(axis=0)
            at = np.where(through & (at >= near), at, np.inf)
        first = np.where(volume < 0, at, np.inf).min(axis=1)
        leave = np.where(volume > 0, at, np.inf).min(axis=1)
        # What is left before it is entered was entered before the near plane.
        cut = leave < first * (1 - 1e-9)
        depth[some] = np.minimum(first, leave) if inside else np.where(cut, near, first)
    return Layer(depth, inside)


def pixel_rays(camera: Camera, *, spacing: int = 1) -> np.ndarray:
    """Rays through the middles of all pixels, row by row, or of all squares of `spacing` pixels."""
    u, v = (np.arange(spacing / 2, side, spacing) - 0.5 for side in (camera.width, camera.height))
    return cameras.normalised_from_pixels(camera, np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2))


def shares(layers: list[Layer]) -> tuple[np.ndarray, np.ndarray]:
    """Of each shape the share of its rays on which nothing is nearer, and how many rays it has."""
    found, counts = [], []
    for i, own in enumerate(layers):
        met = np.isfinite(own.depth)
        others = [np.full(len(met), np.inf) if c.inside else c.depth for j, c in enumerate(layers) if j != i]
        nearest = np.min([np.full(len(met), np.inf), *others], axis=0)
        counts.append(int(met.sum()))
        found.append(float((nearest[met] >= own.depth[met] * (1 - 1e-9)).mean()) if met.any() else np.nan)
    return np.array(found), np.array(counts)
