"""What outlines give while they are being drawn, over HTTP."""

from typing import Any

import httpx
import numpy as np
import pytest
import shapely


@pytest.fixture
def preview(client: httpx.Client, ring: str, ring_scene):
    """What outlines of the ball in some frames give; what is said of a frame changes the ball there."""

    def ask(*frames: int, but: dict[int, dict[str, Any]] | None = None, **more: Any) -> dict[str, Any]:
        views = [
            {"frame": frame, "polygons": ring_scene.polygons(frame, **(but or {}).get(frame, {}))} for frame in frames
        ]
        answer = client.post(f"{ring}/hull-preview", json={"views": views, **more})
        assert answer.status_code == 200, answer.text
        return answer.json()

    return ask


def area_of(overlay: dict[str, Any]) -> shapely.Geometry:
    return shapely.union_all([shapely.Polygon(one["outer"], one["holes"]) for one in overlay["polygons"]])


def overlay(found: dict[str, Any], frame: int, kind: str) -> shapely.Geometry:
    (one,) = (one for one in found["overlays"] if (one["frame"], one["kind"]) == (frame, kind))
    return area_of(one)


def test_one_outline_gives_a_band_in_the_other_frames(preview, ring_scene) -> None:
    found = preview(0, show_in=[0, 3, 5])
    assert (found["hull"], found["angle_degrees"], found["problem"], found["warnings"]) == (None, None, None, [])
    assert {(one["frame"], one["kind"]) for one in found["overlays"]} == {(3, "band"), (5, "band")}
    image = shapely.box(0, 0, 320, 240)
    for frame in (3, 5):
        band, ball = overlay(found, frame, "band"), shapely.Polygon(ring_scene.outline(frame))
        assert ball.difference(band).area < 0.02 * ball.area
        # It crosses the whole image, and is about as wide as the ball.
        assert 1.5 * ball.area < band.intersection(image).area < 0.7 * image.area
    assert found["next_view"]["frame"] not in (0, 6)
    assert found["next_view"]["degrees"] > 45


def test_two_outlines_narrow_the_band_and_give_a_hull(preview, ring_scene) -> None:
    one, two = preview(0, show_in=[3, 5]), preview(0, 3, show_in=[0, 3, 5])
    image = shapely.box(0, 0, 320, 240)
    wide, narrow = (overlay(found, 5, "band").intersection(image).area for found in (one, two))
    assert narrow < 0.7 * wide
    # A frame is told what the others say of it, and where the hull of all is.
    assert overlay(two, 3, "band").symmetric_difference(overlay(one, 3, "band")).area < 1
    drawn = shapely.Polygon(ring_scene.outline(3))
    assert overlay(two, 3, "hull").difference(drawn.buffer(1)).area < 1
    assert overlay(two, 5, "hull").difference(overlay(two, 5, "band").buffer(0.5)).area < 1
    assert overlay(two, 5, "hull").contains(shapely.Polygon(ring_scene.outline(5)).buffer(-1))
    assert two["angle_degrees"] == pytest.approx(75.6, abs=1)
    assert np.linalg.norm(np.array(two["hull"]["centre_of_mass"]) - [0, 0, 0.05]) < 0.01
    assert two["hull"]["size"] == two["hull"]["box"]["size"]
    assert two["hull"]["box"]["T_world_box"]["wxyz"] == [1, 0, 0, 0]
    assert two["warnings"] == []
    assert two["next_view"]["frame"] not in (0, 3)
    assert f"frame {two['next_view']['frame']}" in two["next_view"]["reason"]


def test_what_is_previewed_is_what_is_made(client: httpx.Client, ring: str, preview, ring_scene) -> None:
    options = {"widen_px": 2.0, "ground": 0.02, "orientation": "upright"}
    found = preview(0, 3, 8, **options)
    assert found["overlays"] == []
    views = [{"frame": frame, "polygons": ring_scene.polygons(frame)} for frame in (0, 3, 8)]
    made = client.post(f"{ring}/boxes/from-masks", json={"class_id": 0, "views": views, **options}).json()
    assert found["hull"]["size"] == pytest.approx(made["size"], rel=1e-9)
    assert found["hull"]["volume"] == pytest.approx(made["hull"]["volume"], rel=1e-5)


def test_views_less_than_60_degrees_apart_are_warned_of(preview) -> None:
    found = preview(0, 1)
    assert 20 < found["angle_degrees"] < 60
    (warning,) = found["warnings"]
    assert f"{found['angle_degrees']:.0f} degrees apart" in warning


def test_views_that_disagree_are_told_and_still_show_what_each_says(client: httpx.Client, ring: str, preview) -> None:
    found = preview(0, 3, but={3: {"centre": (0.1, 0.0, 0.0)}}, show_in=[0, 3, 5])
    assert found["hull"] is found["angle_degrees"] is found["next_view"] is None
    assert {view["frame"] for view in found["problem"]["views"]} == {0, 3}
    assert all(view["misfit_px"] > 10 for view in found["problem"]["views"])
    assert "do not meet" in found["problem"]["detail"]
    # In frame 5 no place is left; in the two, what the other says.
    assert {(one["frame"], one["kind"]) for one in found["overlays"]} == {(0, "band"), (3, "band")}
    assert client.get(ring).json()["revision"] == 0


def test_views_from_one_side_are_told_without_a_misfit(client: httpx.Client, sid: str) -> None:
    square = [{"outer": [[70, 50], [90, 50], [90, 70], [70, 70]]}]
    body = {"views": [{"frame": frame, "polygons": square} for frame in (0, 1)], "show_in": [3]}
    found = client.post(f"/api/sessions/{sid}/hull-preview", json=body).json()
    assert found["problem"]["views"] == [{"frame": 0, "misfit_px": None}, {"frame": 1, "misfit_px": None}]


def test_a_support_plane_above_the_object_is_a_problem_of_no_view(preview) -> None:
    found = preview(0, 3, ground=0.3, show_in=[5])
    assert found["hull"] is None
    assert found["problem"]["views"] == found["overlays"] == []
    assert "set the plane lower" in found["problem"]["detail"]


def test_an_outline_beside_the_image_is_a_problem_too(client: httpx.Client, ring: str, ring_scene) -> None:
    beside = [{"outer": [[-90, 50], [-60, 50], [-60, 90]]}]
    views = [{"frame": 0, "polygons": ring_scene.polygons(0)}, {"frame": 3, "polygons": beside}]
    found = client.post(f"{ring}/hull-preview", json={"views": views, "show_in": [3]}).json()
    assert "outline in frame 3 lies outside" in found["problem"]["detail"]
    assert [(one["frame"], one["kind"]) for one in found["overlays"]] == [(3, "band")]


def test_many_views_make_a_band_that_holds_the_object(preview, ring_scene) -> None:
    found = preview(*range(12), show_in=[4])
    ball = shapely.Polygon(ring_scene.outline(4))
    assert overlay(found, 4, "band").area < 1.3 * ball.area
    assert ball.difference(overlay(found, 4, "band").buffer(0.5)).area < 1


def test_pixels_are_taken_too(client: httpx.Client, ring: str, ring_scene, preview) -> None:
    views = [{"frame": frame, "mask_png": ring_scene.png(frame)} for frame in (0, 3)]
    found = client.post(f"{ring}/hull-preview", json={"views": views}).json()
    assert found["hull"]["volume"] == pytest.approx(preview(0, 3)["hull"]["volume"], rel=0.05)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"views": []}, "at least 1"),
        ({"show_in": [12]}, "no frame 12"),
        ({"show_in": list(range(17))}, "at most 16"),
        ({"show_in": ["0"]}, "show_in.0"),
        ({"widen_px": -1}, "widen_px"),
        ({"position": "mass"}, "unknown field"),
    ],
)
def test_previews_that_cannot_be_are_refused(
    client: httpx.Client, ring: str, ring_scene, change: Any, words: str
) -> None:
    views = [{"frame": frame, "polygons": ring_scene.polygons(frame)} for frame in (0, 3)]
    answer = client.post(f"{ring}/hull-preview", json={"views": views, **change})
    assert answer.status_code == 422
    assert words in answer.json()["detail"]
