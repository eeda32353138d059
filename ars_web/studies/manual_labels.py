"""Labels that people made, in a session's frames and under its classes' names."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ars_web.annotations.foreign import ForeignLabels, ForeignOutline, ForeignRectangle, LeftOut
from ars_web.errors import BadFile, BadInput
from ars_web.sessions.label_matching import in_pixels, matched_images
from ars_web.sessions.model import SessionSnapshot


@dataclass(frozen=True, eq=False)
class ManualLabels:
    """n rectangles, and the frames that were looked at.

    Attributes:
        frames: indices of the frames that somebody labelled, with nothing perhaps, ascending.
        frame: (n,) the frame of each rectangle.
        class_names: n of them, as the session calls the class; those that it has not keep their own.
        bbox: (n, 4) x0, y0, x1, y1, image coordinates.
        left_out: labels that are not compared.
        notes: how images were understood, in words.
    """

    frames: tuple[int, ...]
    frame: Int[np.ndarray, "n"]
    class_names: tuple[str, ...]
    bbox: Float[np.ndarray, "n 4"]
    left_out: tuple[LeftOut, ...]
    notes: tuple[str, ...]


def manual_labels(labels: ForeignLabels, snapshot: SessionSnapshot, *, classes: Mapping[str, str]) -> ManualLabels:
    """The rectangles of a file in the frames of a session; of an outline the rectangle round it.

    Args:
        classes: what the session calls a class of the file, for those that have two names.

    Raises:
        BadFile: the file's images are not the session's, have another size, or show poses and no rectangles.
        BadInput: `classes` names a class that the file or the session has not.
    """
    if labels.poses:
        raise BadFile(labels.source, "holds poses; a comparison needs rectangles or outlines, by hand, in the images")
    if not labels.images:
        raise BadFile(labels.source, "lists no image, so nothing tells which frames were labelled")
    frames, cameras = snapshot.frames, snapshot.cameras
    matching = matched_images(labels, frames, cameras, session=snapshot.id)
    labels = in_pixels(labels, matching, frames, cameras)
    drawn = [*labels.outlines, *labels.rectangles]
    _check_classes(drawn, snapshot, classes)
    # In the file's order of images, so that the same labels are told in the same order whatever they are.
    kept = sorted((one for one in drawn if one.image in matching.frames), key=lambda one: matching.frames[one.image])
    outside = [matching.left_out(one.image, one.where) for one in drawn if one.image not in matching.frames]
    unknown = [image.called for place, image in enumerate(labels.images) if place not in matching.frames]
    notes = list(matching.notes)
    if unknown:
        shown = ", ".join(unknown[:3]) + (", …" if len(unknown) > 3 else "")
        notes.append(f"{len(unknown)} of its {len(labels.images)} images are not compared, no frames: {shown}")
    return ManualLabels(
        tuple(sorted(set(matching.frames.values()))),
        np.array([matching.frames[one.image] for one in kept], dtype=np.int64),
        tuple(classes.get(one.class_name, one.class_name) for one in kept),
        np.array([_bbox(one) for one in kept], dtype=np.float64).reshape(-1, 4),
        (*labels.left_out, *outside),
        tuple(notes),
    )


def _check_classes(
    drawn: list[ForeignOutline | ForeignRectangle], snapshot: SessionSnapshot, classes: Mapping[str, str]
) -> None:
    theirs = Counter(one.class_name for one in drawn)
    ours = {a_class.name for a_class in snapshot.state.classes.values()}
    for manual, session in classes.items():
        if manual not in theirs:
            raise BadInput(f"no manual label is of class {manual!r}; their classes are {_listed(theirs)}")
        if session not in ours:
            raise BadInput(f"the session has no class {session!r}; its classes are {_listed(ours)}")


def _listed(names: Mapping[str, int] | set[str]) -> str:
    return ", ".join(sorted(names)) or "none"


def _bbox(one: ForeignOutline | ForeignRectangle) -> Float[np.ndarray, "4"]:
    if isinstance(one, ForeignRectangle):
        return one.bbox
    points = np.concatenate([polygon.outer for polygon in one.polygons])
    return np.concatenate([points.min(axis=0), points.max(axis=0)])
