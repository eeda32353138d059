"""COCO results: a JSON list of {image_id, category_id, bbox: [x, y, width, height], score}.

Ids are those of the truth where it is COCO. Where it is not, image_id is a file name, a stem, or the number that the
stem is, and category_id a class's name or its number from 0.
"""

import json
import math
from pathlib import Path

from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError

from ars_web.errors import BadFile, BadInput
from ars_web.evaluation.predictions_read import PredictionsRead
from ars_web.recordings.json_file import line_said
from ars_web.recordings.number_rows import file_bytes


class _Result(BaseModel):
    model_config = ConfigDict(extra="ignore", frozen=True)

    image_id: int | str
    category_id: int | str
    bbox: tuple[float, float, float, float]
    score: float


_RESULTS = TypeAdapter(list[_Result])

_BETWEEN = frozenset(" \t\r\n,")


def is_one(path: Path) -> bool:
    """Whether a file begins as a JSON list."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return file.read(1 << 12).removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"[")


def read(path: Path, into: PredictionsRead) -> None:
    """Read them.

    Raises:
        BadFile: it is no such list, or a result of it cannot be; the message names the result, and its line.
    """
    data = file_bytes(path)
    try:
        results = _RESULTS.validate_json(data)
    except ValidationError as error:
        raise _bad(path, data, error) from error
    try:
        if results:
            into.refuse_without_pixels()
    except BadInput as error:
        raise BadFile(path, str(error)) from error
    if into.truth.category_ids is None and not into.class_names and any(type(r.category_id) is int for r in results):
        # COCO's own ids begin at 1, these numbers at 0: a shift would go unnoticed but for the last class.
        into.warnings.append(
            f"{path}: the truth is not COCO, so category_id is taken as a class's number ({into.numbered_classes});"
            " where it means others, say --classes"
        )
    for row, one in enumerate(results):
        x, y, width, height = one.bbox
        key = "bbox"
        try:
            if width < 0 or height < 0 or math.isnan(width + height):
                raise BadInput(f"bbox is x, y, width and height, the last two not negative, not {list(one.bbox)}")
            key = "image_id"
            image = into.image_of_id(one.image_id)
            key = "category_id"
            class_ = into.class_of_category(one.category_id)
            key = "bbox" if 0 <= one.score <= 1 else "score"
            into.add(image, class_, (x, y, x + width, y + height), one.score)
        except BadInput as error:
            raise BadFile(path, f"result {row}: {error}", line=_line(data, row, key)) from error


def _bad(path: Path, data: bytes, error: ValidationError) -> BadFile:
    first = error.errors(include_url=False, include_input=False)[0]
    if first["type"] == "json_invalid":
        return BadFile(path, f"is no JSON: {first['msg']}", line=line_said(first["msg"]))
    place = first["loc"]
    if not place or not isinstance(place[0], int):
        return BadFile(path, "COCO results are a JSON list of {image_id, category_id, bbox, score}")
    row, what = place[0], ".".join(str(part) for part in place[1:2])
    is_missing = first["type"] == "missing" and len(place) == 2
    said = f"has no {what}" if is_missing else f"{what}: {first['msg']}" if what else first["msg"]
    needs = "a result needs image_id, category_id, bbox (x, y, width, height) and score"
    if is_missing and what == "bbox":
        needs += "; of a mask, the rectangle round it"
    return BadFile(path, f"result {row} {said}; {needs}", line=_line(data, row, what))


def _line(data: bytes, row: int, key: str) -> int | None:
    """The line, from 1, of a key of a result, or on which the result begins; None where the list is not to be read."""
    text = data.decode(errors="replace")
    decoder, start, end = json.JSONDecoder(), 0, text.find("[") + 1
    try:
        for _ in range(row + 1):
            while text[end : end + 1] in _BETWEEN:
                end += 1
            start = end
            _, end = decoder.raw_decode(text, start)
    except (ValueError, RecursionError):
        return None
    found = text.find(f'"{key}"', start, end) if key else -1
    return text.count("\n", 0, max(found, start)) + 1
