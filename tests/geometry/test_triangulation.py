"""Points from observations: there and back, beside OpenCV, and nothing where rays do not meet."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ars_web.errors import BadInput
from ars_web.geometry import camera as cameras
from ars_web.geometry import rigid_transform
from ars_web.geometry.camera import Camera
from ars_web.geometry.triangulation import Observation, triangulate

PINHOLE = Camera(640, 480, 500.0, 510.0, 300.0, 250.0)
BROWN = Camera(960, 720, 938.8, 932.2, 505.9, 379.4, "brown", (-0.21, 0.07, 0.0011, -0.0009, 0.01))
FISHEYE = Camera(640, 480, 220.0, 222.0, 330.0, 235.0, "fisheye", (0.02, -0.01, 0.003, -0.0005))
EVERY = pytest.mark.parametrize("camera", [PINHOLE, BROWN, FISHEYE], ids=lambda camera: camera.model)


def looking(at: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """`T_world_camera` of a camera at `centre` that looks at a point, the world's z up."""
    z = (at - centre) / np.linalg.norm(at - centre)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    return rigid_transform.from_rotation(np.column_stack([x, np.cross(z, x), z]), centre)


def seen(camera: Camera, T_world_camera: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Image coordinates of a point of the world."""
    T = rigid_transform.invert(T_world_camera)
    return cameras.image_from_pixels(cameras.pixels_from_camera_points(camera, T[:3, :3] @ point + T[:3, 3]))


def round_about(camera: Camera, *, degrees: list[float], point: np.ndarray, noise: np.ndarray | None = None):
    """Observations of a point from a circle round the origin."""
    found: list[Observation] = []
    for frame, angle in enumerate(np.radians(degrees)):
        T = looking(np.zeros(3), np.array([np.cos(angle), np.sin(angle), 0.4]))
        image = seen(camera, T, point) + (0 if noise is None else noise[frame])
        found.append(Observation(frame, camera, T, image))
    return found


@EVERY
@given(
    place=st.tuples(*[st.floats(-0.15, 0.15)] * 3),
    degrees=st.lists(st.integers(0, 179), min_size=2, max_size=6, unique=True),
)
def test_a_point_that_is_seen_exactly_is_found_exactly(camera: Camera, place, degrees):
    point = np.array(place)
    found = triangulate(round_about(camera, degrees=degrees, point=point))
    np.testing.assert_allclose(found.point_world, point, atol=1e-6)
    assert found.residuals_px.max() < 1e-6
    assert found.residuals_px.shape == (len(degrees),)
    assert found.angle > 0


@EVERY
def test_no_place_nearby_fits_better(camera: Camera):
    """What is off in the images is least, as a search round the point finds."""
    random = np.random.default_rng(2)
    for _ in range(10):
        point = random.uniform(-0.15, 0.15, 3)
        observations = round_about(camera, degrees=[0, 20, 70], point=point, noise=random.normal(size=(3, 2)))
        found = triangulate(observations)

        def cost(at: np.ndarray, observations: list[Observation] = observations) -> float:
            return sum(float(np.square(seen(o.camera, o.T_world_camera, at) - o.image).sum()) for o in observations)

        least = cost(found.point_world)
        assert np.square(found.residuals_px).sum() == pytest.approx(least)
        for size in (1e-2, 1e-3, 1e-4):
            for step in random.normal(size=(50, 3)):
                assert cost(found.point_world + size * step / np.linalg.norm(step)) >= least


def test_it_is_at_least_as_near_as_opencvs():
    """`cv2.triangulatePoints` wants undistorted points and minimises an algebraic error."""
    random = np.random.default_rng(0)
    ours, theirs = [], []
    for _ in range(300):
        point = random.uniform(-0.15, 0.15, 3)
        observations = round_about(BROWN, degrees=[0, 40], point=point, noise=random.normal(size=(2, 2)))
        ours.append(np.linalg.norm(triangulate(observations).point_world - point))
        flat, matrices = [], []
        for o in observations:
            pixels = cameras.pixels_from_image(o.image).reshape(1, 1, 2)
            flat.append(cv2.undistortPoints(pixels, BROWN.K, np.array(BROWN.distortion)).reshape(2))
            matrices.append(rigid_transform.invert(o.T_world_camera)[:3])
        X = cv2.triangulatePoints(*matrices, *flat)[:, 0]
        theirs.append(np.linalg.norm(X[:3] / X[3] - point))
    assert np.mean(np.square(ours)) <= 1.001 * np.mean(np.square(theirs))
    assert np.median(ours) == pytest.approx(np.median(theirs), rel=0.1)


def test_the_angle_is_the_widest_between_two_rays():
    point = np.zeros(3)
    found = triangulate(round_about(PINHOLE, degrees=[0, 10, 25], point=point))
    rays = [np.array([np.cos(a), np.sin(a), 0.4]) for a in np.radians([0, 25])]
    cosine = rays[0] @ rays[1] / np.linalg.norm(rays[0]) / np.linalg.norm(rays[1])
    assert found.angle == pytest.approx(np.arccos(cosine))


def test_a_wrong_click_is_seen_in_the_residuals():
    noise = np.zeros((4, 2))
    noise[2] = 12.0, 0.0
    found = triangulate(round_about(PINHOLE, degrees=[0, 30, 60, 90], point=np.zeros(3), noise=noise))
    assert np.argmax(found.residuals_px) == 2
    assert found.residuals_px[2] > 3


def test_rays_that_meet_behind_a_camera_are_refused_and_the_frame_named():
    left, right = np.eye(4), np.eye(4)
    right[0, 3] = 0.2
    # Each looks outwards: the lines meet behind both.
    outwards = [
        Observation(7, PINHOLE, left, np.array([200.0, 250.5])),
        Observation(9, PINHOLE, right, np.array([400.0, 250.5])),
    ]
    with pytest.raises(BadInput, match=r"rays of frames 7 and 9 meet behind the camera of frame 7"):
        triangulate(outwards)


def test_a_point_that_only_one_of_the_cameras_has_behind_it_names_that_one():
    T = rigid_transform.from_rotation(np.eye(3), np.array([0.0, 0.0, 2.0]))
    point = np.array([0.1, 0.05, 1.0])
    turned = rigid_transform.from_rotation(np.eye(3), np.array([0.5, 0.0, 0.0]))
    fine = [Observation(i, PINHOLE, pose, seen(PINHOLE, pose, point)) for i, pose in enumerate((np.eye(4), turned))]
    mirrored = cameras.image_from_pixels(np.array([300.0 + 500.0 * 0.1 / -1.0, 250.0 + 510.0 * 0.05 / -1.0]))
    with pytest.raises(BadInput, match=r"behind the camera of frame 5"):
        triangulate([*fine, Observation(5, PINHOLE, T, mirrored)])


def test_parallel_rays_are_refused():
    aside = rigid_transform.from_rotation(np.eye(3), np.array([0.5, 0.0, 0.0]))
    image = np.array([320.0, 240.0])
    with pytest.raises(BadInput, match=r"frames 1 and 2 are parallel"):
        triangulate([Observation(1, PINHOLE, np.eye(4), image), Observation(2, PINHOLE, aside, image)])


def test_frames_from_one_place_are_refused():
    turned = rigid_transform.from_rotation(rigid_transform.rotation_about_z(0.3), np.zeros(3))
    observations = [
        Observation(1, PINHOLE, np.eye(4), np.array([320.0, 240.0])),
        Observation(2, PINHOLE, turned, np.array([100.0, 40.0])),
    ]
    with pytest.raises(BadInput, match=r"frames 1 and 2 were taken at one place"):
        triangulate(observations)


@pytest.mark.parametrize(
    ("place", "words"),
    [
        ((700.0, 20.0), r"\(700, 20\) is not in the image of frame 4, which is 640 x 480"),
        ((float("nan"), 1.0), "not in the image"),
    ],
)
def test_a_place_outside_the_image_is_refused(place, words):
    good = Observation(3, PINHOLE, np.eye(4), np.array([10.0, 10.0]))
    with pytest.raises(BadInput, match=words):
        triangulate([good, Observation(4, PINHOLE, looking(np.ones(3), np.zeros(3)), np.array(place))])


def test_a_place_that_the_lens_does_not_reach_is_refused():
    short = Camera(640, 480, 300.0, 300.0, 319.5, 239.5, "brown", (-0.5, 0.0, 0.0, 0.0, 0.0))
    observations = [Observation(i, short, np.eye(4), np.array([2.0, 3.0])) for i in range(2)]
    with pytest.raises(BadInput, match=r"calibration does not reach \(2, 3\) in frame 0"):
        triangulate(observations)


def test_one_frame_is_not_enough():
    with pytest.raises(BadInput, match="two frames at least, not 1"):
        triangulate(round_about(PINHOLE, degrees=[0], point=np.zeros(3)))


def test_the_boxes_of_the_generated_recording_are_found_from_its_frames(demo_recording):
    from ars_web.recordings.registry import read_recording

    recording = read_recording(demo_recording.folder)
    corners = demo_recording.objects[0].box.corners_world
    tried = 0
    for corner in corners:
        observations = []
        for index, frame in enumerate(recording.frames):
            camera = recording.cameras[frame.camera_id]
            image = seen(camera, frame.T_world_camera, corner)
            if cameras.in_image(camera, cameras.pixels_from_image(image[None])).all():
                observations.append(Observation(index, camera, frame.T_world_camera, image))
        if len(observations) >= 2:
            np.testing.assert_allclose(triangulate(observations).point_world, corner, atol=1e-8)
            tried += 1
    assert tried == 8
