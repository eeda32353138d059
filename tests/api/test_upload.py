"""Sessions from a zip that is sent: what is taken, what is refused, and that nothing is left behind."""

import io
import os
import shutil
import zipfile
from pathlib import Path

import cv2
import httpx
import numpy as np
import pytest

from ars_web.api import upload as upload_module


def zipped(folder: Path, *, top: str = "", extra: dict[str, bytes] | None = None) -> bytes:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in sorted(folder.rglob("*")):
            if path.is_file():
                archive.write(path, top + path.relative_to(folder).as_posix())
        for name, content in (extra or {}).items():
            archive.writestr(name, content)
    return data.getvalue()


def upload(client: httpx.Client, archive: bytes, **changes: object) -> httpx.Response:
    headers = changes.pop("headers", None)
    return client.post(
        "/api/sessions/upload",
        files={"file": ("my scene.zip", archive, "application/zip")},
        data={"name": "uploaded", **changes},
        headers=headers,
    )


def left_behind(server) -> list[str]:
    building = server.services.store.folder / ".building"
    return sorted(entry.name for entry in building.iterdir() if entry.name != "lock") if building.exists() else []


@pytest.mark.parametrize("top", ["", "scene/", "a/b/c/"])
def test_a_zip_becomes_a_session_with_images_of_its_own(server, client: httpx.Client, top: str) -> None:
    made = upload(client, zipped(server.root / "scene", top=top))
    assert made.status_code == 201, made.text
    session = made.json()
    assert (session["name"], session["frames"], session["source"]) == ("uploaded", 6, "my scene.zip")
    assert made.headers["etag"] == '"0"'
    image = client.get(f"/api/sessions/{session['id']}/frames/3/image")
    assert image.content == (server.root / "scene" / "images" / "00003.jpg").read_bytes()
    assert left_behind(server) == []


def test_an_upload_repeated_with_its_key_makes_one_session(server, client: httpx.Client) -> None:
    archive = zipped(server.root / "scene")
    first, again = (upload(client, archive, headers={"Idempotency-Key": "up"}) for _ in range(2))
    assert first.json() == again.json()


def test_a_name_that_leaves_the_folder_is_refused(server, client: httpx.Client) -> None:
    for name in ("../evil.txt", "/evil.txt", "a/../../evil.txt", "a\\..\\evil.txt"):
        answer = upload(client, zipped(server.root / "scene", extra={name: b"evil"}))
        assert answer.status_code == 422, name
        assert answer.json()["type"].endswith("refused-path")
    assert not list(server.root.parent.rglob("evil.txt"))
    assert left_behind(server) == []


def test_without_that_check_a_name_would_leave_the_folder(
    server, client: httpx.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    def careless(source: Path, target: Path) -> None:
        with zipfile.ZipFile(source) as archive:
            for member in archive.infolist():
                path = target / member.filename
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(archive.read(member))

    monkeypatch.setattr(upload_module, "extract_zip", careless)
    assert upload(client, zipped(server.root / "scene", extra={"../../slipped.txt": b"evil"})).status_code == 201
    (slipped,) = server.root.parent.rglob("slipped.txt")
    slipped.unlink()


def test_a_zip_bomb_is_refused(server, client: httpx.Client) -> None:
    answer = upload(client, zipped(server.root / "scene", extra={"bomb": bytes(50 * 2**20)}))
    assert answer.status_code == 413
    assert answer.json()["type"].endswith("too-large")
    assert left_behind(server) == []


def test_an_upload_beyond_the_limit_is_refused_whatever_it_declares(server, client: httpx.Client) -> None:
    large = os.urandom(11 * 2**20)
    assert upload(client, large).status_code == 413
    boundary = b"x"
    head = b'--x\r\nContent-Disposition: form-data; name="file"; filename="a.zip"\r\n\r\n'

    def pieces():
        yield head
        for _ in range(11):
            yield large[: 2**20]
        yield b"\r\n--x--\r\n"

    answer = client.post(
        "/api/sessions/upload",
        content=pieces(),  # chunked: no length is declared
        headers={"Content-Type": f"multipart/form-data; boundary={boundary.decode()}"},
    )
    assert answer.status_code == 413
    assert left_behind(server) == []


PART = b'--x\r\nContent-Disposition: form-data; name="%s"%s\r\n\r\n%s\r\n'
FILE = PART % (b"file", b'; filename="a.zip"', b"PK")
NAME = PART % (b"name", b"", b"n")
END = b"--x--\r\n"


@pytest.mark.parametrize(
    ("body", "status"),
    [
        (b"", 422),
        (b"nonsense", 422),
        (END, 422),
        (FILE + NAME, 422),  # cut short
        (FILE + END, 422),  # no name
        (NAME + END, 422),  # no file
        (FILE + FILE + NAME + END, 422),
        (FILE + NAME + NAME + END, 422),
        (FILE + NAME + PART % (b"path", b"", b"/etc") + END, 422),
        (FILE + PART % (b"name", b"", b"\xff") + END, 422),
        (FILE + PART % (b"name", b"", b"n" * 2000) + END, 413),
        (FILE + NAME + END, 422),  # no zip
        (b"--x\r\nX: " + b"y" * 100_000 + b"\r\n\r\n", 422),
        (b"--x\r\nContent-Disposition: form-data\r\n\r\n\r\n" + END, 422),
    ],
)
def test_a_form_that_is_none_is_refused(server, client: httpx.Client, body: bytes, status: int) -> None:
    headers = {"Content-Type": "multipart/form-data; boundary=x"}
    answer = client.post("/api/sessions/upload", content=body, headers=headers)
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    assert left_behind(server) == []


@pytest.mark.parametrize(
    "kind", ["", "application/json", "multipart/form-data", "multipart/form-data; boundary=" + "b" * 300]
)
def test_an_upload_that_is_no_form_is_refused(client: httpx.Client, kind: str) -> None:
    assert client.post("/api/sessions/upload", content=b"{}", headers={"Content-Type": kind}).status_code == 422


def test_an_image_of_too_many_pixels_is_not_decoded(server, client: httpx.Client, tmp_path: Path) -> None:
    scene = tmp_path / "huge"
    shutil.copytree(server.root / "scene", scene)
    small = cv2.imencode(".png", np.zeros((4, 4, 3), np.uint8))[1].tobytes()
    # The header alone says 60,000 x 60,000; no decoder ever sees it.
    for image in (scene / "images").iterdir():
        image.unlink()
    for i in range(6):
        huge = small[:16] + (60_000).to_bytes(4, "big") * 2 + small[24:]
        (scene / "images" / f"{i:05d}.png").write_bytes(huge)
    answer = upload(client, zipped(scene))
    assert answer.status_code in (413, 422)
    assert "pixels" in answer.json()["detail"]
    assert left_behind(server) == []
