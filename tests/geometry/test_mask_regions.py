"""Masks from outlines and pixels, and back."""

import cv2
import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from ars_web.errors import BadInput
from ars_web.geometry.mask_regions import (
    combined,
    iou,
    mask_from_polygons,
    polygons_from_mask,
    polygons_of,
    region,
    stroke,
)
from ars_web.geometry.polygon import Polygon

SQUARE = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])


def inside_by_parity(polygons: tuple[Polygon, ...], x: float, y: float) -> bool:
    """Whether a ray to the right of a point meets the rings an odd number of times."""
    met = 0
    for ring in (ring for polygon in polygons for ring in polygon.rings):
        for (x0, y0), (x1, y1) in zip(ring.tolist(), np.roll(ring, -1, axis=0).tolist(), strict=True):
            if (y0 > y) != (y1 > y) and x < x0 + (y - y0) / (y1 - y0) * (x1 - x0):
                met += 1
    return met % 2 == 1


def rings(corners: int = 7):
    coordinate = st.integers(0, 80).map(lambda n: n / 4 + 0.1)
    return arrays.arrays(np.float64, st.tuples(st.integers(3, corners), st.just(2)), elements=coordinate)


@given(outlines=st.lists(rings(), min_size=1, max_size=3))
def test_inside_is_what_an_odd_number_of_rings_goes_round(outlines: list[np.ndarray]):
    polygons = tuple(Polygon(ring) for ring in outlines)
    found = region(polygons)
    assert found.is_valid
    pixels = mask_from_polygons(polygons, 21, 21)
    for row in range(0, 21, 2):
        for column in range(0, 21, 3):
            expected = inside_by_parity(polygons, column + 0.5, row + 0.5)
            assert pixels[row, column] == expected
            centre = shapely.Point(column + 0.5, row + 0.5)
            if found.boundary.is_empty or found.boundary.distance(centre) > 1e-6:
                assert found.contains(centre) == expected


def test_a_bow_tie_is_both_its_halves_and_a_ring_run_twice_is_nothing():
    bow = Polygon(SQUARE[[0, 2, 1, 3]])
    assert region([bow]).area == pytest.approx(50)
    assert len(polygons_of(region([bow]))) == 2
    assert region([Polygon(np.concatenate([SQUARE, SQUARE]))]).area == pytest.approx(0, abs=1e-6)


def test_the_middle_of_a_five_pointed_star_is_outside():
    turns = np.arange(5) * 4 * np.pi / 5
    star = Polygon(50 + 40 * np.column_stack([np.sin(turns), -np.cos(turns)]))
    assert not region([star]).contains(shapely.Point(50, 50))
    assert not mask_from_polygons([star], 100, 100)[50, 50]


def test_holes_and_polygons_within_polygons_are_alike():
    hole = SQUARE / 2 + 2.5
    expected = region([Polygon(SQUARE, (hole,))])
    assert expected.area == pytest.approx(75)
    assert region([Polygon(SQUARE), Polygon(hole)]).equals(expected)
    (polygon,) = polygons_of(expected)
    assert len(polygon.holes) == 1
    # An island in the hole is a piece of its own.
    island = SQUARE / 10 + 4.5
    pieces = polygons_of(region([Polygon(SQUARE, (hole,)), Polygon(island)]))
    assert [len(piece.holes) for piece in pieces] == [1, 0]


def test_pieces_come_biggest_first():
    areas = [region([p]).area for p in polygons_of(region([Polygon(SQUARE * s + 100 * s) for s in (0.1, 3, 1)]))]
    assert areas == pytest.approx([900, 100, 1])


def test_no_polygons_are_an_empty_region():
    assert region([]).is_empty
    assert polygons_of(region([])) == ()
    assert not mask_from_polygons([], 4, 3).any()
    assert mask_from_polygons([], 4, 3).shape == (3, 4)


@pytest.mark.parametrize("tolerance", [0.0, 0.5])
def test_a_rectangle_of_pixels_is_that_rectangle(tolerance: float):
    for x0, y0, x1, y1 in [(3, 5, 40, 25), (0, 0, 60, 40), (7, 7, 8, 8), (10, 4, 50, 5), (0, 39, 60, 40)]:
        mask = np.zeros((40, 60), dtype=bool)
        mask[y0:y1, x0:x1] = True
        (polygon,) = polygons_from_mask(mask, tolerance=tolerance)
        assert sorted(map(tuple, polygon.outer.tolist())) == sorted([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])


@given(mask=arrays.arrays(np.bool_, st.tuples(st.integers(1, 9), st.integers(1, 9))))
def test_exact_outlines_give_the_same_pixels_again(mask: np.ndarray):
    polygons = polygons_from_mask(mask, tolerance=0.0)
    height, width = mask.shape
    np.testing.assert_array_equal(mask_from_polygons(polygons, width, height), mask)
    assert region(polygons).area == mask.sum()
    assert sum(region([polygon]).area for polygon in polygons) == mask.sum()


@given(mask=arrays.arrays(np.bool_, st.tuples(st.integers(1, 12), st.integers(1, 12))))
def test_smoothed_outlines_of_any_pixels_are_valid(mask: np.ndarray):
    for polygon in polygons_from_mask(mask):
        assert region([polygon]).area > 0


def test_outlines_of_a_disc_are_where_the_disc_is():
    y, x = np.mgrid[:300, :400] + 0.5
    away = np.hypot(x - 180.3, y - 140.8)
    mask = (away < 100) & (away > 40)
    polygons = polygons_from_mask(mask)
    (ring,) = polygons
    for points, radius in [(ring.outer, 100), (ring.holes[0], 40)]:
        off = np.hypot(*(points - [180.3, 140.8]).T) - radius
        assert np.abs(off).max() < 1.0
        assert len(points) < 100
    assert region(polygons).area == pytest.approx(mask.sum(), rel=0.005)
    assert (mask_from_polygons(polygons, 400, 300) != mask).mean() < 0.002


def test_a_slanted_edge_of_stairs_becomes_a_line():
    y, x = np.mgrid[:200, :200] + 0.5
    (polygon,) = polygons_from_mask((y < 150) & (y > 0.37 * x + 20))
    assert len(polygon.outer) < 12


def test_pixels_that_touch_at_a_corner_are_two_pieces_and_holes_likewise():
    mask = np.array([[1, 1, 0, 0], [1, 1, 0, 0], [0, 0, 1, 1], [0, 0, 1, 1]], dtype=bool)
    assert [region([p]).area for p in polygons_from_mask(mask, tolerance=0.0)] == [4, 4]


@pytest.mark.parametrize("seed", range(5))
def test_pixels_are_those_whose_centres_opencv_finds_inside(seed: int):
    random = np.random.default_rng(seed)
    ring = (random.uniform(-10, 60, (8, 2)) * 64).round() / 64
    polygon = Polygon(shapely.get_coordinates(shapely.convex_hull(shapely.multipoints(ring)))[:-1])
    found = mask_from_polygons([polygon], 50, 40)
    for row in range(40):
        for column in range(50):
            side = cv2.pointPolygonTest(polygon.outer.astype(np.float32), (column + 0.5, row + 0.5), True)
            if abs(side) > 1e-3:
                assert found[row, column] == (side > 0)


def test_iou_of_known_squares():
    half = SQUARE + np.array([5.0, 0.0])
    assert iou([Polygon(SQUARE)], [Polygon(half)]) == pytest.approx(1 / 3)
    assert iou([Polygon(SQUARE)], [Polygon(SQUARE)]) == 1.0
    assert iou([Polygon(SQUARE)], [Polygon(SQUARE + 50)]) == 0.0
    assert iou([], []) == 0.0


def test_a_brush_adds_and_an_eraser_takes_away():
    square = (Polygon(SQUARE),)
    bigger = combined(square, stroke(np.array([[5.0, 5.0], [15.0, 5.0]]), 4.0), "add")
    assert len(bigger) == 1
    assert bigger[0].outer[:, 0].max() == pytest.approx(17)
    # Through the middle: two halves are left.
    halves = combined(square, stroke(np.array([[-5.0, 5.0], [15.0, 5.0]]), 4.0), "subtract")
    assert [region([half]).area for half in halves] == pytest.approx([30, 30])
    # A dab within is a hole.
    (holed,) = combined(square, stroke(np.array([[5.0, 5.0]]), 4.0), "subtract")
    assert len(holed.holes) == 1
    assert combined(square, square, "subtract") == ()


def test_a_stroke_is_as_wide_as_its_brush_and_round_at_its_ends():
    (capsule,) = stroke(np.array([[10.0, 10.0], [30.0, 10.0]]), 6.0)
    assert region([capsule]).bounds == pytest.approx((7, 7, 33, 13))
    assert region([capsule]).area == pytest.approx(20 * 6 + np.pi * 9, rel=0.01)
    (disc,) = stroke(np.array([[10.0, 10.0]]), 6.0)
    assert region([disc]).area == pytest.approx(np.pi * 9, rel=0.01)
    # A brush that comes back to where it began leaves the middle free.
    (loop,) = stroke(np.array([[0.0, 0.0], [40.0, 0.0], [40.0, 40.0], [0.0, 40.0], [0.0, 0.0]]), 6.0)
    assert len(loop.holes) == 1
    # Twice at one place is once.
    assert region(stroke(np.array([[10.0, 10.0], [10.0, 10.0]]), 6.0)).area == pytest.approx(np.pi * 9, rel=0.01)


@pytest.mark.parametrize("points", [np.zeros((0, 2)), np.array([[np.nan, 1.0]]), np.array([[1.0, np.inf], [0, 0]])])
def test_a_stroke_needs_points(points: np.ndarray):
    with pytest.raises(BadInput, match="a stroke needs points"):
        stroke(points, 5.0)


@pytest.mark.parametrize("width", [0.0, -3.0, np.nan, np.inf])
def test_a_brush_has_a_width(width: float):
    with pytest.raises(BadInput, match="width must be a positive number"):
        stroke(np.array([[1.0, 1.0]]), width)


def test_a_tangle_is_refused_before_it_is_worked_out():
    corners = np.random.default_rng(0).uniform(0, 1000, (1000, 2))
    with pytest.raises(BadInput, match="crosses itself more than 2000 times"):
        region([Polygon(corners)])
    # Those of one ring with another count, too.
    comb = np.column_stack([np.arange(200) * 5.0, np.arange(200) % 2 * 1000.0])
    with pytest.raises(BadInput, match="crosses itself"):
        region([Polygon(comb), Polygon(comb[:, ::-1])])
