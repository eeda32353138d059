"""`outline-rest` and `/api/sessions/{sid}/outline-jobs`: from two outlines of an object to those in further frames."""

from typing import Annotated, Literal, Self

from fastapi import APIRouter, Response
from pydantic import BaseModel, Field

from ars_web.api.dependencies import AuthorDep, IdempotencyKey, ServicesDep, StrictRoute
from ars_web.api.models import Strict
from ars_web.api.problems import documented
from ars_web.masks.propagation import FRAMES_MOST, Dropped
from ars_web.masks.propagation_jobs import MOST_FRAMES, OutlineJob

router = APIRouter(prefix="/api/sessions/{sid}", tags=["masks"], route_class=StrictRoute)


class OutlineRestDraft(Strict):
    """How much further an object is to be outlined."""

    frames_most: Annotated[int, Field(strict=True, ge=1, le=MOST_FRAMES)] = Field(
        FRAMES_MOST, description="outlines that are added at most; fewer, once more would hardly change the hull"
    )


AS_A_RULE = OutlineRestDraft()  # pyright: ignore[reportCallIssue]: it knows no defaults behind Annotated


class FrameReasonAnswer(BaseModel):
    """A frame and what is to be said of its outline."""

    frame: int
    reason: str

    @classmethod
    def of(cls, dropped: Dropped) -> Self:
        """Its JSON."""
        return cls(frame=dropped.frame, reason=dropped.reason)


class OutlineJobAnswer(BaseModel):
    """How far the outlining of an object is."""

    id: str
    box_id: int
    state: Literal["queued", "running", "done", "failed", "cancelled"]
    done: int = Field(description="steps of about the same length")
    total: int = Field(description="0 until that is known")
    seconds_left: float | None
    accepted: list[int] = Field(description="frames whose new outlines count, once done")
    doubtful: list[int] = Field(description="frames whose new outlines wait for a yes or a no")
    doubts: list[FrameReasonAnswer] = Field(description="why they do")
    dropped: list[FrameReasonAnswer] = Field(description="frames that were looked at and got no outline")
    error: str | None = Field(description="of a failed job; nothing was stored")

    @classmethod
    def of(cls, job: OutlineJob) -> Self:
        """Its JSON."""
        return cls(
            id=job.id,
            box_id=job.box_id,
            state=job.state,
            done=job.done,
            total=job.total,
            seconds_left=None if job.seconds_left is None else round(job.seconds_left, 1),
            accepted=list(job.accepted),
            doubtful=list(job.doubtful),
            doubts=[FrameReasonAnswer.of(doubt) for doubt in job.doubts],
            dropped=[FrameReasonAnswer.of(dropped) for dropped in job.dropped],
            error=job.error,
        )


@router.post(
    "/boxes/{box_id}/outline-rest",
    status_code=202,
    operation_id="boxes-outline-rest",
    responses=documented(404, 409, 413),
)
def outline_rest(
    sid: str,
    box_id: int,
    response: Response,
    services: ServicesDep,
    author: AuthorDep,
    key: IdempotencyKey,
    draft: OutlineRestDraft = AS_A_RULE,
) -> OutlineJobAnswer:
    """Outline an object in further frames, beginning from its masks that count, two at least; ask for the job again
    to see how far it is.

    All its outlines, the hull and the box are stored in one edit at the end, or nothing is. The box may be one that
    is not made yet, of which there are masks only: it is made then. A box that was placed by hand stays where it is.
    """
    job = services.outlines.start(sid, box_id, frames_most=draft.frames_most, author=author, key=key)
    response.headers["Location"] = f"/api/sessions/{sid}/outline-jobs/{job.id}"
    return OutlineJobAnswer.of(job)


@router.get("/outline-jobs/{job_id}", operation_id="outline-jobs-get", responses=documented(404))
def get(sid: str, job_id: str, services: ServicesDep) -> OutlineJobAnswer:
    """How far an outlining is."""
    return OutlineJobAnswer.of(services.outlines.get(sid, job_id))


@router.post("/outline-jobs/{job_id}/cancel", operation_id="outline-jobs-cancel", responses=documented(404))
def cancel(sid: str, job_id: str, services: ServicesDep, key: IdempotencyKey) -> OutlineJobAnswer:
    """Stop an outlining, which leaves nothing then. One that has ended stays as it is."""
    return OutlineJobAnswer.of(services.outlines.cancel(sid, job_id))
