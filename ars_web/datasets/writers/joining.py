"""Joining the shards' fragments into one file, a piece at a time."""

import hashlib
from collections.abc import Sequence
from pathlib import Path

_PIECE = 1 << 20


def join_files(
    sources: Sequence[Path], target: Path, *, head: bytes = b"", between: bytes = b"", tail: bytes = b""
) -> str:
    """Write `head`, the sources that are there and not empty with `between` between them, and `tail`; its SHA-256."""
    target.parent.mkdir(parents=True, exist_ok=True)
    with Joined(target) as joined:
        joined.add(head)
        joined.add_files(sources, between=between)
        joined.add(tail)
    return joined.sha256


class Joined:
    """A file being written from pieces; memory is bounded by one of them."""

    def __init__(self, target: Path) -> None:
        self._file = target.open("wb")
        self._digest = hashlib.sha256()

    def __enter__(self) -> "Joined":
        return self

    def __exit__(self, *exc: object) -> None:
        self._file.close()

    @property
    def sha256(self) -> str:
        """Of what was written, in hex."""
        return self._digest.hexdigest()

    def add(self, content: bytes) -> None:
        """Write some bytes."""
        self._file.write(content)
        self._digest.update(content)

    def add_files(self, sources: Sequence[Path], *, between: bytes) -> None:
        """Write the sources that are there and not empty, with `between` between them."""
        first = True
        for source in sources:
            if not source.exists() or source.stat().st_size == 0:
                continue
            if not first:
                self.add(between)
            first = False
            with source.open("rb") as file:
                while piece := file.read(_PIECE):
                    self.add(piece)
