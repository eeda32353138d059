"""Folders to choose a recording from: what lies in one, and which of it can be imported.

Names are read and little else, so that a folder of 100,000 images is listed in a moment.
"""

import os
from dataclasses import dataclass
from pathlib import Path

from ars_web.errors import ArsError, BadFile
from ars_web.recordings.options import real
from ars_web.recordings.registry import detect_formats

MOST_FOLDERS = 1000
"""Folders that one listing names; more than a person looks through."""

MOST_TEXTS = 200
"""Text files that are looked into. A folder of more holds labels, or the like, and no recording."""

MOST_BYTES = 64 * 2**20
"""A larger file is not looked into: a manifest of 100,000 frames is half as large."""

_IMAGES = (".jpg", ".jpeg", ".png")
_TEXTS = (".txt", ".json", ".roars")
_IMAGE_FOLDERS = ("images", "rgb")


@dataclass(frozen=True)
class BrowsedFolder:
    """A folder below the one that was listed.

    Attributes:
        formats: of the recording that it may be.
        images: in it; where it holds none, those in its images/ or rgb/.
        problem: why it cannot be looked into; None: it can.
    """

    name: str
    formats: tuple[str, ...]
    images: int
    problem: str | None = None


@dataclass(frozen=True)
class BrowsedFile:
    """A file that can be imported by itself."""

    name: str
    formats: tuple[str, ...]


@dataclass(frozen=True)
class Browsed:
    """A folder as one chooses from it.

    Attributes:
        formats: of the recording that the folder itself may be.
        images: image files in it.
        folders: sorted by name; hidden ones and links that lead out are left out.
        files: that can be imported, sorted by name.
        more: whether there are more folders than are listed.
    """

    formats: tuple[str, ...]
    images: int
    folders: tuple[BrowsedFolder, ...]
    files: tuple[BrowsedFile, ...]
    more: bool


@dataclass(frozen=True)
class _Names:
    """What a folder holds, by names alone."""

    folders: tuple[str, ...]
    texts: tuple[str, ...]
    images: int
    others: int

    @property
    def may_be_recording(self) -> bool:
        """Every format has files or folders beside its images, and none has more texts than are looked into."""
        return bool(self.folders or self.texts or self.others) and len(self.texts) <= MOST_TEXTS


def browse(folder: Path, *, within: Path) -> Browsed:
    """What `folder`, which lies within `within`, holds.

    Raises:
        BadFile: it is no folder, or cannot be read.
    """
    root = real(within)
    try:
        names = _names(folder, root)
    except OSError as error:
        raise BadFile(folder, f"the folder cannot be read: {error.strerror}") from error
    texts = names.texts if len(names.texts) <= MOST_TEXTS else ()
    files = [BrowsedFile(name, _formats_of_file(folder / name)) for name in texts]
    return Browsed(
        formats=_formats(folder) if names.may_be_recording else (),
        images=names.images,
        folders=tuple(_browsed(folder / name, root) for name in names.folders[:MOST_FOLDERS]),
        files=tuple(file for file in files if file.formats),
        more=len(names.folders) > MOST_FOLDERS,
    )


def _browsed(folder: Path, root: Path) -> BrowsedFolder:
    try:
        names = _names(folder, root)
        images = names.images
        below = next((name for name in _IMAGE_FOLDERS if not images and name in names.folders), None)
        if below is not None:
            images = _names(folder / below, root).images
    except OSError as error:
        return BrowsedFolder(folder.name, (), 0, f"cannot be read: {error.strerror}")
    return BrowsedFolder(folder.name, _formats(folder) if names.may_be_recording else (), images)


def _formats(path: Path) -> tuple[str, ...]:
    try:
        return tuple(detect_formats(path))
    except ArsError:
        return ()  # opening or importing it says what is wrong


def _formats_of_file(path: Path) -> tuple[str, ...]:
    try:
        return _formats(path) if path.stat().st_size <= MOST_BYTES else ()
    except OSError:
        return ()  # gone since its name was read, or a link to nothing


def _names(folder: Path, root: Path) -> _Names:
    """What `folder` holds, sorted. Only links are asked where they lead."""
    folders: list[str] = []
    texts: list[str] = []
    images = others = 0
    with os.scandir(folder) as entries:
        for entry in entries:
            name = entry.name
            # What is no text can be put neither into an answer nor into a request.
            if name.startswith(".") or not _is_text(name):
                continue
            ending = os.path.splitext(name)[1].lower()  # noqa: PTH122 - a tenth of a Path's cost, once an image
            if ending in _IMAGES:
                images += 1
            elif entry.is_symlink() and not real(Path(entry.path)).is_relative_to(root):
                continue
            elif _is_folder(entry):
                folders.append(name)
            elif ending in _TEXTS:
                texts.append(name)
            else:
                others += 1
    return _Names(tuple(sorted(folders)), tuple(sorted(texts)), images, others)


def _is_folder(entry: os.DirEntry[str]) -> bool:
    try:
        return entry.is_dir()
    except OSError:
        return False  # links that run in a ring


def _is_text(name: str) -> bool:
    return name.isascii() or not any("\ud800" <= character <= "\udfff" for character in name)
