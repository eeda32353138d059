"""The columns of a plan's frames on disk, mapped into memory: of a plan of many frames, a worker reads a shard's rows.

Each column is `columns/NAME.npy`; one of texts is their UTF-8 bytes, with `columns/NAME_ends.npy` beside them.
"""

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import overload

import numpy as np
from jaxtyping import Int, UInt8

FOLDER = "columns"

NUMBERS = ("session", "index", "camera_id", "split", "Ts_world_camera", "stamps")
TEXTS = ("names", "stems", "sources")

FILES = tuple(
    f"{FOLDER}/{name}.npy" for name in (*NUMBERS, *(part for text in TEXTS for part in (text, f"{text}_ends")))
)


class Texts(Sequence[str]):
    """Texts in one array of bytes; each is made when it is asked for."""

    def __init__(self, content: UInt8[np.ndarray, "size"], ends: Int[np.ndarray, "n"]) -> None:
        self._content = content
        self._ends = ends

    def __len__(self) -> int:
        return len(self._ends)

    @overload
    def __getitem__(self, place: int) -> str: ...
    @overload
    def __getitem__(self, place: slice) -> tuple[str, ...]: ...
    def __getitem__(self, place: int | slice) -> str | tuple[str, ...]:
        if isinstance(place, slice):
            return tuple(self._text(i) for i in range(*place.indices(len(self))))
        return self._text(range(len(self))[place])

    def __iter__(self) -> Iterator[str]:
        return (self._text(i) for i in range(len(self)))

    def _text(self, i: int) -> str:
        start = int(self._ends[i - 1]) if i else 0
        return self._content[start : int(self._ends[i])].tobytes().decode(errors="surrogateescape")


def text_arrays(texts: Sequence[str]) -> tuple[UInt8[np.ndarray, "size"], Int[np.ndarray, "n"]]:
    """The bytes of all texts, and (n,) where each ends."""
    encoded = [text.encode(errors="surrogateescape") for text in texts]
    ends = np.cumsum(np.fromiter(map(len, encoded), dtype=np.int64, count=len(encoded)))
    return np.frombuffer(b"".join(encoded), dtype=np.uint8), ends


def write_columns(columns: dict[str, np.ndarray], folder: Path) -> None:
    """Write columns, those of texts as `text_arrays` gives them; on the disk when this returns."""
    (folder / FOLDER).mkdir(exist_ok=True)
    for name, column in columns.items():
        with (folder / FOLDER / f"{name}.npy").open("wb") as file:
            np.save(file, column, allow_pickle=False)
            file.flush()
            os.fsync(file.fileno())


def read_columns(folder: Path) -> tuple[dict[str, np.ndarray], dict[str, Texts]]:
    """The columns of numbers and of texts; what is not looked at is not read."""
    numbers = {name: _mapped(folder, name) for name in NUMBERS}
    return numbers, {name: Texts(_mapped(folder, name), _mapped(folder, f"{name}_ends")) for name in TEXTS}


def _mapped(folder: Path, name: str) -> np.ndarray:
    path = folder / FOLDER / f"{name}.npy"
    # Copy on write, and no subclass: compiled functions know two kinds of arrays less.
    return np.load(path, mmap_mode="c", allow_pickle=False).view(np.ndarray)
