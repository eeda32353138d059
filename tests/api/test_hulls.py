"""Boxes of outlines and their hulls, over HTTP: what two masks or more of a ball give, and what cannot be."""

import math
from typing import Any

import httpx
import numpy as np
import pytest

BALL = 4 / 3 * math.pi * 0.04**3

USUAL = {"orientation": "world", "position": "box", "widen_px": 0, "ground": None, "fitted": False}


@pytest.fixture
def wanted(ring_scene):
    """The body that asks for the ball's box from some frames; what is said of a frame changes the ball there."""

    def body(*frames: int, but: dict[int, dict[str, Any]] | None = None, **more: Any) -> dict[str, Any]:
        views = [
            {"frame": frame, "polygons": ring_scene.polygons(frame, **(but or {}).get(frame, {}))} for frame in frames
        ]
        return {"class_id": 0, "views": views, **more}

    return body


def square(x: float, y: float, half: float) -> list[dict[str, Any]]:
    return [{"outer": [[x - half, y - half], [x + half, y - half], [x + half, y + half], [x - half, y + half]]}]


def revision(client: httpx.Client, session: str) -> int:
    return client.get(session).json()["revision"]


def test_outlines_give_the_box_its_hull_and_masks_in_one_edit(client: httpx.Client, ring: str, wanted) -> None:
    answer = client.post(f"{ring}/boxes/from-masks", json=wanted(0, 3, 7, name="the ball"))
    assert answer.status_code == 201, answer.text
    box = answer.json()
    assert answer.headers["location"] == f"{ring}/boxes/{box['id']}"
    assert answer.headers["etag"] == f'"{box["revision"]}"'
    assert (box["name"], box["class_id"], box["has_hull"], box["revision"]) == ("the ball", 0, True, 1)
    assert box["hull_options"] == USUAL
    hull = box["hull"]
    assert hull["position"] == "box"
    assert BALL < hull["volume"] < 1.5 * BALL
    assert np.linalg.norm(np.array(hull["centre_of_mass"]) - [0, 0, 0.05]) < 0.01
    points = np.array(hull["vertices"])
    assert np.array(hull["faces"]).max() == len(points) - 1
    low, high = points.min(axis=0), points.max(axis=0)
    assert high - low == pytest.approx(box["size"], abs=1e-6)
    assert (low + high) / 2 == pytest.approx(box["T_world_box"]["position"], abs=1e-6)
    masks = client.get(f"{ring}/masks").json()
    assert [(m["frame"], m["box_id"], m["class_id"], m["origin"], m["accepted"]) for m in masks] == [
        (frame, box["id"], 0, "drawn", True) for frame in (0, 3, 7)
    ]
    assert client.post(f"{ring}/undo").status_code == 200
    assert client.get(f"{ring}/boxes").json() == client.get(f"{ring}/masks").json() == []
    assert client.post(f"{ring}/redo").status_code == 200
    again = client.get(f"{ring}/boxes/{box['id']}/hull").json()
    assert {**again, "position": "box"} == hull
    assert len(client.get(f"{ring}/masks").json()) == 3


def test_pixels_and_polygons_give_the_same_box_within_a_pixel(
    client: httpx.Client, ring: str, ring_scene, wanted
) -> None:
    drawn = client.post(f"{ring}/boxes/from-masks", json=wanted(0, 3, 7)).json()
    views = [{"frame": frame, "mask_png": ring_scene.png(frame)} for frame in (0, 3, 7)]
    pixels = client.post(f"{ring}/boxes/from-masks", json={"class_id": 0, "views": views}).json()
    pixel = 0.5 / ring_scene.CAMERA.fx
    assert pixels["size"] == pytest.approx(drawn["size"], abs=2 * pixel)
    assert pixels["T_world_box"]["position"] == pytest.approx(drawn["T_world_box"]["position"], abs=pixel)


def test_orientation_position_widening_and_ground_are_heeded(client: httpx.Client, ring: str, wanted) -> None:
    def made(**options: Any) -> dict[str, Any]:
        answer = client.post(f"{ring}/boxes/from-masks", json=wanted(0, 3, 7, **options))
        assert answer.status_code == 201, answer.text
        return answer.json()

    plain = made()
    wide = made(widen_px=4)
    assert wide["hull"]["volume"] > 1.1 * plain["hull"]["volume"]
    cut = made(ground=0.03)
    z = cut["T_world_box"]["position"][2] - cut["size"][2] / 2
    assert z == pytest.approx(0.03, abs=1e-6)
    heavy = made(position="mass")
    assert heavy["hull"]["position"] == "mass"
    assert heavy["T_world_box"]["position"] == pytest.approx(heavy["hull"]["centre_of_mass"], abs=1e-6)
    upright = made(orientation="upright")
    assert upright["T_world_box"]["wxyz"][1:3] == pytest.approx([0, 0])
    assert np.prod(upright["size"]) <= np.prod(plain["size"]) * (1 + 1e-6)
    assert np.prod(made(orientation="free")["size"]) <= np.prod(upright["size"]) * (1 + 1e-6)


def test_outlines_that_do_not_meet_are_named_with_their_pixels(client: httpx.Client, ring: str, wanted) -> None:
    body = wanted(0, 3, but={3: {"centre": (0.1, 0.0, 0.0)}})
    answer = client.post(f"{ring}/boxes/from-masks", json=body)
    assert (answer.status_code, answer.json()["type"]) == (422, "urn:ars-web:problem:views-disagree")
    views = answer.json()["views"]
    assert {view["frame"] for view in views} == {0, 3}
    assert all(10 < view["misfit_px"] < 40 for view in views)
    assert views[0]["misfit_px"] >= views[1]["misfit_px"]
    assert "frame 0" in answer.json()["detail"]
    assert revision(client, ring) == 0


def test_a_view_that_empties_the_hull_is_named_alone(client: httpx.Client, ring: str, wanted) -> None:
    body = wanted(0, 3, 6, 8, but={6: {"centre": (0.0, 0.12, 0.05)}})
    answer = client.post(f"{ring}/boxes/from-masks", json=body)
    assert answer.json()["type"] == "urn:ars-web:problem:views-disagree"
    ((view),) = answer.json()["views"]
    assert view["frame"] == 6
    assert view["misfit_px"] > 5
    assert revision(client, ring) == 0


def test_views_from_one_side_only_are_refused_without_a_misfit(client: httpx.Client, sid: str) -> None:
    views = [{"frame": frame, "polygons": square(80 - 1.5 * frame, 60, 10)} for frame in (0, 5)]
    answer = client.post(f"/api/sessions/{sid}/boxes/from-masks", json={"class_id": 0, "views": views})
    assert answer.json()["type"] == "urn:ars-web:problem:views-disagree"
    assert answer.json()["views"] == [{"frame": 0, "misfit_px": None}, {"frame": 5, "misfit_px": None}]
    assert "2.9 degrees apart" in answer.json()["detail"]
    assert revision(client, f"/api/sessions/{sid}") == 0


def test_an_object_behind_a_camera_is_refused_without_a_misfit(client: httpx.Client, sid: str) -> None:
    # The rays of cameras side by side move apart before them, and meet behind.
    views = [{"frame": frame, "polygons": square(x, 60, 5)} for frame, x in ((0, 60), (5, 100))]
    answer = client.post(f"/api/sessions/{sid}/boxes/from-masks", json={"class_id": 0, "views": views})
    assert answer.json()["type"] == "urn:ars-web:problem:views-disagree"
    assert None in {view["misfit_px"] for view in answer.json()["views"]}
    assert "behind its camera" in answer.json()["detail"]
    assert revision(client, f"/api/sessions/{sid}") == 0


@pytest.mark.parametrize(
    ("views", "words"),
    [
        ([{"frame": 0, "polygons": square(160, 120, 40)}], "at least 2 items"),
        ([{"frame": 0, "polygons": square(160, 120, 40)}] * 2, "frame 0 is given twice"),
        ([{"frame": i, "polygons": square(160, 120, 40)} for i in (0, 12)], "no frame 12"),
        ([{"frame": i, "polygons": square(-90 * i, 120, 40)} for i in (0, 3)], "frame 3"),
        ([{"frame": i, "polygons": square(160, 120, 4e-4)} for i in (0, 3)], "frame 0: an outline must enclose"),
        ([{"frame": i, "polygons": square(2000, 120, 40)} for i in (0, 3)], "frame 0: an outline's corners must be"),
        ([{"frame": i, "polygons": []} for i in (0, 3)], "at least 1 item"),
        ([{"frame": i} for i in (0, 3)], "give polygons or mask_png"),
        ([{"frame": i, "polygons": square(160, 120, 40), "mask_png": "AAAA"} for i in (0, 3)], "not both"),
        ([{"frame": i, "mask_png": "AAAA"} for i in (0, 3)], "frame 0: the mask is not a PNG image"),
        ([{"frame": i, "mask_png": "*"} for i in (0, 3)], "frame 0: the mask's PNG is not base64"),
        ([{"frame": i, "polygons": square(160, 120, 40), "color": 1} for i in (0, 3)], "color: unknown field"),
        ([{"frame": i, "polygons": [{"outer": [[0, 0], [9, 9]]}]} for i in (0, 3)], "at least 3 items"),
        ([{"frame": i, "polygons": [{"outer": [[0, 0], [9, "9"], [5, 5]]}]} for i in (0, 3)], "outer.1.1"),
    ],
)  # fmt: skip
def test_views_that_cannot_be_used_are_refused(client: httpx.Client, ring: str, views: Any, words: str) -> None:
    answer = client.post(f"{ring}/boxes/from-masks", json={"class_id": 0, "views": views})
    assert answer.status_code == 422
    assert words in answer.json()["detail"]
    assert revision(client, ring) == 0


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"class_id": 9}, "no class 9"),
        ({"orientation": "sideways"}, "orientation"),
        ({"position": "corner"}, "position"),
        ({"widen_px": -1}, "widen_px"),
        ({"ground": 1e9}, "ground"),
        ({"ground": 0.3}, "nothing that the outlines leave possible is above the support plane"),
        ({"name": ""}, "name"),
        ({"colour": "red"}, "unknown field"),
    ],
)
def test_options_that_cannot_be_are_refused(client: httpx.Client, ring: str, wanted, more: Any, words: str) -> None:
    answer = client.post(f"{ring}/boxes/from-masks", json=wanted(0, 3, **more))
    assert answer.status_code == 422
    assert words in answer.json()["detail"]
    assert revision(client, ring) == 0


def test_a_tangle_is_refused_at_once(client: httpx.Client, ring: str, wanted) -> None:
    body = wanted(0, 3)
    tangle = np.random.default_rng(0).uniform(0, 200, (2000, 2)).tolist()
    body["views"][1]["polygons"] = [{"outer": tangle}]
    answer = client.post(f"{ring}/boxes/from-masks", json=body)
    assert answer.status_code == 422
    assert "crosses itself" in answer.json()["detail"]


def test_a_repeat_of_the_key_answers_the_same_box(client: httpx.Client, ring: str, wanted) -> None:
    key = {"Idempotency-Key": "a-ball"}
    first = client.post(f"{ring}/boxes/from-masks", json=wanted(0, 3), headers=key)
    again = client.post(f"{ring}/boxes/from-masks", json=wanted(0, 3), headers=key)
    assert (first.status_code, again.status_code) == (201, 201)
    assert again.json() == first.json()
    assert revision(client, ring) == 1
    other = client.post(f"{ring}/boxes/from-masks", json=wanted(0, 4), headers=key)
    assert other.status_code == 422
    assert revision(client, ring) == 1


def test_drawn_masks_become_a_box_of_the_id_that_they_keep(client: httpx.Client, ring: str, ring_scene) -> None:
    one = client.post(f"{ring}/masks", json={"class_id": 0, "frame": 0, "polygons": ring_scene.polygons(0)}).json()
    id_ = one["box_id"]
    lonely = client.put(f"{ring}/boxes/{id_}/hull", json={})
    assert lonely.status_code == 422
    assert "two frames" in lonely.json()["detail"]
    more = {"box_id": id_, "class_id": 0}
    for frame in (3, 7):
        draft = {**more, "frame": frame, "polygons": ring_scene.polygons(frame), "accepted": frame == 3}
        assert client.post(f"{ring}/masks", json=draft).status_code == 201
    made = client.put(f"{ring}/boxes/{id_}/hull", json={"orientation": "upright", "name": "drawn"})
    assert made.status_code == 200, made.text
    box = made.json()
    assert (box["id"], box["name"], box["hull_options"]["orientation"]) == (id_, "drawn", "upright")
    # The one that waits for a yes does not count.
    two = client.post(f"{ring}/boxes/from-masks", json={"class_id": 0, "orientation": "upright", "views": [
        {"frame": frame, "polygons": ring_scene.polygons(frame)} for frame in (0, 3)
    ]}).json()  # fmt: skip
    assert box["size"] == pytest.approx(two["size"], rel=1e-9)


def test_a_box_is_made_again_by_what_is_given(client: httpx.Client, ring: str, wanted) -> None:
    box = client.post(f"{ring}/boxes/from-masks", json=wanted(0, 3, 7, widen_px=2, ground=0.02)).json()
    hull = f"{ring}/boxes/{box['id']}/hull"
    assert client.put(hull, json={}).status_code == 428
    stale = client.put(hull, json={}, headers={"If-Match": '"0"'})
    assert (stale.status_code, stale.json()["current"]["id"]) == (412, box["id"])
    tag = {"If-Match": f'"{box["revision"]}"'}
    upright = client.put(hull, json={"orientation": "upright", "class_id": 1}, headers=tag).json()
    assert upright["hull_options"] == {**USUAL, "orientation": "upright", "widen_px": 2, "ground": 0.02}
    assert {mask["class_id"] for mask in client.get(f"{ring}/masks").json()} == {1}
    tag = {"If-Match": f'"{upright["revision"]}"'}
    free = client.put(hull, json={"ground": None, "widen_px": 0}, headers=tag).json()
    assert free["hull_options"] == {**USUAL, "orientation": "upright"}
    assert client.put(hull, json={"orient": "free"}, headers=tag).status_code == 422


def test_a_hull_goes_where_its_box_goes(client: httpx.Client, ring: str, wanted) -> None:
    box = client.post(f"{ring}/boxes/from-masks", json=wanted(0, 3)).json()
    address = f"{ring}/boxes/{box['id']}"
    place = {**box["T_world_box"], "position": [v + 0.5 for v in box["T_world_box"]["position"]]}
    moved = client.patch(address, json={"T_world_box": place}, headers={"If-Match": f'"{box["revision"]}"'}).json()
    answer = client.get(f"{address}/hull")
    assert answer.headers["etag"] == f'"{moved["revision"]}"'
    assert answer.json()["volume"] == pytest.approx(box["hull"]["volume"], rel=1e-6)
    assert np.array(answer.json()["vertices"]) - 0.5 == pytest.approx(np.array(box["hull"]["vertices"]), abs=1e-6)


def test_what_has_no_hull_answers_404(client: httpx.Client, ring: str, box_json) -> None:
    plain = client.post(f"{ring}/boxes", json=box_json).json()
    assert "no hull" in client.get(f"{ring}/boxes/{plain['id']}/hull").json()["detail"]
    assert client.get(f"{ring}/boxes/{plain['id']}/hull").status_code == 404
    assert client.get(f"{ring}/boxes/77/hull").status_code == 404
    assert client.put(f"{ring}/boxes/77/hull", json={}).status_code == 404
    unmasked = client.put(f"{ring}/boxes/{plain['id']}/hull", json={}, headers={"If-Match": f'"{plain["revision"]}"'})
    assert unmasked.status_code == 422
    assert "needs two" in unmasked.json()["detail"]


def test_a_locked_box_is_not_made_again(client: httpx.Client, ring: str, wanted) -> None:
    box = client.post(f"{ring}/boxes/from-masks", json=wanted(0, 3)).json()
    address = f"{ring}/boxes/{box['id']}"
    locked = client.patch(address, json={"locked": True}, headers={"If-Match": f'"{box["revision"]}"'}).json()
    answer = client.put(f"{address}/hull", json={"widen_px": 1}, headers={"If-Match": f'"{locked["revision"]}"'})
    assert (answer.status_code, answer.json()["type"]) == (409, "urn:ars-web:problem:locked")
    body = wanted(0, 3, box_id=box["id"])
    there = client.post(f"{ring}/boxes/from-masks", json=body)
    assert there.status_code == 409
    assert revision(client, ring) == 2


def test_outlines_take_the_place_of_what_was_drawn_of_the_object(
    client: httpx.Client, ring: str, wanted, ring_scene
) -> None:
    draft = {"class_id": 1, "frame": 5, "polygons": ring_scene.polygons(5)}
    id_ = client.post(f"{ring}/masks", json=draft).json()["box_id"]
    box = client.post(f"{ring}/boxes/from-masks", json=wanted(0, 3, box_id=id_)).json()
    assert box["id"] == id_
    assert [(m["frame"], m["class_id"]) for m in client.get(f"{ring}/masks").json()] == [(0, 0), (3, 0)]
    assert client.post(f"{ring}/boxes/from-masks", json=wanted(0, 3, box_id=99)).status_code == 404
