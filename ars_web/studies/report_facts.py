"""What a report says of a session, in records: the numbers behind its page, as `ars-web report --json` prints them."""

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from ars_web.datasets.options import ExportOptions
from ars_web.datasets.report import SplitCounts

SplitName = Literal["train", "val", "test"]

SMALL_PX, LARGE_PX = 32.0, 96.0
"""Sides of squares: COCO calls objects below 32 x 32 pixels small, from 96 x 96 large."""

TINY_PX = 16.0
"""Below 16 x 16 pixels; a detector whose finest map has a cell for 8 pixels sees of such an object two cells by two."""


class _Record(BaseModel):
    model_config = ConfigDict(frozen=True)


class FrameCounts(_Record):
    """Frames of the session and of the export."""

    recorded: int = Field(description="in the session")
    chosen: int = Field(description="by the options, and so in the export")
    labelled: int = Field(description="of those chosen, with a label")
    negatives: int = Field(description="of those chosen, without any")


class Histogram(_Record):
    """Counts between edges; a value on an edge counts above it, on the last edge below."""

    edges: list[float] = Field(description="one more than counts")
    counts: list[int]


class SizeFacts(_Record):
    """How large labels are: of each the square root of its box's area in the image, pixels."""

    median_px: float
    tiny: int = Field(description=f"below {TINY_PX:g} px")
    small: int = Field(description=f"below {SMALL_PX:g} px, COCO's small")
    medium: int
    large: int = Field(description=f"{LARGE_PX:g} px and more, COCO's large")
    histogram: Histogram


class ShareFacts(_Record):
    """A share of labels' outlines, from 0 to 1."""

    median: float
    histogram: Histogram


class HoleFacts(_Record):
    """Directions, in degrees in the box's frame, from which there is no view."""

    azimuth: tuple[float, float] = Field(description="from, to; they go round at 180")
    polar: tuple[float, float] = Field(description="from +z: from, to")
    share: float = Field(description="of all directions")
    words: str


class ViewFacts(_Record):
    """From where objects are seen where they are labelled."""

    frames: int
    views: int
    empty_area: float = Field(description="of 648 cells of equal area, those without a view; as `coverage` prints it")
    unseen: float = Field(description="of 72 cells of equal area, some 24 degrees wide, those without a view")
    unseen_azimuths: float = Field(description="degrees round +z from which there is no view, in one piece")
    holes: list[HoleFacts] = Field(description="the largest on the side of +z, and on that of -z")


class ClassFacts(_Record):
    """A class, and the labels of its objects."""

    id: int
    name: str
    color: str
    objects: int
    labels: int
    splits: dict[str, int] = Field(description="labels in each split")
    frames: int = Field(description="with a label of it")
    sizes: SizeFacts | None
    visible: ShareFacts | None = Field(description="of labels in the frames where visible shares were looked for")
    truncated: ShareFacts | None
    views: ViewFacts | None


class BoxFacts(_Record):
    """An object."""

    id: int
    name: str
    class_id: int
    class_name: str
    size_mm: tuple[float, float, float]
    drawn_round: str = Field(description="what its labels are drawn round: box, hull or mesh")
    masks: int = Field(description="outlines drawn or accepted of it")
    in_image: int = Field(description="frames with some part of it in the image")
    labels: int
    median_px: float | None
    median_visible: float | None
    views: ViewFacts


class NeighbourFacts(_Record):
    """How near labelled frames of a split are to labelled frames that train."""

    asked: int = Field(description="frames whose nearest was looked for, spread evenly")
    twins: int = Field(description="of those asked, with a twin that trains")
    median_move: float = Field(description="to the nearest, as a share of the distance to the nearest object")
    median_turn: float = Field(description="to the nearest, degrees")


class SplitFacts(_Record):
    """A part of the export."""

    share: float = Field(description="of the frames, as asked")
    counts: SplitCounts
    neighbours: NeighbourFacts | None = Field(description="none for train, and where nothing can be compared")


class CameraFacts(_Record):
    """A camera of the recording."""

    id: int
    width: int
    height: int
    fx: float
    fy: float
    model: str
    frames: int


class RecordingFacts(_Record):
    """Where the frames come from."""

    format: str
    skipped: int = Field(description="frames that could not be used when it was imported")
    cameras: list[CameraFacts]
    path_m: float = Field(description="how far the camera went; of several the one that went farthest")
    jumps: list[str] = Field(description="where tracking may have been lost")


class VisibilityLook(_Record):
    """In how many of the chosen frames visible shares were looked for."""

    frames: int
    every: bool


class ReportWarning(_Record):
    """Something that makes training worse, or worthless."""

    kind: str
    grave: bool = Field(description="whether training, or measuring, makes no sense before it is mended")
    about: str = Field(description="a class, an object, a split; empty: the whole")
    says: str = Field(description="what is so, with its value")
    why: str
    remedy: str
    command: str = Field(description="or options of `export` that help; empty: none does")


class SessionReport(_Record):
    """What an export of a session would hold, and what is to be thought of it."""

    session_id: str
    name: str
    revision: int
    shape: str
    options: ExportOptions
    command: str = Field(description="that would write this set")
    frames: FrameCounts
    labels: int
    dropped: dict[str, int]
    splits: dict[SplitName, SplitFacts]
    classes: list[ClassFacts]
    boxes: list[BoxFacts]
    visibility: VisibilityLook
    recording: RecordingFacts
    warnings: list[ReportWarning]
