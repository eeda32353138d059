"""The options of an export, as the API takes them, the command line spells them and `dataset.json` keeps them.

Titles and descriptions are for people who export: the page shows them, through `option_list.py`.
"""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

# Strict: a truth value or a string is no number.
Share = Annotated[float, Field(strict=True, ge=0.0, le=1.0, allow_inf_nan=False)]
Count = Annotated[int, Field(strict=True, ge=0)]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


def _meanings(**choices: str) -> dict[str, Any]:
    """What each choice of a field means, for its JSON schema."""
    return {"x-meanings": choices}


class FrameChoice(_Strict):
    """Which frames of each session: every `step`-th from `start` up to, not including, `stop`; or those listed."""

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

    @model_validator(mode="after")
    def _one_of_the_two(self) -> "FrameChoice":
        if self.list is not None and (self.step, self.start, self.stop) != (1, 0, None):
            raise ValueError("give a list, or step, start and stop, not both: one of them would be ignored")
        return self


class SplitChoice(_Strict):
    """How frames are divided.

    `block`: contiguous runs, so that neighbours do not fall on both sides; `frame`: frame by frame at random;
    `session`: whole sessions. Shares must add up to 1.
    """

    train: Share = Field(0.8, title="Training", description="share of the frames to train on; the three add up to 1")
    val: Share = Field(0.2, title="Validation", description="share of the frames to tune on while training")
    test: Share = Field(0.0, title="Test", description="share of the frames kept for a last, honest measurement")
    by: Literal["block", "frame", "session"] = Field(
        "block",
        title="Divide by",
        description="what goes to one side or the other as a whole",
        json_schema_extra=_meanings(
            block="runs of neighbouring frames, so that validation frames have no twin in training",
            frame="single frames at random: nearly every validation frame then has a twin in training",
            session="whole sessions, where several are merged",
        ),
    )
    seed: Count = Field(0, title="Seed", description="another number divides the frames another way")

    @model_validator(mode="after")
    def _shares_add_up(self) -> "SplitChoice":
        total = self.train + self.val + self.test
        if abs(total - 1.0) > 1e-6:
            raise ValueError(f"train + val + test must be 1, not {total:g}")
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
