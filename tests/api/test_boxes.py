"""Boxes over HTTP."""

import math
from typing import Any

import httpx
import numpy as np
import pytest


@pytest.fixture
def path(sid: str) -> str:
    return f"/api/sessions/{sid}/boxes"


def test_a_box_is_made_changed_and_deleted(client: httpx.Client, path: str, box_json: dict[str, Any]) -> None:
    assert client.get(path).json() == []
    made = client.post(path, json={**box_json, "name": "left"})
    assert (made.status_code, made.headers["etag"]) == (201, '"1"')
    one = made.headers["location"]
    assert made.json() == {
        **box_json,
        "id": 1,
        "name": "left",
        "has_hull": False,
        "hull_options": None,
        "has_mesh": False,
        "locked": False,
        "revision": 1,
    }
    assert client.get(one).json() == made.json()
    assert client.get(one).headers["etag"] == '"1"'
    assert client.get(path).json() == [made.json()]
    assert client.get(path).headers["etag"] == '"1"'

    assert client.patch(one, json={"size": [1, 2, 3]}).status_code == 428
    changed = client.patch(one, json={"size": [1, 2, 3]}, headers={"If-Match": '"1"'})
    assert (changed.status_code, changed.headers["etag"]) == (200, '"2"')
    assert changed.json() == {**made.json(), "size": [1.0, 2.0, 3.0], "revision": 2}
    stale = client.patch(one, json={"name": "right"}, headers={"If-Match": '"1"'})
    assert (stale.status_code, stale.json()["current"]) == (412, changed.json())
    assert stale.headers["content-type"] == "application/problem+json"

    assert client.delete(one).status_code == 428
    assert client.delete(one, headers={"If-Match": '"1"'}).json()["current"] == changed.json()
    assert client.delete(one, headers={"If-Match": '"2"'}).status_code == 204
    assert client.get(one).status_code == 404


def test_a_quaternion_is_normalised(client: httpx.Client, path: str, box_json: dict[str, Any]) -> None:
    box_json["T_world_box"]["wxyz"] = [-3, 0, 0, -4]
    made = client.post(path, json=box_json).json()
    assert made["T_world_box"]["wxyz"] == pytest.approx([0.6, 0, 0, 0.8], abs=1e-12)


BAD_BOXES: list[dict[str, Any]] = [
    {"size": [-1, 1, 1]},
    {"size": [0, 1, 1]},
    {"size": [1, 1]},
    {"size": [1, 1, 1, 1]},
    {"size": ["1", 1, 1]},
    {"size": [True, 1, 1]},
    {"size": [1e9, 1, 1]},
    {"size": None},
    {"class_id": 7},
    {"class_id": -1},
    {"class_id": "0"},
    {"class_id": 0.5},
    {"class_id": True},
    {"class_id": 2**70},
    {"name": ""},
    {"name": "x" * 101},
    {"name": "two\nlines"},
    {"colour": 1},
    {"id": 5},
    {"locked": None},
    {"locked": 1},
    {"locked": "true"},
    {"T_world_box": {"position": [0, 0, 0], "wxyz": [0, 0, 0, 0]}},
    {"T_world_box": {"position": [0, 0], "wxyz": [1, 0, 0, 0]}},
    {"T_world_box": {"position": [0, 0, 0]}},
    {"T_world_box": {"position": [0, 0, 0], "wxyz": [1, 0, 0, 0], "scale": 2}},
    {"T_world_box": {"position": [0, 0, 0], "wxyz": [1e308, 1e308, 0, 0]}},
    {"T_world_box": [1, 0, 0, 0]},
    {"T_world_box": {"position": [1e308, 0, 0], "wxyz": [1, 0, 0, 0]}},
    {"T_world_box": {"position": [0, -2e7, 0], "wxyz": [1, 0, 0, 0]}},
]


@pytest.mark.parametrize("change", BAD_BOXES)
def test_a_box_that_cannot_be_is_refused(
    client: httpx.Client, sid: str, path: str, box_json: dict[str, Any], change: dict[str, Any]
) -> None:
    assert client.post(path, json={**box_json, **change}).status_code == 422
    one = client.post(path, json=box_json).headers["location"]
    if list(change.values()) != [None]:  # for a change, null is the same as nothing said
        answer = client.patch(one, json=change, headers={"If-Match": '"1"'})
        assert answer.status_code == 422, answer.text
        assert answer.json()["detail"]
    assert client.get(f"/api/sessions/{sid}").json()["revision"] == 1


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"{",
        b"nonsense",
        b"null",
        b"[]",
        b'{"class_id": 0, "size": [NaN, 1, 1], "T_world_box": {"position": [0,0,0], "wxyz": [1,0,0,0]}}',
        b'{"class_id": 0, "size": [Infinity, 1, 1], "T_world_box": {"position": [0,0,0], "wxyz": [1,0,0,0]}}',
        b'{"class_id": 0, "size": [1e999, 1, 1], "T_world_box": {"position": [0,0,0], "wxyz": [1,0,0,0]}}',
        b'{"class_id": 0, "size": [1,1,1], "name": "\\ud800", "T_world_box": {"position": [0,0,0], "wxyz": [1,0,0,0]}}',
        b"\xff\xfe{}",
        b"[" * 100_000,
    ],
)
def test_a_body_that_is_no_json_is_refused(client: httpx.Client, path: str, body: bytes) -> None:
    answer = client.post(path, content=body, headers={"Content-Type": "application/json"})
    assert answer.status_code == 422, answer.text
    assert answer.headers["content-type"] == "application/problem+json"


def test_a_body_of_another_kind_is_refused(client: httpx.Client, path: str, box_json: dict[str, Any]) -> None:
    """A page elsewhere can send text/plain without asking first."""
    answer = client.post(
        path, content=httpx.Request("POST", "x:", json=box_json).content, headers={"Content-Type": "text/plain"}
    )
    assert answer.status_code == 422
    assert client.get(path).json() == []


def test_a_repeat_with_the_same_key_answers_the_same_box(
    client: httpx.Client, path: str, box_json: dict[str, Any]
) -> None:
    key = {"Idempotency-Key": "k"}
    first = client.post(path, json=box_json, headers=key)
    client.patch(first.headers["location"], json={"size": [1, 1, 1]}, headers={"If-Match": '"1"'})
    again = client.post(path, json=box_json, headers=key)
    assert (again.status_code, again.json(), again.headers["etag"]) == (201, first.json(), first.headers["etag"])
    assert len(client.get(path).json()) == 1
    other = client.post(path, json={**box_json, "size": [1, 1, 1]}, headers=key)
    assert other.status_code == 422


@pytest.mark.parametrize("key", ["", "k" * 201, "ümlaut"])
def test_a_key_that_cannot_be_kept_is_refused(
    client: httpx.Client, path: str, box_json: dict[str, Any], key: str
) -> None:
    headers = {"Idempotency-Key": key.encode("latin-1")}
    assert client.post(path, json=box_json, headers=headers).status_code == 422
    assert client.get(path).json() == []


POINTS = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.1], [0.2, 0.0, 0.1], [0.2, 0.3, 0.1]]


def test_four_points_make_a_box(client: httpx.Client, path: str) -> None:
    body = {"class_id": 0, "frame_of": "world", "points": POINTS}
    key = {"Idempotency-Key": "points"}
    made, again = (client.post(f"{path}/from-points", json=body, headers=key) for _ in range(2))
    assert made.status_code == 201
    assert made.json() == again.json()
    box = made.json()
    assert box["size"] == pytest.approx([0.2, 0.3, 0.1], abs=1e-12)
    assert box["T_world_box"]["position"] == pytest.approx([0.1, 0.15, 0.05], abs=1e-12)
    assert box["residual_degrees"] == pytest.approx(0, abs=1e-9)
    assert client.get(made.headers["location"]).json() == {k: v for k, v in box.items() if k != "residual_degrees"}


def test_points_drawn_by_hand_are_set_right_and_the_residual_told(client: httpx.Client, path: str) -> None:
    drawn = [*POINTS[:3], [0.2 + 0.3 * math.sin(0.1), 0.3 * math.cos(0.1), 0.1]]
    box = client.post(f"{path}/from-points", json={"class_id": 0, "frame_of": "world", "points": drawn}).json()
    assert 1 < box["residual_degrees"] < math.degrees(0.1)


def test_points_in_a_cameras_frame_are_moved_to_the_world(client: httpx.Client, sid: str, path: str) -> None:
    frame = client.get(f"/api/sessions/{sid}/frames?offset=4&limit=1").json()["items"][0]
    assert frame["T_world_camera"]["wxyz"] == [1, 0, 0, 0]
    body = {"class_id": 0, "frame_of": "camera", "frame": 4, "points": POINTS}
    box = client.post(f"{path}/from-points", json=body).json()
    expected = np.array([0.1, 0.15, 0.05]) + frame["T_world_camera"]["position"]
    assert box["T_world_box"]["position"] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    "change",
    [
        {"points": POINTS[:3]},
        {"points": [*POINTS[:3], POINTS[2]]},
        {"points": [[0, 0, z] for z in range(4)]},
        {"points": [*POINTS[:3], [1e308, 0, 0]]},
        {"frame_of": "camera"},
        {"frame_of": "camera", "frame": 6},
        {"frame_of": "camera", "frame": -1},
        {"frame_of": "world", "frame": 0},
        {"frame_of": "wrist"},
        {"class_id": 7},
        {"size": [1, 1, 1]},
    ],
)
def test_points_that_make_no_box_are_refused(client: httpx.Client, path: str, change: dict[str, Any]) -> None:
    body = {"class_id": 0, "frame_of": "world", "points": POINTS, **change}
    assert client.post(f"{path}/from-points", json=body).status_code == 422
    assert client.get(path).json() == []


@pytest.mark.parametrize(("box_id", "status"), [("7", 404), ("-1", 404), ("9" * 30, 404), ("x", 422), ("1.5", 422)])
def test_an_unknown_box_is_not_found(client: httpx.Client, path: str, box_id: str, status: int) -> None:
    assert client.get(f"{path}/{box_id}").status_code == status
    assert client.patch(f"{path}/{box_id}", json={}, headers={"If-Match": '"0"'}).status_code == status
    assert client.delete(f"{path}/{box_id}", headers={"If-Match": '"0"'}).status_code == status


def test_a_locked_box_is_kept_until_it_is_unlocked(client: httpx.Client, path: str, box_json: dict[str, Any]) -> None:
    client.post(path, json=box_json)
    locked = client.patch(f"{path}/1", json={"locked": True}, headers={"If-Match": '"1"'})
    assert (locked.status_code, locked.json()["locked"], locked.json()["revision"]) == (200, True, 2)
    now = {"If-Match": '"2"'}
    for refused in (
        client.patch(f"{path}/1", json={"size": [1, 2, 3]}, headers=now),
        client.delete(f"{path}/1", headers=now),
        client.post(f"{path}/1/to-ground", headers=now),
    ):
        assert (refused.status_code, refused.json()["type"]) == (409, "urn:ars-web:problem:locked")
        assert "unlock it before" in refused.json()["detail"]
    assert client.patch(f"{path}/1", json={"size": [1, 2, 3]}, headers={"If-Match": '"1"'}).status_code == 412
    renamed = client.patch(f"{path}/1", json={"name": "left"}, headers=now).json()
    assert (renamed["name"], renamed["locked"], renamed["revision"]) == ("left", True, 3)
    change = {"locked": False, "size": [1, 2, 3]}
    opened = client.patch(f"{path}/1", json=change, headers={"If-Match": '"3"'}).json()
    assert (opened["locked"], opened["size"]) == (False, [1, 2, 3])
    assert client.post(path, json={**box_json, "locked": True}).json()["locked"] is True


def test_a_duplicate_lies_10_mm_beside(client: httpx.Client, path: str, box_json: dict[str, Any]) -> None:
    box_json["T_world_box"] = {"position": [1, 2, 3], "wxyz": [0.5**0.5, 0, 0, 0.5**0.5]}  # its x is the world's y
    client.post(path, json={**box_json, "name": "left", "locked": True})
    key = {"Idempotency-Key": "k"}
    made = client.post(f"{path}/1/duplicate", headers=key)
    assert (made.status_code, made.headers["etag"]) == (201, '"2"')
    assert made.headers["location"] == f"{path}/2"
    box = made.json()
    assert (box["id"], box["name"], box["locked"], box["size"]) == (2, "left 2", False, [0.2, 0.2, 0.2])
    assert box["T_world_box"]["position"] == pytest.approx([1, 2.21, 3])
    assert client.post(f"{path}/1/duplicate", headers=key).json() == box
    assert client.post(f"{path}/1/duplicate", json={"offset": "beside"}).json()["name"] == "left 3"
    assert client.post(f"{path}/1/duplicate", json={"offset": "far"}).status_code == 422
    assert client.post(f"{path}/9/duplicate").status_code == 404


def test_a_box_is_put_on_the_ground(client: httpx.Client, path: str, box_json: dict[str, Any]) -> None:
    client.post(path, json=box_json)
    assert client.post(f"{path}/1/to-ground").status_code == 428
    key = {"If-Match": '"1"', "Idempotency-Key": "k"}
    resting = client.post(f"{path}/1/to-ground", headers=key)
    assert (resting.status_code, resting.headers["etag"]) == (200, '"2"')
    assert resting.json()["T_world_box"]["position"] == pytest.approx([0, 0, 0.1])
    assert client.post(f"{path}/1/to-ground", headers=key).json() == resting.json()
    stale = client.post(f"{path}/1/to-ground", headers={"If-Match": '"1"'})
    assert (stale.status_code, stale.json()["current"]) == (412, resting.json())
