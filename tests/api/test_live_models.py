"""Whatever text comes over the live line, it is a message or is refused in words."""

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ars_web.api.live_models import LiveToPage, PreviewMessage, ViewMessage, page_message, view_event_message
from ars_web.errors import ArsError, BadInput
from ars_web.geometry.box import Box
from ars_web.workspace import (
    BoxPreview,
    Conflicted,
    CoverageSight,
    DirectionPicked,
    Dragged,
    Entered,
    Picked,
    ProposedCamera,
    Refused,
)

numbers = st.one_of(
    st.integers(-3, 3),
    st.floats(),
    st.sampled_from([0, 1e308, -1e308, 5e-324, 2**53, 2**64, 10**400]),
)
texts = st.one_of(st.text(max_size=10), st.sampled_from(["scene", "frame", "all", "box", "world", "move", ""]))
anything = st.recursive(
    st.one_of(st.none(), st.booleans(), numbers, texts),
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(texts, inner, max_size=4)),
    max_leaves=6,
)
places = st.fixed_dictionaries(
    {"position": st.lists(numbers, min_size=3, max_size=3), "wxyz": st.lists(numbers, min_size=4, max_size=4)}
)
FIELDS: dict[str, list[str]] = {
    "hello": ["name"],
    "view": [
        "mode",
        "frame",
        "selected",
        "tool",
        "axes",
        "snap_length",
        "snap_angle",
        "upright",
        "hidden",
        "dark",
        "coverage",
        "tour",
    ],
    "look": ["at"],
    "new-box": ["class_id"],
    "preview": ["box_id", "T_world_box", "size"],
}
messages = st.sampled_from(sorted(FIELDS)).flatmap(
    lambda type_: st.fixed_dictionaries(
        {"type": st.just(type_), **{name: st.one_of(anything, places, numbers) for name in FIELDS[type_]}}
    )
)


@given(message=st.one_of(messages, anything))
def test_any_json_is_a_message_or_refused(message: Any) -> None:
    taken(json.dumps(message))


@given(position=st.lists(numbers, min_size=3, max_size=3), wxyz=st.lists(numbers, min_size=4, max_size=4))
def test_any_place_is_one_or_refused(position: list[float], wxyz: list[float]) -> None:
    place = {"position": position, "wxyz": wxyz}
    taken(json.dumps({"type": "preview", "box_id": 1, "T_world_box": place, "size": [1, 1, 1]}))


@given(text=st.text())
def test_any_text_is_a_message_or_refused(text: str) -> None:
    taken(text)


def taken(text: str) -> None:
    refusal = "it was taken"
    try:
        message = page_message(text)
        if isinstance(message, PreviewMessage) and message.preview is not None:
            assert np.isfinite(message.preview.box.corners_world).all()
    except ArsError as error:
        refusal = str(error)
    assert 0 < len(refusal.encode()) < 2000


@pytest.mark.parametrize("n", [1, 100_000])
def test_a_refusal_does_not_grow_with_what_is_refused(n: int) -> None:
    hidden = ", ".join(['"x"'] * n)
    with pytest.raises(BadInput) as refused:
        page_message(f'{{"type": "view", "hidden": [{hidden}], "{"y" * n}": 1}}')
    assert len(str(refused.value)) < 2000


PREVIEW = BoxPreview(1, Box(np.eye(4), np.ones(3)))


@pytest.mark.parametrize(
    "event",
    [
        Picked(),
        Picked(box_id=1),
        Entered(2, 0.5),
        Dragged("end", PREVIEW, "", own=False),
        Conflicted("no", PREVIEW, None),
        Refused("no"),
    ],
    ids=lambda event: type(event).__name__,
)
def test_what_the_server_says_fits_what_it_documents(event: Any) -> None:
    said = view_event_message(event)
    assert LiveToPage.model_validate_json(said.model_dump_json()).root == said


VIEW: dict[str, Any] = {
    "type": "view",
    "mode": "scene",
    "frame": 0,
    "selected": None,
    "tool": "select",
    "axes": "box",
    "snap_length": 0,
    "snap_angle": 0,
    "upright": False,
    "hidden": [],
    "dark": True,
}


def test_a_view_may_ask_for_a_sphere_and_proposed_cameras() -> None:
    place = {"position": [1.0, 2.0, 3.0], "wxyz": [1.0, 0.0, 0.0, 0.0]}
    sphere = {"box_id": 3, "whole_class": True, "azimuth_bins": 18, "polar_bins": 9, "min_visible": 0.5}
    taken = page_message(json.dumps({**VIEW, "coverage": {**sphere, "chosen_cell": 161}, "tour": [place]}))
    assert isinstance(taken, ViewMessage)
    assert taken.state.coverage == CoverageSight(3, True, 18, 9, 0.5, chosen_cell=161)
    assert taken.state.tour == (ProposedCamera((1.0, 2.0, 3.0), (1.0, 0.0, 0.0, 0.0)),)
    without = page_message(json.dumps(VIEW))
    assert isinstance(without, ViewMessage)
    assert (without.state.coverage, without.state.tour) == (None, ())


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"chosen_cell": 162}, "chosen_cell must be below 162"),
        ({"chosen_bin": 500}, "chosen_bin must be below 162"),
        ({"azimuth_bins": 73}, "less than or equal to 72"),
        ({"min_visible": 1.5}, "less than or equal to 1"),
        ({"box_id": None}, "coverage.box_id"),
    ],
)
def test_a_sphere_that_cannot_be_is_refused(changes: dict[str, Any], words: str) -> None:
    sphere = {"box_id": 3, "whole_class": False, "azimuth_bins": 18, "polar_bins": 9, "min_visible": 0, **changes}
    with pytest.raises(BadInput, match=words):
        page_message(json.dumps({**VIEW, "coverage": sphere}))


def test_a_page_is_told_of_a_direction_that_was_clicked() -> None:
    told = view_event_message(DirectionPicked(bin=5, cell=7)).model_dump()
    assert told == {"type": "direction", "bin": 5, "cell": 7}
