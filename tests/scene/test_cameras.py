"""Frusta, the thinned path, the photo in a frustum, and the nodes that show them."""

from collections.abc import Callable, Iterator

import cv2
import numpy as np
import pytest
import viser

from ars_web.geometry import rigid_transform
from ars_web.geometry.camera import Camera, image_from_pixels, pixels_from_camera_points
from ars_web.scene.cameras import (
    MOST_FRUSTA,
    PHOTO_WIDTH,
    CurrentCamera,
    add_cameras,
    frustum_corners,
    frustum_lines,
    frustum_photo,
    reduced_camera,
    thinned,
)
from ars_web.scene.extent import recording_extent
from ars_web.sessions.model import SessionSnapshot
from ars_web.sessions.store import SessionStore
from ars_web.workspace import SceneAddress

OFF_CENTRE = Camera(640, 480, 500.0, 520.0, 300.0, 260.0)
BENT = Camera(640, 480, 500.0, 520.0, 300.0, 260.0, "brown", (-0.2, 0.05, 1e-3, -1e-3, 0.0))


def test_a_frustums_corners_are_the_images() -> None:
    corners = frustum_corners(OFF_CENTRE, depth=2.0)
    np.testing.assert_array_equal(corners[0], [0, 0, 0])
    np.testing.assert_allclose(corners[1:, 2], 2.0)
    drawn = image_from_pixels(pixels_from_camera_points(OFF_CENTRE, corners[1:]))
    np.testing.assert_allclose(drawn, [[0, 0], [640, 0], [640, 480], [0, 480]], atol=1e-9)


def test_a_bent_images_frustum_lies_within_the_image() -> None:
    corners = frustum_corners(BENT, depth=1.0)
    drawn = image_from_pixels(pixels_from_camera_points(BENT, corners[1:]))
    assert (drawn >= -0.1).all()
    assert (drawn <= [640.1, 480.1]).all()


def test_a_camera_that_cannot_be_rectified_still_has_a_frustum() -> None:
    astray = Camera(640, 480, 500.0, 500.0, 5000.0, 240.0, "brown", (-0.5, 0.0, 0.0, 0.0, 0.0))
    assert np.isfinite(frustum_corners(astray, depth=1.0)).all()


def test_the_path_is_thinned_by_the_way_along_it() -> None:
    centres = np.stack([np.linspace(0, 10, 1001), np.zeros(1001), np.zeros(1001)], axis=1)
    kept = thinned(centres, apart=0.5, most=1000)
    assert kept[0] == 0
    assert kept[-1] == 1000
    assert len(kept) == 21
    assert np.diff(centres[kept, 0]).min() >= 0.49
    assert len(thinned(centres, apart=1e-6, most=300)) == 300


@pytest.mark.parametrize("frames", [1, 2, 50])
def test_a_path_that_stands_still_keeps_an_end(frames: int) -> None:
    kept = thinned(np.ones((frames, 3)), apart=0.1, most=300)
    assert set(kept) <= {0, frames - 1}
    assert len(kept) >= 1


def test_a_reduced_camera_sees_the_same() -> None:
    small = reduced_camera(BENT, width=160, height=120)
    points = np.random.default_rng(0).uniform([-0.4, -0.3, 1.0], [0.4, 0.3, 1.0], (50, 3))
    large = image_from_pixels(pixels_from_camera_points(BENT, points))
    np.testing.assert_allclose(image_from_pixels(pixels_from_camera_points(small, points)), large / 4, atol=1e-9)


def test_a_frustums_photo_is_small_and_red_where_the_image_is_red(tmp_path) -> None:
    image = np.zeros((960, 1280, 3), dtype=np.uint8)
    image[:, :640] = (0, 0, 255)
    assert cv2.imwrite(str(tmp_path / "a.png"), image)
    photo = frustum_photo(tmp_path / "a.png", Camera(1280, 960, 900.0, 900.0, 639.5, 479.5))
    assert photo.shape == (240, PHOTO_WIDTH, 3)
    np.testing.assert_array_equal(photo[120, 20], [255, 0, 0])
    np.testing.assert_array_equal(photo[120, -20], [0, 0, 0])


def test_a_bent_images_photo_is_straight(tmp_path) -> None:
    """A line that the lens bends is straight in the frustum."""
    camera = Camera(640, 480, 400.0, 400.0, 319.5, 239.5, "brown", (-0.25, 0.05, 0.0, 0.0, 0.0))
    across = np.linspace(-0.7, 0.7, 400)
    points = pixels_from_camera_points(camera, np.stack([across, np.full(400, 0.35), np.ones(400)], axis=1))
    image = np.zeros((480, 640, 3), dtype=np.uint8)
    cv2.polylines(image, [np.round(points).astype(np.int32)], False, (255, 255, 255), 3)
    assert cv2.imwrite(str(tmp_path / "a.png"), image)
    photo = frustum_photo(tmp_path / "a.png", camera)[..., 0].astype(float)
    columns = np.flatnonzero(photo.max(axis=0) > 100)
    heights = (photo * np.arange(len(photo))[:, None]).sum(axis=0)[columns] / photo.sum(axis=0)[columns]
    assert len(columns) > 200
    assert np.ptp(heights) < 1.0


@pytest.fixture
def snapshot(store: SessionStore, sid: str) -> SessionSnapshot:
    return store.snapshot(sid)


def test_frustum_lines_join_the_corners_in_the_world(snapshot: SessionSnapshot) -> None:
    frames = snapshot.frames
    lines = frustum_lines(frames, snapshot.cameras, np.array([2, 7]), depth=0.3).reshape(2, 8, 2, 3)
    for row, frame in zip(lines, (2, 7), strict=True):
        camera = snapshot.cameras[int(frames.camera_ids[frame])]
        corners = rigid_transform.transform_points(frames.Ts_world_camera[frame], frustum_corners(camera, depth=0.3))
        np.testing.assert_allclose(row[:4, 0], np.tile(corners[0], (4, 1)))
        np.testing.assert_allclose(row[:4, 1], corners[1:])
        np.testing.assert_allclose(row[4:, 0], corners[1:])
        np.testing.assert_allclose(row[4:, 1], np.roll(corners[1:], -1, axis=0))


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield server
    server.stop()


def test_every_camera_is_a_point(server: viser.ViserServer, snapshot: SessionSnapshot) -> None:
    extent = recording_extent(snapshot.frames.Ts_world_camera)
    add_cameras(server.scene, snapshot.frames, snapshot.cameras, extent)
    points = server.scene.get_handle_by_name("/cameras/points")
    assert isinstance(points, viser.PointCloudHandle)
    holder = server.scene.get_handle_by_name("/cameras")
    assert holder is not None
    np.testing.assert_allclose(points.points + holder.position, snapshot.frames.Ts_world_camera[:, :3, 3], atol=1e-6)
    path = server.scene.get_handle_by_name("/cameras/path")
    assert isinstance(path, viser.LineSegmentsHandle)
    assert len(path.points) <= 8 * MOST_FRUSTA


def test_far_from_the_worlds_origin_points_keep_their_places(
    server: viser.ViserServer, snapshot: SessionSnapshot
) -> None:
    """Single precision would leave them 3 cm apart there."""
    frames = snapshot.frames
    frames.Ts_world_camera.flags.writeable = True
    frames.Ts_world_camera[:, :3, 3] += [500_000.0, -4_000_000.0, 0.0]
    add_cameras(server.scene, frames, snapshot.cameras, recording_extent(frames.Ts_world_camera))
    points, holder = (server.scene.get_handle_by_name(name) for name in ("/cameras/points", "/cameras"))
    assert isinstance(points, viser.PointCloudHandle)
    assert holder is not None
    np.testing.assert_allclose(
        points.points.astype(float) + holder.position, frames.Ts_world_camera[:, :3, 3], atol=1e-6
    )


def test_the_current_frame_is_shown_with_its_photo(
    server: viser.ViserServer, snapshot: SessionSnapshot, visit: Callable, until: Callable
) -> None:
    with visit(SceneAddress(f"ws://127.0.0.1:{server.get_port()}/", {})) as visitor:
        until(lambda: bool(server.get_clients()))
        client = next(iter(server.get_clients().values()))
        extent = recording_extent(snapshot.frames.Ts_world_camera)
        current = CurrentCamera(client, snapshot.frames, snapshot.cameras, extent)
        photo = np.full((60, 80, 3), 200, dtype=np.uint8)
        for frame in (2, 5):
            current.show(frame, photo)
            client.flush()
            visitor.listen_until(
                lambda v, frame=frame: np.allclose(
                    v.nodes.get("/current", {}).get("position", np.inf), snapshot.frames.Ts_world_camera[frame, :3, 3]
                )
            )
        visitor.listen_until(lambda v: {"/current/frustum", "/current/near", "/current/photo"} <= v.nodes.keys())
        current.show(6, None)
        client.flush()
        visitor.listen_until(lambda v: not v.nodes["/current/photo"]["visible"])
        current.hide()
        client.flush()
        visitor.listen_until(lambda v: not v.nodes["/current"]["visible"])
