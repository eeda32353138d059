"""What the study found: its figures as JSON, its curves, and the report."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import cv2
import numpy as np

from ars_web.reporting.page import data_uri, report_page, write_page
from ars_web.reporting.plot import COLOURS, new_figure, plain_axes, png
from examples.train_detector.plan import Configuration, Study
from examples.train_detector.scores import Scores

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Measure = Literal["ap50", "ap75", "ap"]

MEASURES: dict[Measure, str] = {"ap50": "mAP at 0.5", "ap75": "mAP at 0.75", "ap": "mAP at 0.5:0.95"}
"""Of `Scores`, and what they are called."""

VERDICTS = ("holds", "holds on average", "does not hold")
"""In every pair of runs, by the means only, or not even by them."""


@dataclass(frozen=True)
class Run:
    """One training.

    Attributes:
        configuration, seed: of what.
        labels: that it trained on.
        scores: in the test.
        seconds, processor_seconds: that training and test took.
    """

    configuration: Configuration
    seed: int
    labels: int
    scores: Scores
    seconds: float
    processor_seconds: float

    def write(self, file: Path) -> None:
        """As JSON, whole or not at all."""
        partial = file.with_suffix(".partial")
        partial.write_text(json.dumps(asdict(self), indent=1))
        partial.rename(file)

    @classmethod
    def read(cls, file: Path) -> "Run":
        """What `write` wrote."""
        told = json.loads(file.read_bytes())
        scores = told["scores"]
        return cls(
            **{
                **told,
                "configuration": Configuration(**told["configuration"]),
                "scores": Scores(**{**scores, "precision50": tuple(scores["precision50"])}),
            }
        )


@dataclass(frozen=True)
class Figures:
    """All that was found.

    Attributes:
        study: what was asked.
        tightness: of the labels of each shape, mean IoU with the true boxes.
        runs: every training.
    """

    study: Study
    tightness: dict[str, float]
    runs: tuple[Run, ...]


def write_findings(figures: Figures, out: Path) -> Sequence[Path]:
    """Write figures.json, findings.png and report.html into a folder; which they are."""
    curves = findings_picture(figures)
    pictures = {"curves": curves, "precision": precision_picture(figures), "views": views_picture(figures, out)}
    files = out / "figures.json", out / "findings.png", out / "report.html"
    files[0].write_text(json.dumps(asdict(figures), indent=1))
    files[1].write_bytes(curves)
    page = report_page(
        "study.html",
        templates=Path(__file__).parent,
        study=figures.study,
        figures=figures,
        findings=[[one.claim, one.holds, one.shown] for one in findings(figures)],
        rows=table(figures),
        pictures={name: data_uri(picture, media_type="image/png") for name, picture in pictures.items()},
        seconds=sum(run.processor_seconds for run in figures.runs),
    )
    write_page(page, files[2])
    return files


@dataclass(frozen=True)
class Spread:
    """A figure over the seeds."""

    mean: float
    low: float
    high: float

    def __str__(self) -> str:
        """For tables."""
        return f"{self.mean:.3f}" + (f" ({self.low:.3f} to {self.high:.3f})" if self.low != self.high else "")


def spread(figures: Figures, configuration: Configuration, measure: Measure) -> Spread:
    """A measure of one configuration's runs."""
    values = [getattr(run.scores, measure) for run in figures.runs if run.configuration == configuration]
    return Spread(float(np.mean(values)), min(values), max(values))


@dataclass(frozen=True)
class Finding:
    """What the paper found, and whether it is so here.

    Attributes:
        claim: in words.
        shown: the figures.
        holds: one of VERDICTS.
    """

    claim: str
    shown: str
    holds: str


def findings(figures: Figures) -> tuple[Finding, ...]:
    """The three of them."""
    study = figures.study
    more = [spread(figures, one, "ap") for one in study.more]
    steps = [_holds(before, after) for before, after in pairwise(more)]
    images = ", ".join(f"{spread_} with {one.images}" for one, spread_ in zip(study.more, more, strict=True))
    few, many = (spread(figures, one, "ap") for one in (study.fewer_around, study.more_in_sector))
    box, hull = ({m: spread(figures, one, m) for m in MEASURES} for one in (study.boxes, study.hulls))
    return (
        Finding("More images are better", f"mAP at 0.5:0.95: {images}", max(steps, key=VERDICTS.index)),
        Finding(
            f"{study.fewer_around.images} images from 360 degrees beat {study.more_in_sector.images} from 180",
            f"mAP at 0.5:0.95: {few} against {many}",
            _holds(many, few),
        ),
        Finding(
            "Labels drawn round hulls beat labels drawn round boxes",
            f"mAP at 0.5: {hull['ap50']} against {box['ap50']}; at 0.75: {hull['ap75']} against {box['ap75']};"
            f" at 0.5:0.95: {hull['ap']} against {box['ap']}",
            _holds(box["ap"], hull["ap"]),
        ),
    )


def _holds(less: Spread, more: Spread) -> str:
    return VERDICTS[0] if more.low > less.high else VERDICTS[1] if more.mean > less.mean else VERDICTS[2]


def table(figures: Figures) -> list[list[str]]:
    """A row a configuration: images, degrees, shape, labels, and its measures."""
    rows: list[list[str]] = []
    for one in figures.study.configurations:
        labels = next(run.labels for run in figures.runs if run.configuration == one)
        measures = [str(spread(figures, one, measure)) for measure in MEASURES]
        rows.append([str(one.images), f"{one.degrees}", one.shape, str(labels), *measures])
    return rows


def findings_picture(figures: Figures) -> bytes:
    """The three findings side by side: a dot a run, the means joined or barred."""
    study = figures.study
    figure = new_figure(10.5, 3.4)
    left, middle, right = figure.subplots(1, 3, width_ratios=[1.25, 1, 1.15])
    for measure, colour in zip(MEASURES, COLOURS, strict=False):
        means = [spread(figures, one, measure).mean for one in study.more]
        left.plot([one.images for one in study.more], means, color=colour, label=MEASURES[measure], linewidth=1.8)
        for one in study.more:
            values = [getattr(run.scores, measure) for run in figures.runs if run.configuration == one]
            left.plot([one.images] * len(values), values, "o", color=colour, markersize=4)
    left.set_xscale("log")
    left.set_xticks([one.images for one in study.more], [str(one.images) for one in study.more])
    left.minorticks_off()
    left.set_xlabel("images from 360 degrees", fontsize=8)
    left.set_title("More images", fontsize=10)
    left.legend(fontsize=7, frameon=False, loc="lower right")
    _bars(middle, figures, (study.fewer_around, study.more_in_sector), ("{0.images} from {0.degrees}°",) * 2)
    middle.set_title("Views from all round", fontsize=10)
    _bars(right, figures, (study.hulls, study.boxes), ("labels of hulls", "labels of boxes"))
    right.set_title(f"Tighter labels ({study.boxes.images} images)", fontsize=10)
    for axes in (left, middle, right):
        plain_axes(axes)
        axes.set_yticks(np.arange(6) / 5)
    left.set_ylim(0, 1)
    for axes in (middle, right):
        axes.set_ylim(0, 1.25)  # the legend stands over the bars
    left.set_ylabel("average precision in the test", fontsize=8)
    return png(figure)


def _bars(axes: "Axes", figures: Figures, ones: Sequence[Configuration], names: Sequence[str]) -> None:
    """Bars by measure, one colour a configuration, a dot a run."""
    places = np.arange(len(MEASURES), dtype=np.float64)
    for number, (one, name) in enumerate(zip(ones, names, strict=True)):
        at = places + 0.36 * (number - 0.5)
        means = [spread(figures, one, measure).mean for measure in MEASURES]
        axes.bar(at, means, width=0.34, color=("#56b4e9", "#e69f00")[number], label=name.format(one))
        for x, measure in zip(at, MEASURES, strict=True):
            values = [getattr(run.scores, measure) for run in figures.runs if run.configuration == one]
            axes.plot([x] * len(values), values, "o", color="#1b232d", markersize=3)
    axes.set_xticks(places, [text.removeprefix("mAP at ") for text in MEASURES.values()])
    axes.set_xlabel("IoU", fontsize=8)
    axes.legend(fontsize=7, frameon=False, loc="upper right")


def precision_picture(figures: Figures) -> bytes:
    """Precision over recall at IoU 0.5, the mean over seeds and classes, a line a configuration."""
    figure = new_figure(6.4, 4.0)
    axes = figure.subplots()
    for one, colour in zip(figures.study.configurations, COLOURS, strict=False):
        lines = [run.scores.precision50 for run in figures.runs if run.configuration == one]
        name = f"{one.images} from {one.degrees}°, {one.shape}"
        axes.plot(np.linspace(0, 1, 101), np.mean(lines, axis=0), color=colour, label=name, linewidth=1.6)
    plain_axes(axes)
    axes.set(xlim=(0, 1), ylim=(0, 1.02))
    axes.set_xlabel("recall", fontsize=8)
    axes.set_ylabel("precision", fontsize=8)
    axes.legend(fontsize=7, frameon=False, loc="lower left")
    return png(figure)


def views_picture(figures: Figures, out: Path) -> bytes:
    """Two images of each recording: of the first scene from all round and from the sector, and of the test."""
    study = figures.study
    chosen = [("scene-1", 0), ("scene-1", 3), ("scene-1", study.around), ("scene-2", 1), ("test", 0), ("test", 1)]
    images = [cv2.imread(str(out / "recordings" / name / "images" / f"{i:05d}.jpg")) for name, i in chosen]
    return cv2.imencode(".png", np.vstack([np.hstack(images[:3]), np.hstack(images[3:])]))[1].tobytes()
