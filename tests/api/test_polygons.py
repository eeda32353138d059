"""What brushes, erasers, lassos and holes make of an outline, over HTTP."""

from typing import Any

import httpx
import pytest
import shapely

SQUARE = {"outer": [[50, 50], [150, 50], [150, 150], [50, 150]], "holes": []}


@pytest.fixture
def combine(client: httpx.Client, ring: str):
    """The region that a change of outlines gives."""

    def ask(polygons: list[Any], operation: str, **shape: Any) -> shapely.Geometry:
        body = {"polygons": polygons, "operation": operation, "frame": 0, **shape}
        answer = client.post(f"{ring}/polygons/combine", json=body)
        assert answer.status_code == 200, answer.text
        found = answer.json()["polygons"]
        region = shapely.MultiPolygon([(one["outer"], one["holes"]) for one in found])
        assert region.is_valid
        return region

    return ask


def test_a_lasso_begins_an_outline(combine) -> None:
    assert combine([], "add", polygon=SQUARE).equals(shapely.box(50, 50, 150, 150))


def test_a_brush_adds_a_capsule_and_an_eraser_takes_it_off(combine) -> None:
    stroke = {"points": [[100, 100], [200, 100]], "width": 20}
    capsule = shapely.LineString(stroke["points"]).buffer(10)
    square = shapely.box(50, 50, 150, 150)
    more, less = (combine([SQUARE], operation, stroke=stroke) for operation in ("add", "subtract"))
    assert more.symmetric_difference(square.union(capsule)).area < 5
    assert less.symmetric_difference(square.difference(capsule)).area < 5
    assert combine([], "add", stroke={"points": [[30, 30]], "width": 10}).area == pytest.approx(78.5, rel=0.02)


def test_a_hole_is_kept_and_can_be_filled(combine) -> None:
    hole = {"outer": [[80, 80], [120, 80], [120, 120], [80, 120]]}
    holed = combine([SQUARE], "subtract", polygon=hole)
    assert holed.area == 100 * 100 - 40 * 40
    ((outer, (ring,)),) = [(p.exterior.coords[:-1], [r.coords[:-1] for r in p.interiors]) for p in holed.geoms]
    assert combine([{"outer": outer, "holes": [ring]}], "add", polygon=hole).area == 100 * 100


def test_an_eraser_leaves_pieces_or_nothing(combine) -> None:
    stroke = {"points": [[100, 40], [100, 160]], "width": 10}
    assert len(combine([SQUARE], "subtract", stroke=stroke).geoms) == 2
    assert combine([SQUARE], "subtract", polygon=SQUARE).is_empty


def test_an_outline_ends_at_the_images_border(combine) -> None:
    beyond = {"outer": [[-100, -100], [100, -100], [100, 100], [-100, 100]]}
    assert combine([], "add", polygon=beyond).equals(shapely.box(0, 0, 100, 100))


def test_what_crosses_itself_counts_by_even_and_odd(combine) -> None:
    bow_tie = {"outer": [[0, 0], [100, 100], [100, 0], [0, 100]]}
    found = combine([], "add", polygon=bow_tie)
    assert (found.area, len(found.geoms)) == (5000, 2)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"operation": "xor"}, "operation"),
        ({"polygon": None}, "either polygon or stroke"),
        ({"stroke": {"points": [[0, 0]], "width": 3}}, "either polygon or stroke"),
        ({"polygon": None, "stroke": {"points": [], "width": 3}}, "at least 1"),
        ({"polygon": None, "stroke": {"points": [[0, 0]], "width": 0}}, "greater than 0"),
        ({"polygon": None, "stroke": {"points": [[0, 0]], "width": 3, "shape": "square"}}, "unknown field"),
        ({"polygon": {"outer": [[0, 0], [1, 1]]}}, "at least 3"),
        ({"frame": 12}, "no frame 12"),
        ({"polygons": None}, "polygons"),
    ],
)
def test_changes_that_cannot_be_are_refused(client: httpx.Client, ring: str, change: Any, words: str) -> None:
    body = {"polygons": [], "operation": "add", "polygon": SQUARE, "frame": 0, **change}
    answer = client.post(f"{ring}/polygons/combine", json=body)
    assert answer.status_code == 422
    assert words in answer.json()["detail"]
