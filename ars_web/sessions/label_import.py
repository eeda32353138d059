"""What labels of another program would be in a session: its objects, each with a place in the world or with outlines
and rectangles in frames. Pure; `label_editing.py` stores it."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
import shapely
from jaxtyping import Float

from ars_web.annotations.foreign import ForeignLabels, ForeignOutline, ForeignRectangle, LeftOut
from ars_web.errors import BadFile, BadInput
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.mask_regions import polygons_of, region
from ars_web.geometry.polygon import Polygon
from ars_web.geometry.resting_objects import resting_objects
from ars_web.geometry.symmetry import NO_SYMMETRY, Symmetry
from ars_web.sessions.label_matching import Matching, in_pixels, matched_images
from ars_web.sessions.model import FrameTable
from ars_web.sessions.names import checked_name
from ars_web.sessions.outlines import checked_polygons

UNTOLD = (
    "its image has several objects of its class, and nothing says which of them is which in the other images: give"
    " each a track_id, the same in all images (COCO: in the annotation or its attributes; CVAT: a track, or an"
    " attribute of that name)"
)
TWICE = "its object has a rectangle in that image already"

T = TypeVar("T", ForeignOutline, ForeignRectangle)


@dataclass(frozen=True, eq=False)
class PlannedObject:
    """An object as a file tells of it.

    Attributes:
        class_name: as sessions keep it.
        box: where it is, as poses tell; None: they do not.
        symmetry: of its class.
        outlines: by frame.
        rectangles: (4,) x0, y0, x1, y1 by frame, image coordinates.
        wheres: what the file calls its outlines and rectangles, or the first of its poses.
    """

    class_name: str
    box: Box | None = None
    symmetry: Symmetry = NO_SYMMETRY
    outlines: Mapping[int, tuple[Polygon, ...]] = field(default_factory=dict[int, tuple[Polygon, ...]])
    rectangles: Mapping[int, Float[np.ndarray, "4"]] = field(default_factory=dict[int, np.ndarray])
    wheres: Mapping[int, str] = field(default_factory=dict[int, str])


@dataclass(frozen=True, eq=False)
class LabelPlan:
    """What of a file can come in.

    Attributes:
        objects: in the file's order.
        left_out: what cannot.
        notes: what a person should know of how the file was understood.
    """

    objects: tuple[PlannedObject, ...]
    left_out: tuple[LeftOut, ...]
    notes: tuple[str, ...]


def planned_labels(
    labels: ForeignLabels, frames: FrameTable, cameras: Mapping[int, Camera], *, session: str = ""
) -> LabelPlan:
    """The objects of a file, in the frames of a session, whose id is in the names of exports of several.

    Raises:
        BadFile: its images are not the session's or have another size, or a class's name cannot be used.
    """
    matching = matched_images(labels, frames, cameras, session=session)
    labels = in_pixels(labels, matching, frames, cameras)
    posed, unplaced = _posed(labels, matching, frames)
    seen, unseen = _seen(labels, matching, frames, cameras)
    return LabelPlan((*posed, *seen), (*labels.left_out, *unplaced, *unseen), matching.notes)


def _posed(labels: ForeignLabels, matching: Matching, frames: FrameTable) -> tuple[list[PlannedObject], list[LeftOut]]:
    """The objects that poses are of, by the session's cameras."""
    objects: list[PlannedObject] = []
    left_out = [matching.left_out(p.image, p.where) for p in labels.poses if p.image not in matching.frames]
    for key, model in labels.models.items():
        poses = [pose for pose in labels.poses if pose.model == key and pose.image in matching.frames]
        poses.sort(key=lambda pose: matching.frames[pose.image])
        if not poses:
            continue
        class_name = _class_name(labels, model.class_name)
        rows = np.array([matching.frames[pose.image] for pose in poses], dtype=np.int64)
        Ts_camera_object = np.array([pose.T_camera_object for pose in poses])
        Ts_world_box = frames.Ts_world_camera[rows] @ Ts_camera_object @ model.T_object_box
        placed = resting_objects(rows, Ts_world_box, size=model.size, symmetry=model.symmetry)
        for place in placed:
            own = [poses[row] for row in place.rows.tolist()]
            if place.problem is not None:
                left_out.extend(LeftOut(place.problem, pose.where) for pose in own)
                continue
            wheres = {matching.frames[pose.image]: pose.where for pose in own}
            box = Box(place.T_world_box, model.size)
            objects.append(PlannedObject(class_name, box, symmetry=model.symmetry, wheres=wheres))
    return objects, left_out


def _seen(
    labels: ForeignLabels, matching: Matching, frames: FrameTable, cameras: Mapping[int, Camera]
) -> tuple[list[PlannedObject], list[LeftOut]]:
    """The objects that outlines and rectangles are of."""
    left_out = [
        matching.left_out(one.image, one.where)
        for one in (*labels.outlines, *labels.rectangles)
        if one.image not in matching.frames
    ]
    outlines = [one for one in labels.outlines if one.image in matching.frames]
    rectangles = [one for one in labels.rectangles if one.image in matching.frames]
    untold = _untold_classes((*outlines, *rectangles))
    for one in (*outlines, *rectangles):
        if one.instance is None and one.class_name in untold:
            left_out.append(LeftOut(UNTOLD, one.where))
    objects: list[PlannedObject] = []
    by_object = _by_object(outlines, untold)
    rectangles_by_object = _by_object(rectangles, untold)
    for key in dict.fromkeys((*by_object, *rectangles_by_object)):
        class_name, _ = key
        drawn: dict[int, tuple[Polygon, ...]] = {}
        boxed: dict[int, np.ndarray] = {}
        wheres: dict[int, str] = {}
        for frame, pieces in _by_frame(by_object.get(key, []), matching).items():
            camera = cameras[int(frames.camera_ids[frame])]
            try:
                drawn[frame] = checked_polygons(_joined(pieces), width=camera.width, height=camera.height)
            except BadInput as error:
                left_out.extend(LeftOut(str(error), piece.where) for piece in pieces)
            else:
                wheres[frame] = pieces[0].where
        for frame, pieces in _by_frame(rectangles_by_object.get(key, []), matching).items():
            if frame not in drawn:
                boxed[frame] = pieces[0].bbox
                wheres[frame] = pieces[0].where
            left_out.extend(LeftOut(TWICE, piece.where) for piece in pieces[1 if frame in boxed else 0 :])
        if drawn or boxed:
            objects.append(
                PlannedObject(_class_name(labels, class_name), outlines=drawn, rectangles=boxed, wheres=wheres)
            )
    return objects, left_out


def _untold_classes(seen: Sequence[ForeignOutline | ForeignRectangle]) -> set[str]:
    """Classes of which an image has several objects that the file does not tell from each other.

    An outline and a rectangle are of different objects: the formats write them for the same one in one annotation.
    """
    counts = Counter((one.image, one.class_name) for one in seen if one.instance is None)
    return {class_name for (_, class_name), count in counts.items() if count > 1}


def _by_object(seen: Iterable[T], untold: set[str]) -> dict[tuple[str, str | None], list[T]]:
    found: dict[tuple[str, str | None], list[T]] = {}
    for one in seen:
        if one.instance is not None or one.class_name not in untold:
            found.setdefault((one.class_name, one.instance), []).append(one)
    return found


def _by_frame(seen: Sequence[T], matching: Matching) -> dict[int, list[T]]:
    found: dict[int, list[T]] = {}
    for one in seen:
        found.setdefault(matching.frames[one.image], []).append(one)
    return dict(sorted(found.items()))


def _joined(pieces: Sequence[ForeignOutline]) -> tuple[Polygon, ...]:
    """One outline of an object's pieces in an image."""
    if len(pieces) == 1:
        return pieces[0].polygons
    return polygons_of(shapely.union_all([region(piece.polygons) for piece in pieces]))


def _class_name(labels: ForeignLabels, name: str) -> str:
    try:
        return checked_name(name, what="a class")
    except BadInput as error:
        raise BadFile(labels.source, str(error)) from error
