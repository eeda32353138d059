"""COCO results: a JSON list of {image_id, category_id, bbox: [x, y, width, height], score}.

Ids are those of the truth where it is COCO. Where it is not, image_id is a file name, a stem, or the number that the
stem is, and category_id a class's name or its number from 0.
"""

import math
from pathlib import Path

from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError

from ars_web.errors import BadFile, BadInput
from ars_web.evaluation.predictions_read import PredictionsRead
from ars_web.recordings.json_file import line_of
from ars_web.recordings.number_rows import file_bytes


class _Result(BaseModel):
    model_config = ConfigDict(extra="ignore", frozen=True)

    image_id: int | str
    category_id: int | str
    bbox: tuple[float, float, float, float]
    score: float


_RESULTS = TypeAdapter(list[_Result])


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
        try:
            if width < 0 or height < 0 or math.isnan(width + height):
                raise BadInput(f"bbox is x, y, width and height, the last two not negative, not {list(one.bbox)}")
            image, class_ = into.image_of_id(one.image_id), into.class_of_category(one.category_id)
            into.add(image, class_, (x, y, x + width, y + height), one.score)
        except BadInput as error:
            lines = line_of(data, b'"image_id"', count=len(results))
            raise BadFile(path, f"result {row}: {error}", line=lines[row] if lines else None) from error


def _bad(path: Path, data: bytes, error: ValidationError) -> BadFile:
    first = error.errors(include_url=False, include_input=False)[0]
    if first["type"] == "json_invalid":
        return BadFile(path, f"is no JSON: {first['msg']}")
    place = first["loc"]
    if not place or not isinstance(place[0], int):
        return BadFile(path, "COCO results are a JSON list of {image_id, category_id, bbox, score}")
    row, what = place[0], ".".join(str(part) for part in place[1:2])
    is_missing = first["type"] == "missing" and len(place) == 2
    said = f"has no {what}" if is_missing else f"{what}: {first['msg']}" if what else first["msg"]
    # Results are found by what each begins with; where one lacks it, its line is not known.
    lines = line_of(data, b'"bbox"', count=data.count(b'"bbox"')) or []
    known = len(lines) > row and what != "bbox"
    needs = "a result needs image_id, category_id, bbox (x, y, width, height) and score"
    return BadFile(path, f"result {row} {said}; {needs}", line=lines[row] if known else None)
