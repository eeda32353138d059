"""What makes training on a session worse, or worthless: each with its value, why it matters and what to do.

Limits are where a person would want to know, not where a detector fails: it depends on the detector.
"""

import shlex
from collections.abc import Iterator

from ars_web.studies.report_facts import (
    TINY_PX,
    BoxFacts,
    ClassFacts,
    ReportWarning,
    SessionReport,
    SplitFacts,
    ViewFacts,
)

UNSEEN = 0.75
"""Share of directions without a view. Who films objects on a table leaves the half below unseen, and cannot help it:
this is that half, and half of what is above."""

UNSEEN_AZIMUTHS = 90.0
"""Degrees round an object without a view. The paper's 3,000 images from 360 degrees trained a better detector than its
5,000 from 180."""

TINY = 0.1
"""Share of a class's labels that are tiny. One in ten decides a tenth of its recall."""

RARE = 0.1
"""Of the labels that the commonest class has. Ten times rarer is where a detector's loss hardly notices a class."""

HIDDEN = 0.3
"""Visible share, in the median. Detectors are taught mostly the nearer objects then."""

SELDOM = 0.02
"""Share of the frames. An object is in fewer where it lies at the recording's edge, or its box is in a wrong place."""

MANY_NEGATIVES = 0.5
"""Share of the frames without any label. More cost time in training and teach only the background."""

CUT = 0.5
"""Share of an outline outside the image from which a label says little of how the object looks."""

MANY_CUT = 0.25
"""Share of labels cut that much."""

MANY_DROPPED = 0.3
"""Share of the objects in images that one rule leaves without a label: the detector is taught that they are
background."""

MANY_TWINS = 0.2
"""Share of validation frames with a twin that trains. Blocks leave some, at their ends."""

FEW_LABELS = 50
"""Labels of a class. Detectors are trained with hundreds and more, and an average precision over few of them is
chance."""

_RULES = {
    "area": ("are smaller than --min-area-px", "lower --min-area-px, or film from nearer"),
    "truncation": ("are cut more than --max-truncated", "raise --max-truncated, or film from farther away"),
    "visibility": ("are hidden more than --min-visible allows", "lower --min-visible, or move what is in the way"),
}


def warnings_of(report: SessionReport) -> list[ReportWarning]:
    """What to warn of, the graver things first."""
    if not report.boxes:
        return [
            _warning(
                "no_objects",
                says="the session has no boxes, so there is nothing to label",
                why="every frame would be written as background",
                remedy="put a box round each object, in the page or from a file",
                command=f"ars-web boxes import {report.session_id} BOXES.json",
                grave=True,
            )
        ]
    found = [
        *_whole(report),
        *(warning for one in report.classes for warning in _class(report, one)),
        *(warning for one in report.boxes for warning in _box(report, one)),
        *_dropped(report),
        *(warning for name, split in report.splits.items() for warning in _split(report, name, split)),
        *_recording(report),
    ]
    return sorted(found, key=lambda warning: not warning.grave)


def _whole(report: SessionReport) -> Iterator[ReportWarning]:
    frames = report.frames
    if not report.labels:
        yield _warning(
            "no_labels",
            says=f"no object, of {len(report.boxes)}, is labelled in any of the {frames.chosen} chosen frames",
            why="there is nothing to learn",
            remedy="look whether the boxes are where the camera looked, choose other frames, or loosen the rules that"
            " drop labels",
            command=f"ars-web preview {report.session_id} --out pictures",
            grave=True,
        )
    elif not frames.negatives:
        yield _warning(
            "no_negatives",
            says=f"all {frames.chosen} frames have a label" if frames.chosen > 1 else "the only frame has a label",
            why="a detector that never saw a scene without objects finds some in everything; up to a tenth of the"
            " frames may show none",
            remedy="film the place without the objects, too, and merge that session",
            command="--merge SESSION",
        )
    elif frames.negatives > MANY_NEGATIVES * frames.chosen:
        yield _warning(
            "many_negatives",
            says=f"{frames.negatives} of {frames.chosen} frames ({_percent(frames.negatives / frames.chosen)}) have no"
            " label",
            why="they cost as much training time as others and teach only what is background",
            remedy="leave out the parts of the recording that show no object",
            command="--frames-start N --frames-stop N",
        )


def _class(report: SessionReport, one: ClassFacts) -> Iterator[ReportWarning]:
    tour = f"ars-web tour {report.session_id} --class {shlex.quote(one.name)}"
    if not one.labels or one.sizes is None or one.views is None:
        if report.labels or not one.objects:
            yield _warning(
                "never_labelled",
                about=one.name,
                says=f"class {one.name!r} is never labelled: "
                + (f"none of its {_objects(one.objects)} has a label" if one.objects else "it has no box"),
                why="a detector that has the class can only be wrong about it, and its average precision is 0 or none",
                remedy="delete the class, or put a box round an object of it where the camera looked",
                grave=True,
            )
        return
    if one.labels < FEW_LABELS:
        yield _warning(
            "few_labels",
            about=one.name,
            says=f"class {one.name!r} has {_labels(one.labels)}",
            why=f"below some {FEW_LABELS} a detector learns the pictures by heart, and what it scores is chance",
            remedy="film it longer or from more sides, and take more frames",
            command="--frames-step 1" if report.options.frames.step > 1 else tour,
        )
    most = max(report.classes, key=lambda other: other.labels)
    if one.labels < RARE * most.labels:
        yield _warning(
            "rare_class",
            about=one.name,
            says=f"class {one.name!r} has {_labels(one.labels)}, {most.name!r} has {most.labels}: "
            f"{most.labels / one.labels:.0f} times as many",
            why="training hardly notices a class that is so much rarer, and finds it least",
            remedy="film more of it, or put more objects of it into the scene",
            command=tour,
        )
    if one.sizes.tiny > TINY * one.labels:
        yield _warning(
            "tiny_objects",
            about=one.name,
            says=f"{one.sizes.tiny} of {_labels(one.labels)} of class {one.name!r}"
            f" ({_percent(one.sizes.tiny / one.labels)}) are smaller than {TINY_PX:g} x {TINY_PX:g} pixels",
            why="detectors shrink their images besides: at most sizes of networks nothing is left of such an object",
            remedy="film from nearer, train on larger images or on crops, or leave the smallest labels out",
            command=f"--min-area-px {TINY_PX**2:g}",
        )
    if one.views.unseen_azimuths >= UNSEEN_AZIMUTHS:
        yield _warning(
            "seen_from_one_side",
            about=one.name,
            says=f"objects of class {one.name!r} are seen from one side: from"
            f" {one.views.unseen_azimuths:.0f} degrees in one piece of the way round them there is"
            f" no view{_hole(one.views)}",
            why="a detector knows an object from where it was filmed: 3,000 images from all around train a better one"
            " than 5,000 from one side",
            remedy="film from there, too, or turn the object and film again; a class that looks alike from there needs"
            " its symmetry set",
            command=tour,
        )
    elif one.views.unseen > UNSEEN:
        yield _warning(
            "empty_bins",
            about=one.name,
            says=f"objects of class {one.name!r} have no view from {_percent(one.views.unseen)} of all"
            f" directions{_hole(one.views)}",
            why="where the camera will look from there, the detector does not know the object",
            remedy="film from more heights, or lay the object on its side and film again; a class that looks alike from"
            " there needs its symmetry set",
            command=tour,
        )
    for name, split in report.splits.items():
        if split.counts.images and split.counts.labels and not split.counts.classes.get(one.name):
            yield _warning(
                "class_not_in_split",
                about=one.name,
                says=f"class {one.name!r} has no label in {name}",
                why="it is never learnt" if name == "train" else "how well it is found is then not measured",
                remedy="divide otherwise, or take more frames",
                command=f"--split-seed {report.options.split.seed + 1}",
                grave=name == "train",
            )


def _box(report: SessionReport, one: BoxFacts) -> Iterator[ReportWarning]:
    called = f"object {one.id} {one.name!r} of class {one.class_name!r}"
    if not one.in_image:
        yield _warning(
            "never_in_image",
            about=one.name,
            says=f"{called} is in none of the {report.frames.chosen} frames",
            why="it adds nothing; most often its box is not where the object is",
            remedy="look at the box in the scene and put it right, or delete it",
        )
        return
    if one.labels < SELDOM * report.frames.chosen:
        yield _warning(
            "seldom_labelled",
            about=one.name,
            says=f"{called} is labelled in {one.labels} of {report.frames.chosen} frames"
            f" ({_percent(one.labels / report.frames.chosen)})",
            why="it is hardly learnt; if it stands in the middle of the scene, its box is in a wrong place",
            remedy="look at the box in the scene, or film the object, too",
        )
    if one.median_visible is not None and one.median_visible < HIDDEN:
        yield _warning(
            "hardly_visible",
            about=one.name,
            says=f"of {called} {_percent(one.median_visible)} is visible in the median of its labels",
            why="the detector is shown what stands before it, and told that this is the object",
            remedy="leave out what is hidden so much, move what is in the way, or see whether two boxes are in the same"
            " place",
            command=f"--min-visible {HIDDEN:g}",
        )


def _dropped(report: SessionReport) -> Iterator[ReportWarning]:
    in_images = sum(count for reason, count in report.dropped.items() if reason in _RULES) + report.labels
    for reason, (says, remedy) in _RULES.items():
        count = report.dropped[reason]
        if count > MANY_DROPPED * in_images:
            yield _warning(
                "many_dropped",
                about=reason,
                says=f"{count} of {in_images} objects in images ({_percent(count / in_images)}) {says}, and have no"
                " label",
                why="they stay in the pictures, where the detector is taught that they are background",
                remedy=remedy,
            )
    cut = sum(_above(one, CUT) for one in report.classes)
    if report.labels and cut > MANY_CUT * report.labels:
        yield _warning(
            "much_cut",
            says=f"{cut} of {_labels(report.labels)} ({_percent(cut / report.labels)}) lie for half or more outside the"
            " image",
            why="what is left of an object at the border looks like other things",
            remedy="film from farther away, or leave such labels out",
            command=f"--max-truncated {CUT:g}",
        )


def _split(report: SessionReport, name: str, split: SplitFacts) -> Iterator[ReportWarning]:
    if not split.counts.labels:
        if report.labels:
            yield _warning(
                "empty_split",
                about=name,
                says=f"{name} has {split.counts.images} frames and no label, and {_percent(split.share)} was asked for",
                why="there is nothing to learn from" if name == "train" else "there is nothing to measure against",
                remedy="take more frames, divide by single frames, or with another seed",
                command=f"--split-seed {report.options.split.seed + 1}",
                grave=True,
            )
        return
    near = split.neighbours
    if near is not None and near.twins > MANY_TWINS * near.asked:
        by_frame = report.options.split.by == "frame"
        yield _warning(
            "neighbours_across_split",
            about=name,
            says=f"{near.twins} of {near.asked} labelled frames of {name} ({_percent(near.twins / near.asked)}) have a"
            " twin that trains: the camera within 5 % of its distance to the nearest object, and turned by less than"
            " 5 degrees",
            why="what is measured on them is how well the detector remembers, not how well it finds",
            remedy="divide by runs of frames"
            if by_frame
            else "record a second time for validation, and divide by whole sessions; where the camera stands long, take"
            " fewer frames",
            command="--split-by block" if by_frame else "--split-by session --merge SESSION",
        )


def _recording(report: SessionReport) -> Iterator[ReportWarning]:
    for line in report.recording.jumps:
        yield _warning(
            "camera_jumps",
            says=line,
            why="from there on labels may lie beside the objects",
            remedy="look at a few frames after it; if they are off, leave them out",
            command="--frames-stop N",
        )


def _hole(views: ViewFacts) -> str:
    if not views.holes:
        return ""
    hole = views.holes[0]
    return f"; {hole.words}"


def _above(one: ClassFacts, share: float) -> int:
    if one.truncated is None:
        return 0
    histogram = one.truncated.histogram
    return sum(count for edge, count in zip(histogram.edges[:-1], histogram.counts, strict=True) if edge >= share)


def _warning(
    kind: str, *, says: str, why: str, remedy: str, about: str = "", command: str = "", grave: bool = False
) -> ReportWarning:
    return ReportWarning(kind=kind, grave=grave, about=about, says=says, why=why, remedy=remedy, command=command)


def _labels(count: int) -> str:
    return f"{count} label{'' if count == 1 else 's'}"


def _objects(count: int) -> str:
    return f"{count} object{'' if count == 1 else 's'}"


def _percent(share: float) -> str:
    # Rounded to whole percent, nothing that is there is none, and not all is all.
    if 0.0 < share < 0.01:
        return "under 1 %"
    return "over 99 %" if 0.99 < share < 1.0 else f"{100.0 * share:.0f} %"
