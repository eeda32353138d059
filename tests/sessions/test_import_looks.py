"""Looking at a recording before it is imported."""

import shutil
from pathlib import Path

import pytest

from ars_web.errors import BadFile, BadInput, NotFound, RefusedPath
from ars_web.recordings.options import ReadOptions
from ars_web.sessions import import_looks
from ars_web.sessions.import_looks import ImportLooks


@pytest.fixture
def scene(demo_recording, tmp_path: Path) -> Path:
    return Path(shutil.copytree(demo_recording.folder, tmp_path / "scene"))


def test_a_look_shows_what_there_is(scene: Path, demo_recording) -> None:
    looks = ImportLooks()
    look = looks.look(scene, options=ReadOptions(within=scene.parent))
    assert (look.recording.format, look.formats_possible, look.warnings) == ("ars", ("ars",), ())
    assert len(look.recording.frames) == len(demo_recording.image_names)
    for frame in look.overview.sample_frames:
        image = looks.image(look.id, frame)
        assert image.path == scene / "images" / demo_recording.image_names[frame]
        assert image.camera == look.recording.cameras[0]
    with pytest.raises(NotFound, match="no sample"):
        looks.image(look.id, 10_000)


def test_of_several_formats_the_first_that_can_be_read_is_taken(scene: Path) -> None:
    # As if someone kept a TUM trajectory of some other time beside it.
    (scene / "other.txt").write_text("0.0 0 0 0 0 0 0 1\n")
    options = ReadOptions(within=scene)
    look = ImportLooks().look(scene, options=options)
    assert (look.recording.format, look.formats_possible) == ("ars", ("ars", "tum"))
    assert look.warnings == ("it was read as ars, and could also be tum: say which it is",)
    assert ImportLooks().look(scene, format="ars", options=options).warnings == ()
    with pytest.raises(BadInput, match="1 poses for 9 images"):
        ImportLooks().look(scene, format="tum", options=options)
    (scene / "camera_extrinsics.txt").unlink()
    with pytest.raises(BadFile, match=r"camera_extrinsics\.txt: is missing"):
        ImportLooks().look(scene, options=options)


def test_nothing_outside_is_looked_at(scene: Path, tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    with pytest.raises(RefusedPath):
        ImportLooks().look(scene, options=ReadOptions(within=tmp_path / "other"))


def test_looks_are_forgotten(scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(import_looks, "REMEMBERED", 2)
    looks = ImportLooks()
    first, *others = (looks.look(scene, options=ReadOptions()).id for _ in range(3))
    with pytest.raises(NotFound, match="look at the recording again"):
        looks.image(first, 0)
    assert all(looks.image(id_, 0).path.is_file() for id_ in others)
