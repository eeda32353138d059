"""`/api/sessions/{sid}/frames/{index}/marks` and `exports/picture`: labels as each kind and format of them is drawn."""

from typing import Annotated, Any, Literal

from fastapi import APIRouter, Query, Response
from pydantic import BaseModel, Field

from ars_web.api.dependencies import JsonResponse, ServicesDep, StrictRoute
from ars_web.api.problems import documented
from ars_web.datasets.format_picture import format_picture
from ars_web.datasets.frame_marks import FrameMark, frame_marks
from ars_web.datasets.label_functions import LABEL_FUNCTIONS
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.registry import WRITERS

router = APIRouter(prefix="/api/sessions/{sid}", tags=["frames"], route_class=StrictRoute)

DECIMALS = 2
"""Of a pixel; more would be three quarters of the answer."""

STATES = ("unseen", "hidden", "seen")

Shape = Annotated[
    Literal["box", "hull", "mesh"] | None, Query(description="default: the hull where a box has one, else the box")
]


class MarkedPointJson(BaseModel):
    """A named point of an object."""

    name: str
    at: tuple[float, float] | None = Field(description="null: behind the camera, or beyond what the lens can show")
    state: Literal["unseen", "hidden", "seen"] = Field(description="unseen: not in the image")


class MarkJson(BaseModel):
    """What a label function draws of one object in one frame; image coordinates, to a hundredth of a pixel."""

    box_id: int
    class_id: int
    rings: list[list[tuple[float, float]]] = Field(description="not closed; empty: no part is in the image")
    points: list[MarkedPointJson]


@router.get(
    "/frames/{index}/marks",
    operation_id="frame-marks-list",
    response_model=list[MarkJson],
    responses=documented(404),
)
def marks(
    sid: str,
    index: int,
    services: ServicesDep,
    function: Annotated[str, Query(json_schema_extra={"enum": list(LABEL_FUNCTIONS)})],
    shape: Shape = None,
) -> Response:
    """Every box of the session as a label function draws it in a frame, as exports that use it write it."""
    found = frame_marks(services.store.snapshot(sid), index, function=function, shape=shape)
    return JsonResponse([_json(mark) for mark in found])


@router.get(
    "/exports/picture",
    operation_id="exports-picture",
    response_class=Response,
    responses={
        200: {"description": "a JPEG of one labelled frame", "content": {"image/jpeg": {}}},
        **documented(404, 413),
    },
)
def picture(
    sid: str,
    services: ServicesDep,
    format: Annotated[str, Query(json_schema_extra={"enum": list(WRITERS)})],  # noqa: A002 - the contract's name
    frame: Annotated[int | None, Query(ge=0, lt=2**53, description="default: one with many labels")] = None,
    shape: Shape = None,
    min_visible: Annotated[float, Query(ge=0.0, le=1.0)] = 0.0,
    max_truncated: Annotated[float, Query(ge=0.0, le=1.0)] = 1.0,
) -> Response:
    """One frame with the labels that an export would write, drawn as the format holds them."""
    options = ExportOptions.model_validate({"shape": shape, "min_visible": min_visible, "max_truncated": max_truncated})
    drawn = format_picture(services.store.snapshot(sid), format=format, options=options, index=frame)
    return Response(drawn, media_type="image/jpeg", headers={"Cache-Control": "private, no-cache"})


def _json(mark: FrameMark) -> dict[str, Any]:
    return {
        "box_id": mark.box_id,
        "class_id": mark.class_id,
        "rings": [ring.round(DECIMALS).tolist() for ring in mark.rings],
        "points": [
            {
                "name": point.name,
                "at": None if point.at is None else [round(side, DECIMALS) for side in point.at],
                "state": STATES[point.state],
            }
            for point in mark.points
        ],
    }
