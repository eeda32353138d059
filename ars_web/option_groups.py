"""Options that several commands take together: dataclasses whose fields are options, as `arguments.py` describes them.

Typer makes an option of each parameter of a command and knows no groups. `grouped` shows it a group's fields in the
place of the parameter that takes the group.
"""

import inspect
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass
from functools import wraps
from typing import TYPE_CHECKING, Any, Literal, get_type_hints

import typer

from ars_web import arguments as take

if TYPE_CHECKING:
    from ars_web.geometry.sphere_bins import SphereBins
    from ars_web.sessions.model import SessionSnapshot


def grouped(command: Callable[..., None]) -> Callable[..., None]:
    """A command for Typer whose parameters that are dataclasses were taken apart into their fields."""
    written = inspect.signature(command)
    hints = get_type_hints(command, include_extras=True)
    groups = {name: hints[name] for name in written.parameters if is_dataclass(hints[name])}
    shown: list[inspect.Parameter] = []
    for name, parameter in written.parameters.items():
        if name in groups:
            of_group = get_type_hints(groups[name], include_extras=True)
            shown += [
                parameter.replace(name=field.name, default=field.default, annotation=of_group[field.name])
                for field in fields(groups[name])
            ]
        else:
            shown.append(parameter.replace(annotation=hints[name]))

    @wraps(command)
    def taken(**given: Any) -> None:
        for name, group in groups.items():
            given[name] = group(**{field.name: given.pop(field.name) for field in fields(group)})
        command(**given)

    taken.__annotations__ = {one.name: one.annotation for one in shown}
    vars(taken)["__signature__"] = written.replace(
        parameters=[one.replace(kind=inspect.Parameter.KEYWORD_ONLY) for one in shown]
    )
    return taken


@dataclass(frozen=True, kw_only=True)
class DatasetChoices:
    """What of its session a training set holds: frames, labels and splits."""

    frames_step: take.FramesStep = None
    frames_start: take.FramesStart = None
    frames_stop: take.FramesStop = None
    frames_list: take.FramesList = None
    frames_count: take.FramesCount = None
    frames_by: take.FramesBy = None
    frames_near_degrees: take.FramesNearDegrees = None
    frames_near_frames: take.FramesNearFrames = None
    frames_sector: take.FramesSector = None
    frames_sector_box: take.FramesSectorBox = None
    images: take.Images = None
    shape: take.Shape = None
    min_visible: take.MinVisible = None
    max_truncated: take.MaxTruncated = None
    min_area_px: take.MinArea = None
    split_train: take.SplitTrain = None
    split_val: take.SplitVal = None
    split_test: take.SplitTest = None
    split_by: take.SplitBy = None
    split_seed: take.SplitSeed = None

    def given(self) -> dict[str, object]:
        """Each choice by the option's dotted name; None: not given.

        Raises:
            typer.BadParameter: a text that is not what its option takes.
        """
        told: dict[str, object] = {}
        for field in fields(self):
            group, _, key = field.name.partition("_")
            told[f"{group}.{key}" if group in ("frames", "split") else field.name] = getattr(self, field.name)
        return {
            **told,
            "frames.list": take.whole_numbers(self.frames_list, "--frames-list") or None,
            "frames.sector": take.number_range(self.frames_sector, "--frames-sector", example="0:180"),
        }


@dataclass(frozen=True, kw_only=True)
class ViewChoices:
    """Whose views are counted, and in which bins."""

    box: take.OneBox = None
    class_name: take.OneClass = None
    azimuth_bins: take.AzimuthBins = 36
    polar_bins: take.PolarBins = 18
    shape: take.Shape = None

    def __post_init__(self) -> None:
        if self.box is not None and self.class_name is not None:
            raise typer.BadParameter("give --box or --class, not both: a box is of one class", param_hint="--class")

    @property
    def bins(self) -> "SphereBins":
        """The bins that were asked for."""
        from ars_web.geometry.sphere_bins import SphereBins

        return SphereBins(self.azimuth_bins, self.polar_bins)

    def objects(self, snapshot: "SessionSnapshot") -> dict[Literal["box_id", "class_id"], int | None]:
        """The ids of the box and the class that were named.

        Raises:
            BadInput: there is no such class.
        """
        class_id = None if self.class_name is None else take.class_named(snapshot.state, self.class_name).id
        return {"box_id": self.box, "class_id": class_id}
