"""`/api/roots`: what lies in the declared folders."""

import httpx
import pytest


def test_a_root_is_walked_through(server, client: httpx.Client) -> None:
    listed = client.get("/api/roots/data/folders")
    assert listed.status_code == 200, listed.text
    assert listed.json() == {
        "path": "",
        "formats": [],
        "images": 0,
        "folders": [{"name": "scene", "formats": ["ars"], "images": 6, "problem": None}],
        "files": [],
        "more": False,
    }
    scene = client.get("/api/roots/data/folders", params={"path": "./scene/"}).json()
    assert (scene["path"], scene["formats"]) == ("scene", ["ars"])
    images = client.get("/api/roots/data/folders", params={"path": "scene/images"}).json()
    assert (images["path"], images["images"], images["folders"]) == ("scene/images", 6, [])


def test_files_that_can_be_imported_are_named(server, client: httpx.Client) -> None:
    folder = server.root / "with-files"
    folder.mkdir()
    try:
        (folder / "a.json").write_text('{"frames": [{"transform_matrix": []}]}')
        (folder / "b.roars").write_text('{"image_filenames_lists": [], "robot_poses": []}')
        (folder / "notes.txt").write_text("nothing of use")
        found = client.get("/api/roots/data/folders", params={"path": "with-files"}).json()
        assert found["files"] == [
            {"name": "a.json", "formats": ["nerfstudio"]},
            {"name": "b.roars", "formats": ["roars"]},
        ]
    finally:
        for path in folder.iterdir():
            path.unlink()
        folder.rmdir()


@pytest.mark.parametrize(
    ("root", "path", "status", "told"),
    [
        ("data", "..", 422, "climbs"),
        ("data", "/etc", 422, "absolute"),
        ("data", "scene/../..", 422, "climbs"),
        ("data", "scene\\images", 422, "backslash"),
        ("data", "\0", 422, "NUL"),
        ("data", "nothing", 404, "nothing at 'nothing'"),
        ("data", "x" * 5000, 422, "path"),
        ("data", "way-out", 422, "leaves its root"),
        ("data", "scene/robot_poses.txt", 422, "scene/robot_poses.txt: the folder cannot be read: Not a directory"),
        ("other", "", 422, "declared are: data"),
        ("%2e%2e", "", 422, "not declared"),
    ],
)
def test_what_cannot_be_listed_is_refused_in_words(
    server, client: httpx.Client, root: str, path: str, status: int, told: str
) -> None:
    link = server.root / "way-out"
    link.symlink_to(server.root.parent)
    try:
        answer = client.get(f"/api/roots/{root}/folders", params={"path": path})
    finally:
        link.unlink()
    assert answer.status_code == status, answer.text
    assert told in answer.json()["detail"]
    assert str(server.root) not in answer.text


def test_only_who_is_logged_in_sees_them(server) -> None:
    with server.stranger() as stranger:
        assert stranger.get("/api/roots/data/folders").status_code == 401
