"""Sessions over HTTP: made from a root, renamed, deleted and brought back."""

import shutil

import httpx
import pytest

from ars_web.api import sessions
from ars_web.recordings.options import ReadOptions


def create(client: httpx.Client, **changes: object) -> httpx.Response:
    return client.post("/api/sessions", json={"name": "scene", "root": "data", "path": "scene", **changes})


def test_a_session_is_made_from_a_root(client: httpx.Client) -> None:
    made = create(client, name="Table", classes=["cube", "ball"])
    assert made.status_code == 201
    session = made.json()
    assert made.headers["location"] == f"/api/sessions/{session['id']}"
    assert made.headers["etag"] == '"0"'
    assert (session["name"], session["frames"], session["classes"], session["format"]) == ("Table", 6, 2, "ars")
    assert client.get(made.headers["location"]).json() == session
    assert session in client.get("/api/sessions").json()


def test_only_the_names_of_the_roots_are_told(client: httpx.Client) -> None:
    assert client.get("/api/roots").json() == [{"name": "data"}]


@pytest.mark.parametrize(
    ("changes", "status", "told"),
    [
        ({"root": "other"}, 422, "declared are: data"),
        ({"root": "/"}, 422, "not declared"),
        ({"path": "/etc"}, 422, "absolute"),
        ({"path": "../beside/scene"}, 422, "climbs"),
        ({"path": "scene\0"}, 422, "NUL"),
        ({"path": "scene\\images"}, 422, "backslash"),
        ({"path": "nothing"}, 404, "nothing"),
        ({"path": "scene/images/00000.jpg"}, 422, "no recording that is known"),
        ({"format": "nope"}, 422, "nope"),
        ({"name": ""}, 422, "name"),
        ({"name": " "}, 422, "name"),
        ({"name": "n" * 101}, 422, "name"),
        ({"name": 3}, 422, "name"),
        ({"colour": "red"}, 422, "unknown field"),
        ({"classes": "cube"}, 422, "classes"),
    ],
)
def test_a_session_that_cannot_be_made_is_refused_in_words(
    client: httpx.Client, changes: dict[str, object], status: int, told: str
) -> None:
    before = client.get("/api/sessions").json()
    answer = create(client, **changes)
    assert answer.status_code == status, answer.text
    assert told in answer.json()["detail"]
    assert client.get("/api/sessions").json() == before


def test_a_repeat_with_the_same_key_makes_no_second_session(client: httpx.Client) -> None:
    key = {"Idempotency-Key": "import 1"}
    body = {"name": "once", "root": "data", "path": "scene"}
    first, again = (client.post("/api/sessions", json=body, headers=key) for _ in range(2))
    assert (first.status_code, again.status_code) == (201, 201)
    assert again.json() == first.json()
    other = client.post("/api/sessions", json={**body, "name": "twice"}, headers=key)
    assert other.status_code == 422
    assert "key" in other.json()["detail"]


def test_a_link_that_leads_out_of_its_root_is_not_followed(server, client: httpx.Client, write_scene) -> None:
    write_scene(server.root.parent / "outside")
    (server.root / "way-out").symlink_to(server.root.parent / "outside")
    assert create(client, path="way-out").status_code == 422


def test_no_image_outside_the_root_is_taken_in(server, client: httpx.Client, write_scene) -> None:
    scene = write_scene(server.root / "linked-image")
    outside = shutil.copy(scene / "images" / "00003.jpg", server.root.parent / "secret.jpg")
    (scene / "images" / "00003.jpg").unlink()
    (scene / "images" / "00003.jpg").symlink_to(outside)
    answer = create(client, path="linked-image")
    assert answer.status_code == 422
    assert "outside" in answer.json()["detail"]


def test_both_checks_are_what_keeps_links_out(
    server, client: httpx.Client, write_scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_scene(server.root.parent / "outside-2")
    (server.root / "way-out-2").symlink_to(server.root.parent / "outside-2")
    monkeypatch.setattr(sessions, "safe_join", lambda root, path: root / path)
    assert create(client, path="way-out-2").status_code == 422
    monkeypatch.setattr(sessions, "ReadOptions", lambda within: ReadOptions())
    assert create(client, path="way-out-2").status_code == 201
    monkeypatch.undo()
    assert create(client, path="way-out-2").status_code == 422


def test_a_rename_needs_the_current_revision(client: httpx.Client, sid: str) -> None:
    path = f"/api/sessions/{sid}"
    assert client.patch(path, json={"name": "new"}).status_code == 428
    renamed = client.patch(path, json={"name": "new"}, headers={"If-Match": '"0"'})
    assert (renamed.status_code, renamed.headers["etag"], renamed.json()["name"]) == (200, '"1"', "new")
    stale = client.patch(path, json={"name": "newer"}, headers={"If-Match": '"0"'})
    assert stale.status_code == 412
    assert stale.json()["current"] == renamed.json() == client.get(path).json()
    nothing = client.patch(path, json={}, headers={"If-Match": '"1"'})
    assert (nothing.status_code, nothing.json()) == (200, renamed.json())
    assert client.patch(path, json={}, headers={"If-Match": '"0"'}).status_code == 412


@pytest.mark.parametrize(
    ("tag", "status"),
    [
        ('W/"0"', 412),
        ('"x"', 412),
        ('""', 412),
        ('"00000000000000000000"', 412),
        ("0", 412),
        ("*", 422),
        ('"0", "1"', 422),
    ],
)
def test_only_the_one_strong_tag_matches(client: httpx.Client, sid: str, tag: str, status: int) -> None:
    answer = client.patch(f"/api/sessions/{sid}", json={"name": "new"}, headers={"If-Match": tag})
    assert answer.status_code == status
    assert client.get(f"/api/sessions/{sid}").json()["revision"] == 0


def test_a_deleted_session_comes_back(client: httpx.Client, sid: str) -> None:
    path = f"/api/sessions/{sid}"
    before = client.get(path).json()
    assert client.delete(path).status_code == 428
    stale = client.delete(path, headers={"If-Match": '"7"'})
    assert (stale.status_code, stale.json()["current"]) == (412, before)
    assert client.delete(path, headers={"If-Match": '"0"'}).status_code == 204
    assert client.get(path).status_code == 404
    assert client.get(f"{path}/frames").status_code == 404
    assert sid not in [session["id"] for session in client.get("/api/sessions").json()]
    key = {"Idempotency-Key": "restore"}
    assert client.post(f"{path}/restore", headers=key).json() == before
    assert client.post(f"{path}/restore", headers=key).json() == before
    assert client.post(f"{path}/restore").status_code == 404
    assert client.get(path).json() == before


@pytest.mark.parametrize("sid", ["nope", "..", "%2e%2e", ".token", ".exports", "a" * 12, "x" * 5000])
def test_an_unknown_session_is_not_found(client: httpx.Client, sid: str) -> None:
    for part in ("", "/classes", "/boxes", "/boxes/1", "/frames", "/cameras", "/frames/0/image", "/frames/0/labels"):
        answer = client.get(httpx.URL(client.base_url, path=f"/api/sessions/{sid}{part}"))
        assert answer.status_code == 404, part
        assert answer.headers["content-type"] == "application/problem+json"


def test_skipped_frames_are_listed_with_the_reason(server, client: httpx.Client, write_scene) -> None:
    scene = write_scene(server.root / "spoiled")
    (scene / "images" / "00002.jpg").write_bytes((scene / "images" / "00002.jpg").read_bytes()[:-50])
    made = create(client, path="spoiled").json()
    assert (made["frames"], made["skipped"]) == (5, 1)
    (skipped,) = client.get(f"/api/sessions/{made['id']}/skipped").json()
    assert skipped["name"] == "00002.jpg"
    assert "truncated" in skipped["reason"]
