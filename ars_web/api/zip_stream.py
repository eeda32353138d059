"""A folder as a zip, piece by piece: nothing of it is held in memory or written to disk."""

import io
import os
from collections.abc import Iterator
from pathlib import Path
from zipfile import ZIP_STORED, ZipFile, ZipInfo

PIECE = 1 << 18
"""Bytes read at once; small files are gathered up to it."""


class _Sink(io.RawIOBase):
    """Takes what is written until it is taken out; cannot seek, so ZipFile writes sizes after each file."""

    def __init__(self) -> None:
        super().__init__()
        self.pieces: list[bytes] = []
        self.size = 0

    def writable(self) -> bool:
        return True

    def write(self, data: object) -> int:
        piece = bytes(data)  # pyright: ignore[reportArgumentType]: any buffer
        self.pieces.append(piece)
        self.size += len(piece)
        return len(piece)

    def take(self) -> bytes:
        taken = b"".join(self.pieces)
        self.pieces, self.size = [], 0
        return taken


def zip_stream(folder: Path, *, top: str) -> Iterator[bytes]:
    """The regular files of `folder` below `top/` in a zip, STORED, in the order of their names, zip64 where needed.

    The same files give the same bytes. Links are left out.

    Raises:
        OSError: a file vanishes meanwhile; what was sent so far is then no valid zip.
    """
    sink = _Sink()
    with ZipFile(sink, "w", ZIP_STORED, allowZip64=True) as archive:
        for path in _files(folder):
            entry = ZipInfo(f"{top}/{path.relative_to(folder).as_posix()}", date_time=(1980, 1, 1, 0, 0, 0))
            entry.external_attr = 0o644 << 16
            entry.file_size = path.stat().st_size
            with path.open("rb") as source, archive.open(entry, "w") as target:
                while piece := source.read(PIECE):
                    target.write(piece)
                    if sink.size >= PIECE:
                        yield sink.take()
    yield sink.take()


def _files(folder: Path) -> Iterator[Path]:
    """Depth first and sorted; only one folder's names are held at a time."""
    with os.scandir(folder) as found:
        entries = sorted(found, key=lambda entry: entry.name)
    for entry in entries:
        if entry.is_dir(follow_symlinks=False):
            yield from _files(Path(entry.path))
        elif entry.is_file(follow_symlinks=False):
            yield Path(entry.path)
