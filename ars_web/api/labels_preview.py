"""`POST /api/sessions/{sid}/labels`: how boxes that are not stored would look, for while one is dragged."""

from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Response
from pydantic import BaseModel, Field

from ars_web.api.dependencies import IdempotencyKey, JsonResponse, ServicesDep, StrictRoute
from ars_web.api.models import Bounds, Strict
from ars_web.api.problems import documented
from ars_web.datasets.samples import PreviewLabel, preview_labels
from ars_web.geometry.box import Box
from ars_web.sessions.boxes_json import Id, Size, TransformJson

router = APIRouter(prefix="/api/sessions/{sid}", tags=["frames"], route_class=StrictRoute)

MOST_BOXES, MOST_FRAMES = 50, 300

DECIMALS = 2
"""Of a pixel; more would be three quarters of the answer."""


class PreviewBoxJson(Strict):
    """A box as it would be."""

    T_world_box: TransformJson = Field(description="the box's centre and axes in the world")
    size: Size = Field(description="metres along the box's own axes")


class LabelsPreviewDraft(Strict):
    """Boxes, and the frames to see them in."""

    boxes: Annotated[list[PreviewBoxJson], Field(min_length=1, max_length=MOST_BOXES)]
    frames: Annotated[list[Id], Field(min_length=1, max_length=MOST_FRAMES)]


class PreviewLabelJson(BaseModel):
    """One box in one frame; image coordinates of the original image, to a hundredth of a pixel."""

    bbox: Bounds | None = Field(description="x0 y0 x1 y1 of the part in the image; null: no part is in it")
    outline: list[tuple[float, float]] = Field(description="ring round the part in the image, not closed")
    wireframe: list[list[tuple[float, float]]] = Field(description="the edges within the image, bent by the lens")
    truncated: float = Field(description="share of the amodal outline's area outside the image")


class FramePreviewJson(BaseModel):
    """The boxes in one frame, in the request's order."""

    frame: int
    labels: list[PreviewLabelJson]


@router.post(
    "/labels", operation_id="labels-preview", response_model=list[FramePreviewJson], responses=documented(404, 413)
)
def labels_preview(sid: str, draft: LabelsPreviewDraft, services: ServicesDep, key: IdempotencyKey) -> Response:
    """How boxes would be drawn in frames, one answer a frame in the request's order. Nothing is stored or changed."""
    boxes = [Box(box.T_world_box.matrix, np.array(box.size)) for box in draft.boxes]
    cameras, frames = services.store.cameras(sid), services.store.frames(sid)
    found = preview_labels(cameras, frames, boxes, draft.frames)
    return JsonResponse(
        [
            {"frame": frame, "labels": [_json(label) for label in labels]}
            for frame, labels in zip(draft.frames, found, strict=True)
        ]
    )


def _json(label: PreviewLabel) -> dict[str, Any]:
    return {
        "bbox": None if label.bbox is None else [round(side, DECIMALS) for side in label.bbox],
        "outline": label.outline.round(DECIMALS).tolist(),
        "wireframe": [line.round(DECIMALS).tolist() for line in label.wireframe],
        "truncated": label.truncated,
    }
