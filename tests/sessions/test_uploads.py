"""Uploads wait for their import, and not for ever."""

import os
import time
import zipfile
from pathlib import Path

import pytest

from ars_web.errors import BadFile, NotFound, RefusedPath
from ars_web.recordings.recording import SkippedFrame
from ars_web.sessions.uploads import KEPT_SECONDS, UPLOADS, Uploads, as_uploaded, only_folder


@pytest.fixture
def sessions(tmp_path: Path) -> Path:
    return tmp_path / "sessions"


@pytest.fixture
def uploads(sessions: Path) -> Uploads:
    return Uploads(sessions)


def keep(uploads: Uploads, members: dict[str, str], *, key: str | None = None):
    with uploads.receiving() as folder:
        archive = folder / "upload.zip"
        with zipfile.ZipFile(archive, "w") as file:
            for name, text in members.items():
                file.writestr(name, text)
        return uploads.keep(archive, file_name="desk.zip", key=key)


def there(sessions: Path) -> set[str]:
    """What lies in the sessions folder, locks apart."""
    return {str(path.relative_to(sessions)) for path in sessions.rglob("*") if path.name != "lock"}


def test_what_was_in_the_zip_is_kept(uploads: Uploads, sessions: Path) -> None:
    made = keep(uploads, {"desk/poses.txt": "1", "desk/images/0.txt": "2"})
    assert (made.file_name, made.files) == ("desk.zip", 2)
    assert made.bytes > 0
    assert made.recording == made.folder / "desk"
    assert (made.recording / "images" / "0.txt").read_text() == "2"
    assert Uploads(sessions).get(made.id) == made
    assert not list(sessions.rglob("*.zip"))
    uploads.discard(made.id)
    assert there(sessions) == {".building", UPLOADS}
    uploads.discard(made.id)
    with pytest.raises(NotFound, match="send it again"):
        uploads.get(made.id)


@pytest.mark.parametrize("id_", ["", "..", "../sessions", "a" * 12, ".", "x/y", "A" * 12, "nothing\0else"])
def test_nothing_else_is_an_upload(uploads: Uploads, sessions: Path, id_: str) -> None:
    keep(uploads, {"a.txt": ""})
    before = there(sessions)
    with pytest.raises(NotFound):
        uploads.get(id_)
    uploads.discard(id_)
    assert there(sessions) == before


def test_a_zip_that_is_refused_leaves_nothing(uploads: Uploads, sessions: Path) -> None:
    with pytest.raises(RefusedPath):
        keep(uploads, {"good.txt": "", "../evil.txt": ""})
    with uploads.receiving() as folder:
        (folder / "upload.zip").write_bytes(b"no zip")
        with pytest.raises(BadFile):
            uploads.keep(folder / "upload.zip", file_name="x.zip")
    assert there(sessions) == {".building"}


def test_a_repeat_with_the_same_key_keeps_one(uploads: Uploads, sessions: Path) -> None:
    first, again = (keep(uploads, {"a.txt": ""}, key="up 1") for _ in range(2))
    assert first == again
    assert len(list((sessions / UPLOADS).iterdir())) == 1


def test_uploads_that_nobody_wanted_for_a_day_go(uploads: Uploads, sessions: Path) -> None:
    old, asked_for = (keep(uploads, {"a.txt": ""}) for _ in range(2))
    long_ago = time.time() - KEPT_SECONDS - 60
    for upload in (old, asked_for):
        os.utime(sessions / UPLOADS / upload.id, (long_ago, long_ago))
    uploads.get(asked_for.id)
    new = keep(uploads, {"a.txt": ""})
    assert {path.name for path in (sessions / UPLOADS).iterdir()} == {asked_for.id, new.id}
    uploads.sweep()
    assert uploads.get(new.id) == new


def test_an_upload_that_was_damaged_is_none(uploads: Uploads, sessions: Path) -> None:
    made = keep(uploads, {"a.txt": ""})
    (sessions / UPLOADS / made.id / "upload.json").write_text("{")
    with pytest.raises(NotFound):
        uploads.get(made.id)


def test_where_it_was_unpacked_is_told_to_nobody(make_recording, tmp_path: Path) -> None:
    skipped = (SkippedFrame("0.jpg", f"{tmp_path}/desk/images/0.jpg: is missing", f"{tmp_path}/desk/poses.txt:3"),)
    told = as_uploaded(make_recording(skipped=skipped), unpacked=tmp_path, file_name="desk.zip")
    assert told.source == Path("desk.zip")
    assert told.skipped == (SkippedFrame("0.jpg", "desk/images/0.jpg: is missing", "desk/poses.txt:3"),)


def test_only_lone_folders_are_gone_into(tmp_path: Path) -> None:
    (tmp_path / "a" / "b").mkdir(parents=True)
    (tmp_path / "__MACOSX").mkdir()
    (tmp_path / "a" / "b" / "file.txt").touch()
    assert only_folder(tmp_path) == tmp_path / "a" / "b"
    (tmp_path / "a" / "beside").mkdir()
    assert only_folder(tmp_path) == tmp_path / "a"
