"""The demo's scene, to be looked at again."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from ars_web.demo import building, rendering, scene
from ars_web.demo.rendering import Sight


@pytest.fixture(scope="session")
def things():
    return scene.things()


@pytest.fixture(scope="session")
def parts(things):
    return building.place(things, desk=scene.desk())


@pytest.fixture(scope="session")
def world(things):
    """The lit scene, for tests that make many recordings."""
    with ThreadPoolExecutor(2) as executor:
        return building.lit_world(things, desk=scene.desk(), executor=executor, meanwhile=rendering.compile_kernels)


@pytest.fixture(scope="session")
def sights(demo_recording, parts) -> list[Sight]:
    """What every pixel of every frame of the demo recording sees."""
    rays = rendering.ray_table(demo_recording.camera)
    return [rendering.look(parts, rays, np.array(T)) for T in demo_recording.Ts_world_camera]
