"""`/api/sessions/{sid}/report`: what an export would hold, and what to mend before training, as one page."""

from typing import Annotated

from fastapi import APIRouter, Query, Response
from fastapi.exceptions import RequestValidationError
from pydantic import ValidationError

from ars_web.api.dependencies import ServicesDep, StrictRoute
from ars_web.api.problems import documented
from ars_web.datasets.file_names import safe
from ars_web.datasets.options import ExportOptions
from ars_web.studies.report_page import session_page
from ars_web.studies.session_report import session_report
from ars_web.studies.session_study import study_session

router = APIRouter(prefix="/api/sessions/{sid}/report", tags=["report"], route_class=StrictRoute)

CONTENT_SECURITY_POLICY = "; ".join(
    [
        "default-src 'none'",
        "style-src 'unsafe-inline'",
        "img-src data:",
        "base-uri 'none'",
        "form-action 'none'",
        "frame-ancestors 'self'",
        "sandbox",
    ]
)
"""Instead of the workspace's: pictures and styles are in the page itself. There is no script in it, and none would run;
in a sandbox it has no origin, so that nothing of it could ask the server either."""


@router.get(
    "",
    operation_id="report-read",
    response_class=Response,
    responses={
        200: {"description": "the page", "content": {"text/html": {"schema": {"type": "string"}}}},
        **documented(404),
    },
)
def read(
    sid: str,
    services: ServicesDep,
    options: Annotated[
        str, Query(description="those of an export, as the JSON text of what POST …/exports takes", max_length=100_000)
    ] = "{}",
    save: Annotated[bool, Query(description="offer it as a file instead of showing it")] = False,
) -> Response:
    """A report of the session as an export with these options would write it; one of several sessions has no report.

    It comes in seconds also for long sessions: visible shares are then found in some thousand frames alone, unless
    `min_visible` needs them all.
    """
    try:
        chosen = ExportOptions.model_validate_json(options)
    except ValidationError as error:
        found = error.errors(include_url=False, include_input=False)
        raise RequestValidationError([{**one, "loc": ("query", "options", *one["loc"])} for one in found]) from error
    snapshot = services.store.snapshot(sid)
    study = study_session(snapshot, chosen)
    page = session_page(study, session_report(study, services.store.summary(sid)))
    name = f"{safe(snapshot.state.name)}-report.html"
    return Response(
        page.encode(errors="backslashreplace"),
        media_type="text/html; charset=utf-8",
        headers={
            "Content-Security-Policy": CONTENT_SECURITY_POLICY,
            "Content-Disposition": f'{"attachment" if save else "inline"}; filename="{name}"',
        },
    )
