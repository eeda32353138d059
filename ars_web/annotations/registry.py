"""The readers of labels by format, and finding a file's format by looking at it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ars_web.annotations import bop, coco, cvat, voc, yolo
from ars_web.annotations.foreign import ForeignLabels, joined
from ars_web.errors import BadFile, BadInput
from ars_web.recordings.options import NOTHING_SAID, ReadOptions

__all__ = ["READERS", "Reader", "read_labels"]

LARGEST = 2**30
"""Bytes of a file of labels. COCO's own, of 118,000 images, has under half of it."""


@dataclass(frozen=True)
class Reader:
    """One format.

    Attributes:
        format: its key.
        title: what it is called.
        needs: which files it needs.
        find: its files at a path that exists: the file itself, those in the folder; none where it does not look like
            this format.
        read: reads one of them, whole and sound, or raises.
        are_parts: whether several files that `find` found are parts of one set, divided by images.
    """

    format: str
    title: str
    needs: str
    find: Callable[[Path], list[Path]]
    read: Callable[[Path, ReadOptions], ForeignLabels]
    are_parts: Callable[[Sequence[Path]], bool]


READERS: dict[str, Reader] = {
    "bop": Reader("bop", bop.TITLE, bop.NEEDS, bop.find, bop.read, bop.are_parts),
    "coco": Reader("coco", coco.TITLE, coco.NEEDS, coco.find, coco.read, coco.are_parts),
    "cvat": Reader("cvat", cvat.TITLE, cvat.NEEDS, cvat.find, cvat.read, cvat.are_parts),
    "voc": Reader("voc", voc.TITLE, voc.NEEDS, voc.find, voc.read, voc.are_parts),
    "yolo": Reader("yolo", yolo.TITLE, yolo.NEEDS, yolo.find, yolo.read, yolo.are_parts),
}


def read_labels(path: Path, *, format: str = "auto", options: ReadOptions = NOTHING_SAID) -> ForeignLabels:  # noqa: A002 - the contract's name
    """Read the labels at `path`: a file, or a folder that holds one, or all parts of one set.

    Raises:
        BadInput: no reader knows it, or there are several files; the message names them and what to do.
        BadFile: it is damaged; the message says where.
        RefusedPath: something of it lies outside `options.within`.
    """
    if format != "auto" and format not in READERS:
        raise BadInput(f"format {format!r} is unknown; known are auto, {', '.join(READERS)}")
    options.allowed(path)
    try:
        if not path.exists():
            raise BadFile(path, "is missing")
        reader, files = _of_one_set(path, format)
        return joined(path, [_read(reader, file, options) for file in files])
    except OSError as error:
        raise BadFile(error.filename or path, f"cannot be read: {error.strerror}") from error


def _read(reader: Reader, file: Path, options: ReadOptions) -> ForeignLabels:
    options.allowed(file)
    if file.stat().st_size > LARGEST:
        raise BadFile(file, f"is over {LARGEST >> 30} GiB; divide it by images")
    return reader.read(file, options)


def _of_one_set(path: Path, format: str) -> tuple[Reader, list[Path]]:  # noqa: A002 - the contract's name
    readers = list(READERS.values()) if format == "auto" else [READERS[format]]
    found = [(reader, file) for reader in readers for file in reader.find(path)]
    if not found and format != "auto" and path.is_file():
        return READERS[format], [path]  # Reading it says what is wrong with it.
    if not found:
        known = "; ".join(f"{reader.format}: {reader.title}, {reader.needs}" for reader in readers)
        raise BadInput(f"{path} holds no labels that are known. Known are: {known}")
    first = found[0][0]
    are_parts = all(reader is first for reader, _ in found) and first.are_parts([file for _, file in found])
    if len(found) > 1 and not are_parts:
        named = ", ".join(f"{file.relative_to(path)} ({reader.format})" for reader, file in found)
        raise BadInput(f"{path} holds several: {named}; give the one that is meant")
    return first, [file for _, file in found]
