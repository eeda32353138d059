"""`/api/sessions/{sid}/boxes/{box_id}/telling-frames`: where to look whether a box is right."""

from typing import Annotated

from fastapi import APIRouter, Query
from pydantic import BaseModel, Field

from ars_web.api.dependencies import ServicesDep, StrictRoute
from ars_web.api.problems import documented
from ars_web.api.telling import TellingView
from ars_web.errors import NotFound

router = APIRouter(prefix="/api/sessions/{sid}/boxes/{box_id}", tags=["boxes"], route_class=StrictRoute)


class TellingFrameJson(BaseModel):
    """A frame in which errors of the box show."""

    frame: int
    px_per_mm: float = Field(description="pixels that a corner is drawn off for 1 mm that it is off, at most")
    crop: tuple[int, int, int, int] = Field(
        description="x0 y0 x1 y1 of the part of the original image with the box in it; for the image's `crop`"
    )

    @classmethod
    def of(cls, view: TellingView) -> "TellingFrameJson":
        """The JSON of a view."""
        crop = view.crop
        return cls(frame=view.frame, px_per_mm=round(view.px_per_mm, 4), crop=(crop.x0, crop.y0, crop.x1, crop.y1))


@router.get("/telling-frames", operation_id="telling-frames-list", responses=documented(404))
def telling_frames(
    sid: str, box_id: int, services: ServicesDep, count: Annotated[int, Query(ge=1, le=24)] = 6
) -> list[TellingFrameJson]:
    """The frames that together show every kind of error of a box best, from different sides, in the recording's order;
    fewer than `count` where fewer show it. Boxes that hide it are not looked at."""
    found = services.store.state(sid).boxes.get(box_id)
    if found is None:
        raise NotFound(f"session {sid} has no box {box_id}")
    return [TellingFrameJson.of(view) for view in services.telling.find(sid, found.box, count=count)]
