"""What a recording is said to hold before it is imported."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ars_web.geometry.camera import Camera
from ars_web.recordings.overview import SAMPLES, overview
from ars_web.recordings.recording import Frame, Recording, SkippedFrame

CAMERA = Camera(width=64, height=48, fx=50.0, fy=50.0, cx=32.0, cy=24.0, model="pinhole", distortion=())


def recording(positions: np.ndarray, *, cameras: int = 1, **changes: object) -> Recording:
    Ts = np.tile(np.eye(4), (len(positions), 1, 1))
    Ts[:, :3, 3] = positions
    frames = tuple(Frame(f"{i:03d}.png", Path(f"/r/{i:03d}.png"), i % cameras, T) for i, T in enumerate(Ts))
    made = Recording("ars", Path("/r"), dict.fromkeys(range(cameras), CAMERA), frames)
    return replace(made, **changes)


def line(count: int, *, step: float = 0.01) -> np.ndarray:
    return np.arange(count)[:, None] * np.array([step, 0.0, 0.0])


def test_a_sound_recording_warns_of_nothing() -> None:
    seen = overview(recording(line(101)))
    assert seen.path_length == pytest.approx(1.0)
    assert [(use.id, use.camera, use.frames) for use in seen.cameras] == [(0, CAMERA, 101)]
    assert seen.sample_frames == (0, 20, 40, 60, 80, 100)
    assert seen.warnings == ()


@pytest.mark.parametrize("count", [1, 2, 3, 7])
def test_short_recordings_are_seen_whole(count: int) -> None:
    seen = overview(recording(line(count)))
    assert len(seen.sample_frames) == min(count, SAMPLES)
    assert (seen.sample_frames[0], seen.sample_frames[-1]) == (0, count - 1)
    assert seen.warnings == ()


def test_each_camera_goes_its_own_way() -> None:
    """Two cameras a metre apart that take turns: neither jumps."""
    positions = line(100)
    positions[1::2, 1] = 1.0
    seen = overview(recording(positions, cameras=2))
    assert seen.path_length == pytest.approx(0.98)
    assert [use.frames for use in seen.cameras] == [50, 50]
    assert seen.warnings == ()


def test_a_lost_track_is_told() -> None:
    positions = line(50)
    positions[30:] += [0.0, 0.0, 2.0]
    (warning,) = overview(recording(positions)).warnings
    assert "jumps 2 m between frames 29 and 30" in warning
    positions[40:] -= [0.0, 0.0, 2.0]
    (warning,) = overview(recording(positions)).warnings
    assert "and in 1 more places" in warning


def test_a_camera_that_stands_still_is_told() -> None:
    (warning,) = overview(recording(np.zeros((10, 3)))).warnings
    assert "stands still" in warning


def test_a_scale_of_its_own_is_told() -> None:
    (warning,) = overview(recording(line(10), format="colmap")).warnings
    assert "need not be metres" in warning


def test_much_that_is_left_out_is_told() -> None:
    skipped = tuple(SkippedFrame(f"{i}", "why", "where") for i in range(5))
    assert overview(recording(line(95), skipped=skipped)).warnings == ()
    (warning,) = overview(recording(line(10), skipped=skipped)).warnings
    assert "5 of 15" in warning
