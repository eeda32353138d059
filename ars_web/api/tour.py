"""`/api/sessions/{sid}/coverage/tour`: where to look next, to fill what no frame has seen of objects."""

from pathlib import Path
from typing import Annotated, Literal

from fastapi import APIRouter, Response
from pydantic import Field

from ars_web.api.dependencies import IdempotencyKey, JsonResponse, ServicesDep, StrictRoute
from ars_web.api.models import Number, Strict
from ars_web.api.problems import documented
from ars_web.datasets.coverage import chosen_boxes
from ars_web.errors import BadInput
from ars_web.geometry.sphere_bins import MOST_BINS, SphereBins
from ars_web.sessions.boxes_json import Id
from ars_web.studies.recorded_wrist import recorded_wrist
from ars_web.studies.tour import MOST_VIEWS, TourRequest, plan_tour
from ars_web.studies.tour_json import TourJson, tour_json

router = APIRouter(prefix="/api/sessions/{sid}/coverage/tour", tags=["coverage"], route_class=StrictRoute)

Limits = Annotated[tuple[Number, Number] | None, Field(description="least and most; absent: as the frames have it")]
Bins = Annotated[int, Field(strict=True, ge=1, le=MOST_BINS)]


class TourDraft(Strict):
    """Which views are wanted."""

    box_ids: list[Id] | None = Field(None, min_length=1, max_length=10_000, description="absent: all objects")
    class_id: Id | None = Field(None, description="the objects of a class")
    count: int = Field(20, strict=True, ge=1, le=MOST_VIEWS, description="views at most")
    distance: Limits = Field(None, description="metres to the object looked at; absent: as the frames have it")
    height: Limits = Field(None, description="z of the camera in the world, metres; absent: as the frames have it")
    tilt: Limits = Field(None, description="of the camera's axis below the horizontal, radians; absent: likewise")
    min_visible: Annotated[Number, Field(ge=0.0, le=1.0)] | None = Field(
        None,
        description="share of an object that is seen, in frames that count and in views proposed; absent: frames count"
        " as in the coverage without it, and views show at least half",
    )
    shape: Literal["box", "hull", "mesh"] | None = None
    azimuth_bins: Bins = 36
    polar_bins: Bins = 18
    start_frame: Id | None = Field(None, description="frame at which the tour begins; absent: the last")


@router.post("", operation_id="tour-plan", response_model=TourJson, responses=documented(404, 413))
def plan(sid: str, draft: TourDraft, services: ServicesDep, key: IdempotencyKey) -> Response:
    """Views that fill the empty cells of objects' coverage, as a short tour. Nothing is stored."""
    request = TourRequest(
        bins=SphereBins(draft.azimuth_bins, draft.polar_bins),
        count=draft.count,
        distance=draft.distance,
        height=draft.height,
        tilt=draft.tilt,
        min_visible=draft.min_visible,
        shape=draft.shape,
        start_frame=draft.start_frame,
    )
    snapshot = services.store.snapshot(sid)
    if draft.box_ids is not None and draft.class_id is not None:
        raise BadInput("give box_ids or class_id, not both: a box is of one class")
    if draft.box_ids is None:
        rows = chosen_boxes(snapshot, class_id=draft.class_id)
    else:
        rows = sorted({chosen_boxes(snapshot, box_id=box_id)[0] for box_id in draft.box_ids})
    found = plan_tour(snapshot, services.views.find(snapshot, request.options), rows, request)
    summary = services.store.summary(sid)
    wrist = recorded_wrist(summary.format, Path(summary.source))
    return JsonResponse(tour_json(found, T_wrist_camera=wrist.T_wrist_camera).model_dump(mode="json"))
