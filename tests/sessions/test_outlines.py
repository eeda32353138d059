"""Outlines are checked on their way in, rounded once, and kept bit by bit."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ars_web.errors import BadInput
from ars_web.geometry.polygon import Polygon
from ars_web.sessions.outlines import (
    MOST_CORNERS,
    MOST_RINGS,
    checked_polygons,
    corners_of,
    polygons_from_json,
    polygons_json,
    same_polygons,
)

TRIANGLE = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]])


def checked(*polygons: Polygon) -> tuple[Polygon, ...]:
    return checked_polygons(polygons, width=640, height=480)


def test_corners_are_rounded_to_thousandths_of_a_pixel():
    (polygon,) = checked(Polygon(TRIANGLE + 1 / 3, (TRIANGLE / 7 - 1e-4,)))
    assert polygon.outer.tolist() == [[0.333, 0.333], [10.333, 0.333], [10.333, 10.333]]
    assert polygon.holes[0].tolist() == [[0.0, 0.0], [1.428, 0.0], [1.428, 1.428]]
    assert "-0.0" not in json.dumps(polygons_json([polygon]))
    assert same_polygons(checked(polygon), [polygon])


points = st.tuples(st.floats(-640, 1280), st.floats(-480, 960))
rings = st.lists(points, min_size=3, max_size=6).map(np.array)
outlines = st.lists(st.builds(Polygon, rings, st.lists(rings, max_size=2).map(tuple)), max_size=3).map(
    lambda more: (Polygon(TRIANGLE), *more)
)


@given(outlines)
def test_what_was_checked_stays_as_it_is_and_comes_back_from_json(polygons: tuple[Polygon, ...]):
    kept = checked(*polygons)
    assert same_polygons(checked(*kept), kept)
    assert same_polygons(polygons_from_json(json.loads(json.dumps(polygons_json(kept)))), kept)
    for ring, given_ring in zip(
        (r for p in kept for r in p.rings), (r for p in polygons for r in p.rings), strict=True
    ):
        assert np.abs(ring - given_ring).max() <= 0.0005 + 1e-9
        # So few digits that the log stays small.
        assert all(len(repr(x).partition(".")[2]) <= 3 for x in ring.ravel().tolist())


def test_they_may_leave_the_image_by_its_own_size_and_no_further():
    edge = np.array([[-640.0, -480.0], [1280.0, -480.0], [1280.0, 960.0]])
    assert same_polygons(checked(Polygon(edge)), [Polygon(edge)])
    for beyond in (edge - np.array([0.01, 0]), edge + np.array([0, 0.01])):
        with pytest.raises(BadInput, match=r"from -640 to 1280 in x and from -480 to 960 in y.*\(.*\) is not"):
            checked(Polygon(edge), Polygon(TRIANGLE, (beyond,)))


def test_there_are_limits_that_the_error_names():
    with pytest.raises(BadInput, match="at least one polygon"):
        checked()
    most = Polygon(np.tile(TRIANGLE, (MOST_CORNERS // 3 + 1, 1))[:MOST_CORNERS])
    assert corners_of(checked(most)) == MOST_CORNERS
    with pytest.raises(BadInput, match="at most 100 rings and 20000 corners in all, not 2 and 20003"):
        checked(most, Polygon(TRIANGLE))
    rings = (TRIANGLE,) * (MOST_RINGS - 1)
    assert len(checked(Polygon(TRIANGLE, rings))[0].holes) == MOST_RINGS - 1
    with pytest.raises(BadInput, match="not 101 and 303"):
        checked(Polygon(TRIANGLE, rings), Polygon(TRIANGLE))


@pytest.mark.parametrize(
    "ring",
    [
        np.zeros((3, 2)) + 5,
        np.array([[0.0, 0.0], [100.0, 100.0], [50.0, 50.0], [7.0, 7.0]]),
        np.array([[0.0, 0.0], [0.0002, 0.0], [0.0, 0.0003]]),  # nothing is left of it
    ],
)
def test_what_encloses_nothing_is_refused(ring: np.ndarray):
    with pytest.raises(BadInput, match="must enclose something"):
        checked(Polygon(ring))
    assert len(checked(Polygon(TRIANGLE), Polygon(ring))) == 2


def test_outlines_differ_by_any_corner_ring_or_order():
    a, b = Polygon(TRIANGLE), Polygon(TRIANGLE, (TRIANGLE / 2,))
    assert same_polygons([a, b], [Polygon(TRIANGLE.copy()), b])
    for other in ([b, a], [a], [a, b, a], [a, Polygon(TRIANGLE, (TRIANGLE / 3,))], [a, Polygon(TRIANGLE[::-1])]):
        assert not same_polygons([a, b], other)


@pytest.mark.parametrize(
    "damaged",
    [
        [],
        None,
        7,
        [{}],
        [{"outer": [[0, 0], [1, 0]], "holes": []}],
        [{"outer": [[0, 0], [1, 0], [1, "a"]], "holes": []}],
        [{"outer": [[0, 0], [1, 0], [1, 1e7]], "holes": []}],
        [{"outer": [[0, 0], [1, 0], [1, 1]], "holes": None}],
    ],
)
def test_json_of_no_outline_is_refused(damaged: object):
    with pytest.raises((BadInput, ValueError, TypeError, KeyError)):
        polygons_from_json(damaged)
