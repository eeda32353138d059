"""Image folders whose images belong to poses by their place in the sorted list."""

import os
import re
from pathlib import Path

from ars_web.errors import BadFile

# Lower and upper case, but one kind of image: the first kind that is there is the recording, as in the original tool.
_KINDS = ((".jpg", ".jpeg"), (".png",))

_ANY_DIGIT = str.maketrans("123456789", "000000000")
_NUMBER = re.compile(r"(\d+(?:\.\d+)?)")


def list_images(folder: Path) -> list[Path]:
    """The JPEG images of a folder sorted by name; its PNG images where it has no JPEG.

    Raises:
        BadFile: the folder is missing or empty, or its names sort differently as text and by their numbers, so that
            nobody can say which image comes first.
    """
    found = files_in(folder)
    for endings in _KINDS:
        images = [path for path in found if path.suffix.lower() in endings]
        if images:
            _refuse_two_orders(folder, images)
            return images
    raise BadFile(folder, "holds no JPEG and no PNG image")


def uncounted(images: list[Path]) -> str:
    """What a complaint about the number of `images`, as `list_images` found them, has to add: the PNG images that lie
    beside JPEG ones and do not count. Empty where there are none."""
    if images[0].suffix.lower() not in _KINDS[0]:
        return ""
    others = [path.name for path in files_in(images[0].parent) if path.suffix.lower() in _KINDS[1]]
    return f" ({len(others)} PNG images beside the JPEG ones, {others[0]} first, do not count)" if others else ""


def files_in(folder: Path) -> list[Path]:
    """The entries of a folder sorted by name, hidden ones left out.

    Raises:
        BadFile: it is missing, no folder, or not to be read.
    """
    if not folder.is_dir():
        raise BadFile(folder, "is not a folder" if folder.exists() else "the folder is missing")
    try:
        # Sorted as text: paths compare part by part, which takes ten times as long.
        return [folder / name for name in sorted(os.listdir(folder)) if not name.startswith(".")]  # noqa: PTH208
    except OSError as error:
        raise BadFile(folder, f"the folder cannot be read: {error.strerror}") from error


def natural_key(name: str) -> tuple[tuple[bool, float, str], ...]:
    """A sorting key by which `frame_2` comes before `frame_10`."""
    parts = _NUMBER.split(name)
    # split() alternates: text at even places, numbers at odd ones
    return tuple((place % 2 == 0, float(part) if place % 2 else 0.0, part) for place, part in enumerate(parts))


def _refuse_two_orders(folder: Path, images: list[Path]) -> None:
    names = [path.name for path in images]
    if len({name.translate(_ANY_DIGIT) for name in names}) == 1:
        return  # numbers of one length in one place: both orders are the same
    by_number = sorted(names, key=natural_key)
    for as_text, as_number in zip(names, by_number, strict=True):
        if as_text != as_number:
            raise BadFile(
                folder,
                f"its images sort two ways: {as_text} or {as_number} first; poses belong to images by their order, so"
                " pad the numbers in the names with zeros",
            )
