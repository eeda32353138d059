"""Rays against shapes: a surface's own coordinates, and a slow march along the ray that knows only the inside."""

import math

import numpy as np
import pytest

from ars_web.demo import shapes
from ars_web.demo.shapes import BALL, BOX, CYLINDER, HANDLE, MISS, TUBE

SHAPES = [
    (BOX, (0.05, 0.03, 0.02)),
    (BALL, (0.04, 0.0, 0.0)),
    (CYLINDER, (0.03, 0.05, 0.0)),
    (TUBE, (0.05, 0.038, 0.024)),
    (HANDLE, (0.027, 0.0055, -0.008)),
]
SURFACES = [(kind, size, surface) for kind, size in SHAPES for surface in range(shapes.SURFACE_COUNTS[kind])]
STEP = 2e-5


def on_shape(kind, size, surface, point):
    """Not on the handle's part that is cut off, nor at the rim that corners of a disc's (u, v) are drawn in to."""
    if kind == HANDLE:
        return point[0] > size[2]
    return kind != CYLINDER or surface == 0 or math.hypot(*point[:2]) < 0.99 * size[0]


@pytest.mark.parametrize(("kind", "size", "surface"), SURFACES)
def test_surface_coordinates_lead_back_to_the_point(kind, size, surface):
    rng = np.random.default_rng(kind)
    for u, v in rng.uniform(0.02, 0.98, (200, 2)):
        point, normal = shapes.surface_point(kind, size, surface, u, v)
        u_back, v_back, normal_back = shapes.surface_coordinates(kind, size, surface, point)
        point_back, _ = shapes.surface_point(kind, size, surface, u_back, v_back)
        np.testing.assert_allclose(point_back, point, atol=1e-12)
        np.testing.assert_allclose(normal_back, normal, atol=1e-9)
        assert math.isclose(np.linalg.norm(normal), 1.0, abs_tol=1e-12)


@pytest.mark.parametrize(("kind", "size", "surface"), SURFACES)
def test_normals_point_out_of_the_material(kind, size, surface):
    rng = np.random.default_rng(kind)
    for u, v in rng.uniform(0.02, 0.98, (200, 2)):
        point, normal = map(np.array, shapes.surface_point(kind, size, surface, u, v))
        if on_shape(kind, size, surface, point):
            assert shapes.holds(kind, size, tuple(point - 1e-6 * normal))
            assert not shapes.holds(kind, size, tuple(point + 1e-6 * normal))


@pytest.mark.parametrize(("kind", "size", "surface"), SURFACES)
def test_a_ray_from_just_above_a_surface_enters_there(kind, size, surface):
    rng = np.random.default_rng(kind)
    for u, v in rng.uniform(0.02, 0.98, (200, 2)):
        point, normal = map(np.array, shapes.surface_point(kind, size, surface, u, v))
        if on_shape(kind, size, surface, point):
            t, entered = shapes.enter(kind, size, tuple(point + 1e-3 * normal), tuple(-normal))
            assert entered == surface
            assert math.isclose(t, 1e-3, abs_tol=2e-7)


@pytest.mark.parametrize(("kind", "size"), SHAPES)
def test_rays_enter_where_a_slow_march_first_finds_material(kind, size):
    rng = np.random.default_rng(10 + kind)
    hits = 0
    for _ in range(200):
        origin = rng.normal(size=3)
        origin *= 0.15 / np.linalg.norm(origin)
        direction = rng.uniform(-0.03, 0.03, 3) - origin
        direction /= np.linalg.norm(direction)
        t, _ = shapes.enter(kind, size, tuple(origin), tuple(direction))
        marched = march(kind, size, origin, direction)
        if marched == MISS:
            # The march may step over a graze; the ray may not enter where there is no material.
            assert t == MISS or grazes(kind, size, origin + t * direction, direction)
        else:
            hits += 1
            assert marched - STEP - 1e-6 <= t <= marched + 1e-6
    assert hits > 20


def march(kind, size, origin, direction):
    for t in np.arange(0.05, 0.25, STEP):
        if shapes.holds(kind, size, tuple(origin + t * direction)):
            return t
    return MISS


def grazes(kind, size, point, direction):
    """Whether the ray leaves the shape again within two steps of entering it."""
    return not shapes.holds(kind, size, tuple(point + 2 * STEP * direction))


def test_a_ray_through_a_tube_meets_the_far_wall():
    t, surface = shapes.enter(TUBE, (0.05, 0.04, 0.02), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    assert (t, surface) == (0.04, 1)


@pytest.mark.parametrize(("kind", "size"), SHAPES)
def test_a_ray_that_looks_away_misses(kind, size):
    assert shapes.enter(kind, size, (0.2, 0.01, 0.01), (1.0, 0.0, 0.0))[0] == MISS
