"""Where a mesh is seen in an image: the region that its triangles cover together, bent as the lens does."""

import math

import numpy as np
import shapely
from jaxtyping import Float, Int
from manifold3d import CrossSection, FillRule

from ars_web.geometry import camera as cameras
from ars_web.geometry import rigid_transform
from ars_web.geometry.camera import Camera
from ars_web.geometry.labels import NEAR
from ars_web.geometry.rigid_transform import Transform

STRAIGHT = 0.05
"""Pixels that the image's chords may be off."""

MOST_SPLITS = 12

FARTHEST_OUT = 0.9999
"""Of the lens's valid radius."""

RIM_SAMPLES = 512


def silhouette(
    camera: Camera,
    T_world_camera: Transform,
    vertices_world: Float[np.ndarray, "v 3"],
    faces: Int[np.ndarray, "f 3"],
    *,
    reach: float = math.inf,
) -> shapely.MultiPolygon:
    """The region of image coordinates, not cut to the image, that a mesh (v, 3), (f, 3) of any kind covers.

    What is nearer than NEAR before the camera, behind it or beyond the lens's valid radius is not seen. What is beyond
    `reach` in the normalised plane is left out: far outside the image there is much to bend and nothing to see.
    """
    points = rigid_transform.transform_points(rigid_transform.invert(T_world_camera), vertices_world)
    points, faces = _beyond_near(points, faces)
    if len(faces) == 0:
        return shapely.MultiPolygon()
    flat = points[:, :2] / points[:, 2:]
    a, b, c = np.moveaxis(flat[faces], 1, 0)
    front = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0]) > 0
    loops = _border(faces[front]) + _border(faces[~front][:, ::-1])
    # Clipper keeps eight decimals: pixels, so that they are enough for a long lens, too.
    scale = camera.fx
    section = CrossSection([np.ascontiguousarray(flat[loop] * scale) for loop in loops], FillRule.NonZero)
    rim = min(FARTHEST_OUT * camera.valid_radius, reach)
    if np.linalg.norm(flat, axis=1).max() > rim:
        angles = np.linspace(0.0, 2 * np.pi, RIM_SAMPLES, endpoint=False)
        section = section ^ CrossSection([rim * scale * np.column_stack([np.cos(angles), np.sin(angles)])])
    pieces: list[shapely.Geometry] = []
    for piece in section.decompose():
        if not piece.is_empty():
            outer, *holes = (_bent(camera, ring / scale) for ring in piece.to_polygons())
            pieces.append(shapely.make_valid(shapely.Polygon(outer, holes)))
    # Pieces that touch may overlap by rounding once they are bent.
    whole = pieces[0] if len(pieces) == 1 else shapely.union_all(pieces)
    found = shapely.get_parts(shapely.get_parts(whole))
    return shapely.MultiPolygon([part for part in found if isinstance(part, shapely.Polygon)])


def _beyond_near(
    points: Float[np.ndarray, "v 3"], faces: Int[np.ndarray, "f 3"]
) -> tuple[Float[np.ndarray, "w 3"], Int[np.ndarray, "g 3"]]:
    """The triangles cut at the near plane; those that share an edge share its cut."""
    ahead = points[:, 2] >= NEAR
    count = ahead[faces].sum(axis=1)
    if (count == 3).all():
        return points, faces
    whole = faces[count == 3]
    # Turned so that the vertex that is alone on its side comes first.
    one, two = faces[count == 1], faces[count == 2]
    one = np.take_along_axis(one, (np.argmax(ahead[one], axis=1)[:, None] + np.arange(3)) % 3, axis=1)
    two = np.take_along_axis(two, (np.argmin(ahead[two], axis=1)[:, None] + np.arange(3)) % 3, axis=1)
    alone = np.concatenate([one, two])
    edges = np.sort(np.concatenate([alone[:, [0, 1]], alone[:, [0, 2]]]), axis=1)
    cut, which = np.unique(edges, axis=0, return_inverse=True)
    start, end = points[cut[:, 0]], points[cut[:, 1]]
    t = ((NEAR - start[:, 2]) / (end[:, 2] - start[:, 2]))[:, None]
    new = start + t * (end - start)
    new[:, 2] = NEAR
    which = which.reshape(2, -1) + len(points)
    p, q = which[:, : len(one)]
    r, s = which[:, len(one) :]
    pieces = [
        whole,
        np.column_stack([one[:, 0], p, q]),
        np.column_stack([two[:, 1], two[:, 2], s]),
        np.column_stack([two[:, 1], s, r]),
    ]
    points = np.concatenate([points, new])
    points[: len(ahead)][~ahead] = [0.0, 0.0, 1.0]  # used by none any more
    return points, np.concatenate(pieces)


def _border(faces: Int[np.ndarray, "f 3"]) -> list[Int[np.ndarray, "_"]]:
    """Loops of vertices round triangles: the edges that are run along once more in one direction than in the other.

    As many edges lead to a vertex as away from it, so any walk along them comes back.
    """
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    forward = edges[:, 0] < edges[:, 1]
    keys, which = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    net = np.bincount(which.reshape(-1), weights=np.where(forward, 1.0, -1.0), minlength=len(keys)).astype(np.int64)
    ways = np.concatenate(
        [np.repeat(keys, np.maximum(net, 0), axis=0), np.repeat(keys[:, ::-1], np.maximum(-net, 0), axis=0)]
    )
    leads: dict[int, list[int]] = {}
    for start, end in ways.tolist():
        leads.setdefault(start, []).append(end)
    loops: list[np.ndarray] = []
    for start in list(leads):
        while leads[start]:
            loop, vertex = [start], leads[start].pop()
            while vertex != start:
                loop.append(vertex)
                vertex = leads[vertex].pop()
            if len(loop) > 2:
                loops.append(np.array(loop))
    return loops


def _bent(camera: Camera, ring: Float[np.ndarray, "k 2"]) -> Float[np.ndarray, "m 2"]:
    """A ring of the normalised plane in image coordinates; edges are halved until their chords are STRAIGHT."""
    image = _image(camera, ring)
    if camera.model == "pinhole":
        return image
    for _ in range(MOST_SPLITS):
        a, b = ring, np.roll(ring, -1, axis=0)
        image_a, edge = image, np.roll(image, -1, axis=0) - image
        length = np.maximum(np.linalg.norm(edge, axis=1), 1e-12)
        off = np.zeros(len(ring))
        for t in (1 / 3, 2 / 3):
            away = _image(camera, a + t * (b - a)) - image_a
            off = np.maximum(off, np.abs(away[:, 0] * edge[:, 1] - away[:, 1] * edge[:, 0]) / length)
        bends = np.flatnonzero(off > STRAIGHT)
        if len(bends) == 0:
            break
        middles = (a[bends] + b[bends]) / 2
        ring = np.insert(ring, bends + 1, middles, axis=0)
        image = np.insert(image, bends + 1, _image(camera, middles), axis=0)
    return image


def _image(camera: Camera, ring: Float[np.ndarray, "k 2"]) -> Float[np.ndarray, "k 2"]:
    return cameras.image_from_pixels(cameras.pixels_from_normalised(camera, ring))
