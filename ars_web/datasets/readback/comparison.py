"""A written dataset beside the session it was made from: what differs, and by how many pixels."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import cv2
import numpy as np
import shapely
from jaxtyping import Float, Int

from ars_web.datasets.counting import Selection, select_labels
from ars_web.datasets.label_functions import UNSEEN, Marks, label_function
from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.readback.mask_comparison import has_mask, masks_of_frame, wrong_pixels
from ars_web.datasets.readback.reader import ReadFrame, ReadLabel
from ars_web.datasets.readback.registry import reader_of
from ars_web.datasets.splits import SPLITS
from ars_web.errors import BadFile
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.heading import heading_edges
from ars_web.geometry.rigid_transform import Transform

FRAMES_AT_ONCE = 256
"""That are compared together: their labels are in memory at once."""

_SLACK = 0.005
"""Pixels beyond the format's own rounding: halves that two ways to compute round differently."""

_SHOWN = 5
"""Differences that are named one by one."""


@dataclass(frozen=True)
class Comparison:
    """What was found.

    Attributes:
        library: whose reader it was.
        frames, labels: that were read.
        missing_frames, unknown_frames: that the plan has and the dataset has not, and the other way round.
        wrong_counts: frames with more labels or fewer than planned.
        wrong_classes: labels of another class than planned.
        wrong_splits: frames in another split than planned.
        wrong_states: keypoints that are said to be in sight, hidden or out of the image and are not.
        wrong_pixels: of masks, that are in one and not in the other.
        largest_error: pixels between what was read and what the session says, of all boxes, rings, points and poses.
        rounding: pixels that the format's own digits may cost.
        where: the place of the largest error; empty where there is none.
        examples: the first differences in words.
    """

    library: str
    frames: int
    labels: int
    missing_frames: int
    unknown_frames: int
    wrong_counts: int
    wrong_classes: int
    wrong_splits: int
    wrong_states: int
    wrong_pixels: int
    largest_error: float
    rounding: float
    where: str
    examples: tuple[str, ...]

    @property
    def differing(self) -> int:
        """Counts that differ, all together."""
        frames = self.missing_frames + self.unknown_frames + self.wrong_counts + self.wrong_splits
        return frames + self.wrong_classes + self.wrong_states + self.wrong_pixels

    @property
    def agrees(self) -> bool:
        """Whether nothing differs by more than the format's digits."""
        return self.differing == 0 and self.largest_error <= self.rounding + _SLACK

    def lines(self) -> Iterator[str]:
        """What was found, in words."""
        yield f"checked: {self.frames} frames and {self.labels} labels, read by {self.library}"
        yield f"counts that differ: {self.differing or 'none'}"
        yield from (f"  {example}" for example in self.examples)
        at = f", at {self.where}" if self.where else ""
        yield f"largest error: {self.largest_error:.4f} px (the format's digits may cost {self.rounding:.4f} px){at}"


class _Tally:
    """What is counted on the way."""

    def __init__(self) -> None:
        self.frames = self.labels = self.unknown = self.counts = self.classes = self.splits = 0
        self.states = self.pixels = 0
        self.error, self.where, self.rounding = 0.0, "", 0.0
        self.examples: list[str] = []

    def say(self, text: str) -> None:
        if len(self.examples) < _SHOWN:
            self.examples.append(text)

    def measure(self, error: float, place: str) -> None:
        # A number that is none is as wrong as can be.
        error = error if np.isfinite(error) else np.inf
        if error > self.error or not self.where:
            self.error, self.where = error, place


def compare(plan: ExportPlan, folder: Path) -> Comparison:
    """Read the dataset in `folder`, which was written from `plan`, and compare each label with the session's.

    Raises:
        BadFile: a file of it cannot be read as its format.
    """
    reader = reader_of(plan.format)
    tally, seen = _Tally(), np.zeros(len(plan.frames), dtype=np.bool_)
    rows = {stem: row for row, stem in enumerate(plan.frames.stems)}
    frames = reader.read(folder, _sizes(plan))
    while batch := list(islice(frames, FRAMES_AT_ONCE)):
        known: dict[int, ReadFrame] = {}
        for frame in batch:
            row = rows.get(frame.stem)
            if row is None or seen[row]:
                tally.unknown += 1
                tally.say(f"{frame.place}: {frame.stem!r} was not to be exported, or is there twice")
                continue
            seen[row] = True
            known[row] = frame
        for session in np.unique(plan.frames.session[list(known)]).tolist() if known else []:
            of_session = sorted(row for row in known if plan.frames.session[row] == session)
            _compare_frames(plan, of_session, [known[row] for row in of_session], reader.ring_function, tally)
    missing = np.flatnonzero(~seen)
    for row in missing[:_SHOWN].tolist():
        tally.say(f"{plan.frames.stems[row]!r} is not in the dataset")
    longest = max(max(c.width, c.height) for session in plan.sessions for c in session.cameras.values())
    return Comparison(
        library=reader.library(),
        frames=tally.frames,
        labels=tally.labels,
        missing_frames=len(missing),
        unknown_frames=tally.unknown,
        wrong_counts=tally.counts,
        wrong_classes=tally.classes,
        wrong_splits=tally.splits,
        wrong_states=tally.states,
        wrong_pixels=tally.pixels,
        largest_error=tally.error,
        rounding=reader.rounding(longest),
        where=tally.where,
        examples=tuple(tally.examples),
    )


def _sizes(plan: ExportPlan) -> dict[str, tuple[int, int]]:
    """Of each image, by stem. A rectified image is as large as its original."""
    cameras = [session.cameras for session in plan.sessions]
    columns = zip(plan.frames.stems, plan.frames.session.tolist(), plan.frames.camera_id.tolist(), strict=True)
    return {stem: (cameras[number][i].width, cameras[number][i].height) for stem, number, i in columns}


def _compare_frames(
    plan: ExportPlan, rows: Sequence[int], frames: Sequence[ReadFrame], ring_function: str | None, tally: _Tally
) -> None:
    """Compare frames of one session."""
    selection = select_labels(plan, np.array(rows), with_visible=False)
    wanted, asked = selection.keep, [label for frame in frames for label in frame.labels]
    rings = _marks(selection, ring_function) if any(label.rings is not None for label in asked) else None
    points = _marks(selection, "keypoints") if any(label.states is not None for label in asked) else None
    session = plan.sessions[int(plan.frames.session[rows[0]])]
    for i, (row, frame) in enumerate(zip(rows, frames, strict=True)):
        tally.frames += 1
        split = SPLITS[int(plan.frames.split[row])]
        if frame.split not in (None, split):
            tally.splits += 1
            tally.say(f"{frame.place}: in {frame.split}, not in {split}")
        camera = selection.shapes.cameras[int(selection.shapes.camera_ids[i])]
        if frame.image_size not in (None, (camera.width, camera.height)):
            raise BadFile(
                frame.place, f"its image is {frame.image_size}, but its camera's are {(camera.width, camera.height)}"
            )
        columns = np.flatnonzero(wanted[i]).tolist()
        masks = masks_of_frame(selection.shapes, i) if any(has_mask(label) for label in frame.labels) else None
        if len(columns) != len(frame.labels):
            tally.counts += 1
            tally.say(f"{frame.place}: {len(frame.labels)} labels, not {len(columns)}")
            continue
        for number, (column, label) in enumerate(zip(columns, frame.labels, strict=True)):
            tally.labels += 1
            place = f"{frame.place}, label {number}"
            name = plan.classes[session.class_of_box[column]].name
            if label.class_name != name:
                tally.classes += 1
                tally.say(f"{place}: {label.class_name!r}, not {name!r}")
            if label.states is not None and points is not None:
                wrong = _differing(label.states, points.states[i, column])
                tally.states += wrong
                if wrong:
                    tally.say(f"{place}: the states of {wrong} keypoints differ")
            if masks is not None and (wrong := wrong_pixels(masks, column, label)):
                tally.pixels += wrong
                tally.say(f"{place}: {wrong} pixels differ")
            for error in _errors(selection, i, column, camera, label):
                tally.measure(error, place)
            if label.heading is not None:
                edges = heading_edges(session.boxes[column], plan.classes[session.class_of_box[column]].symmetry)
                tally.measure(heading_error(camera, selection.shapes.Ts_world_camera[i], label.heading, edges), place)
            if label.rings is not None and rings is not None:
                tally.measure(_ring_error(label.rings, rings.rings.of(i * wanted.shape[1] + column)), place)


def _marks(selection: Selection, function: str | None) -> Marks | None:
    return (
        None if function is None else label_function(function).draw(selection.shapes, selection.table, selection.keep)
    )


def _errors(selection: Selection, frame: int, column: int, camera: Camera, label: ReadLabel) -> Iterator[float]:
    """Pixels between what was read of a label and what the session says."""
    table, shapes = selection.table, selection.shapes
    for read, true in ((label.bbox, table.bbox), (label.bbox_amodal, table.bbox_amodal)):
        if read is not None:
            yield float(np.abs(read - true[frame, column]).max())
    T_world_camera = shapes.Ts_world_camera[frame]
    if label.points is not None:
        # A class's points may be filled up to those of another with points that are not held.
        true = np.full_like(label.points, np.nan)
        known = reprojected(camera, T_world_camera, shapes.keypoints_world[column])[: len(true)]
        true[: len(known)] = known
        held = ~np.isnan(label.points[:, 0])
        yield float(np.abs(label.points - true)[held].max(initial=0.0))
    if label.corners is not None:
        true = reprojected(camera, T_world_camera, shapes.boxes[column].corners_world)
        held = ~np.isnan(label.corners[:, 0])
        yield float(np.abs(label.corners - true)[held].max(initial=0.0))
    if label.centre_camera is not None:
        centres = np.stack(
            [
                T_world_camera[:3, :3] @ label.centre_camera + T_world_camera[:3, 3],
                shapes.boxes[column].T_world_box[:3, 3],
            ]
        )
        read, true = reprojected(camera, T_world_camera, centres)
        if not np.isnan(true).any():
            yield float(np.abs(read - true).max())
    if label.T_camera_box is not None and label.size is not None:
        read = Box(T_world_camera @ label.T_camera_box, label.size)
        yield pose_error(camera, T_world_camera, read, shapes.boxes[column])


def heading_error(
    camera: Camera,
    T_world_camera: Transform,
    read: tuple[float, float],
    edges: Float[np.ndarray, "m 2 3"],
) -> float:
    """By how many pixels the end of a line is off that leaves its start with a heading within those read.

    Of several lines that cannot be told apart any will do. Lines with an end that is not seen are not compared.
    """
    if len(edges) == 0:
        return 0.0 if read[0] == 0.0 else np.inf
    seen = reprojected(camera, T_world_camera, edges.reshape(-1, 3)).reshape(-1, 2, 2)
    if np.isnan(seen).any():
        return 0.0
    across = seen[:, 1] - seen[:, 0]
    angle = np.arctan2(across[:, 1], across[:, 0])
    middle, half = (read[0] + read[1]) / 2, (read[1] - read[0]) / 2
    off = np.abs((angle - middle + np.pi) % (2 * np.pi) - np.pi)
    turned = np.clip(off - half, 0.0, None)
    return float((2 * np.sin(turned / 2) * np.linalg.norm(across, axis=1)).min())


def _differing(read: Int[np.ndarray, "k"], true: Int[np.ndarray, "m"]) -> int:
    """How many states differ; those that only one of the two has are UNSEEN in the other."""
    both = np.full((2, max(len(read), len(true))), UNSEEN)
    both[0, : len(read)], both[1, : len(true)] = read, true
    return int((both[0] != both[1]).sum())


def pose_error(camera: Camera, T_world_camera: Transform, read: Box, true: Box) -> float:
    """The largest distance in pixels between the corners of two boxes as they are seen, whatever the corners' order.

    Corners nearer than a tenth of the box's distance are left out: there a rounded digit moves them without bound.
    """
    depth = (true.corners_world - T_world_camera[:3, 3]) @ T_world_camera[:3, 2]
    ahead = depth > 0.1 * max(float(np.abs(depth).max()), 1e-6)
    ours = reprojected(camera, T_world_camera, true.corners_world[ahead])
    theirs = reprojected(camera, T_world_camera, read.corners_world)
    ours = ours[~np.isnan(ours[:, 0])]
    if len(ours) == 0:
        return 0.0
    distances = np.linalg.norm(ours[:, None] - theirs[None], axis=2)
    return float(np.nanmin(np.where(np.isnan(distances), np.inf, distances), axis=1).max())


def reprojected(
    camera: Camera, T_world_camera: Transform, points_world: Float[np.ndarray, "k 3"]
) -> Float[np.ndarray, "k 2"]:
    """Points as OpenCV projects them, in image coordinates; NaN behind the camera and beyond the valid radius.

    On purpose not the projection that labels are made with: what is checked does not check itself.
    """
    T_camera_world = rigid_transform.invert(T_world_camera)
    points = rigid_transform.transform_points(T_camera_world, points_world)
    found = np.full((len(points), 2), np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        radius = np.linalg.norm(points[:, :2], axis=1) / points[:, 2]
    there = (points[:, 2] > 0) & (radius <= camera.valid_radius)
    if there.any():
        distortion = np.array(camera.distortion)
        if camera.model == "fisheye":
            pixels, _ = cv2.fisheye.projectPoints(
                points[there][:, None], np.zeros(3), np.zeros(3), camera.K, distortion
            )
        else:
            pixels, _ = cv2.projectPoints(points[there], np.zeros(3), np.zeros(3), camera.K, distortion)
        found[there] = pixels.reshape(-1, 2) + 0.5
    return found


def _ring_error(read: Sequence[Float[np.ndarray, "k 2"]], true: Sequence[Float[np.ndarray, "k 2"]]) -> float:
    """The Hausdorff distance between the rings' lines; infinite where only one of the two is there."""
    if not read or not true:
        return 0.0 if not read and not true else np.inf
    lines = [shapely.MultiLineString([np.vstack([ring, ring[:1]]) for ring in rings]) for rings in (read, true)]
    return float(max(lines[0].hausdorff_distance(lines[1]), lines[1].hausdorff_distance(lines[0])))
