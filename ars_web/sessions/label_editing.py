"""Labels that come in from files: classes, boxes and masks in one edit. Its part of `SessionEditor`."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ars_web.errors import BadInput
from ars_web.geometry.box import Box
from ars_web.geometry.symmetry import NO_SYMMETRY, Symmetry
from ars_web.sessions.edit_json import request_digest
from ars_web.sessions.edits import BoxChange, Change, ClassChange, Edit, MaskChange
from ars_web.sessions.hull_mesh import HullMesh
from ars_web.sessions.model import HullOptions, Mask, ObjectClass, SessionState, VirtualBox
from ars_web.sessions.names import FreshNames, checked_name
from ars_web.sessions.object_drafting import MaskDraft
from ars_web.sessions.object_editing import ObjectEditing
from ars_web.sessions.palette import next_color

MOST_LABELS = 20_000
"""Boxes and masks in one edit; it is kept, sent and undone as one."""


@dataclass(frozen=True, eq=False)
class ObjectLabels:
    """A new object: its box, its masks, or both.

    Attributes:
        class_name: of a class that the session has, or that is added.
        hull, hull_options: of the box, where it was made of the masks.
        masks: at most one a frame.
        symmetry: of its class, where that is added.
    """

    class_name: str
    box: Box | None
    hull: HullMesh | None = None
    hull_options: HullOptions | None = None
    masks: tuple[MaskDraft, ...] = ()
    symmetry: Symmetry = NO_SYMMETRY


class LabelEditing(ObjectEditing):
    """Edits that add objects of any classes."""

    def add_labels(
        self,
        sid: str,
        objects: Sequence[ObjectLabels],
        *,
        summary: str,
        author: str,
        key: str | None = None,
        request: object = None,
    ) -> Edit | None:
        """Add objects in one edit, which one undo takes back; None where there is none.

        Classes are found by their names; those that are not there are added. A repeat with the same idempotency `key`
        and the same `request` (strings, numbers, lists and dicts of them) returns what the first returned, and adds
        nothing.

        Raises:
            BadInput: a class's name cannot be used, an outline cannot be kept, an object has neither box nor masks or
                two masks in one frame, or there are more than MOST_LABELS.
        """
        labels = sum((one.box is not None) + len(one.masks) for one in objects)
        if labels > MOST_LABELS:
            raise BadInput(f"{labels} boxes and outlines are too many for one step; divide the file by images")
        checked = [replace(one, masks=tuple(self._checked(sid, one.masks))) for one in objects]
        digest = request_digest("add labels", author, request)
        with self._editing(sid) as session:
            answered = self._answered(session, key, digest=digest)
            if answered is not None or not checked:
                return answered
            for one in checked:
                if one.hull is not None:
                    session.keep_hull(one.hull)
            changes = _additions(session.state, checked)
            edit = self._append(session, changes, author=author, summary=summary, key=key, digest=digest)
        return edit


def object_ids(edit: Edit) -> list[int]:
    """The ids of the objects that an edit of `add_labels` added, in their order."""
    return list(dict.fromkeys(c.box_id for c in edit.changes if isinstance(c, BoxChange | MaskChange)))


def _additions(state: SessionState, objects: Sequence[ObjectLabels]) -> tuple[Change, ...]:
    revision = state.revision + 1
    classes = {one.name: one for one in state.classes.values()}
    names = FreshNames(box.name for box in state.boxes.values())
    added: list[Change] = []
    changes: list[Change] = []
    mask_id = state.next_mask_id
    for box_id, one in enumerate(objects, start=state.next_box_id):
        if one.box is None and not one.masks:
            raise BadInput(f"an object of class {one.class_name!r} has neither a box nor a mask")
        name = checked_name(one.class_name, what="a class")
        if name not in classes:
            color = next_color(a_class.color for a_class in classes.values())
            id_ = state.next_class_id + len(added)
            classes[name] = ObjectClass(id_, name, color, revision=revision, symmetry=one.symmetry)
            added.append(ClassChange(classes[name].id, None, classes[name]))
        class_id = classes[name].id
        if one.box is not None:
            box = VirtualBox(
                id=box_id,
                class_id=class_id,
                name=names.give(name),
                box=one.box,
                revision=revision,
                hull=None if one.hull is None else one.hull.digest,
                hull_options=one.hull_options,
            )
            changes.append(BoxChange(box_id, None, box))
        if len({mask.frame for mask in one.masks}) != len(one.masks):
            raise BadInput(f"an object of class {name!r} has two masks in one frame; an object has one")
        for draft in one.masks:
            mask = Mask(mask_id, box_id, draft.frame, class_id, draft.polygons, draft.origin, draft.accepted, revision)
            changes.append(MaskChange(mask_id, None, mask))
            mask_id += 1
    return (*added, *changes)
