"""`/api/formats`: what recordings come in, what datasets go out in, and with which options."""

from typing import Any

from fastapi import APIRouter
from pydantic import BaseModel, Field

from ars_web.annotations.registry import READERS as LABEL_READERS
from ars_web.api.dependencies import StrictRoute
from ars_web.api.problems import documented
from ars_web.datasets.label_functions import LABEL_FUNCTIONS
from ars_web.datasets.option_list import OptionType, export_options
from ars_web.datasets.registry import WRITERS
from ars_web.datasets.shapes import SHAPES
from ars_web.recordings.registry import READERS

router = APIRouter(prefix="/api/formats", tags=["formats"], route_class=StrictRoute)


class ReaderJson(BaseModel):
    """A format that recordings or labels come in."""

    format: str
    title: str
    needs: str = Field(description="which files")


class ChoiceJson(BaseModel):
    """One value that an option can have."""

    value: str
    meaning: str


class OptionJson(BaseModel):
    """An export option."""

    name: str = Field(description="as in the options' JSON; split.train is train in the object split")
    title: str
    meaning: str
    type: OptionType = Field(description="of its value; integers and texts are lists")
    optional: bool = Field(description="whether it may be null, which then is its default")
    choices: list[ChoiceJson] = Field(description="of a choice; empty for others")
    default: Any
    minimum: float | None
    maximum: float | None


class WriterJson(BaseModel):
    """A format that datasets go out in."""

    format: str
    title: str
    description: str
    shows: list[str] = Field(description="the label functions that what it holds of a label is drawn by")
    shapes: list[str] = Field(description="what its labels can be drawn round")
    options: list[OptionJson]


class LabelFunctionJson(BaseModel):
    """One of the ways to mark an object in an image."""

    name: str
    title: str
    description: str


class FormatsJson(BaseModel):
    """All formats, in the order in which they are offered."""

    readers: list[ReaderJson]
    labels: list[ReaderJson] = Field(description="that labels beside a recording come in")
    writers: list[WriterJson]
    label_functions: list[LabelFunctionJson]


@router.get("", operation_id="formats-list", responses=documented())
def formats() -> FormatsJson:
    """The formats of recordings, labels and datasets, with the options of exports in words."""
    options = [OptionJson.model_validate(option, from_attributes=True) for option in export_options()]
    owned = {name for writer in WRITERS.values() for name in writer.own_options}
    return FormatsJson(
        readers=[ReaderJson(format=r.format, title=r.title, needs=r.needs) for r in READERS.values()],
        labels=[ReaderJson(format=r.format, title=r.title, needs=r.needs) for r in LABEL_READERS.values()],
        writers=[
            WriterJson(
                format=w.format,
                title=w.title,
                description=w.description,
                shows=list(w.shows),
                shapes=list(SHAPES),
                options=[o for o in options if o.name not in owned or o.name in w.own_options],
            )
            for w in WRITERS.values()
        ],
        label_functions=[
            LabelFunctionJson(name=f.name, title=f.title, description=f.description) for f in LABEL_FUNCTIONS.values()
        ],
    )
