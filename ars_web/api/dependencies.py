"""What handlers are given: the server's services, who asks, and the headers that make changes safe."""

from collections.abc import Callable, Coroutine, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import orjson
from fastapi import Depends, Header, Request, Response
from fastapi.dependencies.models import Dependant
from fastapi.exceptions import RequestValidationError
from fastapi.requests import HTTPConnection
from fastapi.routing import APIRoute

from ars_web.api.credentials import LoginCodes
from ars_web.api.events import EventHub
from ars_web.api.live_line import LiveLines
from ars_web.api.pictures import Pictures
from ars_web.api.presence import Presence
from ars_web.api.problems import PreconditionMissing
from ars_web.api.security import Door
from ars_web.api.telling import TellingViews
from ars_web.datasets.exports import ExportJobs
from ars_web.errors import BadInput
from ars_web.masks.boxing import ObjectBoxes
from ars_web.masks.propagation_jobs import OutlineJobs
from ars_web.masks.segmenter import Segmenter
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.import_jobs import ImportJobs
from ars_web.sessions.import_looks import ImportLooks
from ars_web.sessions.store import SessionStore
from ars_web.sessions.uploads import Uploads
from ars_web.studies.kept_views import KeptViews
from ars_web.workspace import ScenePages, SceneViews


@dataclass(frozen=True)
class Services:
    """What one server works with, opened and closed by `app.py`.

    Attributes:
        looks: recordings that were looked at before their import.
        objects: makes boxes of masks.
        outlines: outlining of objects in further frames.
        segmenter: what the smart tool finds objects with.
        lines: the live lines that are open.
        presence: who is at which session.
        scene: what the live lines show their pages.
        scene_pages: where those scenes are served, for the proxy in front of them.
        door: who is let in.
        codes: one-time login codes.
        roots: folders that clients may import recordings from, links resolved, by name.
        largest_upload: bytes of an uploaded archive.
        views: how frames see boxes, for coverage.
    """

    store: SessionStore
    editor: SessionEditor
    objects: ObjectBoxes
    outlines: OutlineJobs
    segmenter: Segmenter
    exports: ExportJobs
    uploads: Uploads
    looks: ImportLooks
    imports: ImportJobs
    events: EventHub
    lines: LiveLines
    presence: Presence
    scene: SceneViews
    scene_pages: ScenePages
    door: Door
    codes: LoginCodes
    roots: Mapping[str, Path]
    largest_upload: int
    pictures: Pictures
    telling: TellingViews
    views: KeptViews


def _services(connection: HTTPConnection) -> Services:
    services = connection.app.state.services
    assert isinstance(services, Services)
    return services


def _author(connection: HTTPConnection) -> str:
    author: object = connection.scope["state"]["author"]
    assert isinstance(author, str), "the guard lets nobody else in"
    return author


def _optional_revision(
    if_match: Annotated[str | None, Header(description="the ETag of the thing as it was read")] = None,
) -> int | None:
    """The revision in If-Match; None without one; -1, which nothing ever has, for any other well-formed tag."""
    if if_match is None:
        return None
    tag = if_match.strip()
    if tag == "*" or "," in tag:
        raise BadInput('If-Match must name the one revision that you read, such as "12"')
    digits = tag[1:-1]
    is_revision = tag == f'"{digits}"' and digits.isascii() and digits.isdigit() and len(digits) < 16
    return int(digits) if is_revision else -1


def _expected_revision(revision: Annotated[int | None, Depends(_optional_revision)]) -> int:
    """The revision in If-Match, which must be there."""
    if revision is None:
        raise PreconditionMissing
    return revision


def _idempotency_key(
    idempotency_key: Annotated[
        str | None,
        Header(
            min_length=1,
            max_length=200,
            pattern=r"^[\x20-\x7e]+$",
            description="a repeat with the same key answers what the first answered, and does nothing",
        ),
    ] = None,
) -> str | None:
    return idempotency_key


ServicesDep = Annotated[Services, Depends(_services)]
AuthorDep = Annotated[str, Depends(_author)]
ExpectedRevision = Annotated[int, Depends(_expected_revision)]
OptionalRevision = Annotated[int | None, Depends(_optional_revision)]
IdempotencyKey = Annotated[str | None, Depends(_idempotency_key)]


def etag(revision: int) -> str:
    """The ETag of a revision."""
    return f'"{revision}"'


class _StrictRequest(Request):
    async def json(self) -> Any:
        """The body by orjson, which refuses what JSON does not have: NaN, infinities, lone surrogates."""
        if not hasattr(self, "_strict_json"):
            self._strict_json: Any = orjson.loads(await self.body())
        return self._strict_json


class StrictRoute(APIRoute):
    """A route whose JSON bodies are JSON, and which refuses parameters of a query that it does not know: one that is
    misspelt would silently count for nothing."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """FastAPI's handler, given a strict request."""
        handler, known = super().get_route_handler(), _query_names(self.dependant)

        async def strict(request: Request) -> Response:
            unknown = [name for name in request.query_params if name not in known]
            if unknown:
                raise RequestValidationError(
                    [{"type": "extra_forbidden", "loc": ("query", name), "msg": "", "input": None} for name in unknown]
                )
            return await handler(_StrictRequest(request.scope, request.receive))

        return strict


def _query_names(dependant: Dependant) -> set[str]:
    """What a handler, and what it depends on, take of a query."""
    found = {field.alias for field in dependant.query_params}
    return found.union(*map(_query_names, dependant.dependencies))


class JsonResponse(Response):
    """A body that is JSON already, or is made so by orjson: for long lists, where models would cost more."""

    media_type = "application/json"

    def render(self, content: Any) -> bytes:
        """Bytes are taken as they are."""
        return content if isinstance(content, bytes) else orjson.dumps(content)
