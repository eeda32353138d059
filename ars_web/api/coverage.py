"""`/api/sessions/{sid}/coverage`: from where a session's objects are seen, and in which frames."""

from dataclasses import dataclass
from typing import Annotated, Literal

from fastapi import APIRouter, Depends, Query, Response
from pydantic import BaseModel, Field

from ars_web.api.dependencies import JsonResponse, ServicesDep, StrictRoute
from ars_web.api.problems import documented
from ars_web.datasets.coverage import SessionViews, called, chosen_boxes, coverage_of, frames_in_bin
from ars_web.datasets.options import ExportOptions
from ars_web.errors import BadInput
from ars_web.geometry.even_spacing import evenly
from ars_web.geometry.sphere_bins import MOST_BINS, SphereBins
from ars_web.sessions.model import SessionSnapshot
from ars_web.studies.coverage_json import CoverageJson, coverage_json
from ars_web.studies.coverage_picture import coverage_png

router = APIRouter(prefix="/api/sessions/{sid}/coverage", tags=["coverage"], route_class=StrictRoute)

BoxId = Annotated[int | None, Query(ge=0, lt=2**53, description="one object; default: all of them together")]
ClassId = Annotated[int | None, Query(ge=0, lt=2**53, description="the objects of a class")]
Bins = Annotated[int, Query(ge=1, le=MOST_BINS)]
Shape = Annotated[
    Literal["box", "hull", "mesh"] | None, Query(description="default: the hull where a box has one, else the box")
]
MinVisible = Annotated[
    float,
    Query(ge=0.0, le=1.0, allow_inf_nan=False, description="views in which less of an object is seen do not count"),
]


@dataclass(frozen=True)
class Meant:
    """Whose views are counted, of a query."""

    box_id: BoxId = None
    class_id: ClassId = None


@dataclass(frozen=True)
class Counting:
    """How views are counted, of a query."""

    azimuth_bins: Bins = 36
    polar_bins: Bins = 18
    min_visible: MinVisible = 0.0
    shape: Shape = None

    @property
    def bins(self) -> SphereBins:
        """Where views fall into."""
        return SphereBins(self.azimuth_bins, self.polar_bins)

    @property
    def options(self) -> ExportOptions:
        """Of an export that labels what is counted."""
        return ExportOptions.model_validate({"min_visible": self.min_visible, "shape": self.shape})


MeantDep = Annotated[Meant, Depends()]
CountingDep = Annotated[Counting, Depends()]


class ViewJson(BaseModel):
    """A frame that sees an object from the bin."""

    frame: int
    box_id: int


class BinFrames(BaseModel):
    """The views of a bin, frame by frame."""

    total: int
    items: list[ViewJson] = Field(description="the first of them, `limit` at most, spread evenly over all")


class ObjectCoverage(BaseModel):
    """How much of an object, or of a class's objects together, is seen."""

    class_id: int
    box_id: int | None = Field(description="null: all of the class")
    frames: int = Field(description="in which it is labelled")
    views: int
    empty_fraction: float = Field(description="share of all directions, in cells of equal area, without a view")


class ObjectsCoverage(BaseModel):
    """All boxes, then all classes that have some."""

    items: list[ObjectCoverage]


@router.get("", operation_id="coverage-read", response_model=CoverageJson, responses=documented(404))
def read(sid: str, services: ServicesDep, meant: MeantDep, by: CountingDep) -> Response:
    """The paper's histogram of viewpoints, and one with cells of equal area.

    A frame counts where an export with these options would label the object. Views that a class's symmetry makes look
    alike count as one, in the bin that stands for them all.
    """
    _, views, rows = _views(services, sid, meant, by)
    return JsonResponse(coverage_json(coverage_of(views, by.bins, rows)).model_dump(mode="json"))


@router.get(
    "/picture",
    operation_id="coverage-picture",
    response_class=Response,
    responses={200: {"description": "the histograms as PNG", "content": {"image/png": {}}}, **documented(404)},
)
def picture(sid: str, services: ServicesDep, meant: MeantDep, by: CountingDep) -> Response:
    """The same as a picture, for a paper or a notebook."""
    snapshot, views, rows = _views(services, sid, meant, by)
    title = called(snapshot, box_id=meant.box_id, class_id=meant.class_id)
    drawn = coverage_png(coverage_of(views, by.bins, rows), title=title)
    return Response(drawn, media_type="image/png", headers={"Cache-Control": "private, no-cache"})


@router.get("/frames", operation_id="coverage-frames-list", response_model=BinFrames, responses=documented(404))
def frames(
    sid: str,
    services: ServicesDep,
    meant: MeantDep,
    by: CountingDep,
    azimuth: Annotated[int | None, Query(ge=0, lt=MOST_BINS, description="a bin of equal angles, with `polar`")] = None,
    polar: Annotated[int | None, Query(ge=0, lt=MOST_BINS)] = None,
    cell: Annotated[int | None, Query(ge=0, lt=MOST_BINS**2, description="or a cell of equal area")] = None,
    limit: Annotated[int, Query(ge=1, le=10_000)] = 200,
) -> Response:
    """The frames that see an object from one bin."""
    bins = by.bins
    if (azimuth is None) != (polar is None) or (cell is None) == (azimuth is None):
        raise BadInput("give azimuth and polar of a bin of equal angles, or a cell of equal area")
    if azimuth is not None and polar is not None and not (azimuth < bins.azimuth and polar < bins.polar):
        raise BadInput(f"there is no bin {azimuth}, {polar} among {bins.azimuth} x {bins.polar}; they count from 0")
    angle = None if azimuth is None or polar is None else azimuth * bins.polar + polar
    _, views, rows = _views(services, sid, meant, by)
    found = frames_in_bin(views, bins, rows, angle=angle, cell=cell)
    shown = (found[place] for place in evenly(len(found), limit).tolist())
    items = [{"frame": frame, "box_id": views.box_ids[row]} for frame, row in shown]
    return JsonResponse({"total": len(found), "items": items})


@router.get("/objects", operation_id="coverage-objects-list", response_model=ObjectsCoverage, responses=documented(404))
def objects(sid: str, services: ServicesDep, by: CountingDep) -> Response:
    """How much is seen of each object and class: where a recording lacks most. Empty where there is no box."""
    if not services.store.snapshot(sid).state.boxes:
        return JsonResponse({"items": []})
    _, views, rows = _views(services, sid, Meant(), by)
    chosen: list[tuple[int, int | None, list[int]]] = [
        (views.class_ids[row], views.box_ids[row], [row]) for row in rows
    ]
    for class_id in sorted(set(views.class_ids)):
        chosen.append((class_id, None, [row for row in rows if views.class_ids[row] == class_id]))
    items: list[dict[str, int | float | None]] = []
    for class_id, box_id, of in chosen:
        found = coverage_of(views, by.bins, of)
        items.append(
            {
                "class_id": class_id,
                "box_id": box_id,
                "frames": found.frames,
                "views": found.views,
                "empty_fraction": found.empty_area,
            }
        )
    return JsonResponse({"items": items})


def _views(
    services: ServicesDep, sid: str, meant: Meant, by: Counting
) -> tuple[SessionSnapshot, SessionViews, list[int]]:
    snapshot = services.store.snapshot(sid)
    rows = chosen_boxes(snapshot, box_id=meant.box_id, class_id=meant.class_id)
    return snapshot, services.views.find(snapshot, by.options), rows
