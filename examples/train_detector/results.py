"""What a detector found, as COCO's results."""

from collections.abc import Sequence
from pathlib import Path

import orjson
from pydantic import BaseModel


class Result(BaseModel):
    """One of COCO's results; `bbox` is x, y, width, height in the image as it lies in the set."""

    image_id: int | str
    category_id: int | str
    bbox: tuple[float, float, float, float]
    score: float


def write_results(results: Sequence[Result], file: Path) -> None:
    """Write them as COCO's JSON list."""
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(b"[" + b",\n".join(orjson.dumps(result.model_dump()) for result in results) + b"]\n")
