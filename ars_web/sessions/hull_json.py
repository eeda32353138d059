"""How a hull was made, and which it is, as JSON."""

import re
from typing import Any, cast

from ars_web.errors import BadInput
from ars_web.sessions.model import HullOptions

_DIGEST = re.compile(r"[0-9a-f]{64}")


def options_json(options: HullOptions) -> dict[str, Any]:
    """As the log and the API have them; pixels and metres."""
    return {
        "orientation": options.orientation,
        "position": options.position,
        "widen_px": options.widen,
        "ground": options.ground,
        "fitted": options.fitted,
    }


def options_from_json(item: Any) -> HullOptions:
    """The options that `options_json` wrote.

    Raises:
        BadInput, KeyError, TypeError: it is no such object, or holds values that they cannot have.
    """
    if not isinstance(item, dict):
        raise BadInput(f"a hull's options must be an object, not {item!r}")
    values = cast(dict[str, Any], item)
    # What says nothing of fitting was written before there was any.
    fitted = bool(values.get("fitted", False))
    return HullOptions(values["orientation"], values["position"], values["widen_px"], values["ground"], fitted)


def digest_from_json(text: Any, *, what: str = "a hull") -> str:
    """The name of a hull, or of what else is named by what it holds.

    Raises:
        BadInput: it is not 64 hexadecimal digits.
    """
    if not isinstance(text, str) or not _DIGEST.fullmatch(text):
        raise BadInput(f"{what} is named by 64 hexadecimal digits, not {text!r}")
    return text
