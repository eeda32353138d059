"""Boxes and classes as the JSON of the API and of box files."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError, field_validator

from ars_web.errors import BadFile
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import FARTHEST, LARGEST_SIZE, Box
from ars_web.geometry.rigid_transform import Transform
from ars_web.sessions.drafting import BoxDraft
from ars_web.sessions.hull_json import options_json
from ars_web.sessions.model import WIDEST, ObjectClass, Orientation, Position, VirtualBox
from ars_web.sessions.names import LONGEST_NAME
from ars_web.sessions.object_mesh import SourcedMesh
from ars_web.sessions.shape_json import keypoints_json, symmetry_json
from ars_web.sessions.strict_json import first_fault, place_text, strict_json

# Strict: a truth value or a string is no number. Whole numbers are. Beyond a million kilometres it is no place.
Coordinate = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-1e9, le=1e9)]
Component = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Length = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0.0, le=LARGEST_SIZE)]
Size = tuple[Length, Length, Length]
Flag = Annotated[bool, Field(strict=True)]
Id = Annotated[int, Field(strict=True, ge=0)]
Name = Annotated[str, Field(min_length=1, max_length=LONGEST_NAME)]


class Strict(BaseModel):
    """What people or programs wrote: unknown fields are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class TransformJson(Strict):
    """A rigid transform: a position in metres and a quaternion, w first, of any length but zero."""

    position: tuple[Coordinate, Coordinate, Coordinate]
    wxyz: tuple[Component, Component, Component, Component]

    @field_validator("wxyz")
    @classmethod
    def _has_a_direction(cls, wxyz: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
        if not 1e-9 <= math.hypot(*wxyz) <= 1e9:
            raise ValueError("a quaternion must not be zero, nor too long to be normalised")
        return wxyz

    @property
    def matrix(self) -> Transform:
        """As (4, 4)."""
        return rigid_transform.from_position_wxyz(np.array(self.position), np.array(self.wxyz))


class BoxJson(Strict):
    """A box to be added."""

    class_id: Id
    T_world_box: TransformJson = Field(description="the box's centre and axes in the world")
    size: Size = Field(description="metres along the box's own axes")
    name: Name | None = Field(None, description="default: the class's name, with a number where it is taken")

    locked: Flag = Field(False, description="class, place and size stay, and it is not deleted, until it is unlocked")

    @property
    def draft(self) -> BoxDraft:
        """As `SessionEditor` takes it."""
        return BoxDraft(self.class_id, Box(self.T_world_box.matrix, np.array(self.size)), self.name, self.locked)


class BoxPatchJson(Strict):
    """What of a box is to change; what is not given stays."""

    class_id: Id | None = None
    T_world_box: TransformJson | None = None
    size: Size | None = None
    name: Name | None = None
    locked: Flag | None = None


class HullOptionsJson(Strict):
    """How a box and its hull were made from masks."""

    orientation: Orientation = Field(description="world: axes as the world's; upright: turned about its z; free")
    position: Position = Field(description="what the box's centre is: its own, or the hull's centre of mass")
    widen_px: Annotated[float, Field(strict=True, ge=0.0, le=WIDEST)] = Field(
        description="pixels that every mask is widened by"
    )
    ground: Annotated[float, Field(strict=True, ge=-FARTHEST, le=FARTHEST)] | None = Field(
        description="z in the world, metres, of a support plane under the object; null: none"
    )
    fitted: bool = Field(
        description="whether the box was fitted to what is seen since: it stays, the hull alone follows the masks"
    )


class BoxFileItem(BoxJson):
    """A box in a file: what `GET …/boxes` answers, of which `id`, `has_hull`, `hull_options`, `has_mesh` and `revision`
    are not taken over: its hull, mesh and masks are not in the file."""

    id: Id | None = None
    has_hull: bool | None = None
    hull_options: HullOptionsJson | None = None
    has_mesh: bool | None = None
    revision: Id | None = None


_BOX_FILE = TypeAdapter(list[BoxFileItem])


def transform_json(T: Transform) -> dict[str, list[float]]:
    """`{"position", "wxyz"}` of a transform; the quaternion is of unit length with w >= 0."""
    return {
        "position": T[:3, 3].tolist(),
        "wxyz": rigid_transform.wxyz_from_rotation(T[:3, :3]).tolist(),
    }


def box_json(box: VirtualBox) -> dict[str, Any]:
    """The box as the API answers it and box files hold it."""
    return {
        "id": box.id,
        "class_id": box.class_id,
        "name": box.name,
        "T_world_box": transform_json(box.box.T_world_box),
        "size": box.box.size.tolist(),
        "has_hull": box.has_hull,
        "hull_options": None if box.hull_options is None else options_json(box.hull_options),
        "has_mesh": box.has_mesh,
        "locked": box.locked,
        "revision": box.revision,
    }


def class_json(a_class: ObjectClass, meshes: Mapping[str, SourcedMesh]) -> dict[str, Any]:
    """The class as the API answers it, with what there is to say of its mesh, if it is one of `meshes`, by digest; else
    with the mesh's digest alone, as in edits."""
    mesh = None if a_class.mesh is None else meshes.get(a_class.mesh)
    return {
        "id": a_class.id,
        "name": a_class.name,
        "color": a_class.color,
        "default_size": None if a_class.default_size is None else list(a_class.default_size),
        "symmetry": {"rotations": [], "axis": None, "flip": False, **symmetry_json(a_class.symmetry)},
        "keypoints": keypoints_json(a_class.keypoints),
        "mesh": mesh_json(mesh) if mesh is not None else a_class.mesh and {"digest": a_class.mesh},
        "revision": a_class.revision,
    }


def mesh_json(sourced: SourcedMesh) -> dict[str, Any]:
    """What there is to say of a mesh."""
    mesh, source = sourced.mesh, sourced.source
    return {
        "digest": mesh.digest,
        "vertices": len(mesh.vertices),
        "faces": len(mesh.faces),
        "extent": mesh.extent.tolist(),
        "source": {"name": source.name, "unit": source.unit, "axes": source.axes, "origin": source.origin},
    }


def read_boxes_file(path: Path) -> list[BoxDraft]:
    """The boxes of a JSON file: the list that `GET …/boxes` answers.

    Raises:
        BadFile: it cannot be read or is not such a list; the message says which box and which of its values.
    """
    try:
        boxes = _BOX_FILE.validate_python(strict_json(path.read_bytes(), path))
    except OSError as error:
        raise BadFile(path, f"cannot be read: {error.strerror}") from error
    except ValidationError as error:
        raise BadFile(path, _first_fault(error)) from error
    return [box.draft for box in boxes]


def _first_fault(error: ValidationError) -> str:
    """Where in the list the first fault is, and what it is."""
    place, message = first_fault(error)
    if not place:
        return "must hold a list of boxes, as `ars-web boxes export` writes it"
    return f"box {place[0]}{place_text(place[1:])}: {message}; boxes are counted from 0"
