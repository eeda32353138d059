"""The JSON of shapes of objects: symmetries, keypoints, meshes."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from ars_web.geometry.keypoints import FARTHEST_KEYPOINT, LONGEST_KEYPOINT_NAME, MOST_KEYPOINTS, Keypoint
from ars_web.geometry.symmetry import MOST_ROTATIONS, Symmetry
from ars_web.meshes.placement import MeshOrigin, MeshUnit
from ars_web.sessions.boxes_json import Component, Strict, mesh_json
from ars_web.sessions.object_mesh import SourcedMesh

Axis = tuple[Component, Component, Component]
Place = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-FARTHEST_KEYPOINT, le=FARTHEST_KEYPOINT)]


class RotationJson(Strict):
    """A turn that changes nothing about an object, and so do its repeats."""

    axis: Axis = Field(description="through the box's centre, along the box's axes; of any length but zero")
    order: Annotated[int, Field(strict=True, ge=2, le=MOST_ROTATIONS)] = Field(
        description="it turns by 1 / order of a circle"
    )


class SymmetryJson(Strict):
    """How an object looks the same: `discrete` with its `rotations`, `continuous` with its `axis`, or `none`."""

    kind: Literal["none", "discrete", "continuous"]
    rotations: Annotated[list[RotationJson], Field(max_length=MOST_ROTATIONS)] = Field(
        default_factory=list[RotationJson], description="of a discrete one: whatever follows from them counts too"
    )
    axis: Axis | None = Field(None, description="of a continuous one: any turn about it changes nothing")
    flip: Annotated[bool, Field(strict=True)] = Field(
        False, description="of a continuous one: a half turn across the axis changes nothing either"
    )

    @property
    def symmetry(self) -> Symmetry:
        """As a class has it; raises BadInput where it cannot be."""
        rotations = tuple((turn.axis, turn.order) for turn in self.rotations)
        return Symmetry(self.kind, rotations, self.axis, self.flip)


class KeypointJson(Strict):
    """A named point of an object."""

    name: Annotated[str, Field(strict=True, min_length=1, max_length=LONGEST_KEYPOINT_NAME)]
    place: tuple[Place, Place, Place] = Field(
        description="from the box's centre along its axes, in units of its sizes: a corner is at +-0.5"
    )

    @property
    def keypoint(self) -> Keypoint:
        """As a class has it; raises BadInput where it cannot be."""
        return Keypoint(self.name, self.place)


Keypoints = Annotated[list[KeypointJson], Field(max_length=MOST_KEYPOINTS)]


class SymmetryAnswer(BaseModel):
    """How a class's objects look the same, as SymmetryJson takes it."""

    kind: Literal["none", "discrete", "continuous"]
    rotations: list[RotationJson] = Field(description="of a discrete one; whatever follows from them counts too")
    axis: tuple[float, float, float] | None = Field(description="of a continuous one; of unit length")
    flip: bool = Field(description="whether a half turn across the axis changes nothing either")


class KeypointAnswer(BaseModel):
    """A named point of a class's objects."""

    name: str
    place: tuple[float, float, float] = Field(description="in units of the box's sizes, from its centre")


class MeshSourceJson(BaseModel):
    """Where a mesh came from."""

    name: str = Field(description="of its file")
    unit: MeshUnit
    axes: str = Field(description="which axes of the file run along the box's x, y and z")
    origin: MeshOrigin = Field(description="what lies at the box's centre: the middle of it, or the file's own origin")


class MeshJson(BaseModel):
    """What there is to say of a mesh; `GET …/meshes/{digest}` has the mesh itself."""

    digest: str = Field(description="its name: it says what it holds, which never changes")
    vertices: int = Field(description="how many")
    faces: int = Field(description="how many")
    extent: tuple[float, float, float] = Field(description="metres along the box's axes")
    source: MeshSourceJson

    @classmethod
    def of(cls, mesh: SourcedMesh) -> "MeshJson":
        """The JSON of a mesh."""
        return cls.model_validate(mesh_json(mesh))


class MeshSurface(BaseModel):
    """A mesh."""

    digest: str
    vertices: list[tuple[float, float, float]] = Field(
        description="metres along the box's axes, from its centre; the mesh does not scale with the box"
    )
    faces: list[tuple[int, int, int]] = Field(description="rows of `vertices`, counter-clockwise seen from outside")
    extent: tuple[float, float, float] = Field(description="metres along the box's axes")
    source: MeshSourceJson


class MeshFields(Strict):
    """The form's parts beside the file."""

    unit: MeshUnit
    axes: Annotated[str, Field(max_length=20)]
    origin: MeshOrigin = "centre"
    fit_size: Literal["true", "false"] | None = None


class BoxMeshFields(Strict):
    """The form's parts beside the file, of a box's mesh."""

    unit: MeshUnit
    axes: Annotated[str, Field(max_length=20)]
    origin: MeshOrigin = "centre"


def form_body(*, fit_size: bool) -> dict[str, Any]:
    """The OpenAPI of a form with a mesh file."""
    said: dict[str, Any] = {
        "file": {"type": "string", "format": "binary", "description": "an obj, ply, glb or stl, by its name's ending"},
        "unit": {"type": "string", "enum": ["mm", "cm", "m", "in"], "description": "of the file's numbers"},
        "axes": {
            "type": "string",
            "description": "which axes of the file run along the box's x, y and z, such as x,y,z or x,-z,y",
        },
        "origin": {
            "type": "string",
            "enum": ["centre", "file"],
            "default": "centre",
            "description": "what lies at the box's centre: the middle of the mesh's bounds, or the file's own origin",
        },
    }
    if fit_size:
        said["fit_size"] = {
            "type": "string",
            "enum": ["true", "false"],
            "description": "whether the class's default_size becomes the mesh's extent; absent: where it has none",
        }
    schema = {"type": "object", "required": ["file", "unit", "axes"], "properties": said}
    return {"requestBody": {"required": True, "content": {"multipart/form-data": {"schema": schema}}}}
