"""Text files of numbers: one row a line, with `#` comments, blank lines, commas, CRLF and a UTF-8 mark allowed."""

from dataclasses import dataclass
from itertools import chain
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from ars_web.errors import BadFile

_WIDE_MARKS = (b"\xff\xfe", b"\xfe\xff")
_UTF8_MARK = b"\xef\xbb\xbf"


@dataclass(frozen=True, eq=False)
class NumberRows:
    """The numbers of one file.

    Attributes:
        path: the file.
        values: (n, c); may hold NaN or infinities where the file spells them.
        lines: (n,) the line of each row in the file, from 1.
    """

    path: Path
    values: Float[np.ndarray, "n c"]
    lines: Int[np.ndarray, " n"]

    def where(self, row: int) -> str:
        """`FILE:LINE` of a row."""
        return f"{self.path}:{self.lines[row]}"


def file_bytes(path: Path) -> bytes:
    """The bytes of a text file without its UTF-8 mark.

    Raises:
        BadFile: it is missing, no file, not to be read, or UTF-16.
    """
    if not path.is_file():
        raise BadFile(path, "is a folder, a file is expected" if path.is_dir() else "is missing")
    try:
        data = path.read_bytes()
    except OSError as error:
        raise BadFile(path, f"cannot be read: {error.strerror}") from error
    if data.startswith(_WIDE_MARKS):
        raise BadFile(path, "is UTF-16; save it as UTF-8")
    return data.removeprefix(_UTF8_MARK)


def first_row(path: Path) -> list[bytes]:
    """The words of the first line that is no comment; none where the file cannot be read or holds no such line.

    Reads the head of the file only: it is for finding out what a file is.
    """
    if not path.is_file():
        return []
    try:
        with path.open("rb") as file:
            head = file.read(1 << 16)
    except OSError:
        return []
    for line in head.removeprefix(_UTF8_MARK).replace(b",", b" ").splitlines():
        words = line.split(b"#", 1)[0].split()
        if words:
            return words
    return []


def count_numbers(path: Path) -> int:
    """How many numbers the first row of a file has; 0 where it holds anything else."""
    words = first_row(path)
    return len(words) if all(_is_number(word) for word in words) else 0


def _is_number(word: bytes) -> bool:
    if b"_" in word:
        return False  # Python reads 1_000, and no recording means it
    try:
        float(word)
    except ValueError:
        return False
    return True


def read_rows(path: Path, *, columns: dict[int, str]) -> NumberRows:
    """All rows of a file, which have one width throughout.

    Args:
        columns: the widths that are allowed, each with the names of its columns for the message.

    Raises:
        BadFile: the file cannot be read, holds no row, or a line has another width or a word that is no number.
    """
    data = file_bytes(path)
    lines = data.replace(b",", b" ").splitlines()
    if b"#" in data:
        lines = [line.split(b"#", 1)[0] for line in lines]
    words = [line.split() for line in lines]
    numbers = [number for number, row in enumerate(words, 1) if row]
    rows = [row for row in words if row]
    if not rows:
        raise BadFile(path, f"holds no line of numbers; each line has {_either(columns)}")
    width = len(rows[0])
    if width not in columns or any(len(row) != width for row in rows):
        bad = next(i for i, row in enumerate(rows) if len(row) not in columns or len(row) != width)
        expected = _either({width: columns[width]} if width in columns else columns)
        raise BadFile(path, f"has {len(rows[bad])} values; a line has {expected}", line=numbers[bad])
    try:
        flat = None if b"_" in data else list(map(float, chain.from_iterable(rows)))
    except ValueError:
        flat = None
    if flat is None:
        bad = next((i for i, row in enumerate(rows) if not all(map(_is_number, row))), None)
        if bad is None:  # an underscore in a comment
            flat = list(map(float, chain.from_iterable(rows)))
        else:
            word = next(word for word in rows[bad] if not _is_number(word))
            raise BadFile(path, f"{_shown(word)} is not a number", line=numbers[bad])
    return NumberRows(path, np.array(flat).reshape(-1, width), np.array(numbers))


def _either(columns: dict[int, str]) -> str:
    return " or ".join(f"{count} numbers ({names})" for count, names in columns.items())


def _shown(word: bytes) -> str:
    text = word.decode("utf-8", "replace")
    return repr(text if len(text) <= 40 else text[:37] + "...")
