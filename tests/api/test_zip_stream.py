"""A folder as a zip that is never whole in memory."""

import gc
import io
import tracemalloc
import zipfile
from pathlib import Path

from ars_web.api.zip_stream import PIECE, zip_stream


def test_the_zip_holds_the_folders_files(tmp_path: Path) -> None:
    files = {"b.txt": b"two", "a/x.bin": bytes(range(256)) * 5000, "a/empty": b"", "ümläut.txt": b"name"}
    for name, content in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(content)
    (tmp_path / "link").symlink_to("/etc/hostname")
    (tmp_path / "folder-link").symlink_to("/etc")
    data = b"".join(zip_stream(tmp_path, top="set"))
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        assert archive.testzip() is None
        assert archive.namelist() == ["set/a/empty", "set/a/x.bin", "set/b.txt", "set/ümläut.txt"]
        assert {name: archive.read(f"set/{name}") for name in files} == files
    assert b"".join(zip_stream(tmp_path, top="set")) == data


def test_an_empty_folder_is_an_empty_zip(tmp_path: Path) -> None:
    with zipfile.ZipFile(io.BytesIO(b"".join(zip_stream(tmp_path, top="set")))) as archive:
        assert archive.namelist() == []


def test_only_a_piece_is_held_at_a_time(tmp_path: Path) -> None:
    with (tmp_path / "large").open("wb") as file:
        file.truncate(200 * PIECE)
    for i in range(2000):
        (tmp_path / f"{i:04d}").write_bytes(b"small" * 100)
    # Twice: what other threads of this process, or imports, take meanwhile is not there each time.
    held = [held_while_streaming(tmp_path) for _ in range(2)]
    assert min(peak for _, peak in held) < 20 * PIECE
    assert max(largest for largest, _ in held) < 2 * PIECE


def held_while_streaming(folder: Path) -> tuple[int, int]:
    """The largest piece, and the most memory in bytes that was held at a time."""
    gc.collect()
    tracemalloc.start()
    try:
        largest = max(len(piece) for piece in zip_stream(folder, top="set"))
        return largest, tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
