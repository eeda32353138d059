"""Azimuths of cameras, and which lie in a sector, also where it goes on over 360 degrees."""

import numpy as np
import pytest

from ars_web.geometry.rigid_transform import rotation_from_wxyz
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
        (0.0, 180.0, [0, 90, 179]),
        (180.0, 360.0, [180, 270, 359]),
        (270.0, 90.0, [270, 359, 0]),
        (-90.0, 90.0, [270, 359, 0]),
        (-10.0, 1.0, [359, 0]),
        (90.0, 90.5, [90]),
    ],
)
def test_a_sector_begins_where_it_says_and_ends_before(start: float, stop: float, inside: list[float]) -> None:
    azimuths = np.array([0.0, 90.0, 179.0, 180.0, 270.0, 359.0, np.nan])
    assert set(azimuths[in_sector(azimuths, start=start, stop=stop)].tolist()) == set(inside)


def test_a_whole_turn_has_all_and_none_has_nothing() -> None:
    azimuths = np.array([0.0, 123.0, np.nan])
    assert in_sector(azimuths, start=0.0, stop=360.0).all()
    assert in_sector(azimuths, start=-90.0, stop=270.0).all()
    assert not in_sector(azimuths, start=30.0, stop=30.0).any()


def test_every_camera_is_on_one_side_of_an_edge() -> None:
    turn = np.radians(np.arange(0.0, 360.0, 7.5))
    azimuths = azimuths_round(np.column_stack([np.cos(turn), np.sin(turn), turn]), np.eye(4))
    assert azimuths.tolist() == np.arange(0.0, 360.0, 7.5).tolist(), "whole gaps between them are equally wide, too"
    for edge in (0.0, 7.5, 45.0, 187.5):
        one, other = (in_sector(azimuths, start=edge + a, stop=edge + a + 180.0) for a in (0.0, 180.0))
        assert (one ^ other).all()
        assert one.sum() == 24


@pytest.mark.parametrize("width", [0.3, 10.0, 45.3, 120.7])
def test_a_camera_on_an_edge_is_in_one_of_two_sectors_that_meet_there(width: float) -> None:
    for tenth in range(-3600, 3600, 7):
        start = tenth / 10
        edge = np.array([round((start + width) % 360.0, 9)])
        before = in_sector(edge, start=start, stop=start + width)
        after = in_sector(edge, start=start + width, stop=start + 2 * width)
        assert (before.tolist(), after.tolist()) == ([False], [True]), start
        first = np.array([round(start % 360.0, 9)])
        assert in_sector(first, start=start, stop=start + width).all(), start


def test_a_whole_turn_has_all_wherever_it_begins() -> None:
    azimuths = np.array([0.0, 152.1, 152.2, 359.9, np.nan])
    for tenth in range(-3600, 3600):
        assert in_sector(azimuths, start=tenth / 10, stop=tenth / 10 + 360.0).all(), tenth


def test_an_edge_that_no_binary_number_is_parts_cameras_that_stand_on_it() -> None:
    turn = np.radians(np.arange(0.1, 360.0, 0.1))
    azimuths = azimuths_round(np.column_stack([np.cos(turn), np.sin(turn), turn]), np.eye(4))
    for place in range(0, len(turn) - 1, 50):
        start = round(0.1 * (place + 1), 1)
        assert np.flatnonzero(in_sector(azimuths, start=start, stop=start + 0.1)).tolist() == [place]


def test_on_the_z_axis_there_is_no_azimuth_however_the_frame_lies() -> None:
    T_world_about = np.eye(4)
    T_world_about[:3, :3] = rotation_from_wxyz(np.array([0.9, 0.1, 0.3, 0.2]) / np.sqrt(0.95))
    T_world_about[:3, 3] = 1.0, 2.0, 3.0
    along = np.array([-1.1, 0.0, 0.3, 0.5, 0.7])[:, None] * T_world_about[:3, 2]
    assert np.isnan(azimuths_round(T_world_about[:3, 3] + along, T_world_about)).all()
    beside = along + 1e-6 * T_world_about[:3, 1]
    assert azimuths_round(T_world_about[:3, 3] + beside, T_world_about) == pytest.approx(90.0, abs=1e-6)
