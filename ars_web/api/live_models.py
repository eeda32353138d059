"""The messages of the live line, both ways, and what they are in the words of `ars_web.workspace`.

From the page everything is checked: unknown fields, strings for numbers and numbers that are not finite are refused.
"""

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, RootModel, StringConstraints, ValidationError, model_validator

from ars_web.api.models import BoxAnswer, EditJson, TransformAnswer
from ars_web.errors import BadInput
from ars_web.geometry.box import LARGEST_SIZE, Box
from ars_web.sessions.boxes_json import Id, Size, TransformJson, transform_json
from ars_web.workspace import (
    BoxPreview,
    Conflicted,
    CoverageSight,
    DirectionPicked,
    Dragged,
    Entered,
    Look,
    NewBox,
    Picked,
    ProposedCamera,
    Refused,
    Tool,
    ViewEvent,
    ViewState,
)

ViewKey = Annotated[str, StringConstraints(strict=True, pattern=r"^[0-9a-f]{32}$")]


class LiveAddress(BaseModel):
    """What follows the `?` of a live line's address."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    view: ViewKey = Field(description="a random name that the page makes for itself: 32 digits of 0-9a-f")
    after: int | None = Field(None, ge=0, lt=2**53, description="the last revision that the page has; else: from now")


class _FromPage(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class HelloMessage(_FromPage):
    """Who is at the page."""

    type: Literal["hello"]
    name: str = Field(description="shown to the others; cleaned and cut; empty: none")


MOST_AROUND, MOST_DOWN = 72, 36
"""Bins of a sphere in the scene: five degrees each. Finer ones are too small to be clicked."""

MOST_PROPOSED = 500
"""Cameras of a tour in the scene."""


class CoverageSightJson(_FromPage):
    """A sphere round a box: how many views there are of it from each direction."""

    box_id: Id
    whole_class: bool = Field(description="count views of all objects of the box's class")
    azimuth_bins: int = Field(ge=1, le=MOST_AROUND)
    polar_bins: int = Field(ge=1, le=MOST_DOWN)
    min_visible: float = Field(ge=0, le=1, allow_inf_nan=False, description="of an object, for a view to count")
    chosen_bin: Id | None = Field(None, description="outlined: azimuth bin * polar bins + polar bin")
    chosen_cell: Id | None = Field(None, description="or a cell of equal area")

    @model_validator(mode="after")
    def _chosen_is_there(self) -> "CoverageSightJson":
        count = self.azimuth_bins * self.polar_bins
        for name, chosen in (("chosen_bin", self.chosen_bin), ("chosen_cell", self.chosen_cell)):
            if chosen is not None and chosen >= count:
                raise ValueError(f"{name} must be below {count}, the number of bins")
        return self

    @property
    def sight(self) -> CoverageSight:
        """As the scene takes it."""
        return CoverageSight(
            box_id=self.box_id,
            whole_class=self.whole_class,
            azimuth_bins=self.azimuth_bins,
            polar_bins=self.polar_bins,
            min_visible=self.min_visible,
            chosen_bin=self.chosen_bin,
            chosen_cell=self.chosen_cell,
        )


class ViewMessage(_FromPage):
    """What the page wants its scene to show, whole each time."""

    type: Literal["view"]
    mode: Literal["scene", "frame"]
    frame: Id
    selected: Id | None
    tool: Tool
    axes: Literal["box", "world"]
    snap_length: float = Field(ge=0, le=LARGEST_SIZE, allow_inf_nan=False, description="metres; 0: none")
    snap_angle: float = Field(ge=0, le=math.pi, allow_inf_nan=False, description="radians; 0: none")
    upright: bool
    hidden: frozenset[Id] = Field(description="boxes that this page does not show")
    dark: bool
    coverage: CoverageSightJson | None = Field(None, description="a sphere in the scene; null: none")
    tour: tuple[TransformJson, ...] = Field(
        (), max_length=MOST_PROPOSED, description="T_world_camera of cameras proposed next, in their order"
    )

    @property
    def state(self) -> ViewState:
        """As the scene takes it."""
        return ViewState(
            mode=self.mode,
            frame=self.frame,
            selected=self.selected,
            tool=self.tool,
            axes=self.axes,
            snap_length=self.snap_length,
            snap_angle=self.snap_angle,
            upright=self.upright,
            hidden=self.hidden,
            dark=self.dark,
            coverage=None if self.coverage is None else self.coverage.sight,
            tour=tuple(ProposedCamera(place.position, place.wxyz) for place in self.tour),
        )


class LookMessage(_FromPage):
    """Turn the free camera to something."""

    type: Literal["look"]
    at: Literal["all", "selected", "frame"]

    @property
    def action(self) -> Look:
        """As the scene takes it."""
        return Look(self.at)


class NewBoxMessage(_FromPage):
    """Add a box of a class where the view looks at."""

    type: Literal["new-box"]
    class_id: Id

    @property
    def action(self) -> NewBox:
        """As the scene takes it."""
        return NewBox(self.class_id)


class PreviewMessage(_FromPage):
    """A box as it is being typed, nothing of it stored; `box_id` null: no more."""

    type: Literal["preview"]
    box_id: Id | None
    T_world_box: TransformJson | None = Field(None, description="needed where box_id is not null")
    size: Size | None = Field(None, description="metres; needed where box_id is not null")

    @model_validator(mode="after")
    def _is_whole(self) -> "PreviewMessage":
        given = {"T_world_box": self.T_world_box is not None, "size": self.size is not None}
        if self.box_id is None and any(given.values()):
            raise ValueError("T_world_box and size belong to a box: box_id must not be null")
        if self.box_id is not None and not all(given.values()):
            raise ValueError(f"{' and '.join(name for name, is_given in given.items() if not is_given)} is missing")
        return self

    @property
    def preview(self) -> BoxPreview | None:
        """As the scene takes it.

        Raises:
            BadInput: no box can be there.
        """
        if self.box_id is None or self.T_world_box is None or self.size is None:
            return None
        return BoxPreview(self.box_id, Box(self.T_world_box.matrix, np.array(self.size)))


PageMessage = HelloMessage | ViewMessage | LookMessage | NewBoxMessage | PreviewMessage


class LiveFromPage(RootModel[Annotated[PageMessage, Field(discriminator="type")]]):
    """A message from the page to the server."""


def page_message(text: str) -> PageMessage:
    """The message that `text` holds.

    Raises:
        BadInput: it is no JSON, or no message; says which field and why.
    """
    try:
        return LiveFromPage.model_validate_json(text).root
    except ValidationError as error:
        raise BadInput(refusal(error)) from error


def refusal(error: ValidationError) -> str:
    """The first faults in words, each behind its field's name; the refused values are not echoed."""
    faults = error.errors(include_url=False, include_context=True, include_input=False)
    words = [_words(fault["type"], fault["msg"], fault["loc"], fault.get("ctx", {})) for fault in faults[:5]]
    return "; ".join(words)


def _words(kind: str, message: str, place: tuple[int | str, ...], context: Mapping[str, Any]) -> str:
    where = ".".join(str(part)[:100] for part in place)
    if kind == "json_invalid":
        return f"not JSON: {context['error']}"
    if kind == "union_tag_not_found":
        return f"type: missing; it is one of {_TYPES}"
    if kind == "union_tag_invalid":
        return f"type: must be one of {_TYPES}"
    if kind == "extra_forbidden":
        return f"{where}: unknown field"
    return f"{where}: {message.removeprefix('Value error, ')}" if where else f"{message}, with a `type`"


_TYPES = "hello, view, look, new-box, preview"


class _ToPage(BaseModel):
    # What is generated from the schema can tell the messages apart only by a `type` that is never absent.
    model_config = ConfigDict(json_schema_serialization_defaults_required=True)


class ReadyMessage(_ToPage):
    """The line is up; `edit` messages of what the page has missed follow."""

    type: Literal["ready"] = "ready"
    revision: int = Field(description="the session's")


class ResetMessage(_ToPage):
    """The page has seen revisions that the session does not have: it must read everything anew."""

    type: Literal["reset"] = "reset"
    revision: int = Field(description="the session's")


class EditMessage(_ToPage):
    """An edit was made, by whomever."""

    type: Literal["edit"] = "edit"
    edit: EditJson


class GoneMessage(_ToPage):
    """The session was deleted; the line is closed."""

    type: Literal["gone"] = "gone"
    revision: int = Field(description="the last one that was sent")


class PersonJson(BaseModel):
    """A page that is at the session."""

    view: str = Field(description="the page's name for itself")
    author: str = Field(description="as in the edits that are made there")
    name: str = Field(description="of the person; empty: none given")
    frame: int
    selected: int | None = Field(description="the box")
    mode: Literal["scene", "frame"]
    own: bool = Field(description="whether it is the page that this is told to")


class HereMessage(_ToPage):
    """Who is at the session: all of them, whenever that changes, and again where a line would be silent for long."""

    type: Literal["here"] = "here"
    people: list[PersonJson]


class PickedMessage(_ToPage):
    """Something was clicked in the scene: a box, a frame's camera, or (both null) nothing."""

    type: Literal["picked"] = "picked"
    box_id: int | None
    frame: int | None


class DirectionPickedMessage(_ToPage):
    """The coverage's sphere was clicked; the direction is folded by the object's symmetry."""

    type: Literal["direction"] = "direction"
    bin: int = Field(description="of equal angles: azimuth bin * polar bins + polar bin")
    cell: int = Field(description="of equal area")


class EnteredMessage(_ToPage):
    """The scene has been told all of a frame."""

    type: Literal["entered"] = "entered"
    frame: int
    milliseconds: float = Field(description="since it was asked")


class DraggedMessage(_ToPage):
    """A box is being dragged, in this view or another. A slow page gets only the newest of each box."""

    type: Literal["dragged"] = "dragged"
    phase: Literal["start", "move", "end", "cancel"] = Field(description="end: it is stored; cancel: it is as before")
    box_id: int
    T_world_box: TransformAnswer
    size: tuple[float, float, float] = Field(description="metres")
    text: str = Field(description="what changes, such as `X +12.0 mm`")
    own: bool = Field(description="whether it is this page's view that drags")


class PlacedJson(BaseModel):
    """A box's place and size, not stored."""

    box_id: int
    T_world_box: TransformAnswer
    size: tuple[float, float, float] = Field(description="metres")

    @classmethod
    def of(cls, preview: BoxPreview) -> "PlacedJson":
        """The JSON of a preview."""
        return cls.model_validate(_placed(preview))


class ConflictedMessage(_ToPage):
    """A drag could not be stored, since the box was changed meanwhile."""

    type: Literal["conflicted"] = "conflicted"
    detail: str
    yours: PlacedJson = Field(description="as it was dragged")
    current: BoxAnswer | None = Field(description="as it is now; null: deleted")


class RefusedMessage(_ToPage):
    """A message, or what it asked for, could not be done; the line stays open."""

    type: Literal["refused"] = "refused"
    detail: str = Field(description="why, and what to do")


SessionMessage = ReadyMessage | ResetMessage | EditMessage | GoneMessage
ViewEventMessage = (
    PickedMessage | DirectionPickedMessage | EnteredMessage | DraggedMessage | ConflictedMessage | RefusedMessage
)
ServerMessage = SessionMessage | HereMessage | ViewEventMessage


class LiveToPage(RootModel[Annotated[ServerMessage, Field(discriminator="type")]]):
    """A message from the server to the page."""


def view_event_message(event: ViewEvent) -> ViewEventMessage:
    """The message that tells a page of what happened in its scene."""
    match event:
        case Picked():
            return PickedMessage(box_id=event.box_id, frame=event.frame)
        case DirectionPicked():
            return DirectionPickedMessage(bin=event.bin, cell=event.cell)
        case Entered():
            return EnteredMessage(frame=event.frame, milliseconds=event.milliseconds)
        case Dragged():
            return DraggedMessage.model_validate(
                {"phase": event.phase, "text": event.text, "own": event.own, **_placed(event.preview)}
            )
        case Conflicted():
            return ConflictedMessage(
                detail=event.detail,
                yours=PlacedJson.of(event.yours),
                current=None if event.current is None else BoxAnswer.of(event.current),
            )
        case Refused():
            return RefusedMessage(detail=event.detail)


def _placed(preview: BoxPreview) -> dict[str, Any]:
    box = preview.box
    return {"box_id": preview.box_id, "T_world_box": transform_json(box.T_world_box), "size": box.size.tolist()}
