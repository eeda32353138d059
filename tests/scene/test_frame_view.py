"""Entering and leaving frames, as a browser is told."""

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from ars_web.recordings.recording import Recording
from ars_web.scene import photos
from ars_web.scene.extent import FIELD_OF_VIEW
from ars_web.scene.frame_view import NEAREST
from ars_web.scene.server import SceneServers
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.store import SessionStore
from ars_web.workspace import Entered, Refused, ViewEvent, ViewState

VIEW = "a" * 32


@pytest.fixture
def scenes(store: SessionStore, editor: SessionEditor) -> Iterator[SceneServers]:
    with SceneServers(store, editor) as scenes:
        yield scenes


@pytest.fixture
def told(scenes: SceneServers, sid: str) -> list[ViewEvent]:
    events: list[ViewEvent] = []
    scenes.attach(sid, VIEW, author="page-a", send=events.append)
    return events


@pytest.fixture
def visitor(scenes: SceneServers, sid: str, told: list[ViewEvent], visit: Callable[..., Any]) -> Iterator[Any]:
    with visit(scenes.address(sid, view=VIEW, author="page-a")) as visitor:
        visitor.listen_until(lambda v: "/boxes/1/at" in v.nodes)
        yield visitor


def last(visitor: Any, kind: str) -> dict[str, Any]:
    return [message for message in visitor.told if message["type"] == kind][-1]


def test_the_camera_stands_where_the_frames_stood_and_its_photo_is_sent_as_it_is(
    scenes: SceneServers,
    sid: str,
    visitor: Any,
    told: list[ViewEvent],
    recording: Recording,
    until: Callable[..., None],
) -> None:
    scenes.show(sid, VIEW, ViewState(mode="frame", frame=2))
    photo = recording.frames[2].image.read_bytes()
    visitor.listen_until(lambda v: bytes(v.nodes.get("/photo", {}).get("_data", b"")) == photo)
    visitor.listen_until(lambda v: any(m["type"] == "SetCameraFovMessage" for m in v.told))
    T = recording.frames[2].T_world_camera
    assert last(visitor, "SetCameraPositionMessage")["position"] == pytest.approx(T[:3, 3], abs=1e-12)
    looked_at = np.array(last(visitor, "SetCameraLookAtMessage")["look_at"])
    ahead = (looked_at - T[:3, 3]) / np.linalg.norm(looked_at - T[:3, 3])
    assert ahead == pytest.approx(T[:3, 2], abs=1e-12)
    assert last(visitor, "SetCameraUpDirectionMessage")["position"] == pytest.approx(-T[:3, 1], abs=1e-12)
    assert last(visitor, "SetCameraNearMessage")["near"] == NEAREST
    # 16:9, so the photo's height decides: 60 pixels each way at 150.
    assert last(visitor, "SetCameraFovMessage")["fov"] == pytest.approx(2 * math.atan(60 / 150))
    assert visitor.nodes["/photo"]["_format"] == "jpeg"
    until(lambda: any(isinstance(event, Entered) for event in told))
    [entered] = [event for event in told if isinstance(event, Entered)]
    assert entered.frame == 2
    assert entered.milliseconds > 0


def test_another_windows_shape_gets_another_field_of_view(scenes: SceneServers, sid: str, visitor: Any) -> None:
    scenes.show(sid, VIEW, ViewState(mode="frame", frame=2))
    visitor.listen_until(lambda v: any(m["type"] == "SetCameraFovMessage" for m in v.told))
    visitor.arrive(height=2560)  # half as wide as high
    visitor.listen_until(
        lambda v: math.isclose(last(v, "SetCameraFovMessage")["fov"], 2 * math.atan(80 / 150 * 2), rel_tol=1e-9)
    )


def test_leaving_puts_the_free_camera_back(
    scenes: SceneServers, sid: str, visitor: Any, told: list[ViewEvent], until: Callable[..., None]
) -> None:
    scenes.show(sid, VIEW, ViewState(mode="scene", frame=2))
    # A page that begins in a frame leaves to the overview: let it see the scene first.
    visitor.listen_until(lambda v: "/current/photo" in v.nodes)
    scenes.show(sid, VIEW, ViewState(mode="frame", frame=2))
    until(lambda: len(told) == 1)
    scenes.show(sid, VIEW, ViewState(mode="frame", frame=7))  # distorted
    until(lambda: [event.frame for event in told if isinstance(event, Entered)] == [2, 7])
    scenes.show(sid, VIEW, ViewState(mode="scene", frame=7))
    visitor.listen_until(lambda v: v.nodes.get("/photo", {}).get("visible") is False)
    visitor.listen_until(lambda v: last(v, "SetCameraUpDirectionMessage")["position"] == pytest.approx((0, 0, 1)))
    assert last(visitor, "SetCameraPositionMessage")["position"] == pytest.approx((0, 0, 2), abs=1e-12)
    assert last(visitor, "SetCameraLookAtMessage")["look_at"] == pytest.approx((0, 0, 0), abs=1e-12)
    assert last(visitor, "SetCameraFovMessage")["fov"] == pytest.approx(FIELD_OF_VIEW)
    assert last(visitor, "SetCameraNearMessage")["near"] == pytest.approx(
        0.002, rel=0.5
    )  # two thousandths of the recording


def test_the_photo_stays_behind_a_box_that_is_moved_away(
    scenes: SceneServers, editor: SessionEditor, store: SessionStore, sid: str, visitor: Any, recording: Recording
) -> None:
    scenes.show(sid, VIEW, ViewState(mode="frame", frame=2))
    visitor.listen_until(lambda v: "position" in v.nodes.get("/photo", {}))
    T = recording.frames[2].T_world_camera

    def depth(position: Any) -> float:
        return float((np.array(position) - T[:3, 3]) @ T[:3, 2])

    assert depth(visitor.nodes["/photo"]["position"]) == pytest.approx(100.0)
    box = store.state(sid).boxes[1]
    away = box.box.T_world_box.copy()
    away[:3, 3] = T[:3, 3] + 500 * T[:3, 2]
    editor.change_box(sid, 1, expected_revision=box.revision, T_world_box=away, author="a")
    visitor.listen_until(lambda v: depth(v.nodes["/photo"]["position"]) > 1000)
    visitor.listen_until(lambda v: last(v, "SetCameraFarMessage")["far"] > 2000)


def test_a_photo_that_cannot_be_shown_is_refused_in_words(
    scenes: SceneServers,
    sid: str,
    visitor: Any,
    told: list[ViewEvent],
    recording: Recording,
    until: Callable[..., None],
) -> None:
    recording.frames[3].image.unlink()
    scenes.show(sid, VIEW, ViewState(mode="frame", frame=3))
    until(lambda: any(isinstance(event, Refused) for event in told))
    assert "00003.jpg" in next(event.detail for event in told if isinstance(event, Refused))
    scenes.show(sid, VIEW, ViewState(mode="frame", frame=99))
    until(lambda: any("no frame 99" in event.detail for event in told if isinstance(event, Refused)))
    scenes.show(sid, VIEW, ViewState(mode="frame", frame=1))
    until(lambda: Entered in map(type, told))


def test_a_fault_at_one_photo_does_not_keep_the_next_one_away(
    scenes: SceneServers,
    sid: str,
    visitor: Any,
    told: list[ViewEvent],
    monkeypatch: pytest.MonkeyPatch,
    until: Callable[..., None],
) -> None:
    tried: list[int] = []
    make = photos.make_photo

    def faulty(frame: int, *rest: Any) -> photos.Photo:
        tried.append(frame)
        if frame == 3:
            raise RuntimeError("a fault of this program")
        return make(frame, *rest)

    monkeypatch.setattr(photos, "make_photo", faulty)
    scenes.show(sid, VIEW, ViewState(mode="frame", frame=3))
    until(lambda: 3 in tried)
    scenes.show(sid, VIEW, ViewState(mode="frame", frame=1))
    until(lambda: [event.frame for event in told if isinstance(event, Entered)] == [1])


def test_a_row_of_wishes_ends_at_the_last(
    scenes: SceneServers, sid: str, visitor: Any, told: list[ViewEvent], until: Callable[..., None]
) -> None:
    for frame in (0, 1, 2, 3, 4, 5, 6, 7, 5):
        scenes.show(sid, VIEW, ViewState(mode="frame", frame=frame))
    until(lambda: any(isinstance(event, Entered) and event.frame == 5 for event in told))
    scenes.show(sid, VIEW, ViewState(mode="frame", frame=6))
    until(lambda: isinstance(told[-1], Entered) and told[-1].frame == 6)
