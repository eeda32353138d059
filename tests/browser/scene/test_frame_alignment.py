"""In frame mode the photo and what is drawn over it coincide to a pixel: measured from screenshots.

The camera is distorted, its principal point off the centre and its pixels not square. What is measured are the centres
of dots: of points that viser draws in 3D, and of the same points in the photo, which was made with the distortion.
"""

import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import viser
from jaxtyping import Float, UInt8

from ars_web.geometry import rigid_transform
from ars_web.geometry.camera import Camera, rectified
from ars_web.scene.boxes import BoxNodes
from ars_web.scene.extent import Lens
from ars_web.scene.frame_view import FrameView
from ars_web.scene.photo_plane import fitting_fov
from ars_web.scene.photos import Photos
from ars_web.sessions.model import FrameTable
from ars_web.workspace import Entered, Refused

LENS = Lens(fov=0.9, near=0.01, far=1000.0)

CAMERA = Camera(960, 720, 731.3, 724.9, 517.2, 331.8, "brown", (-0.21, 0.06, 0.0012, -0.0007, -0.008))

SHAPES = [(1280, 720), (900, 700), (1400, 500), (560, 800)]
"""Of the window: wide, as the photo, very wide, upright."""

ZOOM = 3.0


def pose() -> Float[np.ndarray, "4 4"]:
    """A camera that is rolled, tilted, and metres from the world's origin."""
    R, _ = cv2.Rodrigues(np.array([-1.9, 0.4, 0.7]))
    return rigid_transform.from_rotation(R, np.array([3.1, -4.56, 1.7]))


def points_camera() -> Float[np.ndarray, "n 3"]:
    """Points all over the rectified image, near and far, in camera coordinates."""
    flat = rectified(CAMERA)
    columns, rows = np.meshgrid(np.linspace(90, flat.width - 90, 5), np.linspace(80, flat.height - 80, 4))
    depth = np.random.default_rng(3).uniform(0.8, 5.0, columns.size)
    rays = np.stack([(columns.ravel() - flat.cx) / flat.fx, (rows.ravel() - flat.cy) / flat.fy], axis=-1)
    return np.column_stack([rays, np.ones(columns.size)]) * depth[:, None]


def photograph(points: Float[np.ndarray, "n 3"], path: Path) -> None:
    """The photo of green dots on grey, as the distorted camera takes it."""
    K, none = CAMERA.K, np.zeros(3)
    pixels = cv2.projectPoints(points, none, none, K, np.array(CAMERA.distortion))[0][:, 0]
    columns, rows = np.meshgrid(np.arange(CAMERA.width), np.arange(CAMERA.height))
    light = np.zeros((CAMERA.height, CAMERA.width))
    for x, y in pixels:
        light += np.clip(6.5 - np.hypot(columns - x, rows - y), 0, 1)
    grey, green = np.array([70.0, 60.0, 60.0]), np.array([0.0, 255.0, 0.0])
    image = grey + np.clip(light, 0, 1)[..., None] * (green - grey)
    assert cv2.imwrite(str(path), np.rint(image).astype(np.uint8), [cv2.IMWRITE_JPEG_QUALITY, 98])


def expected(points: Float[np.ndarray, "n 3"], width: int, height: int) -> Float[np.ndarray, "n 2"]:
    """Where OpenCV projects the points to in a window that shows the whole photo, in CSS pixels from its corner."""
    f = height / 2 / math.tan(fitting_fov(rectified(CAMERA), aspect=width / height) / 2)
    K = np.array([[f, 0, width / 2], [0, f, height / 2], [0, 0, 1]])
    return cv2.projectPoints(points, np.zeros(3), np.zeros(3), K, None)[0][:, 0]


def dots(shot: UInt8[np.ndarray, "h w 3"], near: Float[np.ndarray, "n 2"], *, reach: int, red: bool) -> np.ndarray:
    """The centres of magenta (red) or green dots in a screenshot, each within `reach` pixels of where it should be."""
    b, g, r = (shot[..., i].astype(np.float64) for i in range(3))
    # How much of the dot's colour a pixel has; edges count by their share.
    weight = np.clip((np.minimum(r, b) if red else g) - (g if red else np.maximum(r, b)) - 40, 0, None)
    found: list[np.ndarray] = []
    for x, y in near:
        left, top = max(int(x) - reach, 0), max(int(y) - reach, 0)
        part = weight[top : int(y) + reach + 1, left : int(x) + reach + 1]
        rows, columns = np.mgrid[0 : part.shape[0], 0 : part.shape[1]]
        assert part.sum() > 0, f"no dot near {x:.1f}, {y:.1f}"
        centre = np.array([(columns * part).sum(), (rows * part).sum()]) / part.sum()
        found.append(centre + np.array([left + 0.5, top + 0.5]))
    return np.array(found)


TEXTURE_WIDTH = """() => {
    let width = 0;
    const photo = window.__viserMutable.nodeRefFromName["/photo"];
    photo?.traverse((node) => (width = node.material?.map?.image?.width ?? width));
    return width;
}"""


class Alignment:
    """Measures one window's dots, and keeps the figures."""

    def __init__(self, page: Any, *, ratio: int) -> None:
        self.page = page
        self.ratio = ratio
        self.figures: list[str] = []

    def measure(self, where: Float[np.ndarray, "n 2"], *, zoom: float, red: bool) -> None:
        """Compare the dots on the screen with where they should be, CSS pixels."""
        self.page.settle()
        shot = cv2.imdecode(np.frombuffer(self.page.page.screenshot(scale="device"), np.uint8), cv2.IMREAD_COLOR)
        height, width = np.array(shot.shape[:2]) / self.ratio
        margin = 12 * zoom
        inside = ((where > margin) & (where < [width - margin, height - margin])).all(axis=1)
        assert inside.sum() >= (2 if zoom > 1 else len(where))
        reach = int(self.ratio * (18 if zoom > 1 else 11))
        centres = dots(shot, where[inside] * self.ratio, reach=reach, red=red) / self.ratio
        errors = np.linalg.norm(centres - where[inside], axis=1)
        said = f"{'points' if red else 'photo'} {zoom:.0f}x mean {errors.mean():.2f} worst {errors.max():.2f} px"
        self.figures.append(f"{said} ({len(errors)})")
        assert errors.max() <= 1.0, said


@pytest.mark.parametrize("ratio", [1, 2])
def test_points_and_photo_are_where_opencv_puts_them(
    scene_page: Callable[..., Any],
    viser_server: viser.ViserServer,
    until: Callable[..., None],
    tmp_path: Path,
    ratio: int,
    capsys: pytest.CaptureFixture[str],
) -> None:
    points, T_world_camera = points_camera(), pose()
    photograph(points, tmp_path / "dots.jpg")
    frames = FrameTable(("dots.jpg",), (tmp_path / "dots.jpg",), np.zeros(1, dtype=int), T_world_camera[None])
    photos = Photos({0: CAMERA}, frames)
    page = scene_page(*SHAPES[0], ratio=ratio)
    told: list[Entered | Refused] = []
    nodes = BoxNodes(viser_server)
    view = FrameView(page.client, photos=photos, nodes=nodes, poses=frames.Ts_world_camera, lens=LENS, send=told.append)
    page.tell_bridge(mode="frame", blend=1, dark=True)
    view.enter(0)
    until(lambda: told, page=page.page)
    assert isinstance(told[0], Entered), told
    until(lambda: page.scene.evaluate(TEXTURE_WIDTH) == CAMERA.width, page=page.page)
    cloud = viser_server.scene.add_point_cloud(
        "/dots",
        rigid_transform.transform_points(T_world_camera, points).astype(np.float32),
        colors=(255, 0, 255),
        point_size=0.012,
        point_shape="circle",
        precision="float32",
    )
    viser_server.flush()
    until(lambda: page.node("/dots", "visible"), page=page.page)

    def last_zoom() -> float:
        return ([1.0] + [told["zoom"] for told in page.told("zoom")])[-1]

    for width, height in SHAPES:
        page.page.set_viewport_size({"width": width, "height": height})
        fov = math.degrees(fitting_fov(rectified(CAMERA), aspect=width / height))
        # The server hears of the window's shape, and answers with another field of view.
        until(lambda fov=fov: abs(page.scene.evaluate("__viserMutable.camera.fov") - fov) < 1e-6, page=page.page)
        alignment = Alignment(page, ratio=ratio)
        seen = expected(points, width, height)
        pointer = np.floor(seen[len(seen) // 2])  # a wheel's event has whole pixels
        half = np.array([width, height]) / 2
        # What is under the pointer stays, unless that would show what lies beyond the edge.
        shift = np.clip((pointer - half) * (ZOOM - 1), -half * (ZOOM - 1), half * (ZOOM - 1))
        for zoom, where in ((1.0, seen), (ZOOM, half + (seen - half) * ZOOM - shift)):
            if zoom > 1:
                page.page.mouse.move(*pointer)
                while last_zoom() < ZOOM - 1e-4:  # Chromium halves the wheel's steps at two pixels a pixel
                    before = last_zoom()
                    page.page.mouse.wheel(0, -min(math.log(ZOOM / before) / 0.0018, 400))
                    until(lambda before=before: last_zoom() > before, page=page.page)
            for red in (True, False):
                cloud.visible = red
                viser_server.flush()
                until(lambda red=red: page.node("/dots", "visible") is red, page=page.page)
                alignment.measure(where, zoom=zoom, red=red)
        page.page.mouse.dblclick(*pointer)
        until(lambda: last_zoom() == 1, page=page.page)
        with capsys.disabled():
            sys.stdout.write(f"\n{width} x {height} at {ratio}: {'; '.join(alignment.figures)}")
    view.close()
    photos.close()
