"""How far a bent line leaves its chord is bounded, and what is drawn keeps to its tolerance."""

import numpy as np
import pytest
from shapely.geometry import Polygon

from ars_web.geometry import camera as cameras
from ars_web.geometry.labels import outline
from ars_web.geometry.lens import BINS, lens_tables


@pytest.mark.parametrize("first", range(0, 100, 20))
def test_no_line_leaves_its_chord_further_than_the_bound(random_scene, first: int):
    for seed in range(first, first + 20):
        camera = random_scene(seed)[0]
        random = np.random.default_rng(seed)
        tables = lens_tables(camera)
        reach = 0.999 * min(camera.valid_radius, 8.0)
        angle, radius = random.uniform(0, 2 * np.pi, (2, 60)), reach * np.sqrt(random.uniform(size=(2, 60)))
        starts, ends = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
        t = np.linspace(0, 1, 201)[:, None]
        for a, b in zip(starts, ends, strict=True):
            curve = cameras.pixels_from_normalised(camera, (1 - t) * a + t * b)
            chord = curve[-1] - curve[0]
            length = np.linalg.norm(chord)
            across = np.array([-chord[1], chord[0]]) / length
            leaves = np.abs((curve - curve[0]) @ across).max()
            straight = curve[0] + t * chord
            strays = np.linalg.norm(curve - straight, axis=1).max()
            radii = np.linalg.norm((1 - t) * a + t * b, axis=1)
            low, high = (bin_of(tables.lens.rim, tables.lens.bins_per_e, r) for r in (radii.min(), radii.max()))
            bound = min(tables.bends[0, high], tables.bends[1, low])
            square = np.sum((b - a) ** 2) / 8
            assert leaves <= bound * square + 1e-9, f"camera {seed}"
            assert strays <= tables.bends[2, high] * square + 1e-9, f"camera {seed}"


def bin_of(rim: float, bins_per_e: float, radius: float) -> int:
    return int(np.clip(np.floor(BINS + np.log(max(radius, 1e-30) / rim) * bins_per_e), 0, BINS - 1))


@pytest.mark.parametrize("tolerance", [1.0, 0.1, 0.02])
def test_what_is_drawn_keeps_to_its_tolerance(random_scene, tolerance: float):
    compared = 0
    for seed in range(60):
        camera, T_world_camera, box = random_scene(seed)
        fine = outline(camera, T_world_camera, box, tolerance=0.002)
        coarse = outline(camera, T_world_camera, box, tolerance=tolerance)
        if len(fine) == 0 or len(coarse) == 0:
            continue
        compared += 1
        off = Polygon(fine).exterior.hausdorff_distance(Polygon(coarse).exterior)
        assert off <= 1.05 * tolerance + 0.01, f"scene {seed}"
        assert len(coarse) <= len(fine)
    assert compared > 25


def test_a_pinhole_bends_nothing(random_scene):
    pinholes = [camera for camera in (random_scene(seed)[0] for seed in range(30)) if camera.model == "pinhole"]
    assert pinholes
    for camera in pinholes:
        assert not lens_tables(camera).bends.any()
