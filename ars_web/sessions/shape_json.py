"""The symmetry and the keypoints of a class as JSON: of the log, of the database and of the API."""

from collections.abc import Sequence
from typing import Any, cast

import orjson

from ars_web.errors import ArsError, BadInput, StoreError
from ars_web.geometry.keypoints import Keypoint, checked_keypoints
from ars_web.geometry.symmetry import NO_SYMMETRY, Symmetry


def symmetry_json(symmetry: Symmetry) -> dict[str, Any]:
    """`{"kind": "none"}`, `{"kind": "discrete", "rotations": [{"axis", "order"}]}` or `{"kind": "continuous", "axis",
    "flip"}`."""
    if symmetry.kind == "discrete":
        turns = [{"axis": list(axis), "order": order} for axis, order in symmetry.rotations]
        return {"kind": symmetry.kind, "rotations": turns}
    if symmetry.axis is not None:
        return {"kind": symmetry.kind, "axis": list(symmetry.axis), "flip": symmetry.flip}
    return {"kind": symmetry.kind}


def symmetry_from_json(item: Any) -> Symmetry:
    """The symmetry that `symmetry_json` wrote; None: none, as of classes from before there were any.

    Raises:
        BadInput, KeyError, TypeError, ValueError: it is no such object, or holds values that it cannot have.
    """
    if item is None:
        return NO_SYMMETRY
    if not isinstance(item, dict):
        raise BadInput(f"a symmetry must be an object, not {item!r}")
    values = cast(dict[str, Any], item)
    rotations = tuple((_three(turn["axis"]), turn["order"]) for turn in values.get("rotations", ()))
    axis = values.get("axis")
    return Symmetry(values["kind"], rotations, None if axis is None else _three(axis), bool(values.get("flip", False)))


def keypoints_json(keypoints: Sequence[Keypoint]) -> list[dict[str, Any]]:
    """A list of `{"name", "place"}`."""
    return [{"name": keypoint.name, "place": list(keypoint.place)} for keypoint in keypoints]


def keypoints_from_json(items: Any) -> tuple[Keypoint, ...]:
    """The keypoints that `keypoints_json` wrote; None: none, as of classes from before there were any.

    Raises:
        BadInput, KeyError, TypeError, ValueError, AttributeError: it is no such list, or holds what they cannot have.
    """
    if items is None:
        return ()
    return checked_keypoints(Keypoint(item["name"], _three(item["place"])) for item in items)


def symmetry_text(symmetry: Symmetry) -> str | None:
    """A class's symmetry as its row has it; None for none."""
    return None if symmetry == NO_SYMMETRY else orjson.dumps(symmetry_json(symmetry)).decode()


def symmetry_from_text(text: str | None) -> Symmetry:
    """What `symmetry_text` wrote.

    Raises:
        StoreError: it is something else.
    """
    try:
        return symmetry_from_json(None if text is None else orjson.loads(text))
    except (ValueError, KeyError, TypeError, ArsError) as error:
        raise StoreError(f"a class's symmetry in the session's database cannot be read: {error}") from error


def keypoints_text(keypoints: Sequence[Keypoint]) -> str | None:
    """A class's keypoints as its row has them; None for the default ones."""
    return orjson.dumps(keypoints_json(keypoints)).decode() if keypoints else None


def keypoints_from_text(text: str | None) -> tuple[Keypoint, ...]:
    """What `keypoints_text` wrote.

    Raises:
        StoreError: it is something else.
    """
    try:
        return keypoints_from_json(None if text is None else orjson.loads(text))
    except (ValueError, KeyError, TypeError, AttributeError, ArsError) as error:
        raise StoreError(f"a class's keypoints in the session's database cannot be read: {error}") from error


def _three(numbers: Any) -> tuple[float, float, float]:
    x, y, z = (float(number) for number in numbers)
    return x, y, z
