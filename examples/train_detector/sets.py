"""The study's sessions and sets: objects boxed by their outlines, frames chosen by the export's options, and the truth
that detectors are measured against."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from ars_web.datasets.jobs import plan_export, run_export
from ars_web.datasets.options import ExportOptions, FrameChoice, SplitChoice
from ars_web.datasets.samples import label_table
from ars_web.demo.scene import Thing
from ars_web.demo.truth import DemoTruth
from ars_web.masks.boxing import ObjectBoxes
from ars_web.recordings.registry import read_recording
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.model import HullOptions, SessionSnapshot
from ars_web.sessions.store import SessionStore
from examples.train_detector.filming import outlines
from examples.train_detector.targets import overlaps

Shape = Literal["box", "hull"]

VIEWS = 16
"""In how many frames an object is outlined."""

LEAST_VISIBLE = 0.3
"""Share of an object that must be seen for it to be labelled, and to be looked for in the test."""

LEAST_PIXELS = 30
"""An object of which less is seen in a test image is not looked for, and not wrong to be found."""


def make_session(store: SessionStore, truth: DemoTruth, things: Sequence[Thing], *, name: str) -> SessionSnapshot:
    """The session of a recording, made unless it is there: each object outlined in VIEWS frames and boxed by those."""
    made = next((summary.id for summary in store.list() if summary.name == name), None)
    if made is None:
        recording = read_recording(truth.folder, format="poses")
        made = store.create(recording, name=name, class_names=truth.class_names).id
    boxed = {box.name for box in store.state(made).boxes.values()}
    boxes = ObjectBoxes(store, SessionEditor(store))
    for place, thing in enumerate(things):
        if thing.name not in boxed:
            boxes.from_masks(
                made,
                outlines(truth, things, place, count=VIEWS),
                class_id=truth.class_names.index(thing.class_name),
                options=HullOptions(orientation="upright", ground=0.0),
                name=thing.name,
                author="study",
            )
    return store.snapshot(made)


def export(sessions: Sequence[SessionSnapshot], folder: Path, *, frames: Sequence[int], shape: Shape) -> None:
    """A COCO set of the same frames of every session, unless it is there."""
    if (folder / "dataset.json").exists():
        return
    options = ExportOptions(
        frames=FrameChoice(list=tuple(frames)),
        shape=shape,
        min_visible=LEAST_VISIBLE,
        split=SplitChoice(train=1.0, val=0.0, test=0.0),
        sessions=tuple(session.id for session in sessions[1:]),
    )
    run_export(plan_export(sessions, format="coco", options=options, out=folder))


def write_truth(truth: DemoTruth, folder: Path) -> None:
    """The test set as COCO: boxes round the objects' true surfaces, cut to the image, whatever hides them.

    Objects that are hardly seen are crowds: nobody has to find them, and who does is not wrong.
    """
    width, height = truth.camera.width, truth.camera.height
    boxes = np.clip(truth.bbox_amodal, 0, [width, height, width, height])
    seen = (truth.visible_fractions >= LEAST_VISIBLE) & (truth.px_visible >= LEAST_PIXELS)
    annotations: list[dict[str, object]] = []
    for i, j in zip(*np.nonzero(truth.px_in_image > 0), strict=True):
        x0, y0, x1, y1 = (round(value, 2) for value in boxes[i, j].tolist())
        annotations.append(
            {
                "id": len(annotations) + 1,
                "image_id": int(i) + 1,
                "category_id": truth.class_names.index(truth.objects[j].class_name) + 1,
                "bbox": [x0, y0, round(x1 - x0, 2), round(y1 - y0, 2)],
                "area": round((x1 - x0) * (y1 - y0), 2),
                "iscrowd": int(not seen[i, j]),
            }
        )
    content = {
        "images": [
            {"id": i + 1, "file_name": name, "width": width, "height": height}
            for i, name in enumerate(truth.image_names)
        ],
        "annotations": annotations,
        "categories": [{"id": i + 1, "name": name} for i, name in enumerate(truth.class_names)],
    }
    (folder / "annotations").mkdir(parents=True, exist_ok=True)
    if not (folder / "images").exists():
        (folder / "images").symlink_to(truth.folder.resolve() / "images", target_is_directory=True)
    (folder / "annotations" / "instances_test.json").write_text(json.dumps(content))


def tightness(made: Sequence[tuple[SessionSnapshot, DemoTruth]], *, frames: Sequence[int], shape: Shape) -> float:
    """Mean IoU of the labels of a shape with the boxes round the true surfaces, both cut to the image, over some frames
    of every session, of the objects that are labelled there."""
    shares: list[float] = []
    for snapshot, truth in made:
        width, height = truth.camera.width, truth.camera.height
        table = label_table(snapshot, list(frames), shape=shape)
        true = np.clip(truth.bbox_amodal[list(frames)], 0, [width, height, width, height])
        kept = table.visible >= LEAST_VISIBLE
        shares += [
            float(overlaps(own, other[None])[0]) for own, other in zip(table.bbox[kept], true[kept], strict=True)
        ]
    return float(np.mean(shares))
