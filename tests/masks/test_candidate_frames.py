"""Which frames are worth an outline."""

from dataclasses import replace

import numpy as np
import pytest

from ars_web.geometry.visual_hull import VisualHull, visual_hull
from ars_web.masks.candidate_frames import candidate_frames


@pytest.fixture(scope="module")
def hull(painted) -> VisualHull:
    return visual_hull([painted.view(0), painted.view(4)])


def test_drawn_frames_are_left_out_and_none_comes_twice(painted, hull):
    chosen = candidate_frames(painted.taken, hull, drawn=(0, 4), count=50)
    assert sorted(chosen) == [frame for frame in range(12) if frame not in (0, 4)]


def test_the_first_ones_see_it_from_sides_far_apart(painted, hull):
    first, second = candidate_frames(painted.taken, hull, drawn=(0, 4), count=2)
    ways = painted.taken.frames.Ts_world_camera[:, :3, 3] - hull.centre_of_mass
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    assert np.degrees(np.arccos(ways[first] @ ways[[0, 4]].T)).min() > 60
    assert np.degrees(np.arccos(ways[second] @ ways[[0, 4, first]].T)).min() > 40


def test_frames_that_look_away_or_from_too_far_are_left_out(painted, hull):
    frames = painted.taken.frames
    Ts = frames.Ts_world_camera.copy()
    Ts[5, :3, :3] = Ts[5, :3, :3] @ np.diag([-1.0, 1.0, -1.0])  # looks away
    Ts[6, :3, 3] += 60 * (Ts[6, :3, 3] - painted.ring.CENTRE)  # thirty metres off
    Ts[7, :3, 3] += 0.3 * Ts[7, :3, 0]  # sees half of it at most
    taken = replace(painted.taken, frames=replace(frames, Ts_world_camera=Ts))
    chosen = candidate_frames(taken, hull, drawn=(0, 4), count=50)
    assert not {5, 6, 7} & set(chosen)
    assert len(chosen) == 7
