"""The visual hull: all points that every outline of an object leaves possible (Laurentini 1994), as a closed mesh.

Each outline is a cone from its camera; the cones are intersected exactly as meshes. The hull contains the object where
the outlines do.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from ars_web.errors import BadInput, ViewsDisagree
from ars_web.geometry import cone_intersection
from ars_web.geometry.camera import Camera
from ars_web.geometry.cone_intersection import SMALLEST_ANGLE, ConeScene
from ars_web.geometry.polygon import Polygon
from ars_web.geometry.projection_jacobian import pixels_with_jacobian
from ars_web.geometry.rigid_transform import Transform
from ars_web.geometry.triangulation import CLOSEST_PLACES
from ars_web.geometry.view_disagreement import disagreement
from ars_web.geometry.viewing_cone import ViewingCone, cone_of_mask

WIDEST = 1000.0
"""Pixels that masks may be widened by."""


@dataclass(frozen=True, eq=False)
class View:
    """An object's outline in a frame.

    Attributes:
        frame: its index, for messages.
        polygons: the mask, even-odd over all its rings, image coordinates.
    """

    frame: int
    camera: Camera
    T_world_camera: Transform
    polygons: tuple[Polygon, ...]


@dataclass(frozen=True, eq=False)
class VisualHull:
    """A closed mesh.

    Attributes:
        vertices: (v, 3) in the world, metres.
        faces: (f, 3) triangles, counter-clockwise from outside.
    """

    vertices: Float[np.ndarray, "v 3"]
    faces: Int[np.ndarray, "f 3"]

    @cached_property
    def volume(self) -> float:
        """Cubic metres."""
        return float(self._tetrahedra[1].sum())

    @cached_property
    def centre_of_mass(self) -> Float[np.ndarray, "3"]:
        """(3,) in the world, for one density throughout."""
        centres, volumes = self._tetrahedra
        return volumes @ centres / volumes.sum()

    @property
    def _tetrahedra(self) -> tuple[Float[np.ndarray, "f 3"], Float[np.ndarray, "f"]]:
        """Centres and signed volumes of the tetrahedra between each face and the vertices' middle."""
        middle = self.vertices.mean(axis=0)
        a, b, c = np.moveaxis((self.vertices - middle)[self.faces], 1, 0)
        return middle + (a + b + c) / 4, (a * np.cross(b, c)).sum(axis=1) / 6


def visual_hull(views: Sequence[View], *, widen: float = 0.0, ground: float | None = None) -> VisualHull:
    """The hull of two views or more, of the outlines widened by `widen` pixels.

    An outline that touches the image's border leaves open what is beyond it; where the others do not bound that, it is
    taken to reach no further than the part that is seen, on either side. With `ground`, what is below that z of the
    world is cut off.

    Raises:
        ViewsDisagree: the cones do not meet, the views see the object from one side only (under SMALLEST_ANGLE), or
            leave open how far away it ends.
        BadInput: fewer than two views, a frame twice, an outline that encloses nothing of its image, or nothing of the
            hull is above the ground.
    """
    cones = _cones(views, widen)
    if len(cones) < 2:
        raise BadInput(f"a hull needs outlines in two frames at least, not {len(cones)}")
    _check_angles(cones)
    scene = ConeScene.of(cones, ground)
    hull = cone_intersection.intersection(scene)
    if hull is None:
        raise disagreement(scene)
    if hull.reaches_far:
        raise ViewsDisagree(
            f"the outlines in frames {_listed(cones)} leave open how far away the object ends; draw it in a frame from"
            " another side",
            tuple((cone.frame, math.nan) for cone in cones),
        )
    return VisualHull(hull.vertices, hull.faces)


def band(
    views: Sequence[View], *, depth: tuple[float, float], widen: float = 0.0, ground: float | None = None
) -> VisualHull:
    """Where an object may be by one view or more: what the cones share between two depths, metres before each camera.

    Raises:
        ViewsDisagree: the cones do not meet there.
        BadInput: no view, a frame twice, an outline that encloses nothing of its image, or depths that are not two
            positive numbers, the smaller first.
    """
    near, far = depth
    if not (0 < near < far < math.inf):
        raise BadInput(f"depths must be two positive numbers of metres, the smaller first, not {near} and {far}")
    cones = _cones(views, widen)
    if not cones:
        raise BadInput("a band needs an outline in one frame at least")
    scene = ConeScene.within(cones, ground, near, far)
    hull = cone_intersection.intersection(scene)
    if hull is None:
        raise disagreement(scene)
    return VisualHull(hull.vertices, hull.faces)


def angle_between(views: Sequence[View], point_world: Float[np.ndarray, "3"]) -> float:
    """Radians between the two views that see a point from the sides furthest apart; 0 for a single view."""
    directions = np.array([view.T_world_camera[:3, 3] for view in views]) - point_world
    return _widest_angle(directions / np.maximum(np.linalg.norm(directions, axis=1, keepdims=True), 1e-300))


def expected_widening(
    views: Sequence[View],
    point_world: Float[np.ndarray, "3"],
    *,
    position_error: float = 0.002,
    angle_error: float = math.radians(0.2),
) -> float:
    """By how many pixels the image of a point is off, in the worst of the views, where poses are off by so many metres
    and radians: how far to widen masks so that the object stays within all of them.

    Raises:
        BadInput: the point is behind each of the cameras or beyond what their lenses show, or an error is negative.
    """
    if not (position_error >= 0 and angle_error >= 0):
        raise BadInput(f"pose errors cannot be negative: {position_error} m and {angle_error} radians")
    worst: list[float] = []
    for view in views:
        R, centre = view.T_world_camera[:3, :3], view.T_world_camera[:3, 3]
        point = (point_world - centre) @ R
        _, slope = pixels_with_jacobian(view.camera, point)
        x, y, z = point
        turning = slope @ np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])
        if np.isfinite(slope).all():
            worst.append(float(np.linalg.norm(slope, 2) * position_error + np.linalg.norm(turning, 2) * angle_error))
    if not worst:
        raise BadInput(f"no frame shows the point {np.asarray(point_world).tolist()}; choose one on the object")
    return max(worst)


def _cones(views: Sequence[View], widen: float) -> list[ViewingCone]:
    if not 0 <= widen <= WIDEST:
        raise BadInput(f"masks can be widened by 0 to {WIDEST:g} pixels, not {widen}")
    frames = [view.frame for view in views]
    for frame in frames:
        if frames.count(frame) > 1:
            raise BadInput(f"frame {frame} is given twice; put its outlines into one view")
    return [cone_of_mask(v.frame, v.camera, v.T_world_camera, v.polygons, widen=widen) for v in views]


def _check_angles(cones: Sequence[ViewingCone]) -> None:
    nowhere = tuple((cone.frame, math.nan) for cone in cones)
    centres = np.array([cone.centre_world for cone in cones])
    if float(np.linalg.norm(centres - centres[0], axis=1).max()) < CLOSEST_PLACES:
        raise ViewsDisagree(
            f"frames {_listed(cones)} were taken at one place, so that they do not tell how far the object is; draw it"
            " in a frame from another side",
            nowhere,
        )
    angle = _widest_angle(np.array([cone.middle_world for cone in cones]))
    if angle < SMALLEST_ANGLE:
        raise ViewsDisagree(
            f"frames {_listed(cones)} see the object from nearly the same side, {math.degrees(angle):.1f} degrees"
            f" apart where {math.degrees(SMALLEST_ANGLE):g} are needed; draw it in a frame from another side",
            nowhere,
        )


def _widest_angle(directions: Float[np.ndarray, "n 3"]) -> float:
    """Radians between the two directions that are furthest apart; exact for small ones, where a cosine is not."""
    apart = np.linalg.norm(directions[:, None] - directions[None], axis=-1)
    return float(2 * np.arcsin(np.minimum(apart.max() / 2, 1.0)))


def _listed(cones: Sequence[ViewingCone]) -> str:
    frames = [str(cone.frame) for cone in cones]
    return f"{', '.join(frames[:-1])} and {frames[-1]}"
