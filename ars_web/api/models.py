"""The JSON of the API: what requests may hold, what answers look like, and the one from the other.

Requests refuse unknown fields, strings for numbers and numbers that are not finite. What a box to be added looks like
is in `sessions/boxes_json.py`, which the command line reads, too.
"""

from collections.abc import Mapping
from datetime import datetime
from typing import Annotated, Any, Literal

import numpy as np
from jaxtyping import Float
from pydantic import BaseModel, ConfigDict, Field, StringConstraints

from ars_web.api.mesh_models import KeypointAnswer, Keypoints, MeshJson, SymmetryAnswer, SymmetryJson
from ars_web.datasets.exports import ExportJob
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.registry import WRITERS
from ars_web.datasets.report import ExportReport
from ars_web.datasets.samples import FrameLabel
from ars_web.geometry.camera import Camera
from ars_web.geometry.rigid_transform import wxyz_from_rotation
from ars_web.recordings.registry import READERS
from ars_web.sessions.boxes_json import HullOptionsJson, Id, Size, box_json, class_json
from ars_web.sessions.edits import BoxChange, Change, ClassChange, Edit, MaskChange
from ars_web.sessions.history import History
from ars_web.sessions.mask_json import mask_json, mask_json_without_outline
from ars_web.sessions.model import FrameTable, Mask, ObjectClass, SessionSummary, VirtualBox
from ars_web.sessions.names import LONGEST_NAME
from ars_web.sessions.object_mesh import SourcedMesh

Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Point = Annotated[list[Number], Field(min_length=3, max_length=3)]
Name = Annotated[str, StringConstraints(min_length=1, max_length=LONGEST_NAME, strict=True)]
Color = Annotated[str, StringConstraints(strict=True, pattern=r"^#[0-9a-fA-F]{6}$")]
Bounds = tuple[float, float, float, float]


class Strict(BaseModel):
    """A request's body: unknown fields are refused."""

    model_config = ConfigDict(extra="forbid")


class HealthJson(BaseModel):
    """That the server is up."""

    status: Literal["ok"] = "ok"
    version: str


class RootJson(BaseModel):
    """A folder that recordings may be imported from; where it lies is not told."""

    name: str


class SessionJson(BaseModel):
    """A session's summary; its ETag is its revision."""

    id: str
    name: str
    revision: int = Field(description="0 after import, one more with every edit")
    format: str = Field(description="of the recording that it was made from")
    source: str = Field(description="where that recording was")
    frames: int
    classes: int
    boxes: int
    skipped: int = Field(description="frames that the recording lists and that could not be used")
    created: datetime
    changed: datetime

    @classmethod
    def of(cls, summary: SessionSummary) -> "SessionJson":
        """The JSON of a summary."""
        return cls(
            id=summary.id,
            name=summary.name,
            revision=summary.revision,
            format=summary.format,
            source=summary.source,
            frames=summary.frames,
            classes=summary.classes,
            boxes=summary.boxes,
            skipped=summary.skipped,
            created=summary.created,
            changed=summary.changed,
        )


class SkippedFrameJson(BaseModel):
    """A frame that the recording lists and that could not be used."""

    name: str
    reason: str
    where: str = Field(description="file and line")


class SessionDraft(Strict):
    """A session to make from a recording below a declared root."""

    name: Name
    root: str = Field(description="a name from GET /api/roots")
    path: str = Field(max_length=4096, description="relative to the root, with /")
    format: str = Field("auto", description="auto: found by looking", json_schema_extra={"enum": ["auto", *READERS]})
    classes: list[Name] = Field(default_factory=list[Name], max_length=10_000)


class SessionChange(Strict):
    """What of a session can be changed; what is absent stays."""

    name: Name | None = None


class Login(Strict):
    """The token, to be traded for a cookie."""

    token: Annotated[str, StringConstraints(max_length=4096)]


class ClassDraft(Strict):
    """A class to add."""

    name: Name
    color: Color | None = Field(None, description="#rrggbb; absent: the next of the palette")
    default_size: Size | None = Field(None, description="metres, of new boxes of this class; absent: not set")


class ClassPatch(Strict):
    """What of a class can be changed; what is absent stays."""

    name: Name | None = None
    color: Color | None = None
    default_size: Size | None = Field(None, description="null: not set any more")
    symmetry: SymmetryJson | None = Field(None, description="of its objects; null: none any more")
    keypoints: Keypoints | None = Field(None, description="null or none: the box's centre and corners")


class TransformAnswer(BaseModel):
    """A rigid transform."""

    position: tuple[float, float, float] = Field(description="metres")
    wxyz: tuple[float, float, float, float] = Field(description="unit quaternion, w first and >= 0")


class ClassAnswer(BaseModel):
    """A class; its ETag is its revision."""

    id: int = Field(description="never shifts, never used again")
    name: str
    color: str = Field(description="#rrggbb")
    default_size: tuple[float, float, float] | None = Field(
        description="metres, of new boxes of this class; null: not set"
    )
    symmetry: SymmetryAnswer = Field(description="of its objects, in their boxes' frames")
    keypoints: list[KeypointAnswer] = Field(description="of its objects; none: the box's centre and corners")
    mesh: MeshJson | None = Field(description="of its objects; null: none. Edits have its `digest` alone")
    revision: int = Field(description="the session's revision that last changed it")

    @classmethod
    def of(cls, a_class: ObjectClass, meshes: Mapping[str, SourcedMesh]) -> "ClassAnswer":
        """The JSON of a class, whose mesh is one of `meshes`, by digest."""
        return cls.model_validate(class_json(a_class, meshes))


class BoxAnswer(BaseModel):
    """A virtual box; its ETag is its revision."""

    id: int = Field(description="never used again")
    class_id: int
    name: str
    T_world_box: TransformAnswer = Field(description="the box's centre and axes in the world")
    size: tuple[float, float, float] = Field(description="metres along the box's own axes")
    has_hull: bool = Field(description="whether a visual hull is stored with it")
    hull_options: HullOptionsJson | None = Field(description="how it was made from its masks; null: it was not")
    has_mesh: bool = Field(description="whether a mesh of its own is stored with it; it counts before its class's")
    locked: bool = Field(description="class, place and size stay, and it is not deleted, until it is unlocked")
    revision: int = Field(description="the session's revision that last changed it")

    @classmethod
    def of(cls, box: VirtualBox) -> "BoxAnswer":
        """The JSON of a box."""
        return cls.model_validate(box_json(box))


class PointsDraft(Strict):
    """A box to add from four points along three consecutive edges."""

    class_id: Id
    points: Annotated[list[Point], Field(min_length=4, max_length=4)] = Field(
        description="p0, p1, p2, p3: p0-p1 runs along the box's z, p1-p2 along x, p2-p3 along y; metres"
    )
    frame_of: Literal["world", "camera"] = Field(description="whose coordinates the points are in")
    frame: Id | None = Field(None, description="the frame's index, where frame_of is camera")
    name: Name | None = None


class DuplicateDraft(Strict):
    """Where the copy of a box goes."""

    offset: Literal["beside"] = Field("beside", description="10 mm from the box, along its own x")


class BoxFromPointsAnswer(BoxAnswer):
    """The box that the points gave."""

    residual_degrees: float = Field(description="the largest angle between an edge as given and as kept")


class FrameJson(BaseModel):
    """One frame of the recording."""

    index: int
    name: str = Field(description="the image's path in the recording")
    camera_id: int
    T_world_camera: TransformAnswer = Field(description="OpenCV camera axes: x right, y down, z forward; metres")


class FramePage(BaseModel):
    """Some of a session's frames, in order."""

    items: list[FrameJson]
    offset: int
    limit: int
    total: int


class CameraJson(BaseModel):
    """A camera. All of `fx fy cx cy` are OpenCV's: a pixel's centre is at integers, so in image coordinates, where
    (0, 0) is the image's top left corner, the principal point is at (cx + 0.5, cy + 0.5)."""

    id: int
    width: int = Field(description="pixels")
    height: int = Field(description="pixels")
    fx: float = Field(description="K[0, 0] of OpenCV, pixels")
    fy: float = Field(description="K[1, 1] of OpenCV, pixels")
    cx: float = Field(description="K[0, 2] of OpenCV, pixels; pixel centres at integers")
    cy: float = Field(description="K[1, 2] of OpenCV, pixels; pixel centres at integers")
    model: Literal["pinhole", "brown", "fisheye"]
    distortion: list[float] = Field(description="pinhole: none; brown: k1 k2 p1 p2 k3; fisheye: k1 k2 k3 k4")

    @classmethod
    def of(cls, camera_id: int, camera: Camera) -> "CameraJson":
        """The JSON of a camera."""
        return cls(
            id=camera_id,
            width=camera.width,
            height=camera.height,
            fx=camera.fx,
            fy=camera.fy,
            cx=camera.cx,
            cy=camera.cy,
            model=camera.model,
            distortion=list(camera.distortion),
        )


class LabelJson(BaseModel):
    """One box in one frame; image coordinates of the original image, (0, 0) its top left corner."""

    box_id: int
    class_id: int
    bbox: Bounds | None = Field(description="x0 y0 x1 y1 of the part in the image; null: no part is in it")
    bbox_amodal: Bounds | None = Field(description="of the whole box, unclipped; null: none of it is before the camera")
    outline: list[tuple[float, float]] = Field(description="ring round the part in the image, not closed")
    wireframe: list[list[tuple[float, float]]] = Field(description="the edges within the image, bent by the lens")
    truncated: float = Field(description="share of the amodal outline's area outside the image")
    visible: float = Field(description="share of the in-image outline that no nearer box hides")


class EditJson(BaseModel):
    """One entry of the session's history."""

    revision: int = Field(description="the session's revision after it")
    author: str
    summary: str
    undoes: int | None
    redoes: int | None
    at: datetime
    changes: list[dict[str, Any]] = Field(
        description="each {kind: box | class | mask | name, id, before, after}; before null: added, after null:"
        " deleted. A mask's before is without its polygons and points"
    )

    @classmethod
    def of(cls, edit: Edit) -> "EditJson":
        """The JSON of an edit."""
        return cls(**_entry(edit), changes=[_change_json(change) for change in edit.changes])


class PastEdit(EditJson):
    """One entry of the session's history, as it stands now; its masks are without polygons and points."""

    undone: bool = Field(description="its effect was taken back, by a later undo (or, of an undo, redo) that stands")
    own: bool = Field(description="made by the caller, whose undo and redo are about own edits only")


class EditName(BaseModel):
    """An edit, by its revision."""

    revision: int
    summary: str = Field(description="what was done, such as `Move cube`, without saying that it was undone or redone")

    @classmethod
    def of(cls, edit: Edit | None) -> "EditName | None":
        """The JSON of an edit, if there is one."""
        return None if edit is None else cls(revision=edit.revision, summary=edit.deed)


class HistoryPage(BaseModel):
    """Some of a session's history."""

    items: list[PastEdit] = Field(description="newest first")
    can_undo: EditName | None = Field(description="the edit that the caller's undo would take back")
    can_redo: EditName | None = Field(description="the undo that the caller's redo would take back")

    @classmethod
    def of(cls, history: History, *, author: str) -> "HistoryPage":
        """The JSON of a history, for `author`."""
        return cls(
            items=[
                PastEdit(
                    **_entry(edit),
                    changes=[_past_change_json(change) for change in edit.changes],
                    undone=edit.revision in history.taken_back,
                    own=edit.author == author,
                )
                for edit in history.edits
            ],
            can_undo=EditName.of(history.can_undo),
            can_redo=EditName.of(history.can_redo),
        )


class ExportDraft(Strict):
    """An export to start."""

    format: str = Field(json_schema_extra={"enum": list(WRITERS)})
    options: ExportOptions = ExportOptions()  # pyright: ignore[reportCallIssue]


class ExportJson(BaseModel):
    """An export and how far it is."""

    id: str
    session_id: str
    format: str
    options: ExportOptions
    state: Literal["queued", "running", "done", "failed", "cancelled"]
    done: int = Field(description="frames written")
    total: int = Field(description="frames to write; 0 until that is known")
    error: str | None
    report: ExportReport | dict[str, Any] | None = Field(
        description="once done: counts by class and split, dropped labels by reason"
    )
    created: datetime
    ended: datetime | None = Field(description="when it was done, failed or cancelled; null until then")
    bytes: int | None = Field(description="of all files of a done dataset, linked images too: what a download holds")

    @classmethod
    def of(cls, job: ExportJob) -> "ExportJson":
        """The JSON of an export job."""
        return cls.model_validate(job, from_attributes=True)


def frames_json(frames: FrameTable, start: int, stop: int) -> list[dict[str, Any]]:
    """Frames `start` to `stop` as FrameJson would have them, without its cost of microseconds a field."""
    Ts: Float[np.ndarray, "n 4 4"] = frames.Ts_world_camera[start:stop]
    rows = zip(
        frames.names[start:stop],
        frames.camera_ids[start:stop].tolist(),
        Ts[:, :3, 3].tolist(),
        wxyz_from_rotation(Ts[:, :3, :3]).tolist(),
        strict=True,
    )
    return [
        {
            "index": index,
            "name": name,
            "camera_id": camera_id,
            "T_world_camera": {"position": position, "wxyz": wxyz},
        }
        for index, (name, camera_id, position, wxyz) in enumerate(rows, start)
    ]


def label_json(label: FrameLabel) -> dict[str, Any]:
    """A label as LabelJson has it."""
    return {
        "box_id": label.box_id,
        "class_id": label.class_id,
        "bbox": label.bbox,
        "bbox_amodal": label.bbox_amodal,
        "outline": label.outline.tolist(),
        "wireframe": [line.tolist() for line in label.wireframe],
        "truncated": label.truncated,
        "visible": label.visible,
    }


def current_json(current: object) -> Mapping[str, Any] | None:
    """The JSON of what a Conflict holds."""
    if isinstance(current, VirtualBox):
        return box_json(current)
    if isinstance(current, ObjectClass):
        return class_json(current, {})
    if isinstance(current, Mask):
        return mask_json(current)
    if isinstance(current, SessionSummary):
        return SessionJson.of(current).model_dump(mode="json")
    assert current is None, current
    return None


def _entry(edit: Edit) -> dict[str, Any]:
    """An edit without its changes."""
    names = ("revision", "author", "summary", "undoes", "redoes", "at")
    return {name: getattr(edit, name) for name in names}


def _change_json(change: Change) -> dict[str, Any]:
    if isinstance(change, BoxChange):
        before, after = current_json(change.before), current_json(change.after)
        return {"kind": "box", "id": change.box_id, "before": before, "after": after}
    if isinstance(change, ClassChange):
        before, after = current_json(change.before), current_json(change.after)
        return {"kind": "class", "id": change.class_id, "before": before, "after": after}
    if isinstance(change, MaskChange):
        # The old outline, of thousands of corners, would double the message, and nobody asks for it.
        return {**_past_change_json(change), "after": current_json(change.after)}
    return {"kind": "name", "id": None, "before": change.before, "after": change.after}


def _past_change_json(change: Change) -> dict[str, Any]:
    """As `_change_json`, masks without their outlines: a page of history would have megabytes of them."""
    if isinstance(change, MaskChange):
        before, after = (None if m is None else mask_json_without_outline(m) for m in (change.before, change.after))
        return {"kind": "mask", "id": change.mask_id, "before": before, "after": after}
    return _change_json(change)
