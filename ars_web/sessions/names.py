"""What names of sessions, classes, boxes, authors and images may be."""

import re
import unicodedata
from collections.abc import Iterable
from pathlib import PurePosixPath

from ars_web.errors import BadInput, RefusedPath

LONGEST_NAME = 100
"""Characters."""

LONGEST_KEY = 255


def checked_name(name: str, *, what: str) -> str:
    """`name` without blanks around it; `what` says whose name it is, such as `a class`.

    Raises:
        BadInput: nothing is left, it is longer than LONGEST_NAME, or it holds a control character or half a
            surrogate pair, which no file could hold.
    """
    name = name.strip()
    if not name:
        raise BadInput(f"{what} needs a name that is not empty")
    if len(name) > LONGEST_NAME:
        raise BadInput(f"{what}'s name has at most {LONGEST_NAME} characters, not {len(name)}: {name[:40]!r}…")
    if _unprintable(name):
        raise BadInput(f"{what}'s name cannot hold a control character: {name!r}")
    return name


def checked_key(key: str) -> str:
    """An idempotency key.

    Raises:
        BadInput: it is empty, longer than LONGEST_KEY characters, or holds a control character.
    """
    if not key or len(key) > LONGEST_KEY or _unprintable(key):
        raise BadInput(f"an idempotency key has 1 to {LONGEST_KEY} printable characters, not {key[:40]!r}")
    return key


class FreshNames:
    """Gives names that are not taken, for any number of things without looking at all of them each time."""

    def __init__(self, taken: Iterable[str]) -> None:
        self._taken = set(taken)
        self._next: dict[str, int] = {}

    def take(self, name: str) -> None:
        """Have `name` be taken from now on."""
        self._taken.add(name)

    def give_copy(self, name: str) -> str:
        """A name for a copy of what is called `name`: `cube 2` of `cube`, `cube 3` of `cube 2`; taken from now on."""
        numbered = re.fullmatch(r"(.*\S) ([1-9][0-9]{0,8})", name)
        base, number = (numbered[1], int(numbered[2])) if numbered else (name, 1)
        while True:
            number += 1
            copy = f"{base[: LONGEST_NAME - len(f' {number}')]} {number}"
            if copy not in self._taken:
                self._taken.add(copy)
                return copy

    def give(self, base: str) -> str:
        """`base`, or `base 2`, `base 3`, … where it is taken, never longer than LONGEST_NAME; taken from now on."""
        number, name = self._next.get(base, 2), base
        while name in self._taken:
            name = f"{base[: LONGEST_NAME - len(f' {number}')]} {number}"
            number += 1
        self._next[base] = number
        self._taken.add(name)
        return name


def checked_image_name(name: str) -> str:
    """`name`, which must be a path relative to an image folder, with `/`, that stays in it.

    Raises:
        RefusedPath: it is absolute, has an empty part, `.` or `..`, or a character no file name should hold.
    """
    parts = name.split("/")
    if any(part in ("", ".", "..") for part in parts) or _unprintable(name) or PurePosixPath(name).is_absolute():
        raise RefusedPath(f"{name!r} cannot name an image: a relative path such as images/0001.jpg is needed")
    return name


def _unprintable(text: str) -> bool:
    return any(unicodedata.category(character) in ("Cc", "Cs", "Zl", "Zp") for character in text)
