"""Looking at a recording, sending one, and importing it while one watches."""

import io
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path

import cv2
import httpx
import numpy as np
import pytest


def zipped(folder: Path, *, top: str = "", extra: dict[str, bytes] | None = None) -> bytes:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as archive:
        for path in sorted(folder.rglob("*")):
            if path.is_file():
                archive.write(path, top + path.relative_to(folder).as_posix())
        for name, content in (extra or {}).items():
            archive.writestr(name, content)
    return data.getvalue()


def send(client: httpx.Client, archive: bytes, **headers: str) -> httpx.Response:
    return client.post("/api/imports/uploads", files={"file": ("my scene.zip", archive)}, headers=headers)


def left_behind(server) -> list[str]:
    folder = server.services.store.folder / ".building"
    return sorted(entry.name for entry in folder.iterdir() if entry.name != "lock") if folder.exists() else []


@pytest.fixture
def scene(server, write_scene):
    """A scene below the root for one test."""
    folder = write_scene(server.root / "own")
    yield folder
    shutil.rmtree(folder)


@pytest.fixture
def ended(client: httpx.Client, until) -> Callable[[httpx.Response], dict[str, object]]:
    """The job that an answer tells of, once it has ended."""

    def wait(started: httpx.Response) -> dict[str, object]:
        assert started.status_code == 202, started.text
        job: dict[str, object] = {}

        def has_ended() -> bool:
            job.update(client.get(started.headers["location"]).json())
            return job["state"] not in ("queued", "running")

        until(has_ended)
        return job

    return wait


def test_a_look_tells_what_would_be_imported(client: httpx.Client, scene: Path) -> None:
    poses = (scene / "robot_poses.txt").read_text().splitlines()
    poses[2] = "nan 0 -1 0 0 0 1"
    (scene / "robot_poses.txt").write_text("\n".join(poses))
    before = client.get("/api/sessions").json()
    answer = client.post("/api/imports/look", json={"root": "data", "path": "own"})
    assert answer.status_code == 200, answer.text
    look = answer.json()
    assert (look["format"], look["formats_possible"], look["frames"]) == ("ars", ["ars"], 5)
    (camera,) = look["cameras"]
    assert (camera["width"], camera["height"], camera["model"], camera["frames"]) == (160, 120, "brown", 5)
    assert look["images_size"] == [[160, 120]]
    assert (look["classes"], look["boxes"]) == ([], 0)
    assert look["skipped"]["count"] == 1
    (skipped,) = look["skipped"]["first"]
    assert (skipped["name"], skipped["where"]) == ("00002.jpg", "own/robot_poses.txt:3")
    assert look["path_length_m"] == pytest.approx(0.05)
    assert look["warnings"] == ["1 of 6 cannot be used; the reasons are listed"]
    assert look["sample_frames"] == [0, 1, 2, 3, 4]
    assert client.get("/api/sessions").json() == before


def test_a_look_shows_its_sample_frames_and_no_other(server, client: httpx.Client, scene: Path) -> None:
    look = client.post("/api/imports/look", json={"root": "data", "path": "own"}).json()
    shown = client.get("/api/imports/look/image", params={"look": look["id"], "frame": 3, "width": 40})
    assert (shown.status_code, shown.headers["content-type"]) == (200, "image/jpeg")
    image = cv2.imdecode(np.frombuffer(shown.content, np.uint8), cv2.IMREAD_COLOR)
    assert image.shape == (30, 40, 3)
    whole = client.get("/api/imports/look/image", params={"look": look["id"], "frame": 3})
    assert whole.content == (scene / "images" / "00003.jpg").read_bytes()
    for params, status in (
        ({"look": look["id"], "frame": 6}, 404),
        ({"look": look["id"], "frame": -1}, 422),
        ({"look": "nothing", "frame": 0}, 404),
        ({"look": "../../etc", "frame": 0}, 404),
        ({"look": look["id"], "frame": 3, "width": 0}, 422),
    ):
        assert client.get("/api/imports/look/image", params=params).status_code == status, params
    with server.stranger() as stranger:
        assert stranger.get("/api/imports/look/image", params={"look": look["id"], "frame": 3}).status_code == 401


def test_an_image_that_became_a_link_out_is_not_shown(server, client: httpx.Client, scene: Path) -> None:
    look = client.post("/api/imports/look", json={"root": "data", "path": "own"}).json()
    outside = shutil.copy(scene / "images" / "00003.jpg", server.root.parent / "outside.jpg")
    (scene / "images" / "00003.jpg").unlink()
    (scene / "images" / "00003.jpg").symlink_to(outside)
    params = {"look": look["id"], "frame": 3}
    assert client.get("/api/imports/look/image", params=params).status_code == 422
    (scene / "images" / "00003.jpg").unlink()
    gone = client.get("/api/imports/look/image", params=params)
    assert gone.status_code == 404
    assert str(server.root) not in gone.text


def test_what_was_imported_already_is_told(client: httpx.Client, sid: str) -> None:
    look = client.post("/api/imports/look", json={"root": "data", "path": "scene"}).json()
    assert look["warnings"][-1] == "the session scene was made of this recording already"


@pytest.mark.parametrize("address", ["/api/imports/look", "/api/imports"])
@pytest.mark.parametrize(
    ("changes", "status", "told"),
    [
        ({}, 422, "either root, with path, or upload"),
        ({"root": "data", "upload": "x"}, 422, "either root, with path, or upload"),
        ({"root": "other"}, 422, "declared are: data"),
        ({"root": "data", "path": ".."}, 422, "climbs"),
        ({"root": "data", "path": "/etc"}, 422, "absolute"),
        ({"root": "data", "path": "nothing"}, 404, "nothing at 'nothing'"),
        ({"root": "data", "path": "scene", "images": "../beside"}, 422, "climbs"),
        ({"root": "data", "path": "scene", "camera": "nothing.txt"}, 404, "nothing.txt"),
        ({"upload": "abcdefghijk1"}, 404, "send it again"),
        ({"upload": "../uploads"}, 404, "send it again"),
        ({"root": "data", "path": "scene", "colour": 1}, 422, "unknown field"),
        ({"root": "data", "path": 3}, 422, "path"),
    ],
)
def test_what_cannot_be_is_refused_in_words(
    client: httpx.Client, address: str, changes: dict[str, object], status: int, told: str
) -> None:
    draft = changes if address.endswith("look") else {"name": "x", **changes}
    answer = client.post(address, json=draft)
    assert answer.status_code == status, answer.text
    assert told in answer.json()["detail"]


def test_a_look_names_the_file_and_line_of_a_fault(server, client: httpx.Client, scene: Path) -> None:
    (scene / "robot_poses.txt").write_text("0 0 0 0 0 0 1\n0 0 zero 0 0 0 1\n")
    answer = client.post("/api/imports/look", json={"root": "data", "path": "own"})
    assert answer.status_code == 422
    assert answer.json()["type"] == "urn:ars-web:problem:bad-file"
    assert answer.json()["detail"].startswith("own/robot_poses.txt:2: ")
    assert str(server.root) not in answer.text


def test_images_and_camera_can_be_said(client: httpx.Client, scene: Path) -> None:
    """A trajectory whose images and camera lie elsewhere."""
    (scene / "track").mkdir()
    rows = [f"{i} {0.01 * i} 0 -1 0 0 0 1" for i in range(6)]
    (scene / "track" / "poses.txt").write_text("\n".join(rows) + "\n")
    (scene / "images").rename(scene / "pictures")
    (scene / "camera_intrinsics.txt").rename(scene / "calibration.txt")
    draft = {"root": "data", "path": "own/track"}
    refused = client.post("/api/imports/look", json=draft)
    assert refused.status_code == 422
    assert "say where the images are" in refused.json()["detail"]
    said = {**draft, "images": "own/pictures", "camera": "own/calibration.txt"}
    look = client.post("/api/imports/look", json=said)
    assert look.status_code == 200, look.text
    assert (look.json()["format"], look.json()["frames"]) == ("tum", 6)


def test_an_import_makes_a_session(client: httpx.Client, scene: Path, ended) -> None:
    draft = {"name": "Table", "root": "data", "path": "own", "classes": ["cube", "ball"]}
    job = ended(client.post("/api/imports", json=draft))
    assert (job["state"], job["name"], job["done"], job["total"], job["error"]) == ("done", "Table", 6, 6, None)
    session = client.get(f"/api/sessions/{job['session_id']}").json()
    assert (session["name"], session["frames"], session["classes"], session["source"]) == ("Table", 6, 2, str(scene))
    assert job in client.get("/api/imports").json()
    # Too late, and harmless.
    assert client.post(f"/api/imports/{job['id']}/cancel").json() == job


def test_an_import_that_fails_says_why(server, client: httpx.Client, scene: Path, ended) -> None:
    (scene / "camera_intrinsics.txt").unlink()
    before = client.get("/api/sessions").json()
    job = ended(client.post("/api/imports", json={"name": "x", "root": "data", "path": "own"}))
    assert (job["state"], job["session_id"]) == ("failed", None)
    assert job["error"] == "own/camera_intrinsics.txt: is missing"
    assert client.get("/api/sessions").json() == before
    assert left_behind(server) == []


@pytest.mark.parametrize("top", ["", "desk/"])
def test_what_is_sent_is_looked_at_and_imported(server, client: httpx.Client, ended, top: str) -> None:
    archive = zipped(server.root / "scene", top=top)
    sent = send(client, archive)
    assert sent.status_code == 201, sent.text
    upload = sent.json()
    assert (upload["file_name"], upload["bytes"], upload["files"]) == ("my scene.zip", len(archive), 9)
    look = client.post("/api/imports/look", json={"upload": upload["id"]}).json()
    assert (look["format"], look["frames"]) == ("ars", 6)
    shown = client.get("/api/imports/look/image", params={"look": look["id"], "frame": 5})
    assert shown.content == (server.root / "scene" / "images" / "00005.jpg").read_bytes()
    job = ended(client.post("/api/imports", json={"name": "sent", "upload": upload["id"]}))
    assert job["state"] == "done"
    session = client.get(f"/api/sessions/{job['session_id']}").json()
    assert session["source"] == "my scene.zip"
    image = client.get(f"/api/sessions/{job['session_id']}/frames/3/image")
    assert image.content == (server.root / "scene" / "images" / "00003.jpg").read_bytes()
    assert client.post("/api/imports/look", json={"upload": upload["id"]}).status_code == 404
    assert left_behind(server) == []


def test_faults_of_an_upload_are_told_from_its_own_top(server, client: httpx.Client) -> None:
    extra = {"desk/robot_poses.txt": b"0 0 0\n"}
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as archive:
        for name, content in extra.items():
            archive.writestr(name, content)
    upload = send(client, data.getvalue()).json()
    answer = client.post("/api/imports/look", json={"upload": upload["id"]})
    assert answer.status_code == 422
    assert answer.json()["detail"].startswith("desk/robot_poses.txt:1: ")
    assert str(server.services.store.folder) not in answer.text


def test_a_path_in_an_upload_can_be_said(server, client: httpx.Client, write_scene, tmp_path: Path) -> None:
    """Two recordings in one zip."""
    write_scene(tmp_path / "both" / "one", frames=3)
    write_scene(tmp_path / "both" / "two", frames=4)
    upload = send(client, zipped(tmp_path / "both")).json()["id"]
    assert client.post("/api/imports/look", json={"upload": upload}).status_code == 422
    look = client.post("/api/imports/look", json={"upload": upload, "path": "two"})
    assert look.json()["frames"] == 4
    climbs = client.post("/api/imports/look", json={"upload": upload, "path": "../../"})
    assert (climbs.status_code, climbs.json()["type"]) == (422, "urn:ars-web:problem:refused-path")


@pytest.mark.parametrize(
    ("extra", "status", "told"),
    [
        ({"../evil.txt": b"evil"}, 422, "leave the folder"),
        ({"/evil.txt": b"evil"}, 422, "leave the folder"),
        ({"bomb": bytes(50 * 2**20)}, 413, "limit"),
    ],
)
def test_a_zip_that_is_no_recording_of_an_honest_sender_is_refused(
    server, client: httpx.Client, extra: dict[str, bytes], status: int, told: str
) -> None:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in extra.items():
            archive.writestr(name, content)
    answer = send(client, data.getvalue())
    assert answer.status_code == status, answer.text
    assert told in answer.json()["detail"]
    assert str(server.services.store.folder) not in answer.text
    assert not list(server.root.parent.rglob("evil.txt"))
    assert left_behind(server) == []


def test_an_upload_beyond_the_limit_is_refused(server, client: httpx.Client) -> None:
    assert send(client, bytes(11 * 2**20)).status_code == 413
    assert left_behind(server) == []


def test_what_is_no_upload_is_refused_in_words(server, client: httpx.Client) -> None:
    assert "multipart/form-data request is needed, with `file`" in client.post("/api/imports/uploads").json()["detail"]
    assert "no zip" in send(client, b"nothing of a zip").json()["detail"]
    named = client.post("/api/imports/uploads", files={"file": ("a.zip", b"PK")}, data={"name": "x"})
    assert "'name' is unknown" in named.json()["detail"]
    assert left_behind(server) == []


def test_repeats_with_the_same_key_do_nothing_twice(server, client: httpx.Client, ended) -> None:
    archive = zipped(server.root / "scene")
    first, again = (send(client, archive, **{"Idempotency-Key": "send 1"}) for _ in range(2))
    assert first.json() == again.json()
    draft = {"name": "once", "root": "data", "path": "scene"}
    key = {"Idempotency-Key": "import once"}
    started, repeated = (client.post("/api/imports", json=draft, headers=key) for _ in range(2))
    assert started.json()["id"] == repeated.json()["id"]
    ended(started)
    assert [session["name"] for session in client.get("/api/sessions").json()].count("once") == 1
    other = client.post("/api/imports", json={**draft, "name": "twice"}, headers=key)
    assert (other.status_code, "something else" in other.json()["detail"]) == (422, True)


def test_an_unknown_import_is_not_found_in_words(client: httpx.Client) -> None:
    for answer in (client.get("/api/imports/inothing"), client.post("/api/imports/inothing/cancel")):
        assert answer.status_code == 404
        assert "was started again since" in answer.json()["detail"]


def test_a_foreign_page_sends_nothing(server) -> None:
    archive = zipped(server.root / "scene")
    with server.browser(Origin="http://evil.example") as client:
        assert send(client, archive).status_code == 403
        assert client.post("/api/imports", json={"name": "x", "root": "data", "path": "scene"}).status_code == 403
    with server.stranger() as client:
        assert send(client, archive).status_code == 401
    assert left_behind(server) == []
