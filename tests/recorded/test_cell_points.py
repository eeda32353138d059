"""Points and telling frames on the rendered cell: what its truth projects must be found again."""

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from ars_web.geometry import box_sensitivity as sensitivity
from ars_web.geometry import camera as cameras
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.epipolar import epipolar_curve
from ars_web.geometry.labels import labels_of_boxes
from ars_web.geometry.triangulation import Observation, triangulate

TRUTH = Path(__file__).parents[3] / "shared" / "data" / "cell" / "truth" / "truth.json"


@pytest.fixture(scope="module")
def truth() -> dict[str, Any]:
    return json.loads(TRUTH.read_bytes())


@pytest.fixture(scope="module")
def camera(truth: dict[str, Any]) -> Camera:
    K, (k1, k2, p1, p2) = truth["K"], truth["dist"]
    return Camera(*truth["size"], K[0][0], K[1][1], K[0][2], K[1][2], "brown", (k1, k2, p1, p2, 0.0))


@pytest.fixture(scope="module")
def Ts(truth: dict[str, Any]) -> np.ndarray:
    return np.array([frame["T_world_camera"] for frame in truth["frames"]])


def boxes(truth: dict[str, Any]) -> list[Box]:
    return [Box(np.array(thing["T_world_box"]), np.array(thing["size"])) for thing in truth["objects"]]


def test_true_corners_are_found_from_two_frames_that_show_them(truth: dict[str, Any], camera: Camera, Ts: np.ndarray):
    """Clicked to a hundredth of a pixel, in frames at least 20 degrees apart: to a tenth of a millimetre."""
    K, distortion = np.array(truth["K"]), np.array(truth["dist"])
    found = 0
    for box in boxes(truth):
        for corner in box.corners_world:
            observations: list[Observation] = []
            for frame, T in enumerate(Ts):
                T_camera_world = rigid_transform.invert(T)
                at = T_camera_world[:3, :3] @ corner + T_camera_world[:3, 3]
                if at[2] < 0.05 or np.hypot(*at[:2]) / at[2] > camera.valid_radius:
                    continue
                # Not ours: the truth's own numbers, through OpenCV.
                pixels = cv2.projectPoints(at[None], np.zeros(3), np.zeros(3), K, distortion)[0].reshape(1, 2)
                if not cameras.in_image(camera, pixels).all():
                    continue
                seen = np.round(pixels[0] + 0.5, 2)
                seen = np.clip(seen, 0, [camera.width, camera.height])
                observations.append(Observation(frame, camera, T, seen))
            pairs = [(a, b) for a in observations for b in observations[:1] if angle(a, b, corner) > 20]
            for pair in pairs[::5]:
                point = triangulate(pair)
                assert np.linalg.norm(point.point_world - corner) < 1e-4
                assert point.residuals_px.max() < 0.02
                lines = epipolar_curve(pair[0], camera, pair[1].T_world_camera)
                assert min(distance(pair[1].image, line) for line in lines) < 0.1
                found += 1
    assert found > 100


def distance(point: np.ndarray, line: np.ndarray) -> float:
    a, along = line[:-1], np.diff(line, axis=0)
    t = np.clip(((point - a) * along).sum(axis=1) / (along**2).sum(axis=1), 0, 1)
    return float(np.linalg.norm(a + t[:, None] * along - point, axis=1).min())


def angle(a: Observation, b: Observation, point: np.ndarray) -> float:
    rays = [(point - o.T_world_camera[:3, 3]) / np.linalg.norm(point - o.T_world_camera[:3, 3]) for o in (a, b)]
    return float(np.degrees(np.arccos(np.clip(rays[0] @ rays[1], -1, 1))))


def test_an_error_of_a_true_box_shows_in_its_telling_frames(truth: dict[str, Any], camera: Camera, Ts: np.ndarray):
    """Moved by a millimetre along each axis, the label moves more in the chosen six frames than in six evenly spaced
    ones, and by as much as was said."""
    ids = np.zeros(len(Ts), dtype=np.int64)
    for box in boxes(truth):
        chosen = sensitivity.telling_frames({0: camera}, ids, Ts, box, count=6)
        assert len(chosen) == 6
        rows = [one.frame for one in chosen]
        slopes = sensitivity.corner_slopes(camera, Ts, box)
        matrices = sensitivity.information(slopes, box)
        shown = np.flatnonzero(slopes.seen.any(axis=1))
        even = shown[np.linspace(0, len(shown) - 1, 6).astype(int)]
        known = sensitivity.prior(box)
        told = [np.linalg.slogdet(known + matrices[some].sum(axis=0))[1] for some in (rows, even)]
        assert told[0] > told[1]
        assert (labels_of_boxes(camera, Ts[rows], [box]).truncated < 0.8).all()
        for axis in range(3):
            shift = rigid_transform.from_rotation(np.eye(3), 1e-3 * np.eye(3)[axis])
            moved = Box(box.T_world_box @ shift, box.size)
            before, after = (labels_of_boxes(camera, Ts[rows], [b]).bbox_amodal[:, 0] for b in (box, moved))
            motion = np.abs(after - before).max(axis=1)
            assert motion.max() > 0.3
            for one, moves, label in zip(chosen, motion, before, strict=True):
                if (label > 0).all() and (label < [camera.width, camera.height] * 2).all():
                    assert moves < one.px_per_metre * 1e-3 + 0.25
