"""Edits, classes, boxes and masks as the JSON that the log keeps. Every float comes back bit by bit."""

import hashlib
from datetime import UTC, datetime
from typing import Any, cast

import numpy as np
import orjson

from ars_web.errors import ArsError, BadInput, StoreError
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.sessions.edits import BoxChange, Change, ClassChange, MaskChange, NameChange
from ars_web.sessions.hull_json import digest_from_json, options_from_json, options_json
from ars_web.sessions.model import Mask, ObjectClass, SessionState, VirtualBox, checked_origin
from ars_web.sessions.names import checked_name
from ars_web.sessions.outlines import polygons_from_json, polygons_json
from ars_web.sessions.palette import checked_color
from ars_web.sessions.shape_json import keypoints_from_json, keypoints_json, symmetry_from_json, symmetry_json
from ars_web.sessions.sizes import checked_class_size

Json = dict[str, Any]


def changes_json(changes: tuple[Change, ...]) -> str:
    """The changes of one edit as a JSON list."""
    return orjson.dumps([_change_json(change) for change in changes]).decode()


def changes_from_json(text: str) -> tuple[Change, ...]:
    """The changes that `changes_json` wrote.

    Raises:
        StoreError: the text is not such a list.
    """
    try:
        return tuple(_change(item) for item in orjson.loads(text))
    except (ValueError, KeyError, TypeError, AttributeError, ArsError) as error:
        raise StoreError(f"an entry of the session's log cannot be read: {error}") from error


def state_json(state: SessionState) -> str:
    """A whole state as a JSON object: what the log of a session starts from."""
    return orjson.dumps(
        {
            "revision": state.revision,
            "name": state.name,
            "classes": [_class_json(a_class) for a_class in state.classes.values()],
            "boxes": [_box_json(box) for box in state.boxes.values()],
            "masks": [_mask_json(mask) for mask in state.masks.values()],
            "next_class_id": state.next_class_id,
            "next_box_id": state.next_box_id,
            "next_mask_id": state.next_mask_id,
        }
    ).decode()


def state_from_json(text: str) -> SessionState:
    """The state that `state_json` wrote.

    Raises:
        StoreError: the text is not such an object.
    """
    try:
        item = cast(Json, orjson.loads(text))
        return SessionState(
            revision=_whole(item, "revision"),
            name=checked_name(item["name"], what="a session"),
            classes={c["id"]: _class(c) for c in item["classes"]},
            boxes={b["id"]: _box(b) for b in item["boxes"]},
            next_class_id=_whole(item, "next_class_id"),
            next_box_id=_whole(item, "next_box_id"),
            # Sessions from before there were masks do not say.
            masks={m["id"]: _mask(m) for m in item.get("masks", [])},
            next_mask_id=_whole(item, "next_mask_id") if "next_mask_id" in item else 1,
        )
    except (ValueError, KeyError, TypeError, AttributeError, ArsError) as error:
        raise StoreError(f"the state that the session's log starts from cannot be read: {error}") from error


def default_size_from_json(text: str) -> tuple[float, float, float]:
    """A class's usual size from a JSON list.

    Raises:
        StoreError: it is not three lengths.
    """
    try:
        return checked_class_size(orjson.loads(text))
    except (ValueError, TypeError, ArsError) as error:
        raise StoreError(f"a class's size in the session's database cannot be read: {error}") from error


def request_digest(*parts: object) -> str:
    """A fingerprint of what a request asked for: equal for equal strings, numbers and arrays."""
    return hashlib.sha256(orjson.dumps(parts, option=orjson.OPT_SERIALIZE_NUMPY)).hexdigest()


def utc_text(at: datetime) -> str:
    """A moment as ISO 8601 in UTC, to the microsecond; such texts sort as the moments do."""
    return at.astimezone(UTC).isoformat(timespec="microseconds")


def utc_from_text(text: str) -> datetime:
    """The moment that `utc_text` wrote.

    Raises:
        StoreError: it is none, or says no time zone.
    """
    try:
        at = datetime.fromisoformat(text)
    except ValueError as error:
        raise StoreError(f"the session's database holds {text!r} where a moment should be") from error
    if at.tzinfo is None:
        raise StoreError(f"the session's database holds {text!r}, a moment without a time zone")
    return at


def _change_json(change: Change) -> Json:
    if isinstance(change, NameChange):
        return {"name": None, "before": change.before, "after": change.after}
    if isinstance(change, BoxChange):
        return {
            "box": change.box_id,
            "before": None if change.before is None else _box_json(change.before),
            "after": None if change.after is None else _box_json(change.after),
        }
    if isinstance(change, MaskChange):
        return {
            "mask": change.mask_id,
            "before": None if change.before is None else _mask_json(change.before),
            "after": None if change.after is None else _mask_json(change.after),
        }
    return {
        "class": change.class_id,
        "before": None if change.before is None else _class_json(change.before),
        "after": None if change.after is None else _class_json(change.after),
    }


def _change(item: Json) -> Change:
    before, after = item["before"], item["after"]
    if "box" in item:
        return BoxChange(item["box"], None if before is None else _box(before), None if after is None else _box(after))
    if "class" in item:
        return ClassChange(
            _whole(item, "class"), None if before is None else _class(before), None if after is None else _class(after)
        )
    if "mask" in item:
        return MaskChange(
            _whole(item, "mask"), None if before is None else _mask(before), None if after is None else _mask(after)
        )
    return NameChange(checked_name(before, what="a session"), checked_name(after, what="a session"))


def _class_json(a_class: ObjectClass) -> Json:
    return {
        "id": a_class.id,
        "name": a_class.name,
        "color": a_class.color,
        "revision": a_class.revision,
        "default_size": a_class.default_size,
        "mesh": a_class.mesh,
        "symmetry": symmetry_json(a_class.symmetry),
        "keypoints": keypoints_json(a_class.keypoints),
    }


def _class(item: Json) -> ObjectClass:
    return ObjectClass(
        id=_whole(item, "id"),
        name=checked_name(item["name"], what="a class"),
        color=checked_color(item["color"]),
        revision=_whole(item, "revision"),
        # Logs from before there were such sizes, or shapes, do not say.
        default_size=None if item.get("default_size") is None else checked_class_size(item["default_size"]),
        mesh=None if item.get("mesh") is None else digest_from_json(item["mesh"], what="a mesh"),
        symmetry=symmetry_from_json(item.get("symmetry")),
        keypoints=keypoints_from_json(item.get("keypoints")),
    )


def _box_json(box: VirtualBox) -> Json:
    return {
        "id": box.id,
        "class_id": box.class_id,
        "name": box.name,
        # The matrix, not a quaternion: converting there and back would move the box by a rounding error.
        "rotation": box.box.T_world_box[:3, :3].ravel().tolist(),
        "position": box.box.T_world_box[:3, 3].tolist(),
        "size": box.box.size.tolist(),
        "revision": box.revision,
        "locked": box.locked,
        "hull": box.hull,
        "hull_options": None if box.hull_options is None else options_json(box.hull_options),
        "mesh": box.mesh,
    }


def _box(item: Json) -> VirtualBox:
    T = rigid_transform.from_rotation(
        np.array(item["rotation"], dtype=np.float64).reshape(3, 3), np.array(item["position"], dtype=np.float64)
    )
    return VirtualBox(
        id=_whole(item, "id"),
        class_id=_whole(item, "class_id"),
        name=checked_name(item["name"], what="a box"),
        box=Box(T, np.array(item["size"], dtype=np.float64)),
        revision=_whole(item, "revision"),
        # Logs from before there were locks, hulls or meshes do not say.
        locked=bool(item.get("locked", False)),
        hull=None if item.get("hull") is None else digest_from_json(item["hull"]),
        hull_options=None if item.get("hull_options") is None else options_from_json(item["hull_options"]),
        mesh=None if item.get("mesh") is None else digest_from_json(item["mesh"], what="a mesh"),
    )


def _mask_json(mask: Mask) -> Json:
    return {
        "id": mask.id,
        "box_id": mask.box_id,
        "frame": mask.frame,
        "class_id": mask.class_id,
        "polygons": polygons_json(mask.polygons),
        "origin": mask.origin,
        "accepted": mask.accepted,
        "revision": mask.revision,
    }


def _mask(item: Json) -> Mask:
    return Mask(
        id=_whole(item, "id"),
        box_id=_whole(item, "box_id"),
        frame=_whole(item, "frame"),
        class_id=_whole(item, "class_id"),
        polygons=polygons_from_json(item["polygons"]),
        origin=checked_origin(item["origin"]),
        accepted=bool(item["accepted"]),
        revision=_whole(item, "revision"),
    )


def _whole(item: Json, name: str) -> int:
    number = item[name]
    if not isinstance(number, int) or number < 0:
        raise BadInput(f"{name} must be a whole number from 0, not {number!r}")
    return number
