"""Errors as RFC 9457 problem documents: one table for all of them."""

import logging
import math
import secrets
from collections.abc import Mapping, Sequence
from http import HTTPStatus
from typing import Any, cast

import orjson
from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel, Field
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect
from starlette.routing import BaseRoute, Match
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from ars_web.api.models import current_json
from ars_web.errors import (
    ArsError,
    BadFile,
    BadInput,
    BadOption,
    Cancelled,
    Conflict,
    Locked,
    NotFound,
    RefusedPath,
    StoreError,
    TooLarge,
    ViewsDisagree,
)
from ars_web.sessions.editing import NothingToUndo

logger = logging.getLogger(__name__)

MEDIA_TYPE = "application/problem+json"

STATUS: dict[type[ArsError], tuple[int, str, str]] = {
    BadFile: (422, "bad-file", "A file cannot be used"),
    BadInput: (422, "bad-input", "The request cannot be used"),
    BadOption: (422, "bad-input", "The request cannot be used"),
    ViewsDisagree: (422, "views-disagree", "The outlines do not fit one object"),
    NotFound: (404, "not-found", "Not found"),
    NothingToUndo: (409, "nothing-to-undo", "Nothing to undo or redo"),
    Conflict: (409, "conflict", "It was changed meanwhile"),
    Locked: (409, "locked", "It is locked"),
    RefusedPath: (422, "refused-path", "The path is refused"),
    TooLarge: (413, "too-large", "Too large"),
    Cancelled: (409, "cancelled", "Cancelled"),
    StoreError: (503, "store", "The sessions folder cannot be used"),
    ArsError: (500, "failed", "Failed"),
}
"""HTTP status, the problem's type and its title, by the nearest class. A Conflict of a request that carried
`If-Match` is answered 412."""


class Problem(BaseModel):
    """An RFC 9457 problem document."""

    type: str = Field(description="which kind of problem, stable: `urn:ars-web:problem:...`")
    title: str = Field(description="the kind in words")
    status: int = Field(description="the HTTP status")
    detail: str = Field(description="what is wrong with this request, and what to do")


class FieldProblem(BaseModel):
    """One part of a request that was refused."""

    where: str = Field(description="such as `body.size.1`")
    message: str


class ValidationProblem(Problem):
    """A request that does not fit its schema, or names what cannot be."""

    errors: list[FieldProblem] = Field(default_factory=list[FieldProblem])


class ViewMisfit(BaseModel):
    """One of the views that do not fit together."""

    frame: int
    misfit_px: float | None = Field(
        description="by how much its outline would have to grow to meet the others, pixels; null: no growing helps"
    )


class ViewsProblem(ValidationProblem):
    """The same, or outlines that no one object can have: `views` is there where the type is `views-disagree`."""

    views: list[ViewMisfit] = Field(default_factory=list[ViewMisfit], description="those concerned, the worst first")


class StaleProblem(Problem):
    """`If-Match` names a revision that is not the current one."""

    current: dict[str, Any] | None = Field(description="the thing as it is now; null where it is gone")


DESCRIPTIONS: dict[int, tuple[type[Problem], str]] = {
    401: (Problem, "no token, a wrong one, or a cookie that has ended"),
    403: (Problem, "the request comes from another origin"),
    404: (Problem, "a thing named in the path is not there"),
    409: (Problem, "the thing is not in a state that allows this"),
    412: (StaleProblem, "stale `If-Match`; `current` holds the thing as it is now"),
    413: (Problem, "beyond a limit, which the detail names"),
    421: (Problem, "the Host header names another server"),
    422: (ValidationProblem, "the request cannot be used as it is"),
    428: (Problem, "`If-Match` is missing"),
    500: (Problem, "a fault of the server, logged there under the number in the detail"),
    503: (Problem, "the sessions folder cannot be used"),
}


def documented(*statuses: int, views: bool = False) -> dict[int | str, dict[str, Any]]:
    """The `responses` of a route: the problems that any route may answer, and `statuses`; `views`: it may find that
    outlines do not fit one object."""
    models = {status: DESCRIPTIONS[status][0] for status in sorted({401, 403, 421, 422, 500, 503, *statuses})}
    if views:
        models[422] = ViewsProblem
    return {
        status: {
            "description": DESCRIPTIONS[status][1],
            "content": {MEDIA_TYPE: {"schema": {"$ref": f"#/components/schemas/{model.__name__}"}}},
        }
        for status, model in models.items()
    }


class ProblemResponse(Response):
    """A problem document as a response."""

    media_type = MEDIA_TYPE

    def __init__(
        self, status: int, kind: str, title: str, detail: str, *, headers: Mapping[str, str] | None = None, **more: Any
    ) -> None:
        body = {"type": f"urn:ars-web:problem:{kind}", "title": title, "status": status, "detail": detail, **more}
        # BadInput may quote a number that JSON has no word for; orjson writes it as null.
        super().__init__(orjson.dumps(body), status_code=status, headers=headers)


def of_error(error: ArsError, *, conditional: bool = False) -> ProblemResponse:
    """The answer to an ArsError; `conditional`: the request carried `If-Match`."""
    status, kind, title = next(STATUS[cls] for cls in type(error).__mro__ if cls in STATUS)
    if isinstance(error, Conflict):
        status = 412 if conditional else status
        return ProblemResponse(status, kind, title, str(error), current=current_json(error.current))
    if isinstance(error, ViewsDisagree):
        return ProblemResponse(status, kind, title, str(error), views=misfits_json(error))
    if isinstance(error, BadOption):
        errors = [{"where": f"options.{error.option}", "message": str(error)}]
        return ProblemResponse(status, kind, title, str(error), errors=errors)
    return ProblemResponse(status, kind, title, str(error))


def misfits_json(error: ViewsDisagree) -> list[dict[str, Any]]:
    """The views that disagree, as ViewMisfit has them."""
    return [{"frame": frame, "misfit_px": pixels if math.isfinite(pixels) else None} for frame, pixels in error.misfits]


class PreconditionMissing(Exception):
    """A change without `If-Match`."""


def install(app: FastAPI) -> None:
    """Answer every error of the routes with a problem document."""
    app.add_exception_handler(ArsError, _ars_error)
    app.add_exception_handler(RequestValidationError, _refused_request)
    app.add_exception_handler(HTTPException, _http_error)
    app.add_exception_handler(PreconditionMissing, _precondition_missing)


def _ars_error(request: Request, error: Exception) -> Response:
    assert isinstance(error, ArsError)
    if isinstance(error, StoreError):
        logger.error("%s %s: %s", request.method, request.url.path, error)
    return of_error(error, conditional="if-match" in request.headers)


def _refused_request(request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    # The refused values themselves are not echoed: they may be huge, or no JSON.
    found = cast(Sequence[dict[str, Any]], error.errors())[:20]
    errors = [{"where": ".".join(str(part)[:100] for part in one["loc"]), "message": _words(one)} for one in found]
    detail = "; ".join(f"{one['where']}: {one['message']}" for one in errors)
    return ProblemResponse(422, "bad-request", "The request does not fit its schema", detail, errors=errors)


def _words(error: dict[str, Any]) -> str:
    if error["type"] == "json_invalid":
        return f"not JSON: {error['ctx']['error']}"
    if error["type"] == "extra_forbidden":
        return "unknown field"
    return str(error["msg"]).removeprefix("Value error, ")


def _precondition_missing(request: Request, error: Exception) -> Response:
    detail = "send `If-Match` with the ETag of the thing as you read it, so that nobody's change is lost"
    return ProblemResponse(428, "precondition-required", "If-Match is missing", detail)


def _http_error(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    phrase = HTTPStatus(error.status_code).phrase
    detail, headers = error.detail, error.headers
    if error.status_code == 404:
        detail = "there is nothing at this address; /api/openapi.json lists what there is"
    elif error.status_code == 405:
        headers = {"Allow": ", ".join(_possible_methods(request))}
        detail = f"{request.method} is not possible here; possible is {headers['Allow']}"
    kind = phrase.lower().replace(" ", "-")
    return ProblemResponse(error.status_code, kind, phrase, detail, headers=headers)


def _possible_methods(request: Request) -> list[str]:
    """Of all routes at the request's address; the framework names those of the first one alone.

    The page's files have no route of their own and can only be read.
    """
    routes: Sequence[BaseRoute] = request.app.routes
    scope = {**request.scope, "path_params": {}}
    possible = [
        method
        for method in ("DELETE", "GET", "PATCH", "POST", "PUT")
        if any(route.matches({**scope, "method": method})[0] is Match.FULL for route in routes)
    ]
    return possible or ["GET"]


class Unexpected:
    """Middleware: an error that nobody foresaw is logged whole and answered with its log number only."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on; answer 500 where the app raises before it has answered."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        started = False

        async def watch(message: Message) -> None:
            nonlocal started
            started = started or message["type"] == "http.response.start"
            await send(message)

        try:
            await self.app(scope, receive, watch)
        except ClientDisconnect:
            logger.info("%s %s: the client went away", scope["method"], scope["path"])
        except Exception:  # the one place that catches all: here a bug becomes a 500 and a log entry
            number = secrets.token_hex(4)
            logger.exception("error %s in %s %s", number, scope["method"], scope["path"])
            if started:
                raise  # the server cuts the connection, so that half an answer is not taken for a whole one
            detail = f"the server failed; its log has the reason under {number}"
            await ProblemResponse(500, "internal", "Internal server error", detail)(scope, receive, send)
