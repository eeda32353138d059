"""The options of an export, as the API takes them, the command line spells them and `dataset.json` keeps them."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

# Strict: a truth value or a string is no number.
Share = Annotated[float, Field(strict=True, ge=0.0, le=1.0, allow_inf_nan=False)]
Count = Annotated[int, Field(strict=True, ge=0)]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class FrameChoice(_Strict):
    """Which frames of each session: every `step`-th from `start` up to, not including, `stop`; or those listed."""

    step: int = Field(1, strict=True, ge=1)
    start: Count = 0
    stop: Count | None = None
    list: tuple[Count, ...] | None = None

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

    train: Share = 0.8
    val: Share = 0.2
    test: Share = 0.0
    by: Literal["block", "frame", "session"] = "block"
    seed: Count = 0

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
        description="hard links (copies across file systems), copies, undistorted copies, or no images",
    )
    shape: Literal["box", "hull", "mesh"] | None = Field(
        None, description="default: the hull where a box has one, else the box"
    )
    min_visible: Share = Field(0.0, description="labels with a smaller visible fraction are dropped")
    max_truncated: Share = Field(1.0, description="labels with a larger share outside the image are dropped")
    min_area_px: float = Field(
        4.0, strict=True, ge=0.0, allow_inf_nan=False, description="labels with a smaller in-image box are dropped"
    )
    split: SplitChoice = SplitChoice()  # pyright: ignore[reportCallIssue]
    sessions: tuple[str, ...] = Field((), description="ids of further sessions to merge; classes are matched by name")
