"""A report as its page: the facts, their figures, and some frames as they would be labelled."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ars_web.datasets.preview import draw_frame, spread
from ars_web.datasets.splits import SPLITS
from ars_web.errors import ArsError
from ars_web.reporting.jpeg import jpeg
from ars_web.reporting.page import data_uri, report_page
from ars_web.studies.report_facts import BoxFacts, ClassFacts, SessionReport
from ars_web.studies.report_figures import (
    Bars,
    Course,
    ViewMap,
    course,
    neighbour_dots,
    share_bars,
    size_bars,
    view_map,
)
from ars_web.studies.session_study import SeenFrom, SessionStudy
from ars_web.studies.view_holes import holes_of

SAMPLES = 6
"""Frames that are shown."""

SAMPLE_SIDE = 960
"""Pixels of a picture's longer side: sharp in two columns on a dense screen, and six of them are below a megabyte."""


@dataclass(frozen=True)
class Sample:
    """A frame with its labels drawn.

    Attributes:
        picture: an address that holds it; None where its image cannot be read, as `problem` says.
    """

    frame: int
    name: str
    split: str
    labels: int
    picture: str | None
    problem: str


@dataclass(frozen=True)
class ClassCard:
    """A class with its figures, as far as it has labels."""

    facts: ClassFacts
    views: ViewMap | None
    sizes: Bars | None
    visible: Bars | None
    truncated: Bars | None


@dataclass(frozen=True)
class BoxCard:
    """An object with its map."""

    facts: BoxFacts
    color: str
    views: ViewMap


def session_page(study: SessionStudy, report: SessionReport, *, samples: int = SAMPLES) -> str:
    """The page; the same for the same session and images."""
    colours = {one.id: one.color for one in report.classes}
    return report_page(
        "report.html",
        report=report,
        classes=[_class_card(study, one) for one in report.classes],
        boxes=[BoxCard(one, colours[one.class_id], _map(study.boxes[one.id])) for one in report.boxes],
        course=_course(study),
        dots={split: neighbour_dots(near) for split, near in study.neighbours.items()},
        samples=drawn_samples(study, _sample_rows(study, samples)),
    )


def drawn_samples(study: SessionStudy, rows: Sequence[int]) -> list[Sample]:
    """The frames at these rows of the export, with the labels that are written; an image that cannot be read is told
    of, and the others are drawn."""
    plan, keep = study.labels.plan, study.labels.keep
    box_ids = np.array(plan.sessions[0].box_ids, dtype=np.int64)
    found: list[Sample] = []
    for row in rows:
        index, kept = int(plan.frames.index[row]), box_ids[keep[row]].tolist()
        picture, problem = None, ""
        try:
            drawn = draw_frame(study.snapshot, index, shape=study.options.shape, only=kept)
            picture = data_uri(jpeg(drawn, longest=SAMPLE_SIDE), media_type="image/jpeg")
        except ArsError as error:
            # Reports are passed on: where the recording lies is nobody's business.
            problem = str(error).replace(str(study.snapshot.frames.images[index]), plan.frames.names[row])
        split = SPLITS[int(plan.frames.split[row])]
        found.append(Sample(index, plan.frames.names[row], split, len(kept), picture, problem))
    return found


def _sample_rows(study: SessionStudy, count: int) -> list[int]:
    """Rows of labelled frames, spread evenly; of any where none is labelled."""
    labelled = np.flatnonzero(study.labels.keep.any(axis=1)).tolist()
    return spread(labelled or list(range(len(study.labels.plan.frames))), count)


def _class_card(study: SessionStudy, facts: ClassFacts) -> ClassCard:
    return ClassCard(
        facts=facts,
        views=_map(study.classes[facts.id]) if facts.id in study.classes else None,
        sizes=size_bars(facts.sizes) if facts.sizes else None,
        visible=share_bars(facts.visible.histogram, what="visible") if facts.visible else None,
        truncated=share_bars(facts.truncated.histogram, what="outside the image") if facts.truncated else None,
    )


def _map(seen: SeenFrom) -> ViewMap:
    return view_map(seen.fine, holes_of(seen.fine))


def _course(study: SessionStudy) -> Course:
    return course(study.labels.plan.frames.split, study.labels.keep.sum(axis=1))
