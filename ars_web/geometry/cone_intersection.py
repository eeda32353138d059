"""What viewing cones share, as a mesh: depths are chosen for the cones, then all are intersected at once."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from jaxtyping import Float, Int
from manifold3d import Manifold, OpType

from ars_web.geometry.viewing_cone import ViewingCone, rings_of

SMALLEST_ANGLE = math.radians(5)
"""Between two views. Below it, an outline's error of a pixel moves the hull's ends by more than its width."""

FAR_BASELINES = 100.0
"""Distances between the two cameras that are furthest apart. What reaches further away has no end that they tell."""

NEAR_FAR = 1e-6
"""Of the farthest depth: where cones begin that nothing else is known about."""

DEPTH_MARGIN = 0.05
"""Of its depth, by which a cone is longer than what it must reach."""

FEW = 2
"""Outlines that touch no border. With fewer, a hull has pieces where no camera looks; with as many, a piece that an
open outline shows nothing of may be a part of the object that is beyond that image."""

WIDEST_WINDOW = 1e3
"""In the normalised plane: 89.9 degrees off the axis."""

OPEN_REACH = 3.0
"""How much larger than what is seen of it an object may be that goes on beyond the image and that nothing bounds."""


@dataclass(frozen=True, eq=False)
class ConeScene:
    """Cones, and how far they reach.

    Attributes:
        ground: z of the world below which nothing is; None for no such plane.
        near, far: depths, metres before each camera, between which the cones are looked at.
    """

    cones: Sequence[ViewingCone]
    ground: float | None
    near: float
    far: float

    @property
    def tellable(self) -> float:
        """The depth at which the two cameras that are furthest apart see a point from sides SMALLEST_ANGLE apart."""
        return _widest_baseline(self.cones) / SMALLEST_ANGLE

    @staticmethod
    def of(cones: Sequence[ViewingCone], ground: float | None) -> "ConeScene":
        """Two cones or more from different places, as far as these can tell depths."""
        far = FAR_BASELINES * _widest_baseline(cones)
        return ConeScene(cones, ground, NEAR_FAR * far, far)

    @staticmethod
    def within(cones: Sequence[ViewingCone], ground: float | None, near: float, far: float) -> "ConeScene":
        """One cone or more between two depths."""
        return ConeScene(cones, ground, near, far)


@dataclass(frozen=True, eq=False)
class Solid:
    """A closed mesh in the world, and whether a cone's far end cut it off."""

    vertices: Float[np.ndarray, "v 3"]
    faces: Int[np.ndarray, "f 3"]
    reaches_far: bool


def intersection(scene: ConeScene) -> Solid | None:
    """What all cones share above the ground; None where they share nothing.

    Cones as long as the scene would be needles: from the frames round the masks, which have four sides each, follows
    between which depths every camera can have the object at most, and the cones are made for these.
    """
    closed = [cone for cone in scene.cones if not cone.is_open]
    origin = np.mean([cone.centre_world for cone in scene.cones], axis=0)
    rough = [_frame_solid(cone, scene, origin) for cone in closed]
    cap = None
    bounds = _trimmed(rough, scene, origin)
    if len(closed) < len(scene.cones) and (not closed or bounds is None or _reaches_far(closed, bounds, scene)):
        seen = _trimmed([_frame_solid(cone, scene, origin) for cone in scene.cones], scene, origin)
        if seen is None:
            return None
        low, high = seen.min(axis=0), seen.max(axis=0)
        more = (high - low) * (OPEN_REACH - 1) / 2
        cap = (low - more, high + more)
        bounds = _trimmed([*rough, _cuboid(cap, origin)], scene, origin)
    if bounds is None:
        return None
    middle = (bounds.min(axis=0) + bounds.max(axis=0)) / 2
    solids = [] if cap is None else [_cuboid(cap, middle)]
    taken: list[Manifold] = []
    for cone in scene.cones:
        near, far = _depth_range(cone, bounds, scene)
        if not cone.is_open:
            solids.append(cone.solid(cone.rings, near=near, far=far, origin=middle))
        elif (beside := _beside(cone, bounds, scene)) is not None:
            solids.append(cone.solid(beside, near=near, far=far, origin=middle))
        elif background := rings_of(cone.background):
            taken.append(cone.solid(background, near=scene.near, far=far, origin=middle))
    hull = Manifold.batch_boolean(solids, OpType.Intersect)
    if scene.ground is not None:
        hull = hull.trim_by_plane((0.0, 0.0, 1.0), scene.ground - middle[2])
    for solid in taken:
        hull = hull - solid
    if len(closed) < FEW:
        hull = _seen(hull, scene.cones, scene, middle)
    if hull.is_empty() or not hull.volume() > 0:
        return None
    mesh = hull.to_mesh64()
    vertices = np.asarray(mesh.vert_properties)[:, :3] + middle
    return Solid(vertices, np.asarray(mesh.tri_verts).astype(np.int64), _reaches_far(closed, vertices, scene))


def _widest_baseline(cones: Sequence[ViewingCone]) -> float:
    centres = np.array([cone.centre_world for cone in cones])
    return float(np.linalg.norm(centres[:, None] - centres[None], axis=-1).max())


def _beside(
    cone: ViewingCone, bounds: Float[np.ndarray, "n 3"], scene: ConeScene
) -> tuple[Float[np.ndarray, "_ 2"], ...] | None:
    """The rings of all of the normalised plane but an open cone's background, as far as the corners in the world of
    what the object is within reach there; None where they reach behind the camera, which no such rings can tell."""
    if not cone.depths(bounds).min() > scene.near:
        return None
    flat = cone.flat(bounds)
    if not np.abs(flat).max() < WIDEST_WINDOW:
        return None
    low, high = flat.min(axis=0), flat.max(axis=0)
    more = DEPTH_MARGIN * (high - low)
    return rings_of(shapely.box(*(low - more), *(high + more)).difference(cone.background)) or None


def _seen(hull: Manifold, cones: Sequence[ViewingCone], scene: ConeScene, origin: Float[np.ndarray, "3"]) -> Manifold:
    """A hull without the pieces that some open cone's mask shows nothing of."""
    pieces = [] if hull.is_empty() else hull.decompose()
    for cone in (cone for cone in cones if cone.is_open):
        pieces = [piece for piece in pieces if _shows(cone, piece, scene, origin)]
    return Manifold.batch_boolean(pieces, OpType.Add) if pieces else Manifold()


def _shows(cone: ViewingCone, piece: Manifold, scene: ConeScene, origin: Float[np.ndarray, "3"]) -> bool:
    """Whether a mask shows anything of a solid: one of its corners, as a rule."""
    corners = corners_of(piece) + origin
    depths = cone.depths(corners)
    far = float(depths.max()) * (1 + DEPTH_MARGIN)
    if far <= scene.near:
        return False
    flat = cone.flat(corners[depths > scene.near])
    if shapely.contains_xy(cone.shown, flat[:, 0], flat[:, 1]).any():
        return True
    return not (piece ^ cone.solid(cone.rings, near=scene.near, far=far, origin=origin)).is_empty()


def _frame_solid(cone: ViewingCone, scene: ConeScene, origin: Float[np.ndarray, "3"]) -> Manifold:
    return cone.solid(cone.frame_of_rings, near=scene.near, far=scene.far, origin=origin)


def _trimmed(
    solids: Sequence[Manifold], scene: ConeScene, origin: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "v 3"] | None:
    """The corners in the world of what solids share above the ground; None where they share nothing."""
    if not solids:
        return None
    shared = Manifold.batch_boolean(list(solids), OpType.Intersect)
    if scene.ground is not None:
        shared = shared.trim_by_plane((0.0, 0.0, 1.0), scene.ground - origin[2])
    if shared.is_empty():
        return None
    return corners_of(shared) + origin


def corners_of(solid: Manifold) -> Float[np.ndarray, "v 3"]:
    """Its vertices."""
    return np.asarray(solid.to_mesh64().vert_properties)[:, :3]


def _cuboid(bounds: tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]], origin: Float[np.ndarray, "3"]) -> Manifold:
    low, high = bounds
    return Manifold.cube(high - low).translate(low - origin)


def _depth_range(cone: ViewingCone, bounds: Float[np.ndarray, "n 3"], scene: ConeScene) -> tuple[float, float]:
    depths = cone.depths(bounds)
    near = max(float(depths.min()) * (1 - DEPTH_MARGIN), scene.near)
    return near, max(min(float(depths.max()) * (1 + DEPTH_MARGIN), scene.far), near * (1 + DEPTH_MARGIN))


def _reaches_far(cones: Sequence[ViewingCone], points_world: Float[np.ndarray, "n 3"], scene: ConeScene) -> bool:
    return any(float(cone.depths(points_world).max()) > 0.99 * scene.far for cone in cones)
