"""Scenes are opened when asked for, show what their pages want, follow edits, and go when nobody looks."""

import dataclasses
import queue
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from ars_web.errors import BadInput, NotFound, StoreError
from ars_web.geometry.box import Box
from ars_web.recordings.recording import Recording
from ars_web.scene import session_scene
from ars_web.scene.hardening import SECRET, Visitor, is_stopped
from ars_web.scene.server import SceneServers
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.store import SessionStore
from ars_web.workspace import BoxPreview, Dragged, Look, NewBox, Picked, Refused, SceneViews, ViewEvent, ViewState

VIEW, OTHER = "a" * 32, "b" * 32


@pytest.fixture
def servers(store: SessionStore, editor: SessionEditor) -> Iterator[SceneServers]:
    with SceneServers(store, editor, poll_seconds=0.02) as servers:
        yield servers


def move(box: Box, *, by: float) -> np.ndarray:
    T = box.T_world_box.copy()
    T[0, 3] += by
    return T


def at(position: np.ndarray, name: str = "/boxes/1/at") -> Callable[..., bool]:
    return lambda visitor: np.allclose(visitor.nodes.get(name, {}).get("position", np.inf), position, atol=1e-9)


def test_it_is_what_the_live_line_and_the_proxy_need(servers: SceneServers) -> None:
    views: SceneViews = servers
    assert views is servers
    assert servers.page().etag.startswith('"')


def test_a_scene_is_opened_once_when_it_is_asked_for(servers: SceneServers, sid: str) -> None:
    assert servers.open_sessions == frozenset()
    found: list[str] = []
    threads = [
        threading.Thread(target=lambda: found.append(servers.address(sid, view="", author="api").url)) for _ in range(8)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(set(found)) == 1
    assert len(found) == 8
    assert servers.open_sessions == {sid}


def test_an_address_tells_nothing_by_being_printed(servers: SceneServers, sid: str) -> None:
    address = servers.address(sid, view=VIEW, author="page-1")
    assert address.url.startswith("ws://127.0.0.1:")
    assert SECRET in address.headers.values()
    assert SECRET not in repr(address)


def test_an_unknown_session_has_no_scene(servers: SceneServers) -> None:
    before = set(threading.enumerate())
    with pytest.raises(NotFound):
        servers.address("none", view="", author="api")
    assert servers.open_sessions == frozenset()
    assert set(threading.enumerate()) == before


def test_a_scene_that_cannot_be_made_leaves_no_server(
    servers: SceneServers, sid: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    from ars_web.scene import session_scene

    def fail(*_: object) -> None:
        raise StoreError("no")

    before = set(threading.enumerate())
    with monkeypatch.context() as patched:
        patched.setattr(session_scene, "add_ground", fail)
        with pytest.raises(StoreError, match="no"):
            servers.address(sid, view="", author="api")
    assert set(threading.enumerate()) == before
    assert servers.address(sid, view="", author="api").url


def test_who_comes_sees_cameras_ground_and_boxes(servers: SceneServers, sid: str, visit: Callable) -> None:
    with visit(servers.address(sid, view="", author="api")) as visitor:
        wanted = {"/cameras/points", "/cameras/path", "/ground/cells", "/axes/x", "/boxes/1/at/edges", "/current/photo"}
        visitor.listen_until(lambda v: wanted <= v.nodes.keys())


def test_a_view_shows_what_its_page_wants(
    servers: SceneServers, store: SessionStore, sid: str, visit: Callable
) -> None:
    poses = store.frames(sid).Ts_world_camera
    events: queue.Queue[ViewEvent] = queue.Queue()
    servers.attach(sid, VIEW, author="page-1", send=events.put)
    servers.show(sid, VIEW, ViewState(frame=3, dark=False))
    with visit(servers.address(sid, view=VIEW, author="page-1")) as visitor:
        visitor.listen_until(at(poses[3, :3, 3], "/current"))
        visitor.listen_until(
            lambda v: any(m["type"] == "ThemeConfigurationMessage" and not m["dark_mode"] for m in v.told)
        )
        servers.show(sid, VIEW, ViewState(frame=6))
        visitor.listen_until(at(poses[6, :3, 3], "/current"))
        servers.show(sid, VIEW, ViewState(frame=6, mode="frame"))
        visitor.listen_until(lambda v: not v.nodes["/cameras"]["visible"] and "/photo" in v.nodes)
        assert not visitor.nodes["/ground"]["visible"]
        servers.show(sid, VIEW, ViewState(frame=6))
        visitor.listen_until(lambda v: v.nodes["/current"]["visible"] and "/cameras" not in v.nodes)
        servers.act(sid, VIEW, Look("selected"))  # nothing is selected: nothing happens
        servers.act(sid, VIEW, Look("frame"))
        visitor.listen_until(lambda v: any(m["type"] == "SetCameraPositionMessage" for m in v.told))


def test_each_view_has_its_own_frame(servers: SceneServers, store: SessionStore, sid: str, visit: Callable) -> None:
    poses = store.frames(sid).Ts_world_camera
    for view, frame in ((VIEW, 1), (OTHER, 5)):
        servers.attach(sid, view, author="page-1", send=lambda event: None)
        servers.show(sid, view, ViewState(frame=frame))
    with (
        visit(servers.address(sid, view=VIEW, author="page-1")) as one,
        visit(servers.address(sid, view=OTHER, author="page-1")) as other,
    ):
        one.listen_until(at(poses[1, :3, 3], "/current"))
        other.listen_until(at(poses[5, :3, 3], "/current"))


def test_an_image_that_is_gone_is_told(
    servers: SceneServers, recording: Recording, store: SessionStore, sid: str, visit: Callable
) -> None:
    recording.frames[4].image.unlink()
    events: queue.Queue[ViewEvent] = queue.Queue()
    servers.attach(sid, VIEW, author="page-1", send=events.put)
    servers.show(sid, VIEW, ViewState(frame=4))
    with visit(servers.address(sid, view=VIEW, author="page-1")) as visitor:
        visitor.listen_until(at(store.frames(sid).Ts_world_camera[4, :3, 3], "/current"))
        told = events.get(timeout=20)
        assert isinstance(told, Refused)
        assert "00004.jpg" in told.detail


@pytest.mark.parametrize("frame", [-1, 8, 10**9])
def test_a_frame_that_is_not_there_does_no_harm(
    servers: SceneServers, store: SessionStore, sid: str, visit: Callable, frame: int
) -> None:
    servers.attach(sid, VIEW, author="page-1", send=lambda event: None)
    with visit(servers.address(sid, view=VIEW, author="page-1")) as visitor:
        for mode in ("scene", "frame"):
            servers.show(sid, VIEW, ViewState(mode=mode, frame=frame))
        servers.act(sid, VIEW, Look("frame"))
        servers.show(sid, VIEW, ViewState(frame=2))
        visitor.listen_until(at(store.frames(sid).Ts_world_camera[2, :3, 3], "/current"))


def test_a_click_picks_a_camera_a_box_or_nothing(
    servers: SceneServers, store: SessionStore, sid: str, visit: Callable
) -> None:
    events: queue.Queue[ViewEvent] = queue.Queue()
    servers.attach(sid, VIEW, author="page-1", send=events.put)
    servers.show(sid, VIEW, ViewState())
    centres = store.frames(sid).Ts_world_camera[:, :3, 3]
    box = store.state(sid).boxes[1].box.T_world_box[:3, 3]
    above = np.array([0.1, 0.2, 3.0])

    def picked(visitor: object, origin: np.ndarray, towards: np.ndarray) -> Picked:
        visitor.click(origin, towards)  # pyright: ignore
        event = events.get(timeout=20)
        assert isinstance(event, Picked)
        return event

    with visit(servers.address(sid, view=VIEW, author="page-1")) as visitor:
        visitor.listen_until(lambda v: "/current" in v.nodes)
        assert picked(visitor, above, centres[5]) == Picked(frame=5)
        assert picked(visitor, above, box) == Picked(box_id=1)
        assert picked(visitor, above, 2 * above) == Picked()
        # The camera stands before the box.
        assert picked(visitor, centres[2] + (centres[2] - box), box) == Picked(frame=2)
        servers.show(sid, VIEW, ViewState(hidden=frozenset({1})))
        assert picked(visitor, above, box) == Picked()
        servers.show(sid, VIEW, ViewState(mode="frame"))
        assert isinstance(events.get(timeout=20), object)  # entered
        assert picked(visitor, above, centres[5]) == Picked()  # cameras are not to be seen there


def test_an_edit_reaches_the_scene(
    servers: SceneServers, store: SessionStore, editor: SessionEditor, sid: str, visit: Callable
) -> None:
    with visit(servers.address(sid, view="", author="api")) as visitor:
        stored = store.state(sid).boxes[1]
        visitor.listen_until(at(stored.box.T_world_box[:3, 3]))
        T = move(stored.box, by=0.25)
        editor.change_box(sid, 1, expected_revision=stored.revision, T_world_box=T, author="api")
        visitor.listen_until(at(T[:3, 3]))


def test_an_edit_by_another_process_reaches_the_scene(
    servers: SceneServers, store: SessionStore, sid: str, visit: Callable
) -> None:
    with visit(servers.address(sid, view="", author="api")) as visitor, SessionStore(store.folder) as elsewhere:
        stored = store.state(sid).boxes[1]
        visitor.listen_until(at(stored.box.T_world_box[:3, 3]))
        T = move(stored.box, by=-0.25)
        SessionEditor(elsewhere).change_box(sid, 1, expected_revision=stored.revision, T_world_box=T, author="api")
        visitor.listen_until(at(T[:3, 3]))


def test_a_preview_is_seen_by_all_and_ends_with_its_page(
    servers: SceneServers, store: SessionStore, sid: str, visit: Callable
) -> None:
    stored = store.state(sid).boxes[1]
    T = move(stored.box, by=0.5)
    servers.attach(sid, VIEW, author="page-1", send=lambda event: None)
    with visit(servers.address(sid, view="", author="api")) as visitor:
        for end in (
            lambda: servers.preview(sid, VIEW, None),
            lambda: servers.detach(sid, VIEW),
        ):
            servers.preview(sid, VIEW, BoxPreview(1, dataclasses.replace(stored.box, T_world_box=T)))
            visitor.listen_until(at(T[:3, 3]))
            end()
            visitor.listen_until(at(stored.box.T_world_box[:3, 3]))


def test_a_page_that_comes_back_before_it_is_missed_stays(servers: SceneServers, sid: str, visit: Callable) -> None:
    """Its new live line is up before the server has noticed that the old one is dead."""
    events: queue.Queue[ViewEvent] = queue.Queue()
    servers.attach(sid, VIEW, author="page-1", send=lambda event: None)
    servers.attach(sid, VIEW, author="page-1", send=events.put)
    servers.detach(sid, VIEW)
    servers.show(sid, VIEW, ViewState())
    with visit(servers.address(sid, view=VIEW, author="page-1")) as visitor:
        visitor.listen_until(lambda v: "/current" in v.nodes)
        visitor.click(np.array([9.0, 9.0, 9.0]), np.array([10.0, 10.0, 10.0]))
        assert events.get(timeout=20) == Picked()


def test_of_drags_all_pages_are_told(servers: SceneServers, store: SessionStore, sid: str) -> None:
    own: list[ViewEvent] = []
    others: list[ViewEvent] = []
    servers.attach(sid, VIEW, author="page-1", send=own.append)
    servers.attach(sid, OTHER, author="page-2", send=others.append)
    servers.address(sid, view=VIEW, author="page-1")
    scene = servers._open[sid].scene  # pyright: ignore[reportPrivateUsage]
    assert scene is not None
    preview = BoxPreview(1, store.state(sid).boxes[1].box)
    visitor = Visitor(view=VIEW, author="page-1")
    deadline = threading.Event()
    for _ in range(2000):
        scene._tell(visitor, Dragged("move", preview, "X +1.0 mm", own=True))  # pyright: ignore[reportPrivateUsage]
        if own and others:
            break
        deadline.wait(0.01)
    assert isinstance(own[0], Dragged)
    assert own[0].own
    assert isinstance(others[0], Dragged)
    assert not others[0].own


def test_nobody_looks_through_another_authors_view(
    servers: SceneServers, store: SessionStore, sid: str, visit: Callable
) -> None:
    events: queue.Queue[ViewEvent] = queue.Queue()
    # Before the page was there, or while its line was interrupted, nobody could know whose the name is.
    with visit(servers.address(sid, view=VIEW, author="page-2")) as thief:
        thief.listen_until(lambda v: "/boxes/1/at" in v.nodes)
        servers.attach(sid, VIEW, author="page-1", send=events.put)
        servers.show(sid, VIEW, ViewState(frame=5))
        with pytest.raises(BadInput, match="somebody else's page"):
            servers.address(sid, view=VIEW, author="page-2")
        servers.act(sid, VIEW, NewBox(0))
        assert events.get(timeout=20) == Refused("the 3D scene is not connected yet; add the box once it shows")
        assert store.revision(sid) == 0
        with visit(servers.address(sid, view=VIEW, author="page-1")) as owner:
            owner.listen_until(lambda v: "/current" in v.nodes)
            servers.act(sid, VIEW, NewBox(1))
            assert isinstance(events.get(timeout=20), (Picked, Refused))
        assert "/current" not in thief.nodes


def test_nonsense_from_a_client_does_not_end_the_scene(servers: SceneServers, sid: str, visit: Callable) -> None:
    with visit(servers.address(sid, view="", author="api")) as visitor:
        for bad in (np.nan, np.inf, 0.0):
            visitor.click_along(np.full(3, bad), np.ones(3))
            visitor.click_along(np.zeros(3), np.full(3, bad))
        visitor.arrive(height=0)
        visitor.arrive(fov=float("nan"))
        visitor.click(np.zeros(3), np.ones(3))
        visitor.listen_until(lambda v: "/current/photo" in v.nodes)
    with visit(servers.address(sid, view="", author="api")) as visitor:
        visitor.listen_until(lambda v: "/current/photo" in v.nodes)


def test_a_deleted_session_keeps_those_who_look_from_harm(
    servers: SceneServers, store: SessionStore, sid: str, visit: Callable, until: Callable
) -> None:
    with visit(servers.address(sid, view="", author="api")) as visitor:
        visitor.listen_until(lambda v: "/current/photo" in v.nodes)
        store.delete(sid)
        visitor.click(np.zeros(3), np.ones(3))
        with pytest.raises(NotFound):
            servers.address(sid, view="", author="api")
    servers.idle_seconds = 0.0
    until(lambda: servers.open_sessions == frozenset())


def test_a_scene_that_nobody_looks_at_is_closed_and_opens_again(
    store: SessionStore, editor: SessionEditor, sid: str, visit: Callable, until: Callable
) -> None:
    with SceneServers(store, editor, idle_seconds=0.3, poll_seconds=0.02) as servers:
        servers.attach(sid, VIEW, author="page-1", send=lambda event: None)
        servers.show(sid, VIEW, ViewState(frame=4))
        with visit(servers.address(sid, view=VIEW, author="page-1")) as visitor:
            visitor.listen_until(lambda v: "/current/photo" in v.nodes)
            assert servers.open_sessions == {sid}
        until(lambda: servers.open_sessions == frozenset())
        with visit(servers.address(sid, view=VIEW, author="page-1")) as visitor:
            visitor.listen_until(at(store.frames(sid).Ts_world_camera[4, :3, 3], "/current"))


def test_a_scene_that_is_busy_is_stopped_all_the_same(
    servers: SceneServers, sid: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, until: Callable
) -> None:
    monkeypatch.setattr(session_scene, "CLOSING_SECONDS", 0.05)
    servers.address(sid, view="", author="api")
    scene = servers._open[sid].scene  # pyright: ignore[reportPrivateUsage]
    assert scene is not None
    free = threading.Event()
    scene.server.get_event_loop().call_soon_threadsafe(free.wait)
    servers.idle_seconds = 0.0
    until(lambda: "busy" in caplog.text)
    free.set()
    until(lambda: is_stopped(scene.server))
    # What closes idle scenes goes on.
    assert servers.address(sid, view="", author="api").url
    until(lambda: servers.open_sessions == frozenset())


def test_fifty_scenes_are_opened_and_leave_no_thread(
    store: SessionStore, editor: SessionEditor, recording: Recording, visit: Callable
) -> None:
    before = set(threading.enumerate())
    with SceneServers(store, editor) as servers:
        made = [store.create(recording, name=f"table {i}").id for i in range(50)]
        addresses = [servers.address(sid, view="", author="api") for sid in made]
        assert len({address.url for address in addresses}) == 50
        with visit(addresses[0]) as first, visit(addresses[-1]) as last:
            for visitor in (first, last):
                visitor.listen_until(lambda v: "/current/photo" in v.nodes)
            servers.close()
        with pytest.raises(StoreError, match="stopping"):
            servers.address(made[0], view="", author="api")
    assert set(threading.enumerate()) <= before


def test_viser_is_not_imported_until_a_scene_is_asked_for(tmp_path: Path) -> None:
    code = "import sys, ars_web.cli, ars_web.app; sys.exit('viser' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], cwd=Path(__file__).parents[2], check=False).returncode == 0
