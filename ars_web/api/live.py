"""`/api/sessions/{sid}/live`, the websocket between a page and the server, and `/people`: who else is there."""

from typing import Annotated

from fastapi import APIRouter, Query, WebSocket
from pydantic import ValidationError
from starlette.concurrency import run_in_threadpool

from ars_web.api.dependencies import AuthorDep, ServicesDep
from ars_web.api.live_line import Close, Ended, LiveLine, close, failed, person_json, refuse
from ars_web.api.live_models import LiveAddress, PersonJson, ViewKey, refusal
from ars_web.api.presence import Person
from ars_web.api.problems import documented
from ars_web.errors import ArsError, BadInput

router = APIRouter(prefix="/api/sessions/{sid}", tags=["live"])


@router.websocket("/live")
async def live(websocket: WebSocket, sid: str, services: ServicesDep, author: AuthorDep) -> None:
    """One page's line. The guard has refused strangers; all else is told on the open line, since a browser shows its
    page nothing of an answer that opens none."""
    await websocket.accept()
    try:
        address = LiveAddress.model_validate(dict(websocket.query_params))
    except ValidationError as error:
        await refuse(websocket, BadInput(refusal(error)))
        await close(websocket, Ended(Close.BAD_ADDRESS, "view or after cannot be used"))
        return
    try:
        frames = (await run_in_threadpool(services.store.summary, sid)).frames
    except ArsError as error:
        await close(websocket, await failed(websocket, error))
        return
    line = LiveLine(
        websocket,
        sid=sid,
        person=Person(view=address.view, author=author),
        frames=frames,
        events=services.events,
        presence=services.presence,
        scene=services.scene,
        patience_seconds=services.lines.patience_seconds,
    )
    await services.lines.run(line, websocket, after=address.after)


@router.get("/people", operation_id="people-list", responses=documented(404))
async def people(
    sid: str,
    services: ServicesDep,
    view: Annotated[ViewKey | None, Query(description="which of them is `own`")] = None,
) -> list[PersonJson]:
    """The pages that are at the session now."""
    await run_in_threadpool(services.store.revision, sid)
    return [person_json(person, own_view=view) for person in services.presence.people(sid)]
