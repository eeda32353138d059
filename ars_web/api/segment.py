"""`POST /api/sessions/{sid}/frames/{index}/segment`: the smart tool, an outline from a rough rectangle or scribbles."""

import time
from typing import Annotated

import numpy as np
from fastapi import APIRouter, Response
from pydantic import BaseModel, Field

from ars_web.api.dependencies import IdempotencyKey, JsonResponse, ServicesDep, StrictRoute
from ars_web.api.mask_models import PolygonAnswer, rounded_polygons_json
from ars_web.api.models import Strict
from ars_web.api.problems import documented
from ars_web.errors import NotFound
from ars_web.geometry.mask_regions import mask_from_polygons, polygons_from_mask
from ars_web.masks.masks_json import Coordinate, Corner, PolygonJson
from ars_web.masks.photographs import photograph
from ars_web.masks.segmenter import WIDEST_STROKE, SegmentPrompt, Stroke
from ars_web.masks.views import camera_of, photographs
from ars_web.sessions.outlines import MOST_RINGS

router = APIRouter(prefix="/api/sessions/{sid}/frames", tags=["masks"], route_class=StrictRoute)

Line = Annotated[list[Corner], Field(min_length=1, max_length=5000)]
Lines = Annotated[list[Line], Field(max_length=100)]

TOLERANCE = 0.5
"""Pixels that an outline is simplified by."""


class SegmentDraft(Strict):
    """Where an object is, roughly; image coordinates. At least one of `rectangle`, `inside` and `start`."""

    rectangle: tuple[Coordinate, Coordinate, Coordinate, Coordinate] | None = Field(
        None, description="x0, y0, x1, y1, all of the object within it"
    )
    inside: Lines = Field(default_factory=list[Line], description="brush strokes on the object")
    outside: Lines = Field(default_factory=list[Line], description="brush strokes beside it")
    brush_width: Annotated[float, Field(strict=True, gt=0.0, le=WIDEST_STROKE, allow_inf_nan=False)] = Field(
        6.0, description="of the strokes, pixels"
    )
    start: Annotated[list[PolygonJson], Field(max_length=MOST_RINGS)] | None = Field(
        None, description="an outline to begin from, such as the last answer"
    )


class SegmentAnswer(BaseModel):
    """An outline that was found."""

    polygons: list[PolygonAnswer]
    seconds: float = Field(description="that it took to find")


@router.post(
    "/{index}/segment", operation_id="frames-segment", response_model=SegmentAnswer, responses=documented(404, 413)
)
def segment(sid: str, index: int, draft: SegmentDraft, services: ServicesDep, key: IdempotencyKey) -> Response:
    """Find an object's outline in a frame's photograph. Nothing is stored."""
    taken = photographs(services.store, sid)
    if not 0 <= index < len(taken.frames):
        raise NotFound(f"session {sid} has no frame {index}; its frames are 0 to {len(taken.frames) - 1}")
    camera = camera_of(taken, index)
    began = time.perf_counter()
    start = None
    if draft.start:
        start = mask_from_polygons([one.polygon for one in draft.start], camera.width, camera.height)
    prompt = SegmentPrompt(
        rectangle=draft.rectangle,
        inside=tuple(Stroke(np.array(line), draft.brush_width) for line in draft.inside),
        outside=tuple(Stroke(np.array(line), draft.brush_width) for line in draft.outside),
        start=start,
    )
    mask = services.segmenter.segment(photograph(taken, index), prompt)
    polygons = polygons_from_mask(mask, tolerance=TOLERANCE)
    seconds = round(time.perf_counter() - began, 3)
    return JsonResponse({"polygons": rounded_polygons_json(polygons), "seconds": seconds})
