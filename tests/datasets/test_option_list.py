"""The list of options is the options: names, defaults and bounds that the export itself keeps."""

from typing import Any

import pytest
from pydantic import ValidationError

from ars_web.datasets.option_list import ExportOption, export_options
from ars_web.datasets.options import ExportOptions

OPTIONS = {option.name: option for option in export_options()}


def given(name: str, value: object) -> dict[str, Any]:
    group, dot, key = name.partition(".")
    return {group: {key: value}} if dot else {name: value}


def test_every_option_is_there_but_those_that_leave_no_choice() -> None:
    assert list(OPTIONS) == [
        "frames.step", "frames.start", "frames.stop", "frames.list", "frames.count", "frames.by",
        "frames.near_degrees", "frames.near_frames", "frames.sector", "frames.sector_box", "images", "shape", "masks",
        "min_visible", "max_truncated", "min_area_px", "heading_bins", "split.train", "split.val", "split.test",
        "split.by", "split.hold_out", "split.seed", "sessions",
    ]  # fmt: skip
    assert {name: option.type for name, option in OPTIONS.items() if option.type not in ("integer", "number")} == {
        "frames.list": "integers", "frames.by": "choice", "frames.sector": "range", "images": "choice",
        "shape": "choice", "masks": "choice", "split.by": "choice",
        "split.hold_out": "texts", "sessions": "texts",
    }  # fmt: skip


@pytest.mark.parametrize("option", OPTIONS.values(), ids=OPTIONS)
def test_an_option_says_what_it_is_and_its_default_is_the_default(option: ExportOption) -> None:
    assert option.title
    assert option.meaning
    assert option.title[0].isupper()
    assert option.meaning[0].islower()
    # Shares of one group depend on each other, and a shape that nobody chose is kept as such.
    if not option.name.startswith("split.") and option.name != "shape":
        assert ExportOptions.model_validate(given(option.name, option.default)) == ExportOptions.model_validate({})
    if option.optional:
        assert option.default is None


@pytest.mark.parametrize(
    "option", [o for o in OPTIONS.values() if o.type in ("integer", "number")], ids=lambda o: o.name
)
def test_bounds_are_those_of_the_export(option: ExportOption) -> None:
    assert option.minimum is not None
    with pytest.raises(ValidationError):
        ExportOptions.model_validate(given(option.name, option.minimum - 1))
    if option.maximum is not None:
        with pytest.raises(ValidationError):
            ExportOptions.model_validate(given(option.name, option.maximum + 1))


@pytest.mark.parametrize("option", [o for o in OPTIONS.values() if o.type == "choice"], ids=lambda o: o.name)
def test_every_choice_can_be_made_and_says_what_it_means(option: ExportOption) -> None:
    assert len(option.choices) > 1
    assert option.default in [choice.value for choice in option.choices]
    for choice in option.choices:
        assert choice.meaning
        # How frames are chosen means something only where some are.
        count = {"frames": {"count": 3, "by": choice.value}}
        ExportOptions.model_validate(count if option.name == "frames.by" else given(option.name, choice.value))


def test_the_shape_that_nobody_chose_is_the_hull() -> None:
    shape = OPTIONS["shape"]
    assert ExportOptions.model_validate({}).shape is None
    assert (shape.default, shape.optional) == ("hull", False)
    assert [choice.value for choice in shape.choices] == ["box", "hull", "mesh"]
