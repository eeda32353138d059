"""`POST /api/sessions/{sid}/polygons/combine`: what brushes, erasers, lassos and holes make of an outline."""

from typing import Annotated, Literal, Self

import numpy as np
import shapely
from fastapi import APIRouter, Response
from pydantic import Field, model_validator

from ars_web.api.dependencies import IdempotencyKey, JsonResponse, ServicesDep, StrictRoute
from ars_web.api.mask_models import PolygonsAnswer, rounded_polygons_json
from ars_web.api.models import Strict
from ars_web.api.problems import documented
from ars_web.geometry.mask_regions import combined, polygons_of, region, stroke
from ars_web.masks.masks_json import Corner, PolygonJson
from ars_web.masks.views import camera_of, photographs
from ars_web.sessions.boxes_json import Id
from ars_web.sessions.outlines import MOST_RINGS

router = APIRouter(prefix="/api/sessions/{sid}/polygons", tags=["masks"], route_class=StrictRoute)

FINE = 0.05
"""Pixels that an outline may be simplified by after each change; a brush leaves many corners close together."""


class StrokeJson(Strict):
    """The way of a round brush."""

    points: Annotated[list[Corner], Field(min_length=1, max_length=5000)] = Field(description="one: a dab")
    width: Annotated[float, Field(strict=True, gt=0.0, le=1000.0, allow_inf_nan=False)] = Field(description="pixels")


class CombineDraft(Strict):
    """An outline, and a shape to add to it or to take off it."""

    polygons: Annotated[list[PolygonJson], Field(max_length=MOST_RINGS)] = Field(description="empty: nothing yet")
    operation: Literal["add", "subtract"]
    polygon: PolygonJson | None = Field(None, description="the shape; may cross itself")
    stroke: StrokeJson | None = Field(None, description="or what a brush covers")
    frame: Id = Field(description="whose image the outline is in; it ends at that image's border")

    @model_validator(mode="after")
    def _has_one_shape(self) -> Self:
        if (self.polygon is None) == (self.stroke is None):
            raise ValueError("give either polygon or stroke")
        return self


@router.post("/combine", operation_id="polygons-combine", response_model=PolygonsAnswer, responses=documented(404, 413))
def combine(sid: str, draft: CombineDraft, services: ServicesDep, key: IdempotencyKey) -> Response:
    """An outline with a shape added to it or taken off it, within its image. Nothing is stored or changed."""
    camera = camera_of(photographs(services.store, sid), draft.frame)
    if draft.stroke is not None:
        shape = stroke(np.array(draft.stroke.points), draft.stroke.width)
    else:
        assert draft.polygon is not None
        shape = (draft.polygon.polygon,)
    made = region(combined([one.polygon for one in draft.polygons], shape, draft.operation))
    within = made.intersection(shapely.box(0, 0, camera.width, camera.height))
    return JsonResponse({"polygons": rounded_polygons_json(polygons_of(within, tolerance=FINE))})
