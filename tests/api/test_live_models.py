"""Whatever text comes over the live line, it is a message or is refused in words."""

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ars_web.api.live_models import LiveToPage, PreviewMessage, page_message, view_event_message
from ars_web.errors import ArsError, BadInput
from ars_web.geometry.box import Box
from ars_web.workspace import BoxPreview, Conflicted, Dragged, Entered, Picked, Refused

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
    "view": ["mode", "frame", "selected", "tool", "axes", "snap_length", "snap_angle", "upright", "hidden", "dark"],
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
