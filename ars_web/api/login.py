"""`/login`: a one-time code, or the token, for a cookie."""

from pathlib import Path
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from fastapi.responses import FileResponse, RedirectResponse
from starlette.requests import cookie_parser

from ars_web.api.credentials import COOKIE_LIFETIME, same
from ars_web.api.dependencies import Services, ServicesDep, StrictRoute
from ars_web.api.models import Login
from ars_web.api.problems import ProblemResponse, documented
from ars_web.api.security import WORKSPACE
from ars_web.errors import NotFound


def router(static: Path) -> APIRouter:
    """The routes of the page's door; `static` holds the page."""
    routes = APIRouter(tags=["login"], route_class=StrictRoute)

    @routes.get("/", include_in_schema=False)
    def page(request: Request) -> FileResponse:
        """The page for those who are logged in, how to log in for others."""
        return _page(static, "index.html", request)

    @routes.get("/sessions/{sid}", include_in_schema=False)
    def workspace(sid: str, request: Request) -> FileResponse:
        """A session's page, which asks for the session itself; how to log in for others."""
        if not WORKSPACE.fullmatch(request.scope["path"]):
            raise NotFound(f"there is no session {sid[:40]!r}; the list of sessions is at /")
        return _page(static, "workspace.html", request)

    @routes.get("/favicon.ico", include_in_schema=False)
    def icon() -> FileResponse:
        """What browsers ask for by themselves where they show JSON."""
        return FileResponse(static / "icon.svg")

    @routes.get("/login", include_in_schema=False)
    def by_code(
        request: Request,
        services: ServicesDep,
        code: Annotated[str, Query(max_length=200)] = "",
        destination: Annotated[str, Query(alias="next")] = "/",
    ) -> Response:
        """Trade a one-time code for the cookie, and go on to `next`: a session's page, else the list of sessions."""
        redeemed = services.codes.redeem(code)
        if not redeemed and request.scope["state"]["author"] is None:
            # Static, so nothing of the request comes back as HTML.
            return FileResponse(static / "login.html", status_code=403, headers={"Cache-Control": "no-store"})
        # Nothing but a page of ours: `//host`, `/\host` and the like would lead a browser elsewhere.
        answer = RedirectResponse(destination if WORKSPACE.fullmatch(destination) else "/", status_code=303)
        if redeemed:
            _set_cookie(answer, request, services)
        return answer

    @routes.post("/login", status_code=204, operation_id="login-create", responses=documented(413))
    def by_token(login: Login, request: Request, services: ServicesDep) -> Response:
        """Trade the token for the page's cookie."""
        if not same(login.token, services.door.token):
            return ProblemResponse(401, "unauthorized", "Not logged in", "this is not the server's token")
        answer = Response(status_code=204)
        _set_cookie(answer, request, services)
        return answer

    return routes


def _page(static: Path, name: str, request: Request) -> FileResponse:
    known = request.scope["state"]["author"] is not None
    return FileResponse(static / (name if known else "login.html"), headers={"Cache-Control": "no-store"})


def _set_cookie(answer: Response, request: Request, services: Services) -> None:
    # A browser that is known keeps its name, and with it what it may undo.
    held = cookie_parser(request.headers.get("cookie", "")).get(services.door.cookie_name, "")
    answer.set_cookie(
        services.door.cookie_name,
        services.door.cookies.issue(services.door.cookies.browser(held)),
        max_age=COOKIE_LIFETIME,
        path="/",
        httponly=True,
        samesite="strict",
        secure=request.url.scheme == "https",
    )
