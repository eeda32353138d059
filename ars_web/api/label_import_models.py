"""The JSON of labels that come in from files."""

from typing import Literal

from pydantic import BaseModel, Field

from ars_web.annotations.registry import READERS
from ars_web.api.models import Strict, TransformAnswer
from ars_web.sessions.boxes_json import Flag


class LabelsFields(Strict):
    """How a file of labels is to be read."""

    format: str = Field("auto", description="auto: found by looking", json_schema_extra={"enum": ["auto", *READERS]})
    dry_run: bool = Field(False, description="say what would come in, and store nothing")


class LabelsDraft(LabelsFields):
    """A file of labels below a declared root."""

    dry_run: Flag = Field(False, description="say what would come in, and store nothing")
    root: str = Field(description="a name from GET /api/roots")
    path: str = Field(max_length=4096, description="of a file, or of a folder that holds one; relative, with /")


class ImportedObjectJson(BaseModel):
    """An object that came in, or would."""

    class_name: str
    box_id: int | None = Field(description="of its box, or that is kept for it; null: nothing was stored")
    name: str | None = Field(description="the box's; null: there is none")
    T_world_box: TransformAnswer | None = Field(description="null: it has masks only, and `note` says why")
    size: tuple[float, float, float] | None = Field(description="metres")
    made_of: Literal["poses", "outlines", "rectangles"] | None = Field(description="what the box was made of")
    masks: int = Field(description="outlines that came with it")
    note: str = Field(description="what to know of it; empty: nothing")


class LeftOutJson(BaseModel):
    """Labels that are left out for one reason."""

    reason: str
    count: int
    examples: list[str] = Field(description="what the file calls the first of them")


class ImportedLabelsJson(BaseModel):
    """What came of a file of labels."""

    format: str = Field(description="that it was read as")
    revision: int | None = Field(description="the session's, that it made; null: nothing was stored")
    boxes: int
    masks: int
    classes: list[str] = Field(description="that are new in the session")
    objects: list[ImportedObjectJson]
    left_out: list[LeftOutJson] = Field(description="the most frequent reason first")
    notes: list[str] = Field(description="how the file was understood, where that could be otherwise")
