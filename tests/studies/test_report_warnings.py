"""Each warning shows where it should, and not where its limit is not reached."""

from collections.abc import Callable
from typing import Any

import pytest

from ars_web.datasets.options import ExportOptions
from ars_web.datasets.report import SplitCounts
from ars_web.studies.report_facts import (
    BoxFacts,
    CameraFacts,
    ClassFacts,
    FrameCounts,
    Histogram,
    HoleFacts,
    NeighbourFacts,
    RecordingFacts,
    ReportWarning,
    SessionReport,
    ShareFacts,
    SizeFacts,
    SplitFacts,
    ViewFacts,
    VisibilityLook,
)
from ars_web.studies.report_warnings import warnings_of

TENTHS = [i / 10 for i in range(11)]

HOLE = HoleFacts(azimuth=(0, 90), polar=(30, 60), share=0.1, words="none from azimuth 0 to 90 degrees")

VIEWS = ViewFacts(frames=500, views=500, empty_area=0.8, unseen=0.5, unseen_azimuths=80.0, holes=[HOLE])

SIZES = SizeFacts(
    median_px=100, tiny=50, small=50, medium=400, large=50, histogram=Histogram(edges=[0, 1], counts=[500])
)

CLASSES = ("cup", "pan")


def shares(*counts: int) -> ShareFacts:
    return ShareFacts(median=0.5, histogram=Histogram(edges=TENTHS, counts=[*counts, *[0] * (10 - len(counts))]))


def well() -> SessionReport:
    """A report of a session that nothing is to be said of."""
    options = ExportOptions.model_validate({})

    def split(share: float, images: int, labels: int, near: NeighbourFacts | None) -> SplitFacts:
        counts = SplitCounts(
            images=images, negatives=images // 10, labels=2 * labels, classes=dict.fromkeys(CLASSES, labels)
        )
        return SplitFacts(share=share, counts=counts, neighbours=near)

    return SessionReport(
        session_id="s1",
        name="kitchen",
        revision=4,
        shape="box",
        options=options,
        command="",
        frames=FrameCounts(recorded=1000, chosen=1000, labelled=900, negatives=100),
        labels=1000,
        dropped={"not_in_image": 1000, "area": 0, "truncation": 0, "visibility": 0},
        splits={
            "train": split(0.8, 800, 400, None),
            "val": split(0.2, 200, 100, NeighbourFacts(asked=180, twins=36, median_move=0.3, median_turn=20.0)),
        },
        classes=[
            ClassFacts(
                id=i,
                name=name,
                color="#e6194b",
                objects=1,
                labels=500,
                splits={"train": 400, "val": 100},
                frames=500,
                sizes=SIZES,
                visible=shares(0, 0, 0, 0, 0, 0, 0, 0, 0, 500),
                truncated=shares(375, 0, 0, 0, 0, 125),
                views=VIEWS,
            )
            for i, name in enumerate(CLASSES)
        ],
        boxes=[
            BoxFacts(
                id=i + 1,
                name=f"the {name}",
                class_id=i,
                class_name=name,
                size_mm=(100, 100, 100),
                drawn_round="box",
                masks=0,
                in_image=500,
                labels=500,
                median_px=100,
                median_visible=0.3,
                views=VIEWS,
            )
            for i, name in enumerate(CLASSES)
        ],
        visibility=VisibilityLook(frames=1000, every=True),
        recording=RecordingFacts(
            format="tum",
            skipped=0,
            cameras=[CameraFacts(id=0, width=640, height=480, fx=500, fy=500, model="pinhole", frames=1000)],
            path_m=10.0,
            jumps=[],
        ),
        warnings=[],
    )


Change = Callable[[SessionReport], SessionReport]


def whole(**values: Any) -> Change:
    return lambda report: report.model_copy(update=values)


def frames(**values: int) -> Change:
    return lambda report: report.model_copy(update={"frames": report.frames.model_copy(update=values)})


def of_class(**values: Any) -> Change:
    """The second class, changed."""

    def change(report: SessionReport) -> SessionReport:
        first, second = report.classes
        return report.model_copy(update={"classes": [first, second.model_copy(update=values)]})

    return change


def views(**values: float) -> Change:
    return of_class(views=VIEWS.model_copy(update=values))


def sizes(tiny: int) -> Change:
    return of_class(sizes=SIZES.model_copy(update={"tiny": tiny}))


def of_box(**values: Any) -> Change:
    """The second object, changed."""

    def change(report: SessionReport) -> SessionReport:
        first, second = report.boxes
        return report.model_copy(update={"boxes": [first, second.model_copy(update=values)]})

    return change


def of_val(twins: int | None = None, **counts: Any) -> Change:
    def change(report: SessionReport) -> SessionReport:
        val = report.splits["val"]
        assert val.neighbours is not None
        near = val.neighbours if twins is None else val.neighbours.model_copy(update={"twins": twins})
        changed = val.model_copy(update={"neighbours": near, "counts": val.counts.model_copy(update=counts)})
        return report.model_copy(update={"splits": {**report.splits, "val": changed}})

    return change


def dropped(**counts: int) -> Change:
    return lambda report: report.model_copy(update={"dropped": {**report.dropped, **counts}})


def kinds(report: SessionReport) -> list[str]:
    return [warning.kind for warning in warnings_of(report)]


def test_nothing_is_said_of_a_session_at_all_limits() -> None:
    assert warnings_of(well()) == []


@pytest.mark.parametrize(
    ("change", "kind", "says", "remedy"),
    [
        (frames(negatives=0), "no_negatives", "all 1000 frames have a label", "--merge SESSION"),
        (frames(chosen=1, negatives=0), "no_negatives", "the only frame has a label", "--merge SESSION"),
        (frames(negatives=501), "many_negatives", "501 of 1000 frames (50 %) have no label", "--frames-start"),
        (of_class(labels=49), "few_labels", "class 'pan' has 49 labels", "ars-web tour s1 --class pan"),
        (of_class(labels=49, objects=2), "rare_class", "'cup' has 500: 10 times as many", "ars-web tour s1"),
        (sizes(51), "tiny_objects", "51 of 500 labels of class 'pan' (10 %)", "--min-area-px 256"),
        (views(unseen_azimuths=90.0), "seen_from_one_side", "from 90 degrees in one piece", "ars-web tour"),
        (views(unseen=0.76), "empty_bins", "no view from 76 % of all directions; none from azimuth 0", "ars-web tour"),
        (of_val(classes={"cup": 100, "pan": 0}), "class_not_in_split", "'pan' has no label in val", "--split-seed 1"),
        (
            of_box(in_image=0, labels=0),
            "never_in_image",
            "object 2 'the pan' of class 'pan' is in none of the 1000",
            "",
        ),
        (of_box(labels=19), "seldom_labelled", "is labelled in 19 of 1000 frames (2 %)", ""),
        (of_box(median_visible=0.29), "hardly_visible", "'pan' 29 % is visible", "--min-visible 0.3"),
        (dropped(area=430), "many_dropped", "430 of 1430 objects in images (30 %) are smaller than --min-area-px", ""),
        (dropped(truncation=430), "many_dropped", "cut more than --max-truncated", ""),
        (dropped(visibility=430), "many_dropped", "hidden more than --min-visible allows", ""),
        (
            of_class(truncated=shares(374, 0, 0, 0, 0, 126)),
            "much_cut",
            "251 of 1000 labels (25 %)",
            "--max-truncated 0.5",
        ),
        (of_val(twins=37), "neighbours_across_split", "37 of 180 labelled frames of val (21 %)", "--split-by session"),
        (
            whole(recording=well().recording.model_copy(update={"jumps": ["the camera jumps 2 m"]})),
            "camera_jumps",
            "the camera jumps 2 m",
            "--frames-stop",
        ),
    ],
)
def test_a_warning_shows(change: Change, kind: str, says: str, remedy: str) -> None:
    found = {warning.kind: warning for warning in warnings_of(change(well()))}
    assert kind in found
    assert says in found[kind].says
    assert found[kind].why
    assert found[kind].remedy
    assert found[kind].command.startswith(remedy)
    assert not found[kind].grave


@pytest.mark.parametrize(
    "change",
    [
        frames(negatives=1),
        frames(negatives=500),
        of_class(labels=50, sizes=SIZES.model_copy(update={"tiny": 5})),
        sizes(50),
        views(unseen_azimuths=89.0),
        views(unseen=0.75),
        of_box(labels=20),
        of_box(median_visible=None),
        dropped(area=428),
        of_val(twins=36),
    ],
)
def test_and_not_below_its_limit(change: Change) -> None:
    assert kinds(change(well())) == []


@pytest.mark.parametrize(
    ("change", "kind", "says"),
    [
        (whole(boxes=[], classes=[], labels=0), "no_objects", "the session has no boxes"),
        (whole(labels=0), "no_labels", "no object, of 2, is labelled in any of the 1000 chosen frames"),
        (
            of_class(labels=0, sizes=None, objects=1),
            "never_labelled",
            "class 'pan' is never labelled: none of its 1 object has",
        ),
        (of_class(labels=0, sizes=None, views=None, objects=0), "never_labelled", "never labelled: it has no box"),
        (of_val(images=0, labels=0), "empty_split", "val has 0 frames and no label, and 20 % was asked for"),
    ],
)
def test_what_makes_training_senseless_comes_first(change: Change, kind: str, says: str) -> None:
    first, *_ = warnings_of(change(of_box(labels=1)(well())))
    assert (first.kind, first.grave) == (kind, True)
    assert says in first.says


def test_names_in_commands_are_quoted() -> None:
    hostile = of_class(name="a; rm -rf ~", labels=10)(well())
    few = next(warning for warning in warnings_of(hostile) if warning.kind == "few_labels")
    assert few.command == "ars-web tour s1 --class 'a; rm -rf ~'"


def test_frames_divided_one_by_one_are_told_to_go_in_runs() -> None:
    options = ExportOptions.model_validate({"split": {"by": "frame"}})
    (said,) = warnings_of(whole(options=options)(of_val(twins=180)(well())))
    assert isinstance(said, ReportWarning)
    assert said.command == "--split-by block"


def test_little_is_not_nothing_and_nearly_all_is_not_all() -> None:
    seldom = next(one for one in warnings_of(of_box(labels=9)(well())) if one.kind == "seldom_labelled")
    assert seldom.says.endswith("in 9 of 1000 frames (under 1 %)")
    never = next(one for one in warnings_of(of_box(labels=0)(well())) if one.kind == "seldom_labelled")
    assert never.says.endswith("in 0 of 1000 frames (0 %)")
    negatives = next(one for one in warnings_of(frames(negatives=999)(well())) if one.kind == "many_negatives")
    assert "(over 99 %)" in negatives.says


def test_a_class_that_does_not_train_is_graver_than_one_that_is_not_measured() -> None:
    def of_split(name: str) -> Change:
        def change(report: SessionReport) -> SessionReport:
            counts = report.splits[name].counts.model_copy(update={"classes": {"cup": 100, "pan": 0}})
            changed = report.splits[name].model_copy(update={"counts": counts})
            return report.model_copy(update={"splits": {**report.splits, name: changed}})

        return change

    for name, grave in (("train", True), ("val", False)):
        (found,) = warnings_of(of_split(name)(well()))
        assert (found.kind, found.grave) == ("class_not_in_split", grave)


def test_where_nothing_is_labelled_that_is_said_once_and_not_of_each_class() -> None:
    nothing = whole(labels=0, classes=[one.model_copy(update={"labels": 0, "sizes": None}) for one in well().classes])
    found = kinds(nothing(well()))
    assert "no_labels" in found
    assert "never_labelled" not in found
