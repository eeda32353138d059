"""JSON from files that people wrote: what is wrong with them is said by file, line and place."""

import json
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ars_web.errors import BadFile, BadInput


def strict_json(data: bytes, path: Path | str) -> Any:
    """The JSON in `data`, read from `path`; text in UTF-8, with or without a byte order mark.

    Raises:
        BadFile: it is no text, no JSON, too deeply nested, or names something twice in one object.
    """
    try:
        # Not orjson: of a name given twice in one object it would silently take one.
        return json.loads(data.decode("utf-8-sig"), object_pairs_hook=_without_repeats)
    except UnicodeDecodeError as error:
        raise BadFile(path, f"is not text in UTF-8 (byte {error.start})") from error
    except json.JSONDecodeError as error:
        raise BadFile(path, f"is not JSON: {error.msg}", line=error.lineno) from error
    except BadInput as error:
        raise BadFile(path, str(error)) from error
    except RecursionError as error:
        raise BadFile(path, "is nested too deeply") from error


def first_fault(error: ValidationError) -> tuple[list[int | str], str]:
    """Where in the JSON the first fault is, and what it is, with what was given and how many more there are."""
    faults = error.errors(include_url=False)
    fault = faults[0]
    more = f" (and {len(faults) - 1} more faults)" if len(faults) > 1 else ""
    message = fault["msg"].removeprefix("Value error, ")
    given = "" if fault["type"] == "missing" else f", not {str(fault['input'])[:60]}"
    return list(fault["loc"]), f"{message}{given}{more}"


def place_text(parts: list[int | str]) -> str:
    """A place in JSON as `.size[1]`."""
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in parts)


def _without_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) != len(pairs):
        twice = next(key for key, _ in pairs if sum(key == other for other, _ in pairs) > 1)
        raise BadInput(f"{twice!r} is given twice in one object")
    return found
