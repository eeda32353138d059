"""Classes over HTTP."""

import httpx
import pytest


def test_a_class_is_made_changed_and_deleted(client: httpx.Client, sid: str) -> None:
    path = f"/api/sessions/{sid}/classes"
    listed = client.get(path)
    assert listed.headers["etag"] == '"0"'
    assert [c["name"] for c in listed.json()] == ["cube"]

    made = client.post(path, json={"name": "ball", "color": "#AABBCC"})
    assert (made.status_code, made.headers["etag"]) == (201, '"1"')
    assert made.json() == {
        "id": 1,
        "name": "ball",
        "color": "#aabbcc",
        "default_size": None,
        "symmetry": {"kind": "none", "rotations": [], "axis": None, "flip": False},
        "keypoints": [],
        "mesh": None,
        "revision": 1,
    }
    one = made.headers["location"]
    assert client.get(one).json() == made.json()
    assert client.get(one).headers["etag"] == '"1"'

    assert client.patch(one, json={"name": "sphere"}).status_code == 428
    changed = client.patch(one, json={"name": "sphere"}, headers={"If-Match": '"1"'})
    assert (changed.status_code, changed.json()["name"], changed.headers["etag"]) == (200, "sphere", '"2"')
    stale = client.patch(one, json={"color": "#000000"}, headers={"If-Match": '"1"'})
    assert (stale.status_code, stale.json()["current"]) == (412, changed.json())

    assert client.delete(one).status_code == 428
    assert client.delete(one, headers={"If-Match": '"1"'}).status_code == 412
    assert client.delete(one, headers={"If-Match": '"2"'}).status_code == 204
    assert client.get(one).status_code == 404
    gone = client.delete(one, headers={"If-Match": '"2"'})
    assert gone.status_code in (404, 412)
    assert client.post(path, json={"name": "cone"}).json()["id"] == 2


def test_a_class_in_use_stays(client: httpx.Client, sid: str, box_json) -> None:
    client.post(f"/api/sessions/{sid}/boxes", json=box_json)
    answer = client.delete(f"/api/sessions/{sid}/classes/0", headers={"If-Match": '"0"'})
    assert answer.status_code == 422
    assert "box" in answer.json()["detail"]


def test_a_repeat_with_the_same_key_adds_no_second_class(client: httpx.Client, sid: str) -> None:
    path, key = f"/api/sessions/{sid}/classes", {"Idempotency-Key": "k"}
    first, again = (client.post(path, json={"name": "ball"}, headers=key) for _ in range(2))
    assert first.json() == again.json()
    assert len(client.get(path).json()) == 2
    assert client.post(path, json={"name": "cone"}, headers=key).status_code == 422


@pytest.mark.parametrize(
    "body",
    [
        {},
        {"name": ""},
        {"name": "cube"},
        {"name": "x", "color": "red"},
        {"name": "x", "id": 5},
        {"name": None},
        [],
        "x",
        3,
    ],
)
def test_a_class_that_cannot_be_is_refused(client: httpx.Client, sid: str, body: object) -> None:
    assert client.post(f"/api/sessions/{sid}/classes", json=body).status_code == 422
    assert client.get(f"/api/sessions/{sid}").json()["revision"] == 0


@pytest.mark.parametrize("class_id", ["7", "-1", "99999999999999999999999"])
def test_an_unknown_class_is_not_found(client: httpx.Client, sid: str, class_id: str) -> None:
    path = f"/api/sessions/{sid}/classes/{class_id}"
    assert client.get(path).status_code == 404
    assert client.patch(path, json={"name": "x"}, headers={"If-Match": '"0"'}).status_code == 404


def test_a_class_has_a_usual_size(client: httpx.Client, sid: str) -> None:
    path = f"/api/sessions/{sid}/classes"
    sized = client.patch(f"{path}/0", json={"default_size": [0.1, 0.2, 0.3]}, headers={"If-Match": '"0"'})
    assert (sized.status_code, sized.json()["default_size"]) == (200, [0.1, 0.2, 0.3])
    kept = client.patch(f"{path}/0", json={"name": "brick"}, headers={"If-Match": '"1"'})
    assert kept.json()["default_size"] == [0.1, 0.2, 0.3]
    for bad in ([0, 1, 1], [1, 1], [1, 1, "1"], [True, 1, 1], 3, "x"):
        answer = client.patch(f"{path}/0", json={"default_size": bad}, headers={"If-Match": '"2"'})
        assert answer.status_code == 422, bad
    assert client.get(f"{path}/0").headers["etag"] == '"2"'
    cleared = client.patch(f"{path}/0", json={"default_size": None}, headers={"If-Match": '"2"'})
    assert (cleared.json()["default_size"], cleared.json()["revision"]) == (None, 3)
    assert client.post(path, json={"name": "ball", "default_size": [1, 1, 1]}).json()["default_size"] == [1, 1, 1]
