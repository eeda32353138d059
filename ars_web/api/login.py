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


def router(static: Path) -> APIRouter:
    """The routes of the page's door; `static` holds the page."""
    routes = APIRouter(tags=["login"], route_class=StrictRoute)

    @routes.get("/", include_in_schema=False)
    def page(request: Request) -> FileResponse:
        """The page for those who are logged in, how to log in for others."""
        known = request.scope["state"]["author"] is not None
        return FileResponse(static / ("index.html" if known else "login.html"), headers={"Cache-Control": "no-store"})

    @routes.get("/favicon.ico", include_in_schema=False)
    def icon() -> FileResponse:
        """What browsers ask for by themselves where they show JSON."""
        return FileResponse(static / "icon.svg")

    @routes.get("/login", include_in_schema=False)
    def by_code(request: Request, services: ServicesDep, code: Annotated[str, Query(max_length=200)] = "") -> Response:
        """Trade a one-time code for the cookie, and go on to the page."""
        if not services.codes.redeem(code):
            # Static, so nothing of the request comes back as HTML.
            return FileResponse(static / "login.html", status_code=403, headers={"Cache-Control": "no-store"})
        answer = RedirectResponse("/", status_code=303)
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
