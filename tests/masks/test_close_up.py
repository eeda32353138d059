"""Close-ups: outlines go into their pixels and come back, and points are found where the photograph shows them."""

import numpy as np
import pytest
import shapely

from ars_web.geometry import rigid_transform
from ars_web.geometry.camera import Camera
from ars_web.geometry.mask_regions import iou
from ars_web.geometry.polygon import Polygon
from ars_web.masks.close_up import LONGEST_SIDE, CloseUp, close_up

AHEAD = rigid_transform.from_rotation(np.eye(3), np.zeros(3))


def made(*, width: int, height: int, region: shapely.Polygon, points: np.ndarray | None = None) -> CloseUp:
    camera = Camera(width, height, 100.0, 100.0, width / 2 - 0.5, height / 2 - 0.5)
    image = np.zeros((height, width, 3), dtype=np.uint8)
    points = np.zeros((0, 3)) if points is None else points
    return close_up(image, frame=3, camera=camera, T_world_camera=AHEAD, region=region, points=points)


def square(x0: float, y0: float, x1: float, y1: float) -> Polygon:
    return Polygon(np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]]))


@pytest.mark.parametrize("size", [60, 1500])
def test_an_outline_goes_in_and_comes_back(size):
    shape = square(300, 200, 300 + size, 200 + 0.7 * size)
    shot = made(width=2400, height=1600, region=shapely.Polygon(shape.outer))
    assert max(shot.shape) <= LONGEST_SIDE
    back = shot.polygons(shot.raster([shape]), grow=0.0)
    assert iou(back, [shape]) > 0.97
    np.testing.assert_allclose(
        np.concatenate([back[0].outer.min(axis=0), back[0].outer.max(axis=0)]),
        [300, 200, 300 + size, 200 + 0.7 * size],
        atol=1.0 / shot.scale,
    )


def test_whole_pixels_come_back_as_they_are_and_wider_by_what_is_asked():
    shape = square(40, 30, 80, 60)
    shot = made(width=200, height=100, region=shapely.Polygon(shape.outer))
    assert shot.scale == 1.0
    (back,) = shot.polygons(shot.raster([shape]), grow=2.0)
    np.testing.assert_allclose(shapely.Polygon(back.outer).bounds, (38, 28, 82, 62), atol=0.51)


def test_an_outline_ends_at_the_photographs_border():
    shot = made(width=200, height=100, region=shapely.box(150, 20, 260, 80))
    (back,) = shot.polygons(shot.raster([square(150, 20, 260, 80)]), grow=3.0)
    assert back.outer[:, 0].max() == pytest.approx(200)


def test_holes_are_kept():
    shape = Polygon(square(20, 20, 80, 80).outer, (square(40, 40, 60, 60).outer,))
    shot = made(width=100, height=100, region=shapely.box(20, 20, 80, 80))
    (back,) = shot.polygons(shot.raster([shape]), grow=0.0)
    assert len(back.holes) == 1
    assert iou([back], [shape]) > 0.98


def test_points_are_within_a_mask_or_beyond_the_photograph():
    # One metre ahead, 100 px a metre: columns 150, 10 and -50 of a photograph 200 px wide; the last is behind.
    points = np.array([[0.5, 0.0, 1.0], [-0.9, 0.0, 1.0], [-1.5, 0.0, 1.0], [0.0, 0.0, -1.0]])
    shot = made(width=200, height=100, region=shapely.box(140, 40, 160, 60), points=points)
    inside = shot.raster([square(140, 40, 160, 60)])
    # In the mask; in the photograph far from it; where the photograph says nothing, twice.
    assert shot.within(inside).tolist() == [True, False, True, True]
    assert shot.within(np.zeros_like(inside)).tolist() == [False, False, True, True]


def test_squares_are_so_large_that_a_grid_of_points_fills_them():
    spacing = 0.01
    grid = np.arange(-0.1, 0.1, spacing)
    points = np.stack(np.meshgrid(grid, grid, [1.0]), axis=-1).reshape(-1, 3)
    shot = made(width=200, height=100, region=shapely.box(90, 40, 110, 60), points=points)
    cells = shot.cells(spacing)
    mask = shot.raster([square(91, 41, 109, 59)])
    of_points, of_mask = cells.of_points(np.ones(len(points), dtype=np.bool_)), cells.of_mask(mask)
    assert of_mask.any()
    assert not (of_mask & ~of_points).any()
    assert (cells.pixels(of_mask) & mask).sum() == mask.sum()
