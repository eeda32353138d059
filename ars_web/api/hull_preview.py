"""`POST /api/sessions/{sid}/hull-preview`: what outlines give, for while they are being drawn."""

import math
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Response
from pydantic import BaseModel, Field

from ars_web.api.dependencies import IdempotencyKey, JsonResponse, ServicesDep, StrictRoute
from ars_web.api.mask_models import PolygonAnswer, Triple, rounded_polygons_json
from ars_web.api.models import Strict, TransformAnswer
from ars_web.api.problems import ViewMisfit, documented, misfits_json
from ars_web.errors import BadInput, ViewsDisagree
from ars_web.geometry.next_view import SuggestedView
from ars_web.masks.hull_preview import HullPreview, preview_hull
from ars_web.masks.masks_json import Height, ViewJson, Widening, outlines_of
from ars_web.masks.views import photographs, views_of
from ars_web.sessions.boxes_json import Id, transform_json
from ars_web.sessions.model import HullOptions, Orientation

router = APIRouter(prefix="/api/sessions/{sid}", tags=["masks"], route_class=StrictRoute)

MOST_VIEWS, MOST_SHOWN = 32, 16

DECIMALS = 2
"""Of a pixel, in overlays."""


class HullPreviewDraft(Strict):
    """Outlines, and the frames to see in what they say."""

    views: Annotated[list[ViewJson], Field(min_length=1, max_length=MOST_VIEWS)]
    widen_px: Widening = 0.0
    ground: Height | None = None
    orientation: Orientation = "world"
    show_in: Annotated[list[Id], Field(max_length=MOST_SHOWN)] = Field(default_factory=list[int])


class PreviewedBoxJson(BaseModel):
    """A box that is not stored."""

    T_world_box: TransformAnswer
    size: Triple = Field(description="metres along the box's own axes")


class PreviewedHullJson(BaseModel):
    """A hull that is not stored."""

    volume: float = Field(description="cubic metres")
    size: Triple = Field(description="of its box, metres along the box's own axes")
    centre_of_mass: Triple = Field(description="in the world, metres")
    box: PreviewedBoxJson


class OverlayJson(BaseModel):
    """Where something of the object is in a frame, to an image's size beyond its border."""

    frame: int
    polygons: list[PolygonAnswer] = Field(description="to a hundredth of a pixel")
    kind: Literal["band", "hull"] = Field(
        description="band: where the object must lie by the outlines in all other frames; hull: where the hull of all"
        " of them is seen"
    )


class PreviewProblemJson(BaseModel):
    """Why outlines in two frames or more give no hull."""

    detail: str
    views: list[ViewMisfit] = Field(description="those that disagree, the worst first; none: it is something else")


class NextViewJson(BaseModel):
    """The frame in which to draw the object next."""

    frame: int
    degrees: float | None = Field(description="to the nearest side from which it is drawn already; null: it is not")
    reason: str


class HullPreviewAnswer(BaseModel):
    """What outlines give."""

    hull: PreviewedHullJson | None = Field(description="null: of one view, or where `problem` says why")
    angle_degrees: float | None = Field(description="between the two views that are farthest apart; null: no hull")
    overlays: list[OverlayJson]
    problem: PreviewProblemJson | None
    next_view: NextViewJson | None = Field(description="null: no frame would add to it, or the views disagree")
    warnings: list[str] = Field(description="what is uncertain, and what to do about it, for the user")


@router.post(
    "/hull-preview",
    operation_id="hull-preview",
    response_model=HullPreviewAnswer,
    responses=documented(404, 413),
)
def hull_preview(sid: str, draft: HullPreviewDraft, services: ServicesDep, key: IdempotencyKey) -> Response:
    """The hull that outlines in one frame or more give, and where that puts the object in other frames. Nothing is
    stored or changed."""
    taken = photographs(services.store, sid)
    views = views_of(taken, outlines_of(taken, draft.views))
    options = HullOptions(draft.orientation, widen=draft.widen_px, ground=draft.ground)
    return JsonResponse(_json(preview_hull(taken, views, options, show_in=draft.show_in)))


def _json(preview: HullPreview) -> dict[str, Any]:
    hull: dict[str, Any] | None = None
    if preview.hull is not None and preview.box is not None:
        size = preview.box.size.tolist()
        hull = {
            "volume": preview.hull.volume,
            "size": size,
            "centre_of_mass": preview.hull.centre_of_mass.tolist(),
            "box": {"T_world_box": transform_json(preview.box.T_world_box), "size": size},
        }
    problem = preview.problem
    return {
        "hull": hull,
        "angle_degrees": None if preview.angle is None else math.degrees(preview.angle),
        "overlays": [
            {"frame": one.frame, "polygons": rounded_polygons_json(one.polygons, decimals=DECIMALS), "kind": one.kind}
            for one in preview.overlays
        ],
        "problem": None if problem is None else {"detail": str(problem), "views": _misfits(problem)},
        "next_view": None if preview.next_view is None else next_view_json(preview.next_view),
        "warnings": list(preview.warnings),
    }


def _misfits(problem: BadInput) -> list[dict[str, Any]]:
    return misfits_json(problem) if isinstance(problem, ViewsDisagree) else []


def next_view_json(found: SuggestedView) -> dict[str, Any]:
    """A suggested frame as NextViewJson."""
    if math.isnan(found.angle):
        return {"frame": found.frame, "degrees": None, "reason": f"frame {found.frame} is a good one to begin with"}
    degrees = math.degrees(found.angle)
    return {
        "frame": found.frame,
        "degrees": degrees,
        "reason": f"frame {found.frame} sees it from {degrees:.0f} degrees beside what is drawn, and narrows it most",
    }
