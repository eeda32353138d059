"""The facts of a report: a session as an export would write it, counted and judged."""

import math
import shlex
from typing import cast

import numpy as np
from jaxtyping import Float

from ars_web.datasets.counting import split_counts
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.report import SplitCounts
from ars_web.datasets.splits import SPLITS
from ars_web.recordings.overview import jumps, path_length
from ars_web.sessions.model import SessionSnapshot, SessionSummary
from ars_web.studies.report_facts import (
    LARGE_PX,
    SMALL_PX,
    TINY_PX,
    BoxFacts,
    CameraFacts,
    ClassFacts,
    FrameCounts,
    Histogram,
    HoleFacts,
    NeighbourFacts,
    RecordingFacts,
    SessionReport,
    ShareFacts,
    SizeFacts,
    SplitFacts,
    SplitName,
    ViewFacts,
    VisibilityLook,
)
from ars_web.studies.report_warnings import warnings_of
from ars_web.studies.session_study import SeenFrom, SessionStudy
from ars_web.studies.split_neighbours import Neighbours
from ars_web.studies.view_holes import holes_of, unseen_azimuths

SIZE_EDGES: tuple[float, ...] = (0, 4, 8, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512, 768, 1024, 65536)
"""Pixels; COCO's limits are among them, and no image is larger than the last."""

SHARE_EDGES: tuple[float, ...] = tuple(i / 10 for i in range(11))


def session_report(study: SessionStudy, recorded: SessionSummary) -> SessionReport:
    """What is to be said of a session that was looked at; `recorded` tells where it comes from."""
    labels, snapshot = study.labels, study.snapshot
    planned = labels.plan.sessions[0]
    chosen, labelled = len(labels.plan.frames), int(labels.keep.any(axis=1).sum())
    facts = SessionReport(
        session_id=snapshot.id,
        name=snapshot.state.name,
        revision=snapshot.state.revision,
        shape=" or ".join(kind for kind in ("mesh", "hull", "box") if kind in planned.drawn_round),
        options=study.options,
        command=export_command(snapshot, study.options),
        frames=FrameCounts(
            recorded=len(snapshot.frames),
            chosen=chosen,
            labelled=labelled,
            negatives=chosen - labelled,
        ),
        labels=int(labels.keep.sum()),
        dropped=labels.dropped,
        splits=_splits(study),
        classes=[_class(study, place, class_id) for place, class_id in enumerate(sorted(snapshot.state.classes))],
        boxes=[_box(study, column, box_id) for column, box_id in enumerate(planned.box_ids)],
        visibility=VisibilityLook(frames=len(labels.looked_at), every=len(labels.looked_at) == chosen),
        recording=_recording(snapshot, recorded),
        warnings=[],
    )
    return facts.model_copy(update={"warnings": warnings_of(facts)})


def export_command(snapshot: SessionSnapshot, options: ExportOptions) -> str:
    """The command that writes what was looked at, as YOLO, which every other format may stand for."""
    words = ["ars-web", "export", snapshot.id, "--format", "yolo", "--out", "dataset"]
    given = options.model_dump(exclude_defaults=True)
    for name, value in given.items():
        for key, part in value.items() if isinstance(value, dict) else [("", value)]:
            option = "--" + "-".join(filter(None, (name, key))).replace("_", "-")
            between = ":" if key == "sector" else ","
            words += [option, between.join(map(str, part)) if isinstance(part, list | tuple) else str(part)]
    return shlex.join(words)


def _splits(study: SessionStudy) -> dict[SplitName, SplitFacts]:
    plan, choice = study.labels.plan, study.options.split
    counted = split_counts(
        [SPLITS[i] for i in plan.frames.split.tolist()],
        study.labels.keep,
        plan.sessions[0].class_of_box,
        plan.class_names,
    )
    nothing = SplitCounts(images=0, negatives=0, labels=0, classes=dict.fromkeys(plan.class_names, 0))
    found: dict[SplitName, SplitFacts] = {}
    for name, share in zip(SPLITS, (choice.train, choice.val, choice.test), strict=True):
        if share > 0 or name in counted:
            near = _near(study.neighbours.get(name))
            found[name] = SplitFacts(share=share, counts=counted.get(name, nothing), neighbours=near)
    return found


def _near(near: Neighbours | None) -> NeighbourFacts | None:
    if near is None:
        return None
    return NeighbourFacts(
        asked=len(near.rows),
        twins=int(near.twins.sum()),
        median_move=float(np.median(near.move)),
        median_turn=math.degrees(float(np.median(near.turn))),
    )


def _class(study: SessionStudy, place: int, class_id: int) -> ClassFacts:
    labels, a_class = study.labels, study.snapshot.state.classes[class_id]
    columns = [column for column, one in enumerate(labels.plan.sessions[0].class_of_box) if one == place]
    keep = labels.keep[:, columns]
    of_split = labels.plan.frames.split
    return ClassFacts(
        id=class_id,
        name=a_class.name,
        color=a_class.color,
        objects=len(columns),
        labels=int(keep.sum()),
        splits={name: int(keep[of_split == i].sum()) for i, name in enumerate(SPLITS) if (of_split == i).any()},
        frames=int(keep.any(axis=1).sum()),
        sizes=_sizes(labels.side[:, columns][keep]),
        visible=_shares(labels.visible[:, columns][keep[labels.looked_at]]),
        truncated=_shares(labels.truncated[:, columns][keep]),
        views=_views(study.classes[class_id]) if class_id in study.classes else None,
    )


def _box(study: SessionStudy, column: int, box_id: int) -> BoxFacts:
    labels, state = study.labels, study.snapshot.state
    box = state.boxes[box_id]
    keep = labels.keep[:, column]
    seen = labels.visible[:, column][keep[labels.looked_at]]
    x, y, z = (1000.0 * box.box.size).round(3).tolist()
    return BoxFacts(
        id=box_id,
        name=box.name,
        class_id=box.class_id,
        class_name=state.classes[box.class_id].name,
        size_mm=(x, y, z),
        drawn_round=labels.plan.sessions[0].drawn_round[column],
        masks=sum(mask.accepted for mask in state.masks_of(box_id)),
        in_image=int(labels.in_image[:, column].sum()),
        labels=int(keep.sum()),
        median_px=float(np.median(labels.side[:, column][keep])) if keep.any() else None,
        median_visible=float(np.median(seen)) if len(seen) else None,
        views=_views(study.boxes[box_id]),
    )


def _views(seen: SeenFrom) -> ViewFacts:
    return ViewFacts(
        frames=seen.fine.frames,
        views=seen.fine.views,
        empty_area=seen.fine.empty_area,
        unseen=seen.coarse.empty_area,
        unseen_azimuths=unseen_azimuths(seen.fine),
        holes=[
            HoleFacts(azimuth=hole.azimuth, polar=hole.polar, share=hole.share, words=hole.words)
            for hole in holes_of(seen.fine)
        ],
    )


def _sizes(sides: Float[np.ndarray, "m"]) -> SizeFacts | None:
    if not len(sides):
        return None
    small, large = int((sides < SMALL_PX).sum()), int((sides >= LARGE_PX).sum())
    return SizeFacts(
        median_px=float(np.median(sides)),
        tiny=int((sides < TINY_PX).sum()),
        small=small,
        medium=len(sides) - small - large,
        large=large,
        histogram=_histogram(sides, SIZE_EDGES),
    )


def _shares(shares: Float[np.ndarray, "m"]) -> ShareFacts | None:
    if not len(shares):
        return None
    return ShareFacts(median=float(np.median(shares)), histogram=_histogram(shares, SHARE_EDGES))


def _histogram(values: Float[np.ndarray, "m"], edges: tuple[float, ...]) -> Histogram:
    # In the values' own precision: an edge of 0.1 is not 0.1 in every one.
    cut = np.array(edges, dtype=values.dtype)
    return Histogram(edges=list(edges), counts=cast("list[int]", np.histogram(values, bins=cut)[0].tolist()))


def _recording(snapshot: SessionSnapshot, recorded: SessionSummary) -> RecordingFacts:
    centres, ids = snapshot.frames.Ts_world_camera[:, :3, 3], snapshot.frames.camera_ids
    return RecordingFacts(
        format=recorded.format,
        skipped=recorded.skipped,
        cameras=[
            CameraFacts(
                id=camera_id,
                width=camera.width,
                height=camera.height,
                fx=camera.fx,
                fy=camera.fy,
                model=camera.model,
                frames=int((ids == camera_id).sum()),
            )
            for camera_id, camera in sorted(snapshot.cameras.items())
        ],
        path_m=path_length(centres, ids),
        jumps=jumps(centres, ids),
    )
