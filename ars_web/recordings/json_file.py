"""JSON files as pydantic models, with errors that say file, line and place."""

import re
from itertools import accumulate
from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from ars_web.errors import BadFile
from ars_web.recordings.number_rows import file_bytes

Model = TypeVar("Model", bound=BaseModel)

_PLACE = re.compile(r"line (\d+) column \d+")


def parse_json(path: Path, data: bytes, model: type[Model]) -> Model:
    """`data`, read from `path`, as `model`. NaN and Infinity are let through, as Python's own writer makes them.

    Raises:
        BadFile: it is no JSON, or not of the model's shape; the first thing that is wrong is named.
    """
    try:
        return model.model_validate_json(data)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        message = first["msg"]
        if first["type"] == "json_invalid":
            raise BadFile(path, message, line=line_said(message)) from error
        place = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in first["loc"]).lstrip(".")
        raise BadFile(path, f"{place}: {message}") from error


def line_said(message: str) -> int | None:
    """The line that pydantic's message about broken JSON names; None where it names none."""
    found = _PLACE.search(message)
    return int(found[1]) if found else None


def holds_words(path: Path, words: tuple[bytes, ...]) -> bool:
    """Whether the file at `path` begins as a JSON object and holds all the words; False where it cannot be read."""
    if not path.is_file():
        return False
    try:
        with path.open("rb") as file:
            if not file.read(1 << 12).removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"{"):
                return False
        data = file_bytes(path)
    except (OSError, BadFile):
        return False
    return all(word in data for word in words)


def line_of(data: bytes, word: bytes, *, count: int) -> list[int] | None:
    """The line of each occurrence of `word`, from 1; None unless it occurs `count` times, once a record."""
    pieces = data.split(word)
    if len(pieces) != count + 1:
        return None
    return [newlines + 1 for newlines in accumulate(piece.count(b"\n") for piece in pieces[:-1])]
