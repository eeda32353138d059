"""The cone of all points that a camera sees within an outline, as a closed mesh in the world."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import shapely
from jaxtyping import Float, Int
from manifold3d import Error, Manifold, Mesh64, triangulate

from ars_web.errors import BadInput
from ars_web.geometry import camera as cameras
from ars_web.geometry import rigid_transform
from ars_web.geometry.camera import Camera
from ars_web.geometry.mask_regions import multipolygon, region
from ars_web.geometry.polygon import Polygon
from ars_web.geometry.rigid_transform import Transform

COARSEST = 0.5
"""Pixels that an outline may be simplified by."""

COARSENESS = 0.0025
"""Of the mask's diameter, likewise: a small mask loses no more of its volume than a big one."""

STRAIGHT = 0.05
"""Pixels that a straight edge in the normalised plane may be off the straight edge in the image."""

MOST_SPLITS = 12

BORDER = 1.0
"""Pixels. A mask that comes nearer to the border of what its camera sees may go on beyond it."""

RIM_SAMPLES = 512

ROUND_SEGMENTS = 4
"""Of a quarter circle, where a mask is widened."""


@dataclass(frozen=True, eq=False)
class ViewingCone:
    """What a mask says about where the object is.

    Attributes:
        frame: its index, for messages.
        mask: widened, in image coordinates, cut to what the camera sees; not simplified.
        shown: the mask in the normalised plane, simplified.
        background: of a mask that touches the border, in the normalised plane, what the camera sees beside it: all that
            is known then is that the object is not there. Empty of other masks.
        is_open: whether the mask touches the border.
    """

    frame: int
    camera: Camera
    T_world_camera: Transform
    mask: shapely.MultiPolygon
    shown: shapely.MultiPolygon
    background: shapely.MultiPolygon
    is_open: bool

    @cached_property
    def rings(self) -> tuple[Float[np.ndarray, "_ 2"], ...]:
        """Those of `shown`, the outer ones counter-clockwise in (x, y) and holes clockwise."""
        return rings_of(self.shown)

    @property
    def centre_world(self) -> Float[np.ndarray, "3"]:
        """Where the camera is."""
        return self.T_world_camera[:3, 3]

    @property
    def middle_world(self) -> Float[np.ndarray, "3"]:
        """The direction, of unit length, in which the camera sees the middle of the mask."""
        points = np.concatenate(self.rings)
        middle = (points.min(axis=0) + points.max(axis=0)) / 2
        direction = self.T_world_camera[:3, :3] @ np.append(middle, 1.0)
        return direction / np.linalg.norm(direction)

    @property
    def frame_of_rings(self) -> tuple[Float[np.ndarray, "4 2"]]:
        """The smallest upright rectangle in the normalised plane round the mask, a ring like `rings`."""
        points = np.concatenate(self.rings)
        (x0, y0), (x1, y1) = points.min(axis=0), points.max(axis=0)
        return (np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]]),)

    def flat(self, points_world: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 2"]:
        """Points before the camera on its normalised plane."""
        points = rigid_transform.transform_points(rigid_transform.invert(self.T_world_camera), points_world)
        return points[:, :2] / points[:, 2:]

    def depths(self, points_world: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n"]:
        """How far points are before the camera, along its axis."""
        return (points_world - self.centre_world) @ self.T_world_camera[:3, 2]

    def solid(
        self,
        rings: Sequence[Float[np.ndarray, "_ 2"]],
        *,
        near: float,
        far: float,
        origin: Float[np.ndarray, "3"],
    ) -> Manifold:
        """All that the camera sees within rings of the normalised plane between two depths, moved so that `origin` in
        the world is at zero."""
        points = np.concatenate(rings)
        n = len(points)
        flat = np.column_stack([points, np.ones(n)])
        vertices = np.concatenate([near * flat, far * flat]) @ self.T_world_camera[:3, :3].T
        vertices += self.centre_world - origin
        cap = np.asarray(triangulate(list(rings)), dtype=np.int64)
        this, after = np.arange(n), _next_in_rings([len(ring) for ring in rings])
        faces = np.concatenate(
            [
                cap[:, ::-1],
                cap + n,
                np.column_stack([this, after, after + n]),
                np.column_stack([this, after + n, this + n]),
            ]
        )
        made = Manifold(Mesh64(np.ascontiguousarray(vertices), np.ascontiguousarray(faces.astype(np.uint64))))
        assert made.status() == Error.NoError, made.status()
        return made


def _next_in_rings(lengths: Sequence[int]) -> Int[np.ndarray, "n"]:
    starts = np.cumsum([0, *lengths[:-1]])
    after = np.arange(1, sum(lengths) + 1)
    after[starts + np.array(lengths) - 1] = starts
    return after


def cone_of_mask(
    frame: int, camera: Camera, T_world_camera: Transform, polygons: Sequence[Polygon], *, widen: float
) -> ViewingCone:
    """The cone of a mask that is widened by `widen` pixels.

    Raises:
        BadInput: the mask has no area, or none where the camera sees anything.
    """
    drawn = region(polygons)
    if drawn.is_empty:
        raise BadInput(f"the outline in frame {frame} encloses nothing; draw it round the object")
    seen = seen_region(camera)
    inside = multipolygon(drawn.intersection(seen))
    if inside.is_empty:
        raise BadInput(
            f"the outline in frame {frame} lies outside the {camera.width} x {camera.height} pixels that its lens"
            " shows; draw it round the object"
        )
    touches = not seen.buffer(-BORDER).covers(inside)
    mask = inside
    if widen > 0:
        mask = multipolygon(inside.buffer(widen, quad_segs=ROUND_SEGMENTS).intersection(seen))
    if touches:
        # Over the border, so that no strip of background is left there when the outline is simplified.
        over = mask.buffer(2 * BORDER, quad_segs=1).difference(seen.buffer(-BORDER))
        simple = multipolygon(simplified(multipolygon(mask.union(over))).intersection(seen))
        background = multipolygon(seen.difference(simple))
    else:
        simple, background = simplified(mask), shapely.MultiPolygon()
    return ViewingCone(
        frame,
        camera,
        T_world_camera,
        mask,
        undistorted(camera, simple),
        undistorted(camera, background),
        touches,
    )


@lru_cache(maxsize=64)
def seen_region(camera: Camera) -> shapely.Polygon:
    """The part of the image that the lens's model reaches, in image coordinates; the whole image, as a rule."""
    image = shapely.box(0, 0, camera.width, camera.height)
    border = cameras.image_border_pixels(camera)
    if np.isfinite(cameras.normalised_from_pixels(camera, border)).all():
        return image
    angles = np.linspace(0.0, 2 * np.pi, RIM_SAMPLES, endpoint=False)
    # The rim itself is where the inverse ends.
    circle = 0.9999 * camera.valid_radius * np.column_stack([np.cos(angles), np.sin(angles)])
    rim = cameras.image_from_pixels(cameras.pixels_from_normalised(camera, circle))
    pieces = multipolygon(image.intersection(shapely.make_valid(shapely.Polygon(rim)))).geoms
    return max(pieces, key=lambda piece: piece.area)


def simplified(mask: shapely.MultiPolygon) -> shapely.MultiPolygon:
    """A mask with fewer corners and the same area, off by COARSEST pixels at most.

    Chords of a round outline lie within it, so that every view would take a little off the hull: the outline is moved
    outwards by what it lost on average.
    """
    x0, y0, x1, y1 = mask.bounds
    tolerance = min(COARSEST, COARSENESS * float(np.hypot(x1 - x0, y1 - y0)))
    simple = multipolygon(mask.simplify(tolerance))
    lost = (mask.area - simple.area) / simple.length if simple.length > 0 else 0.0
    if simple.is_empty or abs(lost) > tolerance:
        return mask
    level = multipolygon(simple.buffer(lost, join_style="mitre", mitre_limit=2.0))
    return level if not level.is_empty else simple


def undistorted(camera: Camera, mask: shapely.MultiPolygon) -> shapely.MultiPolygon:
    """A mask in the normalised plane; a straight edge has as many corners as the lens bends it."""
    bent = shapely.MultiPolygon(
        [
            shapely.Polygon(
                _undistorted(camera, shapely.get_coordinates(piece.exterior)[:-1]),
                [_undistorted(camera, shapely.get_coordinates(hole)[:-1]) for hole in piece.interiors],
            )
            for piece in mask.geoms
        ]
    )
    # Where two edges nearly meet, their chords may cross.
    return bent if bent.is_valid else _areas(shapely.make_valid(bent))


def rings_of(region: shapely.Geometry) -> tuple[Float[np.ndarray, "_ 2"], ...]:
    """The rings of a region's areas, outer ones counter-clockwise in (x, y) and holes clockwise."""
    oriented = [shapely.orient_polygons(part) for part in _areas(region).geoms]
    rings = [ring for part in oriented for ring in (part.exterior, *part.interiors)]
    return tuple(np.ascontiguousarray(shapely.get_coordinates(ring)[:-1]) for ring in rings)


def _areas(geometry: shapely.Geometry) -> shapely.MultiPolygon:
    parts = shapely.get_parts(shapely.get_parts(geometry))
    return shapely.MultiPolygon([part for part in parts if isinstance(part, shapely.Polygon)])


def _undistorted(camera: Camera, ring: Float[np.ndarray, "k 2"]) -> Float[np.ndarray, "m 2"]:
    """A ring of image coordinates in the normalised plane; edges are halved until their chords are STRAIGHT."""
    flat = _normalised(camera, ring)
    if camera.model == "pinhole":
        return flat
    for _ in range(MOST_SPLITS):
        a, b = ring, np.roll(ring, -1, axis=0)
        flat_a, flat_b = flat, np.roll(flat, -1, axis=0)
        edge = b - a
        length = np.maximum(np.linalg.norm(edge, axis=1), 1e-12)
        off = np.zeros(len(ring))
        for t in (1 / 3, 2 / 3):
            chord = cameras.image_from_pixels(cameras.pixels_from_normalised(camera, flat_a + t * (flat_b - flat_a)))
            away = chord - a
            off = np.fmax(off, np.abs(away[:, 0] * edge[:, 1] - away[:, 1] * edge[:, 0]) / length)
        bent = np.flatnonzero(off > STRAIGHT)
        if len(bent) == 0:
            break
        middles = (a[bent] + b[bent]) / 2
        ring = np.insert(ring, bent + 1, middles, axis=0)
        flat = np.insert(flat, bent + 1, _normalised(camera, middles), axis=0)
    return flat


def _normalised(camera: Camera, image: Float[np.ndarray, "k 2"]) -> Float[np.ndarray, "k 2"]:
    flat = cameras.normalised_from_pixels(camera, cameras.pixels_from_image(image))
    assert np.isfinite(flat).all(), "masks are cut to what the lens reaches before"
    return flat
