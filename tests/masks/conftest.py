"""The painted recording round a ball, as propagation takes it, and as a session."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from ars_web.geometry.polygon import Polygon
from ars_web.geometry.visual_hull import View
from ars_web.masks.views import Photographs
from ars_web.recordings.images import read_image
from ars_web.recordings.registry import read_recording
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.model import FrameTable
from ars_web.sessions.store import SessionStore


@dataclass(frozen=True)
class Painted:
    """A recording with its object's true outlines."""

    taken: Photographs
    ring: ModuleType

    def read(self, frame: int) -> np.ndarray:
        return read_image(self.taken.frames.images[frame])

    def view(self, frame: int) -> View:
        """The ball's true outline."""
        camera = self.taken.cameras[0]
        return View(frame, camera, self.taken.frames.Ts_world_camera[frame], (Polygon(self.ring.outline(frame)),))


@pytest.fixture(scope="session")
def painted_folder(tmp_path_factory: pytest.TempPathFactory, ring_scene: ModuleType, painted_ring: ModuleType) -> Path:
    return painted_ring.write(ring_scene, tmp_path_factory.mktemp("painted") / "ring")


@pytest.fixture(scope="session")
def painted(painted_folder: Path, ring_scene: ModuleType) -> Painted:
    recording = read_recording(painted_folder)
    frames = recording.frames
    table = FrameTable(
        tuple(frame.name for frame in frames),
        tuple(frame.image for frame in frames),
        np.array([frame.camera_id for frame in frames]),
        np.array([frame.T_world_camera for frame in frames]),
    )
    return Painted(Photographs(recording.cameras, table), ring_scene)


@pytest.fixture
def painted_store(tmp_path: Path) -> Iterator[SessionStore]:
    with SessionStore(tmp_path / "sessions") as store:
        yield store


@pytest.fixture
def painted_editor(painted_store: SessionStore) -> SessionEditor:
    return SessionEditor(painted_store)


@pytest.fixture
def painted_sid(painted_store: SessionStore, painted_folder: Path) -> str:
    """A session of the painted recording with the class `ball`, of id 0."""
    return painted_store.create(read_recording(painted_folder), name="ring", class_names=("ball",)).id
