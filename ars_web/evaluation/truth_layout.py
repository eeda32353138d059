"""What a layout of truth is to the registry, and what all of them share: what was asked for, splits, images' sizes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import BaseModel, ConfigDict

from ars_web.errors import BadFile, BadInput
from ars_web.evaluation.detections import Truth
from ars_web.recordings.images import image_size

SPLITS = ("train", "val", "test")
"""What parts of a set are called."""

WHOLE = "all"
"""What is asked for where no split is meant."""


@dataclass(frozen=True)
class TruthOptions:
    """What was asked for.

    Attributes:
        split: train, val, test, all; None: val where there is one, else the whole.
        image_size: width and height of images that have none of their own; None: not said.
    """

    split: str | None = None
    image_size: tuple[int, int] | None = None


@dataclass(frozen=True)
class TruthLayout:
    """One layout.

    Attributes:
        format: its key.
        title: what it looks like.
        is_one: whether a path that exists looks like it.
        read: reads it, whole and sound, or raises.
    """

    format: str
    title: str
    is_one: Callable[[Path], bool]
    read: Callable[[Path, TruthOptions], Truth]


class _Class(BaseModel):
    model_config = ConfigDict(extra="ignore", frozen=True)
    name: str


class _Dataset(BaseModel):
    """Of this program's dataset.json what says whose dataset it is, and its classes in their order."""

    model_config = ConfigDict(extra="ignore", frozen=True)
    program: str
    format: str
    classes: list[_Class]


def own_classes(folder: Path) -> tuple[str, ...] | None:
    """The classes of a dataset that this program wrote, by their numbers; None where it is somebody else's."""
    told = _own(folder)
    return None if told is None else tuple(one.name for one in told.classes)


def own_format(folder: Path) -> str | None:
    """The format of a dataset that this program wrote; None where it is somebody else's."""
    told = _own(folder)
    return None if told is None else told.format


def _own(folder: Path) -> _Dataset | None:
    try:
        told = _Dataset.model_validate_json((folder / "dataset.json").read_bytes())
    except (OSError, ValueError):
        return None
    return told if told.program == "ars-web" else None


def chosen_split(source: Path, present: Sequence[str], wanted: str | None) -> str | None:
    """Which split to read of those that are present; None: the whole.

    Raises:
        BadInput: that one is not there.
    """
    if wanted is None:
        return "val" if "val" in present else None
    if wanted == WHOLE:
        return None
    if wanted in present:
        return wanted
    there = f"it has {', '.join(present)}" if present else "it is not divided into splits"
    raise BadInput(f"{source} has no split {wanted!r}: {there}; say --split {present[0] if present else WHOLE}")


def size_of(file: Path | None, options: TruthOptions) -> tuple[int, int] | None:
    """An image's size: its file's, else what was said; None where neither is there.

    Raises:
        BadFile, TooLarge: it is no image that can be read.
    """
    return options.image_size if file is None else image_size(file)


def text_lines(path: Path) -> list[str]:
    """A text file's lines.

    Raises:
        BadFile: it cannot be read, or is no UTF-8.
    """
    try:
        return path.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise BadFile(path, "is not UTF-8; save it as UTF-8") from error
    except OSError as error:
        raise BadFile(path, f"cannot be read: {error.strerror}") from error
