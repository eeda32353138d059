"""The classes of a YOLO set by their numbers: data.yaml, or a list of names, one a line."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import yaml

from ars_web.annotations.yolo_rows import YoloRow
from ars_web.errors import BadFile
from ars_web.recordings.number_rows import file_bytes

_YAML = (".yaml", ".yml")
_LARGEST_YAML = 1 << 18
_SHOWN = 8


@dataclass(frozen=True)
class YoloNames:
    """What a file of names says.

    Attributes:
        names: by class number; numbers may be left out.
        keypoints: numbers that follow a rectangle; 0: rows have no keypoints.
        values: all of a data.yaml: texts, lists and mappings.
    """

    file: Path
    names: Mapping[int, str]
    keypoints: int
    values: Mapping[str, object]

    def name_of(self, path: Path, row: YoloRow) -> str:
        """The class of a row; BadFile where there is none of its number."""
        if row.number not in self.names:
            pairs = [f"{number}: {name}" for number, name in sorted(self.names.items())]
            known = ", ".join(pairs[:_SHOWN]) + (", …" if len(pairs) > _SHOWN else "")
            raise BadFile(
                path, f"class {row.number} is none of {self.file.name}'s ({known or 'which has none'})", line=row.line
            )
        return self.names[row.number]


def read_names(file: Path) -> YoloNames:
    """Read a data.yaml, or a list of names.

    Raises:
        BadFile: it is damaged, or names no class; the message names the line where there is one.
    """
    if file.suffix.lower() not in _YAML:
        return YoloNames(file, dict(enumerate(_lines(file))), 0, {})
    values = _mapping(file)
    return YoloNames(file, _names(file, values.get("names")), _keypoints(file, values.get("kpt_shape")), values)


def _lines(file: Path) -> list[str]:
    try:
        lines = file_bytes(file).decode().splitlines()
    except UnicodeDecodeError as error:
        raise BadFile(file, "is not UTF-8; save it as UTF-8") from error
    while lines and not lines[-1].strip():
        lines.pop()
    names = [line.strip() for line in lines]
    if "" in names:
        said = "a class without a name; a line is a class, and none may be empty"
        raise BadFile(file, said, line=names.index("") + 1)
    return names


def _mapping(file: Path) -> dict[str, object]:
    data = file_bytes(file)
    if len(data) > _LARGEST_YAML:
        raise BadFile(file, f"is over {_LARGEST_YAML >> 10} KiB, which names of classes do not take")
    try:
        # BaseLoader makes texts, lists and mappings, nothing else: a class may be called `no` or `1`.
        content = cast("object", yaml.load(data, Loader=yaml.BaseLoader))
    except RecursionError as error:
        raise BadFile(file, "is nested too deeply for names of classes") from error
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        # What is never closed is told behind the last line.
        line = None if mark is None else min(int(mark.line) + 1, len(data.splitlines()))
        raise BadFile(file, f"is no YAML: {getattr(error, 'problem', None) or error}", line=line) from error
    if not isinstance(content, dict):
        raise BadFile(file, "is no mapping; it needs names, train and val")
    return cast("dict[str, object]", content)


def _names(file: Path, given: object) -> dict[int, str]:
    if isinstance(given, list):
        pairs = [(str(place), name) for place, name in enumerate(cast("list[object]", given))]
    elif isinstance(given, dict):
        pairs = [(str(key), name) for key, name in cast("dict[object, object]", given).items()]
    else:
        raise BadFile(file, "has no names; give the classes as a list, or by their numbers")
    names: dict[int, str] = {}
    for key, name in pairs:
        if not (key.isascii() and key.isdecimal()) or not isinstance(name, str) or not name.strip():
            raise BadFile(file, f"names: {key[:40]!r}: {str(name)[:40]!r} is no class; they are NUMBER: NAME")
        names[int(key)] = name.strip()
    if not names:
        raise BadFile(file, "names no class")
    return names


def _keypoints(file: Path, given: object) -> int:
    if given is None:
        return 0
    texts = cast("list[object]", given) if isinstance(given, list) else []
    counts = [int(text) for text in texts if isinstance(text, str) and text.isascii() and text.isdecimal()]
    if len(texts) != 2 or len(counts) != 2:
        raise BadFile(file, f"kpt_shape must be [points, 2 or 3], not {str(given)[:40]}")
    return counts[0] * counts[1]
