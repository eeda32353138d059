"""`/api/sessions/{sid}/report`: what an export would hold, and what to mend before training, as one page."""

from typing import Annotated, Literal

from fastapi import APIRouter, Query, Response
from pydantic import ValidationError

from ars_web.api.dependencies import ServicesDep, StrictRoute
from ars_web.api.problems import documented
from ars_web.datasets.file_names import safe
from ars_web.datasets.options import ExportOptions
from ars_web.errors import BadInput
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

Share = Annotated[float, Query(ge=0.0, le=1.0, allow_inf_nan=False)]
Index = Annotated[int, Query(ge=0, lt=2**53)]


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
    frames_step: Annotated[int, Query(ge=1, lt=2**53, description="every N-th frame")] = 1,
    frames_start: Index = 0,
    frames_stop: Annotated[int | None, Query(ge=0, lt=2**53, description="default: to the end")] = None,
    shape: Annotated[
        Literal["box", "hull", "mesh"] | None, Query(description="default: the hull where a box has one, else the box")
    ] = None,
    min_visible: Share = 0.0,
    max_truncated: Share = 1.0,
    min_area_px: Annotated[float, Query(ge=0.0, allow_inf_nan=False)] = 4.0,
    split_train: Share = 0.8,
    split_val: Share = 0.2,
    split_test: Share = 0.0,
    split_by: Literal["block", "frame"] = "block",
    split_seed: Index = 0,
    save: Annotated[bool, Query(description="offer it as a file instead of showing it")] = False,
) -> Response:
    """A report of the session as an export with these options would write it; each means what it means there.

    It comes in seconds also for long sessions: visible shares are then found in some thousand frames alone, unless
    `min_visible` needs them all.
    """
    split = {"train": split_train, "val": split_val, "test": split_test, "by": split_by, "seed": split_seed}
    given = {
        "frames": {"step": frames_step, "start": frames_start, "stop": frames_stop},
        "shape": shape,
        "min_visible": min_visible,
        "max_truncated": max_truncated,
        "min_area_px": min_area_px,
        "split": split,
    }
    try:
        options = ExportOptions.model_validate(given)
    except ValidationError as error:
        # What one number alone decides has been looked at: what is left is that the shares do not add up.
        raise BadInput(error.errors()[0]["msg"].removeprefix("Value error, ")) from error
    snapshot = services.store.snapshot(sid)
    study = study_session(snapshot, options)
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
