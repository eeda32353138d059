"""`/api/sessions/{sid}/boxes`: the virtual boxes."""

import math

import numpy as np
from fastapi import APIRouter, Response
from jaxtyping import Float

from ars_web.api.dependencies import AuthorDep, ExpectedRevision, IdempotencyKey, ServicesDep, StrictRoute, etag
from ars_web.api.models import BoxAnswer, BoxFromPointsAnswer, DuplicateDraft, PointsDraft
from ars_web.api.problems import documented
from ars_web.errors import BadInput, NotFound
from ars_web.geometry.box import from_four_points
from ars_web.geometry.rigid_transform import transform_points
from ars_web.sessions.boxes_json import BoxJson, BoxPatchJson, box_json
from ars_web.sessions.model import VirtualBox
from ars_web.sessions.store import SessionStore

router = APIRouter(prefix="/api/sessions/{sid}/boxes", tags=["boxes"], route_class=StrictRoute)

BESIDE = DuplicateDraft()  # pyright: ignore[reportCallIssue]: it knows no defaults behind Annotated


@router.get("", operation_id="boxes-list", responses=documented(404))
def boxes(sid: str, response: Response, services: ServicesDep) -> list[BoxAnswer]:
    """The session's boxes, by id; the ETag is the session's revision."""
    state = services.store.state(sid)
    response.headers["ETag"] = etag(state.revision)
    return [BoxAnswer.of(box) for box in state.boxes.values()]


@router.post("", status_code=201, operation_id="boxes-create", responses=documented(404, 413))
def create(
    sid: str, draft: BoxJson, response: Response, services: ServicesDep, author: AuthorDep, key: IdempotencyKey
) -> BoxAnswer:
    """Add a box."""
    box = draft.draft
    made = services.editor.add_box(
        sid, class_id=box.class_id, box=box.box, name=box.name, locked=box.locked, author=author, key=key
    )
    _headers(response, sid, made, created=True)
    return BoxAnswer.of(made)


@router.post("/from-points", status_code=201, operation_id="boxes-from-points", responses=documented(404, 413))
def from_points(
    sid: str, draft: PointsDraft, response: Response, services: ServicesDep, author: AuthorDep, key: IdempotencyKey
) -> BoxFromPointsAnswer:
    """Add the box whose three consecutive edges run through four points, as a pen draws it.

    Edges that are not quite perpendicular are set right; `residual_degrees` says by how much.
    """
    box, residual = from_four_points(_points_world(services.store, sid, draft))
    made = services.editor.add_box(sid, class_id=draft.class_id, box=box, name=draft.name, author=author, key=key)
    _headers(response, sid, made, created=True)
    return BoxFromPointsAnswer(**box_json(made), residual_degrees=math.degrees(residual))


@router.get("/{box_id}", operation_id="boxes-get", responses=documented(404))
def get(sid: str, box_id: int, response: Response, services: ServicesDep) -> BoxAnswer:
    """One box."""
    found = services.store.state(sid).boxes.get(box_id)
    if found is None:
        raise NotFound(f"session {sid} has no box {box_id}")
    _headers(response, sid, found)
    return BoxAnswer.of(found)


@router.patch("/{box_id}", operation_id="boxes-change", responses=documented(404, 409, 412, 413, 428))
def change(
    sid: str,
    box_id: int,
    changes: BoxPatchJson,
    response: Response,
    services: ServicesDep,
    author: AuthorDep,
    expected: ExpectedRevision,
) -> BoxAnswer:
    """Change a box that is at the revision in `If-Match`.

    A locked box answers 409 (`locked`), unless only its name changes or it is unlocked with the same request.
    """
    after = services.editor.change_box(
        sid,
        box_id,
        expected_revision=expected,
        class_id=changes.class_id,
        T_world_box=None if changes.T_world_box is None else changes.T_world_box.matrix,
        size=None if changes.size is None else np.array(changes.size),
        name=changes.name,
        locked=changes.locked,
        author=author,
    )
    _headers(response, sid, after)
    return BoxAnswer.of(after)


@router.delete("/{box_id}", status_code=204, operation_id="boxes-delete", responses=documented(404, 409, 412, 428))
def delete(sid: str, box_id: int, services: ServicesDep, author: AuthorDep, expected: ExpectedRevision) -> None:
    """Delete a box that is at the revision in `If-Match`, and its masks, unless it is locked; undo brings them back."""
    services.editor.delete_box(sid, box_id, expected_revision=expected, author=author)


@router.post("/{box_id}/duplicate", status_code=201, operation_id="boxes-duplicate", responses=documented(404, 413))
def duplicate(
    sid: str,
    box_id: int,
    response: Response,
    services: ServicesDep,
    author: AuthorDep,
    key: IdempotencyKey,
    draft: DuplicateDraft = BESIDE,
) -> BoxAnswer:
    """Add a box like another, next to it, with its hull and the next free name; it has no masks and is not locked."""
    made = services.editor.duplicate_box(sid, box_id, author=author, key=key)
    _headers(response, sid, made, created=True)
    return BoxAnswer.of(made)


@router.post("/{box_id}/to-ground", operation_id="boxes-to-ground", responses=documented(404, 409, 412, 428))
def to_ground(
    sid: str,
    box_id: int,
    response: Response,
    services: ServicesDep,
    author: AuthorDep,
    expected: ExpectedRevision,
    key: IdempotencyKey,
) -> BoxAnswer:
    """Move a box that is at the revision in `If-Match` up or down until its lowest corner is at z = 0."""
    after = services.editor.rest_on_ground(sid, box_id, expected_revision=expected, author=author, key=key)
    _headers(response, sid, after)
    return BoxAnswer.of(after)


def _headers(response: Response, sid: str, box: VirtualBox, *, created: bool = False) -> None:
    response.headers["ETag"] = etag(box.revision)
    if created:
        response.headers["Location"] = f"/api/sessions/{sid}/boxes/{box.id}"


def _points_world(store: SessionStore, sid: str, draft: PointsDraft) -> Float[np.ndarray, "4 3"]:
    points = np.array(draft.points)
    if draft.frame_of == "world":
        if draft.frame is not None:
            raise BadInput("`frame` has no meaning where `frame_of` is world; leave it out")
        return points
    if draft.frame is None:
        raise BadInput("`frame` must say whose camera the points are in, where `frame_of` is camera")
    frames = store.frames(sid)
    if not 0 <= draft.frame < len(frames):
        raise BadInput(f"session {sid} has no frame {draft.frame}; its frames are 0 to {len(frames) - 1}")
    return transform_points(frames.Ts_world_camera[draft.frame], points)
