"""The bridge between viser's page and the one round it: keys, the camera's lock, zoom and pan, fading, looks."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import cv2
import numpy as np
import pytest
import viser
from playwright.sync_api import Browser, Route

from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.scene.boxes import BoxNodes
from ars_web.scene.extent import Lens
from ars_web.scene.frame_view import FrameView
from ars_web.scene.photos import Photos
from ars_web.sessions.model import FrameTable, ObjectClass, SessionState, VirtualBox
from ars_web.workspace import Entered

STATIC = Path(__file__).parents[3] / "static"

LENS = Lens(fov=0.9, near=0.01, far=1000.0)

CAMERA = Camera(640, 480, 600.0, 600.0, 319.5, 239.5)

ZOOM = "() => [__viserMutable.camera.fov, __viserMutable.camera.view?.enabled ?? false]"

OPACITY = """() => {
    const found = [];
    __viserMutable.nodeRefFromName["/photo"]?.traverse((node) => node.material && found.push(node.material.opacity));
    return found;
}"""


def looking(eye: np.ndarray, about_x: float) -> np.ndarray:
    return rigid_transform.from_rotation(cv2.Rodrigues(np.array([about_x, 0.3, 0.2]))[0], eye)


@pytest.fixture
def in_frame(
    scene_page: Callable[..., Any], viser_server: viser.ViserServer, tmp_path: Path, until: Callable[..., None]
) -> Iterator[Any]:
    """A page in frame mode; `page.view` is its FrameView."""
    image = np.full((480, 640, 3), 128, dtype=np.uint8)
    for i in range(2):
        assert cv2.imwrite(str(tmp_path / f"{i}.jpg"), image + i)
    Ts = np.stack([looking(np.ones(3), -2.0), looking(np.array([1.1, 0.9, 1.0]), -2.1)])
    frames = FrameTable(("0.jpg", "1.jpg"), (tmp_path / "0.jpg", tmp_path / "1.jpg"), np.zeros(2, dtype=int), Ts)
    photos = Photos({0: CAMERA}, frames)
    page = scene_page(1000, 700)
    page.told_by_view = []
    nodes = BoxNodes(viser_server)
    page.nodes = nodes
    page.view = FrameView(page.client, photos=photos, nodes=nodes, poses=Ts, lens=LENS, send=page.told_by_view.append)
    page.tell_bridge(mode="frame", blend=1, dark=True)
    page.view.enter(0)
    until(lambda: page.scene.evaluate(OPACITY) == [1], page=page.page)
    page.settle()
    yield page
    page.view.close()
    photos.close()


def ask(in_frame: Any, message: str) -> None:
    """Tell the bridge something else than what is to be seen."""
    in_frame.page.evaluate(f"frames[0].postMessage({message}, location.origin)")
    in_frame.settle()


def test_the_camera_is_locked_in_a_frame_and_free_after(in_frame: Any, until: Callable[..., None]) -> None:
    page, mouse = in_frame.page, in_frame.page.mouse
    place = in_frame.camera_place()

    def pull(button: str) -> None:
        mouse.move(300, 500)
        mouse.down(button=button)
        mouse.move(420, 450, steps=5)
        mouse.up(button=button)

    for button in ("left", "middle", "right"):
        pull(button)
    mouse.wheel(0, 300)
    in_frame.scene.evaluate("window.focus()")
    for key in ("w", "ArrowUp", "e"):
        page.keyboard.press(key, delay=60)
    in_frame.settle()
    assert in_frame.camera_place() == place
    in_frame.view.leave()
    in_frame.tell_bridge(mode="scene", blend=1, dark=True)
    until(lambda: in_frame.camera_place() != place, page=page)
    in_frame.settle()
    free = in_frame.camera_place()
    pull("left")
    until(lambda: in_frame.camera_place() != free, page=page)


def test_keys_go_to_the_page_unless_they_are_typed(in_frame: Any, until: Callable[..., None]) -> None:
    page, scene = in_frame.page, in_frame.scene
    scene.evaluate("window.focus()")
    page.keyboard.press("Control+Shift+KeyZ")
    until(lambda: len(in_frame.told("key")) == 2, page=page)
    [down, up] = in_frame.told("key")
    assert down == {
        "ars": "key", "type": "keydown", "key": "Z", "code": "KeyZ",
        "ctrl": True, "shift": True, "alt": False, "meta": False, "repeat": False,
    }  # fmt: skip
    assert up["type"] == "keyup"
    scene.evaluate(
        "() => { const field = document.createElement('input'); document.body.append(field); field.focus(); }"
    )
    page.keyboard.type("wz0")
    assert scene.evaluate("document.activeElement.value") == "wz0"
    assert len(in_frame.told("key")) == 2


def test_zoom_has_its_limits_and_fits_again(in_frame: Any, until: Callable[..., None]) -> None:
    page, scene = in_frame.page, in_frame.scene
    [fov, shifted] = scene.evaluate(ZOOM)
    assert not shifted
    page.mouse.move(250, 350)
    for _ in range(12):
        page.mouse.wheel(0, -400)
    until(lambda: in_frame.told("zoom")[-1]["zoom"] == 20, page=page)
    in_frame.settle()
    assert scene.evaluate(ZOOM)[0] < fov / 15
    for _ in range(12):
        page.mouse.wheel(0, 400)
    until(lambda: in_frame.told("zoom")[-1]["zoom"] == 1, page=page)
    in_frame.settle()
    assert scene.evaluate(ZOOM) == [fov, False]
    page.mouse.wheel(0, -400)
    until(lambda: in_frame.told("zoom")[-1]["zoom"] > 1, page=page)
    page.mouse.dblclick(250, 350)
    until(lambda: in_frame.told("zoom")[-1]["zoom"] == 1, page=page)
    page.mouse.wheel(0, -400)
    until(lambda: in_frame.told("zoom")[-1]["zoom"] > 1, page=page)
    ask(in_frame, "{ars: 'fit'}")
    until(lambda: in_frame.told("zoom")[-1]["zoom"] == 1, page=page)
    ask(in_frame, "{ars: 'zoom', by: 2.5}")
    until(lambda: in_frame.told("zoom")[-1]["zoom"] == 2.5, page=page)
    for nonsense in ("'2'", "-1", "0", "NaN", "Infinity"):
        ask(in_frame, f"{{ars: 'zoom', by: {nonsense}}}")
    assert in_frame.told("zoom")[-1]["zoom"] == 2.5


def test_the_view_stays_with_a_box_from_frame_to_frame(in_frame: Any, until: Callable[..., None]) -> None:
    page, middle = in_frame.page, np.array([500.0, 350.0])
    centre = rigid_transform.transform_points(in_frame.view._poses[0], np.array([[0.1, -0.05, 1.0]]))[0]
    box = Box(rigid_transform.from_rotation(rigid_transform.rotation_about_z(0.3), centre), np.full(3, 0.08))
    stored = VirtualBox(7, 0, "mug", box, revision=1)
    in_frame.nodes.show(SessionState(1, "s", {0: ObjectClass(0, "mug", "#56b4e9", 1)}, {7: stored}, 1, 2))
    in_frame.scene.wait_for_function("() => Boolean(__viserMutable.nodeRefFromName['/boxes/7/at/edges'])")

    def seen() -> tuple[np.ndarray, float]:
        """Where the box's middle is on the screen, and how much of it the box takes."""
        corners = np.array([in_frame.screen_of(corner) for corner in box.corners_world])
        least, most = corners.min(axis=0), corners.max(axis=0)
        return (least + most) / 2, float(((most - least) / (1000, 700)).max())

    ask(in_frame, "{ars: 'show', box: 8}")  # there is none
    assert in_frame.told("zoom") == []
    ask(in_frame, "{ars: 'show', box: 7}")
    until(lambda: bool(in_frame.told("zoom")), page=page)
    in_frame.settle()
    at, share = seen()
    assert at == pytest.approx(middle, abs=1.0)
    assert share == pytest.approx(0.6, abs=0.01)

    in_frame.view.enter(1)  # which sees it elsewhere
    until(lambda: in_frame.view.frame == 1 and np.abs(seen()[0] - middle).max() < 1.0, page=page)

    page.mouse.move(500, 350)
    page.mouse.wheel(0, -100)  # from here on the view is where it is put by hand
    until(lambda: seen()[1] > 0.65, page=page)
    in_frame.view.enter(0)
    until(lambda: in_frame.view.frame == 0, page=page)
    in_frame.settle()
    assert np.abs(seen()[0] - middle).max() > 20


def test_a_drag_on_nothing_moves_the_zoomed_view_with_the_pointer(in_frame: Any, until: Callable[..., None]) -> None:
    page, mouse = in_frame.page, in_frame.page.mouse
    mouse.move(500, 350)
    mouse.wheel(0, -400)
    until(lambda: bool(in_frame.told("zoom")), page=page)
    in_frame.settle()
    point = rigid_transform.transform_points(in_frame.view._poses[0], np.array([[0.01, 0.02, 1.0]]))[0]
    for button in ("left", "middle", "right"):
        before = in_frame.screen_of(point)
        mouse.move(400, 300)
        mouse.down(button=button)
        mouse.move(430, 320, steps=6)
        mouse.up(button=button)
        in_frame.settle()
        after = in_frame.screen_of(point)
        # A press that moves less than four pixels is a click; from there on the view follows exactly.
        assert np.subtract(after, before) == pytest.approx([30, 20], abs=0.1)
    told = in_frame.told("pointer")
    assert {message["buttons"] for message in told} >= {0, 1, 4, 2}
    assert (told[-1]["x"], told[-1]["y"], told[-1]["buttons"]) == (430, 320, 0)


def test_zoom_survives_another_shape_of_the_window(in_frame: Any, until: Callable[..., None]) -> None:
    page = in_frame.page
    page.mouse.move(700, 200)
    page.mouse.wheel(0, -400)
    until(lambda: bool(in_frame.told("zoom")), page=page)
    in_frame.settle()
    zoom, (fov, _) = in_frame.told("zoom")[-1]["zoom"], in_frame.scene.evaluate(ZOOM)
    page.set_viewport_size({"width": 500, "height": 700})
    until(lambda: in_frame.scene.evaluate(ZOOM)[0] != fov, page=page)
    in_frame.settle()
    offset = in_frame.scene.evaluate(
        "() => { const { view } = __viserMutable.camera; return [view.fullWidth, view.width]; }"
    )
    assert offset == [500, 500]
    assert in_frame.told("zoom")[-1]["zoom"] == zoom


def test_the_photo_fades_and_stays_so_in_the_next_frame(in_frame: Any, until: Callable[..., None]) -> None:
    in_frame.tell_bridge(mode="frame", blend=0.35, dark=True)
    assert in_frame.scene.evaluate(OPACITY) == [0.35]
    in_frame.view.enter(1)
    until(lambda: [e.frame for e in in_frame.told_by_view if isinstance(e, Entered)] == [0, 1], page=in_frame.page)
    in_frame.settle()
    assert in_frame.scene.evaluate(OPACITY) == [0.35]


def test_only_the_page_round_it_is_heard(in_frame: Any) -> None:
    scene = in_frame.scene
    scene.evaluate("window.postMessage({ars: 'view', mode: 'scene', blend: 0, dark: false}, location.origin)")
    scene.evaluate(
        "window.dispatchEvent(new MessageEvent('message', {data: {ars: 'view', blend: 0}, origin: 'http://evil'}))"
    )
    for nonsense in (
        "null",
        "'view'",
        "{ars: 'view', blend: 'x', mode: 'admin', dark: 1}",
        "{ars: 'view', blend: NaN}",
    ):
        in_frame.page.evaluate(f"frames[0].postMessage({nonsense}, location.origin)")
    in_frame.tell_bridge()
    assert scene.evaluate("document.documentElement.className.includes('ars-light')") is False
    assert scene.evaluate(OPACITY) == [1]


def test_the_canvas_has_the_pages_colours_and_nothing_of_visers_is_over_it(in_frame: Any) -> None:
    colour = "() => getComputedStyle(document.querySelector('canvas[data-engine]')).backgroundColor"
    assert in_frame.scene.evaluate(colour) == "rgb(13, 17, 23)"
    in_frame.tell_bridge(mode="frame", blend=1, dark=False)
    assert in_frame.scene.evaluate(colour) == "rgb(246, 248, 250)"
    covered = """() => {
        const { canvas } = __viserMutable;
        const { width, height } = canvas.getBoundingClientRect();
        const [right, bottom] = [width - 20, height - 20];
        const places = [[8, 8], [right, 20], [width / 2, height / 2], [20, bottom], [right, bottom]];
        return [[width, height], places.filter(([x, y]) => document.elementFromPoint(x, y) !== canvas)];
    }"""
    assert in_frame.scene.evaluate(covered) == [[1000, 700], []]


def test_names_told_before_the_page_has_a_body_are_kept(browser: Browser) -> None:
    """viser's page is 2 MB: the page round it may speak while it is still being read."""
    context = browser.new_context()
    page = context.new_page()
    complaints: list[str] = []
    page.on("pageerror", lambda error: complaints.append(str(error)))
    telling = """<!doctype html><html><head><script src="/bridge.js"></script><script>
        dispatchEvent(new MessageEvent("message", { origin: location.origin, source: window.parent,
            data: { ars: "names", boxes: [{ id: 1, name: "cube", color: "#56b4e9" }] } }));
        window.told = document.body === null;
    </script></head><body></body></html>"""
    bridge = (STATIC / "scene" / "bridge.js").read_text(encoding="utf-8")
    answers = {
        "/": ("<iframe src='/scene'></iframe>", "text/html"),
        "/scene": (telling, "text/html"),
        "/bridge.js": (bridge, "text/javascript"),
    }

    def answer(route: Route) -> None:
        body, kind = answers[urlsplit(route.request.url).path]
        route.fulfill(body=body, content_type=kind)

    context.route("http://ars.invalid/**", answer)
    page.goto("http://ars.invalid/")
    frame = page.frames[1]
    frame.wait_for_function("window.told !== undefined")
    assert frame.evaluate("window.told") is True
    assert complaints == []
    context.close()
