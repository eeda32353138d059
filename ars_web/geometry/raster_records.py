"""What the loops of `raster_kernels.py` hand to each other, and the numbers that they share."""

from typing import NamedTuple

import numpy as np

Array = np.ndarray

AHEAD = 1e-9
"""Metres of depth, from which on x / z and y / z are used."""

MARGIN = 1.25
"""Times the largest radius that the image has on the normalised plane: up to there corners are said to have an image.
Beyond, the lens may bend too much for the image of a corner to tell anything."""

SLACK = 0.05
"""Pixels that rays may be off their image points, because they are taken between others, and corners' images."""

STRAIGHT = 0.05
"""Pixels that the chords of bent edges may be off."""

FEW = 3
"""Columns of a triangle's box, up to which every ray in it is tried."""

NEARER = 1.0 + 1e-9
"""Times the other's inverse depth: surfaces that lie in each other do not hide each other."""

OUTSIDE, ROUND, CUT = 0, 1, 2
"""What a shape is to a camera: all beyond the near plane; with the camera inside; cut by the near plane."""


class Shapes(NamedTuple):
    """`shape_stack.ShapeStack` as the kernels read it.

    Attributes:
        vertices: (3, v).
        faces: (3, f).
        planes: (4, f).
        edges: (4, e) as `Mesh.edges`, their vertices and faces counted through all shapes.
        sides: (f,) the square of each face's longest side.
    """

    vertices: Array
    faces: Array
    planes: Array
    edges: Array
    sides: Array
    first_vertex: Array
    first_face: Array
    first_edge: Array
    Ts_world_bound: Array
    halves: Array


class Placed(NamedTuple):
    """The shapes of one frame, as its camera sees them; overwritten frame by frame.

    Attributes:
        points: (3, v) camera coordinates of the vertices.
        image: (2, v) their image coordinates; the first is NaN where they have none.
        nearness: (v,) the square of their inverse depth.
        listed: (f,) the faces to draw, from `first_face` on for each shape.
        reach: (5, f) the least and largest u, and the least and largest v, of those faces, in the order of `listed`,
            infinite where a corner has no image; and by how much they may be off the triangles of the corners' images.
        counts: (b,) how many faces are listed.
        kinds: (b,) OUTSIDE, ROUND or CUT.
        front: (f,) whether a face is turned to the camera; of shapes that are OUTSIDE.
    """

    points: Array
    image: Array
    nearness: Array
    listed: Array
    reach: Array
    counts: Array
    kinds: Array
    front: Array


class View(NamedTuple):
    """What a camera shows of the normalised plane.

    Attributes:
        limit: the square of the radius up to which points are said to have an image: MARGIN times the image's own.
        bend: bound, up to there, on the second derivative of a straight line's image, in pixels.
        rim, rim_bend: the same up to the lens's valid radius.
        low_x, high_x, low_y, high_y: bounds on the image's rays.
    """

    limit: float
    bend: float
    rim: float
    rim_bend: float
    low_x: float
    high_x: float
    low_y: float
    high_y: float


class Grid(NamedTuple):
    """Rays row by row, at the image points (u + j du, v + i dv).

    Attributes:
        first_row, end_row, first_column, end_column: where there is something to draw.
    """

    u: float
    v: float
    du: float
    dv: float
    rows: int
    columns: int
    first_row: int
    end_row: int
    first_column: int
    end_column: int
