"""How the numbers of a mesh's file are meant: their unit, and which of its axes run along the box's."""

from typing import Literal

import numpy as np
from jaxtyping import Float

from ars_web.errors import BadInput

MeshUnit = Literal["mm", "cm", "m", "in"]
MeshOrigin = Literal["centre", "file"]

METRES: dict[MeshUnit, float] = {"mm": 0.001, "cm": 0.01, "m": 1.0, "in": 0.0254}
ORIGINS: tuple[MeshOrigin, ...] = ("centre", "file")

LARGEST, SMALLEST = 20.0, 0.0005
"""Metres, of an object's longest side. Beyond them the unit is mistaken."""


def checked_unit(unit: str) -> MeshUnit:
    """The unit of a file's numbers.

    Raises:
        BadInput: it is none of METRES.
    """
    for known in METRES:
        if unit == known:
            return known
    raise BadInput(f"a mesh's unit must be one of {', '.join(METRES)}, not {unit!r}")


def checked_origin(origin: str) -> MeshOrigin:
    """What of a file lies at the box's centre.

    Raises:
        BadInput: it is neither `centre` nor `file`.
    """
    for known in ORIGINS:
        if origin == known:
            return known
    raise BadInput(f"a mesh's origin must be one of {', '.join(ORIGINS)}, not {origin!r}")


def rotation_from_axes(axes: str) -> Float[np.ndarray, "3 3"]:
    """R_box_file of axes such as `x,-z,y`: which axis of the file runs along the box's x, y and z.

    Raises:
        BadInput: it does not name each of the file's axes once, or mirrors the object.
    """
    rows = np.zeros((3, 3))
    parts = [part.strip() for part in axes.split(",")]
    names = [part.removeprefix("-") for part in parts]
    if sorted(names) != ["x", "y", "z"]:
        raise BadInput(
            f"a mesh's axes must say which axis of the file runs along the box's x, y and z, each once, such as x,y,z"
            f" or x,-z,y, not {axes!r}"
        )
    for row, (part, name) in enumerate(zip(parts, names, strict=True)):
        rows[row, "xyz".index(name)] = -1.0 if part.startswith("-") else 1.0
    if np.linalg.det(rows) < 0:
        first = parts[0].removeprefix("-") if parts[0].startswith("-") else f"-{parts[0]}"
        raise BadInput(
            f"the axes {axes!r} would mirror the object, as they are left-handed; {','.join([first, *parts[1:]])}, for"
            " one, are not"
        )
    return rows


def axes_text(axes: str) -> str:
    """Axes without blanks, as they are kept."""
    return ",".join(part.strip() for part in axes.split(","))


def unit_fault(extent: Float[np.ndarray, "3"], unit: MeshUnit) -> str | None:
    """What is wrong with an object of this extent in metres: that its unit cannot be meant; None: it can."""
    longest = float(extent.max())
    if SMALLEST <= longest <= LARGEST:
        return None
    fitting = [other for other, metres in METRES.items() if 0.01 <= longest / METRES[unit] * metres <= 3.0]
    remedy = f"is it in {' or '.join(fitting)}?" if fitting else "scale it to the object's true size"
    size = f"{longest:.3g} m long" if longest >= 0.1 else f"{1000 * longest:.3g} mm long"
    return f"the object would be {size} in unit {unit} (0.5 mm to {LARGEST:g} m can be): {remedy}"
