"""Masks over HTTP, and how boxes and hulls that are made of them follow."""

import threading
from typing import Any

import httpx
import pytest


@pytest.fixture
def made(client: httpx.Client, ring: str, ring_scene) -> dict[str, Any]:
    """The ball's box from frames 0, 3 and 7."""
    views = [{"frame": frame, "polygons": ring_scene.polygons(frame)} for frame in (0, 3, 7)]
    answer = client.post(f"{ring}/boxes/from-masks", json={"class_id": 0, "views": views})
    assert answer.status_code == 201, answer.text
    return answer.json()


def mask_in(client: httpx.Client, ring: str, frame: int) -> dict[str, Any]:
    return next(mask for mask in client.get(f"{ring}/masks").json() if mask["frame"] == frame)


def tag(thing: dict[str, Any]) -> dict[str, str]:
    return {"If-Match": f'"{thing["revision"]}"'}


def revision(client: httpx.Client, session: str) -> int:
    return client.get(session).json()["revision"]


def test_a_mask_is_kept_as_drawn_and_listed(client: httpx.Client, ring: str) -> None:
    ring_json = {"outer": [[10.1234, 20], [50, 20], [30, 60.5]], "holes": [[[25, 25], [35, 25], [30, 35]]]}
    draft = {"class_id": 1, "frame": 4, "polygons": [ring_json], "origin": "smart"}
    answer = client.post(f"{ring}/masks", json=draft)
    assert answer.status_code == 201, answer.text
    mask = answer.json()
    assert answer.headers["location"] == f"{ring}/masks/{mask['id']}"
    kept = {"outer": [[10.123, 20], [50, 20], [30, 60.5]], "holes": ring_json["holes"]}
    assert mask == {
        "id": 1, "box_id": 1, "class_id": 1, "frame": 4, "polygons": [kept], "origin": "smart", "accepted": True,
        "points": 6, "revision": 1,
    }  # fmt: skip
    listed = client.get(f"{ring}/masks")
    assert listed.json() == [mask]
    assert listed.headers["etag"] == '"1"'
    one = client.get(f"{ring}/masks/1")
    assert (one.json(), one.headers["etag"]) == (mask, '"1"')


def test_a_new_object_reserves_its_boxs_id(client: httpx.Client, ring: str, ring_scene, box_json) -> None:
    draft = {"class_id": 0, "frame": 0, "polygons": ring_scene.polygons(0)}
    first, second = (client.post(f"{ring}/masks", json=draft).json()["box_id"] for _ in range(2))
    box = client.post(f"{ring}/boxes", json=box_json).json()
    assert len({first, second, box["id"]}) == 3
    same = client.post(f"{ring}/masks", json={**draft, "box_id": first})
    assert same.status_code == 409
    assert same.json()["current"]["frame"] == 0
    more = client.post(f"{ring}/masks", json={**draft, "box_id": first, "frame": 3})
    assert more.json()["box_id"] == first


def test_a_png_mask_is_traced(client: httpx.Client, ring: str, ring_scene) -> None:
    mask = client.post(f"{ring}/masks", json={"class_id": 0, "frame": 2, "mask_png": ring_scene.png(2)}).json()
    ((polygon),) = mask["polygons"]
    xs, ys = zip(*polygon["outer"], strict=True)
    outline = ring_scene.outline(2)
    assert (min(xs), max(xs)) == pytest.approx((outline[:, 0].min(), outline[:, 0].max()), abs=1)
    assert (min(ys), max(ys)) == pytest.approx((outline[:, 1].min(), outline[:, 1].max()), abs=1)


def test_a_repeat_of_the_key_answers_the_same_mask(client: httpx.Client, ring: str, made, ring_scene) -> None:
    for box_id in (None, made["id"]):
        draft = {"class_id": 0, "frame": 5, "box_id": box_id, "polygons": ring_scene.polygons(5)}
        key = {"Idempotency-Key": f"mask of {box_id}"}
        first, again = (client.post(f"{ring}/masks", json=draft, headers=key) for _ in range(2))
        assert (first.status_code, again.status_code) == (201, 201)
        assert again.json() == first.json()
    assert revision(client, ring) == 3


def test_a_changed_mask_takes_hull_and_box_with_it_in_one_step(
    client: httpx.Client, ring: str, made, ring_scene
) -> None:
    mask = mask_in(client, ring, 3)
    smaller = ring_scene.polygons(3, radius=0.03)
    answer = client.put(f"{ring}/masks/{mask['id']}", json={"polygons": smaller}, headers=tag(mask))
    assert answer.status_code == 200, answer.text
    assert answer.json()["polygons"] == smaller
    assert answer.headers["etag"] == '"2"'
    box = client.get(f"{ring}/boxes/{made['id']}").json()
    assert box["revision"] == 2
    hull = client.get(f"{ring}/boxes/{made['id']}/hull").json()
    assert hull["volume"] < 0.9 * made["hull"]["volume"]
    assert box["size"] != made["size"]
    assert client.post(f"{ring}/undo").json()["summary"].startswith("Undo: Change outline of ball in frame 3")
    assert mask_in(client, ring, 3)["polygons"] == mask["polygons"]
    before = client.get(f"{ring}/boxes/{made['id']}").json()
    assert {**before, "revision": 1} == {key: made[key] for key in before}
    assert client.get(f"{ring}/boxes/{made['id']}/hull").json()["volume"] == made["hull"]["volume"]
    assert client.post(f"{ring}/redo").status_code == 200
    assert client.get(f"{ring}/boxes/{made['id']}/hull").json() == hull


def test_a_mask_that_disagrees_changes_nothing(client: httpx.Client, ring: str, made, ring_scene) -> None:
    wrong = ring_scene.polygons(3, centre=(0.1, 0.0, 0.0))
    mask = mask_in(client, ring, 3)
    refused = [
        client.put(f"{ring}/masks/{mask['id']}", json={"polygons": wrong}, headers=tag(mask)),
        client.post(f"{ring}/masks", json={
            "box_id": made["id"], "class_id": 0, "frame": 9, "polygons": ring_scene.polygons(9, centre=(0.1, 0.0, 0.0)),
        }),
    ]  # fmt: skip
    for answer in refused:
        assert (answer.status_code, answer.json()["type"]) == (422, "urn:ars-web:problem:views-disagree")
        assert answer.json()["views"][0]["misfit_px"] > 0
    assert revision(client, ring) == 1
    assert mask_in(client, ring, 3) == mask


def test_a_mask_more_or_less_takes_the_hull_with_it(client: httpx.Client, ring: str, made, ring_scene) -> None:
    hull = f"{ring}/boxes/{made['id']}/hull"
    draft = {"box_id": made["id"], "class_id": 0, "frame": 10, "polygons": ring_scene.polygons(10)}
    added = client.post(f"{ring}/masks", json=draft).json()
    less = client.get(hull).json()["volume"]
    assert less < made["hull"]["volume"]
    assert client.delete(f"{ring}/masks/{added['id']}", headers=tag(added)).status_code == 204
    assert client.get(hull).json()["volume"] == pytest.approx(made["hull"]["volume"], rel=1e-6)
    assert client.get(f"{ring}/masks/{added['id']}").status_code == 404


def test_a_proposed_mask_counts_once_it_is_accepted(client: httpx.Client, ring: str, made, ring_scene) -> None:
    address = f"{ring}/boxes/{made['id']}"
    # It would empty the hull if it counted.
    wrong = ring_scene.polygons(9, centre=(0.1, 0.0, 0.0))
    draft = {"box_id": made["id"], "class_id": 0, "frame": 9, "origin": "proposed", "accepted": False}
    mask = client.post(f"{ring}/masks", json={**draft, "polygons": wrong}).json()
    assert (mask["accepted"], mask["origin"]) == (False, "proposed")
    assert client.get(address).json()["revision"] == 1
    yes = client.put(f"{ring}/masks/{mask['id']}", json={"accepted": True}, headers=tag(mask))
    assert yes.json()["type"] == "urn:ars-web:problem:views-disagree"
    mended = client.put(
        f"{ring}/masks/{mask['id']}",
        json={"accepted": True, "origin": "drawn", "polygons": ring_scene.polygons(9)},
        headers=tag(mask),
    )
    assert (mended.json()["accepted"], mended.json()["origin"]) == (True, "drawn")
    narrowed = client.get(f"{address}/hull").json()["volume"]
    assert narrowed < made["hull"]["volume"]
    aside = client.put(f"{ring}/masks/{mask['id']}", json={"accepted": False}, headers=tag(mended.json()))
    assert aside.status_code == 200
    assert client.get(f"{address}/hull").json()["volume"] == pytest.approx(made["hull"]["volume"], rel=1e-6)


def test_a_box_keeps_two_masks_that_count(client: httpx.Client, ring: str, ring_scene) -> None:
    views = [{"frame": frame, "polygons": ring_scene.polygons(frame)} for frame in (0, 3)]
    client.post(f"{ring}/boxes/from-masks", json={"class_id": 0, "views": views})
    mask = mask_in(client, ring, 0)
    for answer in (
        client.delete(f"{ring}/masks/{mask['id']}", headers=tag(mask)),
        client.put(f"{ring}/masks/{mask['id']}", json={"accepted": False}, headers=tag(mask)),
    ):
        assert answer.status_code == 422
        assert "needs two that count" in answer.json()["detail"]
    assert revision(client, ring) == 1


def test_stale_changes_are_refused_with_the_mask_as_it_is(client: httpx.Client, ring: str, made, ring_scene) -> None:
    mask = mask_in(client, ring, 3)
    address = f"{ring}/masks/{mask['id']}"
    body = {"polygons": ring_scene.polygons(3, radius=0.035)}
    assert client.put(address, json=body).status_code == 428
    assert client.delete(address).status_code == 428
    newer = client.put(address, json=body, headers=tag(mask)).json()
    for answer in (client.put(address, json=body, headers=tag(mask)), client.delete(address, headers=tag(mask))):
        assert (answer.status_code, answer.json()["current"]) == (412, newer)
    assert client.put(f"{ring}/masks/99", json={"accepted": True}, headers=tag(mask)).status_code == 404
    assert client.delete(f"{ring}/masks/99", headers=tag(mask)).status_code == 404
    assert client.get(f"{ring}/masks/99").status_code == 404


def test_two_people_change_two_masks_of_one_object_and_both_count(
    client: httpx.Client, server, ring: str, made, ring_scene
) -> None:
    masks = [mask_in(client, ring, frame) for frame in (0, 3, 7)]
    begin = threading.Barrier(len(masks))
    answers: list[httpx.Response] = []

    def change(mask: dict[str, Any]) -> None:
        with httpx.Client(base_url=server.url, headers=dict(client.headers), timeout=30) as own:
            begin.wait()
            body = {"polygons": ring_scene.polygons(mask["frame"], radius=0.03)}
            answers.append(own.put(f"{ring}/masks/{mask['id']}", json=body, headers=tag(mask)))

    people = [threading.Thread(target=change, args=(mask,)) for mask in masks]
    for person in people:
        person.start()
    for person in people:
        person.join()
    assert [answer.status_code for answer in answers] == [200] * 3
    assert sorted(answer.json()["revision"] for answer in answers) == [2, 3, 4]
    # What the last of them left is what all three give.
    box = client.get(f"{ring}/boxes/{made['id']}").json()
    views = [{"frame": frame, "polygons": ring_scene.polygons(frame, radius=0.03)} for frame in (0, 3, 7)]
    alone = client.post(f"{ring}/boxes/from-masks", json={"class_id": 0, "views": views}).json()
    assert box["size"] == pytest.approx(alone["size"], rel=1e-9)


def test_a_locked_box_keeps_its_masks(client: httpx.Client, ring: str, made, ring_scene) -> None:
    client.patch(f"{ring}/boxes/{made['id']}", json={"locked": True}, headers=tag(made))
    mask = mask_in(client, ring, 3)
    # Whether they would fit one object is not even asked.
    wrong = ring_scene.polygons(3, centre=(0.1, 0.0, 0.0))
    draft = {"box_id": made["id"], "class_id": 0, "frame": 5, "polygons": ring_scene.polygons(5)}
    for answer in (
        client.put(f"{ring}/masks/{mask['id']}", json={"polygons": wrong}, headers=tag(mask)),
        client.delete(f"{ring}/masks/{mask['id']}", headers=tag(mask)),
        client.post(f"{ring}/masks", json=draft),
        client.post(f"{ring}/masks", json={**draft, "accepted": False}),
    ):
        assert (answer.status_code, answer.json()["type"]) == (409, "urn:ars-web:problem:locked")
    assert revision(client, ring) == 2


def test_masks_of_a_box_that_was_placed_by_hand_leave_it(client: httpx.Client, ring: str, box_json, ring_scene) -> None:
    box = client.post(f"{ring}/boxes", json=box_json).json()
    for frame in (0, 3):
        draft = {"box_id": box["id"], "class_id": 0, "frame": frame, "polygons": ring_scene.polygons(frame)}
        assert client.post(f"{ring}/masks", json=draft).status_code == 201
    assert client.get(f"{ring}/boxes/{box['id']}").json() == box
    made = client.put(f"{ring}/boxes/{box['id']}/hull", json={}, headers=tag(box)).json()
    assert made["has_hull"]
    assert made["name"] == box["name"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"class_id": 9}, "no class 9"),
        ({"class_id": None}, "class_id"),
        ({"frame": 12}, "no frame 12"),
        ({"frame": True}, "frame"),
        ({"polygons": None}, "give polygons or mask_png"),
        ({"mask_png": "AAAA"}, "not both"),
        ({"polygons": [{"outer": [[0, 0], [1e7, 0], [5, 5]]}]}, "outer.1.0"),
        ({"polygons": [{"outer": [[0, 0], [5, 5], [9, 9]]}]}, "enclose something"),
        ({"polygons": [{"outer": [[0, 0], [5, 0], [9, 9]]}] * 101}, "at most 100"),
        ({"origin": "guessed"}, "origin"),
        ({"accepted": 1}, "accepted"),
        ({"points": 3}, "unknown field"),
    ],
)
def test_masks_that_cannot_be_are_refused(client: httpx.Client, ring: str, change: Any, words: str) -> None:
    draft = {"class_id": 0, "frame": 0, "polygons": [{"outer": [[0, 0], [50, 0], [25, 50]]}], **change}
    answer = client.post(f"{ring}/masks", json=draft)
    assert answer.status_code == 422
    assert words in answer.json()["detail"]
    assert revision(client, ring) == 0


def test_a_mask_is_of_its_boxs_class(client: httpx.Client, ring: str, made, ring_scene) -> None:
    draft = {"box_id": made["id"], "class_id": 1, "frame": 5, "polygons": ring_scene.polygons(5)}
    answer = client.post(f"{ring}/masks", json=draft)
    assert answer.status_code == 422
    assert "of class 0" in answer.json()["detail"]
    assert client.post(f"{ring}/masks", json={**draft, "box_id": 77}).status_code == 404
