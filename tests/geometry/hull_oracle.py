"""The slow readable version of the visual hull: points are asked one by one, in every image; and scenes for it."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np
import shapely
import trimesh

from ars_web.geometry import camera as cameras
from ars_web.geometry import rigid_transform
from ars_web.geometry.camera import Camera
from ars_web.geometry.mask_regions import polygons_of
from ars_web.geometry.mesh_silhouette import silhouette
from ars_web.geometry.visual_hull import View, VisualHull

CAMERAS = {
    "pinhole": Camera(640, 480, 500.0, 510.0, 320.0, 240.0),
    "brown": Camera(640, 480, 460.0, 459.0, 320.0, 240.5, "brown", (-0.28, 0.09, 0.0008, -0.0005, -0.012)),
    "wide": Camera(640, 480, 280.0, 280.0, 310.0, 250.0, "brown", (-0.2, 0.04, 0.001, 0.002, -0.003)),
    "fisheye": Camera(640, 480, 230.0, 231.0, 325.0, 235.0, "fisheye", (0.02, -0.01, 0.003, -0.0005)),
}


def shape(name: str) -> trimesh.Trimesh:
    """A mesh of about 0.1 m round the origin."""
    if name == "sphere":
        return trimesh.creation.icosphere(4, 0.05)
    if name == "box":
        return trimesh.creation.box((0.10, 0.07, 0.05))
    if name == "cylinder":
        return trimesh.creation.cylinder(0.035, 0.1, sections=96)
    if name == "torus":
        return trimesh.creation.torus(0.038, 0.014, major_sections=64, minor_sections=32)
    assert name == "L"
    outline = shapely.Polygon([(0, 0), (0.1, 0), (0.1, 0.03), (0.03, 0.03), (0.03, 0.08), (0, 0.08)])
    made = trimesh.creation.extrude_polygon(outline, 0.04)
    made.apply_translation(-made.bounds.mean(axis=0))
    return made


def looking(eye: Sequence[float], at: Sequence[float] = (0.0, 0.0, 0.0), up: Sequence[float] = (0.0, 0.0, 1.0)):
    """`T_world_camera` of a camera at `eye`, with `at` on its axis and `up` upwards in the image."""
    z = np.subtract(at, eye)
    z = z / np.linalg.norm(z)
    x = np.cross(z, up)
    x = x / np.linalg.norm(x)
    return rigid_transform.from_rotation(np.column_stack([x, np.cross(z, x), z]), np.array(eye, dtype=float))


def round_about(views: int, *, distance: float = 0.45) -> list[np.ndarray]:
    """Cameras all round the origin, in turns low and high; two are a quarter turn apart."""
    turn = np.pi * np.arange(views) / views * (1 if views == 2 else 2) + 0.3
    rise = np.radians(np.where(np.arange(views) % 2 == 0, 30, 62))
    places = distance * np.column_stack([np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise)])
    return [looking(place) for place in places]


def view_of(frame: int, camera: Camera, T_world_camera: np.ndarray, mesh: trimesh.Trimesh) -> View:
    """What a person would outline who draws exactly: the silhouette, cut to the image."""
    seen = silhouette(camera, T_world_camera, np.asarray(mesh.vertices), np.asarray(mesh.faces))
    image = shapely.box(0, 0, camera.width, camera.height)
    return View(frame, camera, T_world_camera, polygons_of(seen.intersection(image)))


def views_of(mesh: trimesh.Trimesh, camera: Camera, Ts_world_camera: Sequence[np.ndarray]) -> list[View]:
    return [view_of(i, camera, T, mesh) for i, T in enumerate(Ts_world_camera)]


@dataclass(frozen=True)
class Asked:
    """What images say about points (n,): whether they may be the object's, and how many pixels that is from changing
    in the image where it is nearest to that."""

    possible: np.ndarray
    margin: np.ndarray


def ask(views: Sequence[View], points_world: np.ndarray, *, widen: float = 0.0) -> Asked:
    """A point is possible where every image shows it in the mask, or, if the mask touches the border, not at all."""
    possible, margin = np.ones(len(points_world), dtype=bool), np.full(len(points_world), np.inf)
    for view in views:
        camera = view.camera
        image = shapely.box(0, 0, camera.width, camera.height)
        rings = [shapely.make_valid(shapely.Polygon(ring)) for polygon in view.polygons for ring in polygon.rings]
        mask = shapely.intersection(reduce(shapely.symmetric_difference, rings), image)
        touches = not image.buffer(-1).covers(mask)
        points = rigid_transform.transform_points(rigid_transform.invert(view.T_world_camera), points_world)
        places = cameras.image_from_pixels(cameras.pixels_from_camera_points(camera, points))
        known = np.isfinite(places).all(axis=1)
        at = shapely.points(np.where(known[:, None], places, -1e6))
        shown = known & shapely.contains(image, at)
        inside = shown & (shapely.distance(mask, at) <= widen)
        possible &= inside | (touches & ~shown)
        border = np.abs(shapely.distance(mask, at) - widen) if widen else shapely.distance(mask.boundary, at)
        if touches:
            border = np.minimum(border, shapely.distance(image.boundary, at))
        margin = np.minimum(margin, border)
    return Asked(possible, margin)


def inside(hull: VisualHull, points_world: np.ndarray) -> np.ndarray:
    """Which points a closed mesh winds round: the solid angles of its faces, van Oosterom and Strackee 1983."""
    winds = np.empty(len(points_world))
    for i, point in enumerate(points_world):
        a, b, c = np.moveaxis((hull.vertices - point)[hull.faces], 1, 0)
        la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
        above = (a * np.cross(b, c)).sum(axis=1)
        below = la * lb * lc + (a * b).sum(axis=1) * lc + (a * c).sum(axis=1) * lb + (b * c).sum(axis=1) * la
        winds[i] = np.arctan2(above, below).sum() / (2 * np.pi)
    return winds > 0.5


def wrong(hull: VisualHull, views: Sequence[View], *, widen: float = 0.0, points: int = 600, seed: int = 0) -> int:
    """How many of random points round the hull are on the other side of it than the images say, among those that no
    image shows within a pixel of a border."""
    random = np.random.default_rng(seed)
    low, high = hull.vertices.min(axis=0), hull.vertices.max(axis=0)
    more = 0.1 * (high - low)
    sample = random.uniform(low - more, high + more, (points, 3))
    asked = ask(views, sample, widen=widen)
    clear = asked.margin > 1.0
    assert clear.sum() > points / 3
    assert (asked.possible & clear).sum() > 5
    return int((inside(hull, sample[clear]) != asked.possible[clear]).sum())
