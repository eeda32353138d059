"""`outline-rest` and `/api/sessions/{sid}/outline-jobs`."""

import httpx
import pytest

DRAWN = (0, 4)
ENDED = ("done", "failed", "cancelled")


@pytest.fixture
def session(client: httpx.Client, server, ring_scene, painted_ring) -> str:
    """Where a new session is of the recording with a ball in its pictures."""
    if not (server.root / "painted").exists():
        painted_ring.write(ring_scene, server.root / "painted")
    body = {"name": "painted", "root": "data", "path": "painted", "classes": ["ball"]}
    made = client.post("/api/sessions", json=body)
    assert made.status_code == 201, made.text
    return f"/api/sessions/{made.json()['id']}"


@pytest.fixture
def object_id(client: httpx.Client, session: str, ring_scene) -> int:
    """A new object with two masks and no box yet."""
    id_ = None
    for frame in DRAWN:
        body = {"box_id": id_, "class_id": 0, "frame": frame, "polygons": ring_scene.polygons(frame)}
        made = client.post(f"{session}/masks", json=body)
        assert made.status_code == 201, made.text
        id_ = made.json()["box_id"]
    assert id_ is not None
    return id_


def ended(client: httpx.Client, until, location: str) -> dict:
    until(lambda: client.get(location).json()["state"] in ENDED, seconds=60)
    return client.get(location).json()


def test_two_masks_become_a_box_with_more_masks(client, until, session, object_id):
    started = client.post(f"{session}/boxes/{object_id}/outline-rest", json={"frames_most": 3})
    assert started.status_code == 202, started.text
    assert started.headers["Location"] == f"{session}/outline-jobs/{started.json()['id']}"
    job = ended(client, until, started.headers["Location"])
    assert (job["state"], job["error"], job["seconds_left"], job["box_id"]) == ("done", None, None, object_id)
    assert job["done"] == job["total"] > 0
    assert 1 <= len(job["accepted"]) <= 3
    assert [doubt["frame"] for doubt in job["doubts"]] == job["doubtful"]
    assert all(dropped["reason"] for dropped in job["dropped"])
    masks = {mask["frame"]: mask for mask in client.get(f"{session}/masks").json()}
    assert {frame for frame, mask in masks.items() if mask["origin"] == "proposed" and mask["accepted"]} == set(
        job["accepted"]
    )
    box = client.get(f"{session}/boxes/{object_id}").json()
    assert box["has_hull"]
    undone = client.post(f"{session}/undo")
    assert undone.status_code == 200
    assert {mask["frame"] for mask in client.get(f"{session}/masks").json()} == set(DRAWN)
    assert client.get(f"{session}/boxes/{object_id}").status_code == 404


def test_the_number_of_frames_need_not_be_said_and_a_key_is_kept_to(client, until, session, object_id):
    first = client.post(f"{session}/boxes/{object_id}/outline-rest", headers={"Idempotency-Key": "rest"})
    assert first.status_code == 202, first.text
    again = client.post(f"{session}/boxes/{object_id}/outline-rest", headers={"Idempotency-Key": "rest"}, json={})
    assert again.json()["id"] == first.json()["id"]
    cancelled = client.post(f"{first.headers['Location']}/cancel")
    assert cancelled.status_code == 200
    assert ended(client, until, first.headers["Location"])["state"] in ("cancelled", "done")


@pytest.mark.parametrize("body", [{"frames_most": 0}, {"frames_most": 51}, {"frames_most": "3"}, {"frames": 3}])
def test_what_cannot_be_asked_is_refused(client, session, object_id, body):
    answer = client.post(f"{session}/boxes/{object_id}/outline-rest", json=body)
    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"


def test_one_mask_is_too_few(client, session, ring_scene):
    body = {"class_id": 0, "frame": 0, "polygons": ring_scene.polygons(0)}
    made = client.post(f"{session}/masks", json=body).json()
    answer = client.post(f"{session}/boxes/{made['box_id']}/outline-rest", json={})
    assert answer.status_code == 422
    assert "two are needed" in answer.json()["detail"]


def test_what_is_not_there_is_told(client, session, object_id):
    assert client.post(f"{session}/boxes/77/outline-rest", json={}).status_code == 404
    assert client.post("/api/sessions/nowhere/boxes/1/outline-rest", json={}).status_code == 404
    assert client.get(f"{session}/outline-jobs/o1").status_code == 404
    assert client.post(f"{session}/outline-jobs/o1/cancel").status_code == 404
