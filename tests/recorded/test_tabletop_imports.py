"""The five forms of the recorded table top are one recording: same cameras, same poses, same images."""

import json
from pathlib import Path

import numpy as np
import pytest

from ars_web.errors import BadInput
from ars_web.recordings.recording import Recording
from ars_web.recordings.registry import detect_formats, read_recording

DATA = Path(__file__).parents[3] / "shared" / "data"
TABLETOP = DATA / "tabletop"
FORMATS = TABLETOP / "formats"
FORMS = {
    "ars": TABLETOP,
    "tum": FORMATS / "tum.txt",
    "nerfstudio": FORMATS / "transforms.json",
    "colmap": FORMATS / "colmap",
    "colmap_text": FORMATS / "colmap_text",
}


@pytest.fixture(scope="module")
def recordings() -> dict[str, Recording]:
    return {form: read_recording(path) for form, path in FORMS.items()}


@pytest.mark.parametrize("form", FORMS)
def test_every_form_is_found_by_looking(form: str) -> None:
    assert detect_formats(FORMS[form]) == [form.removesuffix("_text")]


@pytest.mark.parametrize("form", FORMS)
def test_every_form_gives_the_same_poses(recordings: dict[str, Recording], form: str) -> None:
    ours, first = recordings[form], recordings["ars"]
    assert len(ours.frames) == 99
    assert ours.skipped == ()
    np.testing.assert_allclose(ours.Ts_world_camera, first.Ts_world_camera, rtol=0, atol=1e-6)


@pytest.mark.parametrize("form", FORMS)
def test_every_form_gives_the_same_camera(recordings: dict[str, Recording], form: str) -> None:
    camera, first = recordings[form].cameras[0], recordings["ars"].cameras[0]
    assert list(recordings[form].cameras) == [0]
    assert (camera.width, camera.height, camera.model) == (640, 480, "pinhole")
    np.testing.assert_allclose(camera.K, first.K, rtol=0, atol=1e-6)


@pytest.mark.parametrize("form", FORMS)
def test_every_form_names_the_same_images(recordings: dict[str, Recording], form: str) -> None:
    assert [frame.name for frame in recordings[form].frames] == [f"rgb_{i:05d}.jpg" for i in range(99)]
    assert [frame.image for frame in recordings[form].frames] == [frame.image for frame in recordings["ars"].frames]


def test_the_folder_of_formats_is_ambiguous() -> None:
    with pytest.raises(BadInput, match="could be tum or nerfstudio"):
        read_recording(FORMATS)


def test_cell_is_what_its_truth_says() -> None:
    cell = read_recording(DATA / "cell")
    truth = json.loads((DATA / "cell" / "truth" / "truth.json").read_text())
    assert cell.skipped == ()
    Ts = [frame["T_world_camera"] for frame in truth["frames"]]
    np.testing.assert_allclose(cell.Ts_world_camera, Ts, rtol=0, atol=1e-6)
    camera = cell.cameras[0]
    assert camera.model == "brown"
    np.testing.assert_allclose(camera.K, truth["K"], rtol=0, atol=1e-6)
    np.testing.assert_allclose(camera.distortion, [*truth["dist"], 0.0], rtol=0, atol=1e-9)
