"""Azimuths of cameras, and which lie in a sector, also where it goes on over 360 degrees."""

import numpy as np
import pytest

from ars_web.geometry.view_sector import azimuths_round, in_sector


def test_azimuths_count_from_x_over_y_seen_from_above() -> None:
    about = np.array([1.0, 2.0, 3.0])
    cameras = about + np.array([[1, 0, 5], [1, 1, 0], [0, 2, -1], [-3, 0, 0], [0, -1, 0], [1, -1, 0], [0, 0, 4]])
    T_world_about = np.eye(4)
    T_world_about[:3, 3] = about
    told = [0, 45, 90, 180, 270, 315, np.nan]
    assert azimuths_round(cameras, T_world_about).tolist() == pytest.approx(told, nan_ok=True)
    # In a frame that lies on its side: its x, y and z are the world's y, z and x.
    T_world_about[:3, :3] = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
    turned = (cameras - about)[:, [2, 0, 1]] + about
    assert azimuths_round(turned, T_world_about).tolist() == pytest.approx(told, nan_ok=True)


@pytest.mark.parametrize(
    ("start", "stop", "inside"),
    [
        (0, 180, [0, 90, 179]),
        (180, 360, [180, 270, 359]),
        (270, 90, [270, 359, 0]),
        (-90, 90, [270, 359, 0]),
        (-10, 1, [359, 0]),
        (90, 90.5, [90]),
    ],
)
def test_a_sector_begins_where_it_says_and_ends_before(start: float, stop: float, inside: list[float]) -> None:
    azimuths = np.array([0.0, 90.0, 179.0, 180.0, 270.0, 359.0, np.nan])
    assert set(azimuths[in_sector(azimuths, start=start, stop=stop)].tolist()) == set(inside)


def test_a_whole_turn_has_all_and_none_has_nothing() -> None:
    azimuths = np.array([0.0, 123.0, np.nan])
    assert in_sector(azimuths, start=0, stop=360).all()
    assert in_sector(azimuths, start=-90, stop=270).all()
    assert not in_sector(azimuths, start=30, stop=30).any()


def test_every_camera_is_on_one_side_of_an_edge() -> None:
    turn = np.radians(np.arange(0.0, 360.0, 7.5))
    azimuths = azimuths_round(np.column_stack([np.cos(turn), np.sin(turn), turn]), np.eye(4))
    for edge in (0.0, 7.5, 45.0, 187.5):
        one, other = (in_sector(azimuths, start=edge + a, stop=edge + a + 180.0) for a in (0.0, 180.0))
        assert (one ^ other).all()
        assert one.sum() == 24
