"""The options of an export, as the API takes them, the command line spells them and `dataset.json` keeps them.

Titles and descriptions are for people who export: the page shows them, through `option_list.py`.
"""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

# Strict: a truth value or a string is no number.
Share = Annotated[float, Field(strict=True, ge=0.0, le=1.0, allow_inf_nan=False)]
Count = Annotated[int, Field(strict=True, ge=0)]
Degrees = Annotated[float, Field(strict=True, ge=-360.0, le=360.0, allow_inf_nan=False)]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


def _meanings(**choices: str) -> dict[str, Any]:
    """What each choice of a field means, for its JSON schema."""
    return {"x-meanings": choices}


class FrameChoice(_Strict):
    """Which frames of each session: every `step`-th from `start` up to, not including, `stop`; or those listed.

    Of these only what lies in `sector`, without near twins; and of that `count` frames of all sessions together.
    """

    step: int = Field(
        1,
        strict=True,
        ge=1,
        title="Every N-th frame",
        description="neighbouring frames look alike: with 5, every fifth is written",
    )
    start: Count = Field(0, title="First frame", description="frames before this one are left out; they count from 0")
    stop: Count | None = Field(
        None, title="Up to frame", description="this frame and those after it are left out; empty: to the end"
    )
    list: tuple[Count, ...] | None = Field(
        None, title="These frames alone", description="numbers of frames, instead of the three options above"
    )
    count: int | None = Field(
        None,
        strict=True,
        ge=1,
        title="How many frames",
        description="so many of all sessions together, chosen from those that the other options leave; empty: all",
    )
    by: Literal["coverage", "even"] = Field(
        "coverage",
        title="Chosen by",
        description="how that many frames are chosen",
        json_schema_extra=_meanings(
            coverage="those that show objects from most directions, then each as often; frames without a label last",
            even="evenly over the recording",
        ),
    )
    near_degrees: float = Field(
        0.0,
        strict=True,
        ge=0.0,
        le=90.0,
        allow_inf_nan=False,
        title="Near twins by view",
        description="a frame that shows its objects from so nearly the same side as a chosen one, and from a distance"
        " within a tenth, is left out; 0 keeps all",
    )
    near_frames: Count = Field(
        0,
        title="Near twins by time",
        description="frames that are so few frames before or after a chosen one are left out; 0 keeps all",
    )
    sector: tuple[Degrees, Degrees] | None = Field(
        None,
        title="Cameras from one side",
        description="only cameras between two angles round the objects, in degrees: 0 to 180 is half the sphere;"
        " empty: all round",
    )
    sector_box: Count | None = Field(
        None,
        title="Angles round box",
        description="id of the box whose own z axis they are about, as in its coverage; empty: the world's z axis,"
        " through the middle of all boxes",
    )

    @model_validator(mode="after")
    def _one_of_the_two(self) -> "FrameChoice":
        if self.list is not None and (self.step, self.start, self.stop) != (1, 0, None):
            raise ValueError("give a list, or step, start and stop, not both: one of them would be ignored")
        return self

    @model_validator(mode="after")
    def _nothing_is_ignored(self) -> "FrameChoice":
        if self.by != "coverage" and self.count is None:
            raise ValueError(f"by {self.by!r} says how count frames are chosen: give a count, too")
        if self.sector_box is not None and self.sector is None:
            raise ValueError("sector_box says what the angles of a sector are about: give a sector, too")
        if self.sector is not None and self.sector[0] == self.sector[1]:
            raise ValueError(f"the sector from {self.sector[0]:g} to {self.sector[1]:g} degrees is empty")
        return self

    @property
    def looks_at_views(self) -> bool:
        """Whether frames are chosen by more than their place in the recording."""
        return self.count is not None or self.near_degrees > 0 or self.near_frames > 0 or self.sector is not None


class SplitChoice(_Strict):
    """How frames are divided.

    `block`: contiguous runs, so that neighbours do not fall on both sides; `frame`: frame by frame at random;
    `session`: whole sessions; `sector`: by where cameras stand round the objects. Shares must add up to 1.
    """

    train: Share = Field(0.8, title="Training", description="share of the frames to train on; the three add up to 1")
    val: Share = Field(0.2, title="Validation", description="share of the frames to tune on while training")
    test: Share = Field(0.0, title="Test", description="share of the frames kept for a last, honest measurement")
    by: Literal["block", "frame", "session", "sector"] = Field(
        "block",
        title="Divide by",
        description="what goes to one side or the other as a whole",
        json_schema_extra=_meanings(
            block="runs of neighbouring frames, so that validation frames have no twin in training",
            frame="single frames at random: nearly every validation frame then has a twin in training",
            session="whole sessions, where several are merged",
            sector="by the side that cameras look from: validation and test each get a side of their own",
        ),
    )
    hold_out: tuple[str, ...] = Field(
        (),
        title="Sessions held out",
        description="of a split by session: these are for validation or test, and all others for training",
    )
    seed: Count = Field(0, title="Seed", description="another number divides the frames another way")

    @model_validator(mode="after")
    def _shares_add_up(self) -> "SplitChoice":
        total = self.train + self.val + self.test
        if abs(total - 1.0) > 1e-6:
            raise ValueError(f"train + val + test must be 1, not {total:g}")
        return self

    @model_validator(mode="after")
    def _held_out_is_of_sessions(self) -> "SplitChoice":
        if self.hold_out and self.by != "session":
            raise ValueError(f"hold_out names whole sessions, but the split is by {self.by!r}: split by 'session'")
        if self.hold_out and self.val == self.test == 0.0:
            raise ValueError("hold_out needs a share of val or test, for which its sessions are")
        return self


class ExportOptions(_Strict):
    """All options with their defaults; what each means is in its description.

    The models are immutable, so two exports with equal options are the same export.
    """

    frames: FrameChoice = FrameChoice()  # pyright: ignore[reportCallIssue]
    images: Literal["link", "copy", "rectify", "none"] = Field(
        "link",
        title="Images",
        description="how the dataset gets its images",
        json_schema_extra=_meanings(
            link="the same files under a second name, which takes no room (copies on another disk)",
            copy="copies, so that nothing done to the recording later changes the dataset",
            rectify="copies without the lens's distortion, with labels to match; slow",
            none="no images, only labels",
        ),
    )
    shape: Literal["box", "hull", "mesh"] | None = Field(
        None,
        title="Label shape",
        description="what labels are drawn round; default: the hull where a box has one, else the box",
        json_schema_extra={
            **_meanings(
                box="the virtual box, also of objects that have a hull",
                hull="the visual hull of the object's masks, where there is one; else the box",
                mesh="the mesh of the object or its class, where there is one; else the hull, else the box",
            ),
            "x-null-means": "hull",
        },
    )
    masks: Literal["write", "none"] = Field(
        "write",
        title="Masks",
        description="of formats that hold each label's pixels as images, which BOP scenes do",
        json_schema_extra=_meanings(
            write="two PNG files a label: its whole silhouette, and what is seen of it",
            none="no masks, which is much faster; counts of pixels are estimates from outlines",
        ),
    )
    min_visible: Share = Field(
        0.0,
        title="Smallest visible share",
        description="labels of which less than this is visible, nearer boxes hiding the rest, are dropped; 0 keeps all",
    )
    max_truncated: Share = Field(
        1.0,
        title="Largest share outside",
        description="labels of which more than this lies outside the image are dropped; 1 keeps all",
    )
    min_area_px: float = Field(
        4.0,
        strict=True,
        ge=0.0,
        allow_inf_nan=False,
        title="Smallest area",
        description="labels whose box in the image is smaller than so many pixels are dropped",
    )
    heading_bins: int = Field(
        18,
        strict=True,
        ge=0,
        le=360,
        title="Bins of a heading",
        description="how many bins a turn has where headings are part of the class; 0 writes them as angles",
    )
    split: SplitChoice = SplitChoice()  # pyright: ignore[reportCallIssue]
    sessions: tuple[str, ...] = Field(
        (),
        title="Merge with",
        description="further sessions in the same dataset; classes are matched by name",
    )
