"""`/api/sessions/{sid}/frames` and `cameras`: the recording, and what is labelled in it."""

from typing import Annotated, Literal

from fastapi import APIRouter, Header, Query, Response

from ars_web.api.crops import crop_from_text
from ars_web.api.dependencies import JsonResponse, ServicesDep, StrictRoute
from ars_web.api.models import CameraJson, FramePage, LabelJson, frames_json, label_json
from ars_web.api.pictures import PictureRequest, recorded_image
from ars_web.api.problems import documented
from ars_web.datasets.samples import frame_labels
from ars_web.errors import NotFound
from ars_web.recordings.stored_images import local

router = APIRouter(prefix="/api/sessions/{sid}", tags=["frames"], route_class=StrictRoute)

FRAMES_AT_ONCE = 10_000

IMAGE_CACHE = "private, max-age=60, stale-while-revalidate=604800"
"""A session's images do not change, but someone may put others in their place: for a minute nothing is asked, and after
that a browser shows what it has at once and asks about the ETag meanwhile."""


@router.get("/frames", operation_id="frames-list", response_model=FramePage, responses=documented(404))
def frames(
    sid: str,
    services: ServicesDep,
    offset: Annotated[int, Query(ge=0, lt=2**53)] = 0,
    limit: Annotated[int, Query(ge=1, le=FRAMES_AT_ONCE)] = 1000,
) -> Response:
    """The frames from `offset`, at most `limit` of them; `total` says how many there are."""
    table = services.store.frames(sid)
    total = len(table)
    items = frames_json(table, min(offset, total), min(offset + limit, total))
    return JsonResponse({"items": items, "offset": offset, "limit": limit, "total": total})


@router.get("/cameras", operation_id="cameras-list", responses=documented(404))
def cameras(sid: str, services: ServicesDep) -> list[CameraJson]:
    """The cameras, by id."""
    return [CameraJson.of(camera_id, camera) for camera_id, camera in sorted(services.store.cameras(sid).items())]


@router.get(
    "/frames/{index}/image",
    operation_id="frame-image-get",
    response_class=Response,
    responses={
        200: {"description": "the image", "content": {"image/jpeg": {}, "image/png": {}}},
        304: {"description": "`If-None-Match` names the ETag: the image is as it was"},
        **documented(404, 413),
    },
)
def image(
    sid: str,
    index: int,
    services: ServicesDep,
    width: Annotated[int | None, Query(ge=1, le=16384, description="pixels; never wider than the image is")] = None,
    rectified: Annotated[bool, Query(description="without the lens's distortion")] = False,
    crop: Annotated[
        str | None,
        Query(
            description="x0,y0,x1,y1: this part alone, in whole pixels of the original image, or of the rectified one;"
            " `width` is then the part's"
        ),
    ] = None,
    if_none_match: Annotated[str | None, Header()] = None,
) -> Response:
    """A frame's image: as it is stored, or a JPEG of it that is smaller, rectified or a part."""
    table = services.store.frames(sid)
    _check(sid, index, len(table))
    camera = services.store.cameras(sid)[int(table.camera_ids[index])]
    path = recorded_image(local(table.images[index]), own=services.store.folder / sid)
    part = None if crop is None else crop_from_text(crop, width=camera.width, height=camera.height)
    request = PictureRequest(path, camera, width, rectified, part)
    headers = {"ETag": request.etag(), "Cache-Control": IMAGE_CACHE}
    if if_none_match is not None and headers["ETag"] in [tag.strip() for tag in if_none_match.split(",")]:
        return Response(status_code=304, headers=headers)
    data, media_type = services.pictures.get(request, headers["ETag"])
    return Response(data, media_type=media_type, headers=headers)


@router.get(
    "/frames/{index}/labels",
    operation_id="frame-labels-list",
    response_model=list[LabelJson],
    responses=documented(404),
)
def labels(
    sid: str,
    index: int,
    services: ServicesDep,
    shape: Annotated[
        Literal["box", "hull", "mesh"] | None, Query(description="default: the hull where a box has one, else the box")
    ] = None,
) -> Response:
    """Every box of the session as it appears in a frame, those out of sight included."""
    found = frame_labels(services.store.snapshot(sid), index, shape=shape)
    return JsonResponse([label_json(label) for label in found])


def _check(sid: str, index: int, total: int) -> None:
    if not 0 <= index < total:
        raise NotFound(f"session {sid} has no frame {index}; its frames are 0 to {total - 1}")
