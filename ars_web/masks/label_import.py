"""Labels of another program brought into a session: poses say where a box is, outlines become masks and the box of
their hull, rectangles the box that fits them."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float

from ars_web.annotations.foreign import LeftOut
from ars_web.annotations.registry import read_labels
from ars_web.errors import BadInput
from ars_web.geometry.box import Box
from ars_web.geometry.box_fit import BoxFit, fit_box
from ars_web.geometry.box_sighting import Sighting
from ars_web.geometry.hull_box import box_of_hull
from ars_web.geometry.polygon import Polygon
from ars_web.geometry.visual_hull import angle_between, visual_hull
from ars_web.masks.views import Photographs, camera_of, object_of, photographs, views_of
from ars_web.recordings.options import NOTHING_SAID, ReadOptions
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.edits import BoxChange, ClassChange, Edit
from ars_web.sessions.label_editing import ObjectLabels, object_ids
from ars_web.sessions.label_import import PlannedObject, planned_labels
from ars_web.sessions.model import HullOptions, ObjectClass
from ars_web.sessions.object_drafting import MaskDraft
from ars_web.sessions.store import SessionStore

MOST_VIEWS = 24
"""Of an object's outlines, evenly spread, that count for its hull: more hardly make it smaller, only slower."""

SMALL_ANGLE = math.radians(60.0)
"""Between the views of an object's outlines that are furthest apart: from below it a hull is far too long."""

FEWEST_RECTANGLES = 3
"""That a box is fitted to: two leave it open."""

WORST_FIT = 0.05
"""Of an object's size in the images: a box that is off by more, in the root mean square, is not taken."""

EXAMPLES = 3
"""Of what is left out for one reason, that are named."""

HULL_OPTIONS = HullOptions(orientation="upright")

FEW_RECTANGLES = (
    f"it is a rectangle, which is no outline, and its object has fewer than {FEWEST_RECTANGLES} of them: no box can be"
    " fitted to those; outline it in two frames"
)
WITH_OUTLINES = "it is a rectangle of an object whose outlines tell more, in other images"

NOTHING = "Nothing of the file can come in; what is left out says why."

MadeOf = Literal["poses", "outlines", "rectangles"]


@dataclass(frozen=True)
class Reason:
    """Labels that are left out for one reason.

    Attributes:
        count: how many.
        examples: what the file calls the first of them.
    """

    reason: str
    count: int
    examples: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class ImportedObject:
    """An object that came in, or would.

    Attributes:
        box_id: of its box, or that is kept for it while it has masks only; None where nothing was stored.
        name: the box's; None where there is none.
        box: None: it has masks only, and `note` says why.
        made_of: what the box was made of; None: there is none.
        masks: how many came with it.
        note: what to know of it, in words; empty: nothing.
    """

    class_name: str
    box_id: int | None
    name: str | None
    box: Box | None
    made_of: MadeOf | None
    masks: int
    note: str = ""


@dataclass(frozen=True, eq=False)
class ImportedLabels:
    """What came of a file.

    Attributes:
        revision: the session's, that the edit made; None: nothing was stored.
        new_classes: that were added, or would be.
        left_out: what did not come in, the most frequent reason first.
    """

    format: str
    revision: int | None
    objects: tuple[ImportedObject, ...]
    new_classes: tuple[str, ...]
    left_out: tuple[Reason, ...]
    notes: tuple[str, ...]

    @property
    def boxes(self) -> int:
        """How many boxes came in."""
        return sum(one.box is not None for one in self.objects)

    @property
    def masks(self) -> int:
        """How many masks came in."""
        return sum(one.masks for one in self.objects)


class LabelImport:
    """Brings labels into sessions, for any number of threads. Methods raise what those of `SessionEditor` do."""

    def __init__(self, store: SessionStore, editor: SessionEditor) -> None:
        self._store = store
        self._editor = editor

    def run(
        self,
        sid: str,
        path: Path,
        *,
        format: str = "auto",  # noqa: A002 - the contract's name
        options: ReadOptions = NOTHING_SAID,
        dry_run: bool = False,
        author: str,
        key: str | None = None,
        request: object = None,
    ) -> ImportedLabels:
        """All labels of a file that can come in, in one edit that one undo takes back; with `dry_run` none is stored.

        A repeat with the same idempotency `key` and the same `request` answers what the first answered, and adds
        nothing.

        Raises:
            BadFile: the file is damaged, or is not about this session's images.
            BadInput: no reader knows it, or there are several files, or too many labels for one edit.
            RefusedPath: something of it lies outside `options.within`.
        """
        taken = photographs(self._store, sid)
        labels = read_labels(path, format=format, options=options)
        plan = planned_labels(labels, taken.frames, taken.cameras, session=sid)
        made = [_made(taken, one) for one in plan.objects]
        coming = [one for one in made if one.labels is not None]
        drafts = [one.labels for one in coming if one.labels is not None]
        classes = {a_class.name: a_class for a_class in self._store.state(sid).classes.values()}
        notes = [*plan.notes, *_kept_symmetries(drafts, classes)]
        new_classes = tuple(dict.fromkeys(d.class_name for d in drafts if d.class_name not in classes))
        edit = None
        if not dry_run:
            edit = self._editor.add_labels(
                sid,
                drafts,
                summary=f"Import labels ({labels.format}) of {len(drafts)} object{'s' * (len(drafts) != 1)}",
                author=author,
                key=key,
                request=["import labels", format, request],
            )
        return ImportedLabels(
            labels.format,
            None if edit is None else edit.revision,
            _imported(coming, edit),
            new_classes if edit is None else _added_classes(edit),
            reasons((*plan.left_out, *(left for one in made for left in one.left_out))),
            (*notes, *(() if drafts else (NOTHING,))),
        )


@dataclass(frozen=True, eq=False)
class _Made:
    """A planned object, with its box where one can be made; `labels` None: nothing of it comes in."""

    labels: ObjectLabels | None
    made_of: MadeOf | None
    note: str
    left_out: tuple[LeftOut, ...]


def reasons(left_out: Sequence[LeftOut]) -> tuple[Reason, ...]:
    """What is left out, counted by reason, the most frequent first."""
    counts = Counter(one.reason for one in left_out)
    examples: dict[str, list[str]] = {}
    for one in left_out:
        if len(examples.setdefault(one.reason, [])) < EXAMPLES:
            examples[one.reason].append(one.where)
    return tuple(Reason(reason, count, tuple(examples[reason])) for reason, count in counts.most_common())


def _kept_symmetries(drafts: Sequence[ObjectLabels], classes: Mapping[str, ObjectClass]) -> list[str]:
    """Which classes that were there have another symmetry than the file says: people may have set it."""
    given = {d.class_name: d.symmetry for d in drafts if d.symmetry.kind != "none" and d.class_name in classes}
    other = [name for name, symmetry in given.items() if classes[name].symmetry != symmetry]
    return [f"The class {name} keeps the symmetry that it has; the file says another." for name in other]


def _made(taken: Photographs, one: PlannedObject) -> _Made:
    if one.box is not None:
        return _Made(ObjectLabels(one.class_name, one.box, symmetry=one.symmetry), "poses", "", ())
    if not one.outlines:
        return _of_rectangles(taken, one)
    made = _of_outlines(taken, one)
    if one.rectangles and made.made_of is None and len(one.rectangles) >= FEWEST_RECTANGLES:
        fitted = _of_rectangles(taken, one)
        if fitted.labels is not None and made.labels is not None:
            return replace(fitted, labels=replace(made.labels, box=fitted.labels.box))
    return replace(made, left_out=tuple(LeftOut(WITH_OUTLINES, one.wheres[frame]) for frame in one.rectangles))


def _of_outlines(taken: Photographs, one: PlannedObject) -> _Made:
    """Masks, and the box of those that count, where they are two or more and fit one object."""
    frames = sorted(one.outlines)
    among = np.unique(np.linspace(0, len(frames) - 1, min(len(frames), MOST_VIEWS)).round().astype(np.int64))
    counted = {frames[i] for i in among.tolist()}
    note = "" if len(counted) == len(frames) else f"{len(counted)} of its outlines count for its hull"
    masks = tuple(MaskDraft(frame, one.outlines[frame], accepted=frame in counted) for frame in frames)
    without_box = ObjectLabels(one.class_name, None, masks=masks)
    if len(counted) < 2:
        return _Made(without_box, None, "no box: it is outlined in one frame; outline it in another", ())
    outlines: list[tuple[int, tuple[Polygon, ...]]] = [(frame, one.outlines[frame]) for frame in sorted(counted)]
    views = views_of(taken, outlines)
    try:
        box, hull = object_of(views, HULL_OPTIONS)
    except BadInput as error:
        return _Made(without_box, None, f"no box: {error}", ())
    angle = angle_between(views, box.T_world_box[:3, 3])
    if angle < SMALL_ANGLE:
        narrow = (
            f"its outlines are from at most {math.degrees(angle):.0f} degrees apart: the box is far too long; outline"
            " it from further round, or fit it with `boxes refine`"
        )
        note = f"{note}; {narrow}" if note else narrow
    return _Made(replace(without_box, box=box, hull=hull, hull_options=HULL_OPTIONS), "outlines", note, ())


def _of_rectangles(taken: Photographs, one: PlannedObject) -> _Made:
    """The box that fits an object's rectangles, where they determine it."""
    wheres = [one.wheres[frame] for frame in one.rectangles]
    if len(one.rectangles) < FEWEST_RECTANGLES:
        return _Made(None, None, "", tuple(LeftOut(FEW_RECTANGLES, where) for where in wheres))
    frames = sorted(one.rectangles)
    among = np.unique(np.linspace(0, len(frames) - 1, min(len(frames), MOST_VIEWS)).round().astype(np.int64))
    chosen = {frames[i]: one.rectangles[frames[i]] for i in among.tolist()}
    try:
        fit = _fit(taken, chosen)
    except BadInput as error:
        reason = f"it is a rectangle, and no box can be fitted to those of its object: {error}"
        return _Made(None, None, "", tuple(LeftOut(reason, where) for where in wheres))
    note = f"fitted to {len(chosen)} rectangles, {fit.rms_px:.1f} px off on the average"
    return _Made(ObjectLabels(one.class_name, fit.box), "rectangles", note, ())


def _fit(taken: Photographs, rectangles: Mapping[int, Float[np.ndarray, "4"]]) -> BoxFit:
    """The upright box whose labels agree best with rectangles by frame.

    It is searched from where the pyramids meet that the rectangles are of.

    Raises:
        BadInput: they do not determine one, or are of no one box.
    """
    sightings = [
        Sighting(frame, camera_of(taken, frame), taken.frames.Ts_world_camera[frame], bbox)
        for frame, bbox in rectangles.items()
    ]
    outlines = [(frame, (_rectangle(bbox),)) for frame, bbox in rectangles.items()]
    start = box_of_hull(visual_hull(views_of(taken, outlines)), orientation="upright", position="box")
    fit = fit_box(start, sightings, orientation="upright")
    size = float(np.median([np.sqrt(np.prod(sighting.size)) for sighting in sightings]))
    if fit.rms_px > WORST_FIT * size:
        raise BadInput(
            f"the best one is {fit.rms_px:.1f} px off on the average, of {size:.0f}; are some round what is seen of it"
            " only, or of another object?"
        )
    return fit


def _rectangle(bbox: Float[np.ndarray, "4"]) -> Polygon:
    x0, y0, x1, y1 = bbox
    return Polygon(np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]]))


def _imported(made: Sequence[_Made], edit: Edit | None) -> tuple[ImportedObject, ...]:
    ids: Sequence[int | None] = [None] * len(made) if edit is None else object_ids(edit)
    names: dict[int, str] = {}
    if edit is not None:
        for change in edit.changes:
            if isinstance(change, BoxChange) and change.after is not None:
                names[change.box_id] = change.after.name
    found: list[ImportedObject] = []
    for one, box_id in zip(made, ids, strict=True):
        labels = one.labels
        assert labels is not None
        found.append(
            ImportedObject(
                class_name=labels.class_name,
                box_id=box_id,
                name=names.get(box_id or 0),
                box=labels.box,
                made_of=one.made_of,
                masks=len(labels.masks),
                note=one.note,
            )
        )
    return tuple(found)


def _added_classes(edit: Edit) -> tuple[str, ...]:
    return tuple(c.after.name for c in edit.changes if isinstance(c, ClassChange) and c.after is not None)
