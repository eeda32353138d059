"""Epipolar curves against points along the ray, projected one by one."""

import numpy as np
import pytest

from ars_web.errors import BadInput
from ars_web.geometry import camera as cameras
from ars_web.geometry import rigid_transform
from ars_web.geometry.camera import Camera
from ars_web.geometry.epipolar import epipolar_curve
from ars_web.geometry.labels import NEAR
from ars_web.geometry.triangulation import Observation, ray_of_observation

PINHOLE = Camera(640, 480, 500.0, 510.0, 300.0, 250.0)
FISHEYE = Camera(640, 480, 220.0, 222.0, 330.0, 235.0, "fisheye", (0.02, -0.01, 0.003, -0.0005))


def along_the_ray(observation: Observation, camera: Camera, T_world_camera: np.ndarray) -> np.ndarray:
    """Image coordinates (k, 2) of points along the ray, close together, those within the image."""
    start, direction = ray_of_observation(observation)
    depth = direction @ observation.T_world_camera[:3, 2]
    t = np.concatenate([np.geomspace(NEAR / depth, 1e6, 40_000), np.linspace(NEAR / depth, 20, 40_000)])
    points = rigid_transform.transform_points(rigid_transform.invert(T_world_camera), start + t[:, None] * direction)
    pixels = cameras.pixels_from_camera_points(camera, points[points[:, 2] >= NEAR])
    return cameras.image_from_pixels(pixels[cameras.in_image(camera, pixels)])


def distance_to_lines(points: np.ndarray, lines: list[np.ndarray]) -> np.ndarray:
    """From each point (k,) to the nearest of the lines."""
    a = np.concatenate([line[:-1] for line in lines])
    b = np.concatenate([line[1:] for line in lines])
    along = b - a
    t = np.einsum("kjd,jd->kj", points[:, None] - a, along) / np.maximum((along * along).sum(axis=1), 1e-300)
    nearest = a + np.clip(t, 0, 1)[..., None] * along
    return np.linalg.norm(points[:, None] - nearest, axis=-1).min(axis=1)


def pair(seed: int, random_scene) -> tuple[Observation, Camera, np.ndarray] | None:
    """An observation, and another camera of any model somewhere near that looks anywhere."""
    random = np.random.default_rng(1000 + seed)
    camera_of, T_of, _ = random_scene(seed)
    camera, _, _ = random_scene(seed + 5000)
    turn = rigid_transform.rotation_from_wxyz(np.array([1.0, *random.normal(size=3) * random.choice([0.1, 0.5, 3.0])]))
    T = T_of @ rigid_transform.from_rotation(turn, random.normal(size=3) * 0.4)
    image = random.uniform([0, 0], [camera_of.width, camera_of.height])
    observation = Observation(3, camera_of, T_of, image)
    ray = cameras.normalised_from_pixels(camera_of, cameras.pixels_from_image(image[None]))
    return None if np.isnan(ray).any() else (observation, camera, T)


@pytest.mark.parametrize("first", range(0, 120, 20))
def test_the_curve_is_where_points_of_the_ray_are_seen(first: int, random_scene):
    shown = 0
    for seed in range(first, first + 20):
        made = pair(seed, random_scene)
        if made is None:
            continue
        observation, camera, T = made
        lines = epipolar_curve(observation, camera, T)
        want = along_the_ray(observation, camera, T)
        if len(want) < 2:
            assert sum(np.linalg.norm(np.diff(line, axis=0), axis=1).sum() for line in lines) < 2, seed
            continue
        shown += 1
        assert distance_to_lines(want[::7], lines).max() < 0.1, seed
        # And it goes no further than the ray does.
        own = np.concatenate(lines)
        assert distance_to_lines(own, [want]).max() < 1.0, seed
        assert (own >= 0).all()
        assert (own <= [camera.width, camera.height]).all()
    assert shown >= 5


def test_the_curve_passes_through_the_point_in_the_other_frame(demo_recording):
    camera, Ts = demo_recording.camera, demo_recording.Ts_world_camera
    corner = demo_recording.objects[0].box.corners_world[:1]
    images = [
        cameras.image_from_pixels(
            cameras.pixels_from_camera_points(
                camera, rigid_transform.transform_points(rigid_transform.invert(T), corner)
            )
        )
        for T in Ts
    ]
    inside = [i for i, image in enumerate(images) if cameras.in_image(camera, image - 0.5).all()]
    assert len(inside) >= 3
    for other in inside[1:]:
        lines = epipolar_curve(Observation(inside[0], camera, Ts[inside[0]], images[inside[0]][0]), camera, Ts[other])
        assert distance_to_lines(images[other], lines).max() < 0.1


def test_without_distortion_it_is_the_epipolar_line_of_the_fundamental_matrix():
    import cv2

    T = rigid_transform.from_rotation(
        rigid_transform.rotation_from_wxyz(np.array([1.0, 0.02, -0.1, 0.05])), np.array([0.3, 0.05, 0.1])
    )
    observation = Observation(0, PINHOLE, np.eye(4), np.array([250.5, 200.5]))
    (line,) = epipolar_curve(observation, PINHOLE, T)
    R, t = rigid_transform.invert(T)[:3, :3], rigid_transform.invert(T)[:3, 3]
    cross = np.array([[0, -t[2], t[1]], [t[2], 0, -t[0]], [-t[1], t[0], 0]])
    F = np.linalg.inv(PINHOLE.K).T @ cross @ R @ np.linalg.inv(PINHOLE.K)
    a, b, c = cv2.computeCorrespondEpilines(np.array([[250.0, 200.0]]), 1, F)[0, 0]
    off = np.abs((line - 0.5) @ [a, b] + c)
    assert off.max() < 1e-3
    assert len(line) == 2


def test_it_runs_away_from_the_observing_camera():
    aside = rigid_transform.from_rotation(np.eye(3), np.array([0.5, 0.0, 0.0]))
    (line,) = epipolar_curve(Observation(0, PINHOLE, np.eye(4), np.array([400.0, 240.0])), PINHOLE, aside)
    assert line[0, 0] == 0.0  # the ray begins left of this camera's image
    np.testing.assert_allclose(line[-1], [400.0, 240.0], atol=1e-6)  # and ends where it is parallel


def test_a_ray_that_another_camera_does_not_show_leaves_no_curve():
    back = rigid_transform.from_rotation(np.diag([-1.0, 1.0, -1.0]), np.array([0.5, 0.0, -1.0]))
    assert epipolar_curve(Observation(0, PINHOLE, np.eye(4), np.array([320.0, 240.0])), PINHOLE, back) == []


def test_a_ray_through_the_other_camera_leaves_no_curve():
    ahead = rigid_transform.from_rotation(np.eye(3), np.array([0.0, 0.0, 0.5]))
    on_axis = np.array([PINHOLE.cx, PINHOLE.cy]) + 0.5
    assert epipolar_curve(Observation(0, PINHOLE, np.eye(4), on_axis), PINHOLE, ahead) == []


@pytest.mark.parametrize("tilt", [0.0, 1e-12, -1e-12, 1e-300])
@pytest.mark.parametrize("camera", [PINHOLE, FISHEYE], ids=lambda camera: camera.model)
def test_a_ray_parallel_to_the_other_image_is_cut_at_its_border(camera: Camera, tilt: float):
    quarter = rigid_transform.rotation_from_wxyz(np.array([np.sqrt(0.5), 0.0, np.sqrt(0.5) + tilt, 0.0]))
    T = rigid_transform.from_rotation(quarter, np.array([-1.0, 0.02, 1.0]))
    on_axis = np.array([PINHOLE.cx, PINHOLE.cy]) + 0.5
    (line,) = epipolar_curve(Observation(0, PINHOLE, np.eye(4), on_axis), camera, T)
    assert np.abs(np.diff(line[:, 0])).sum() > 100
    assert {float(line[0, 0]), float(line[-1, 0])} & {0.0, float(camera.width)}


def test_frames_from_one_place_are_refused():
    turned = rigid_transform.from_rotation(rigid_transform.rotation_about_z(0.3), np.zeros(3))
    with pytest.raises(BadInput, match="frame 8 was taken at the same place"):
        epipolar_curve(Observation(8, PINHOLE, np.eye(4), np.array([10.0, 20.0])), PINHOLE, turned)


def test_a_place_outside_the_image_is_refused():
    with pytest.raises(BadInput, match=r"\(-1, 20\) is not in the image of frame 8"):
        epipolar_curve(Observation(8, PINHOLE, np.eye(4), np.array([-1.0, 20.0])), PINHOLE, np.eye(4))
