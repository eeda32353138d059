import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ars_web.errors import BadFile, BadInput, Cancelled, RefusedPath
from ars_web.recordings.registry import READERS, ReadOptions, detect_formats, read_recording


def format_of(form: str) -> str:
    return form.removesuffix("_binary")


def test_every_form_is_the_same_recording(written, truth, form: str) -> None:
    recording = read_recording(written(form))
    assert recording.format == format_of(form)
    assert recording.cameras == {0: truth.camera}
    assert [frame.name for frame in recording.frames] == truth.names
    assert all(frame.image.is_absolute() and frame.image.is_file() for frame in recording.frames)
    assert all(frame.camera_id == 0 for frame in recording.frames)
    assert recording.skipped == ()
    np.testing.assert_allclose(recording.Ts_world_camera, truth.Ts, rtol=0, atol=1e-9)


def test_every_form_is_found_by_looking(written, form: str) -> None:
    assert detect_formats(written(form)) == [format_of(form)]


def test_every_reader_has_a_form(written) -> None:
    forms = {"ars", "roars", "tum", "colmap", "nerfstudio", "poses"}
    # BOP names images by their numbers and has no distortion: test_bop.py has a form of its own for it.
    assert set(READERS) == forms | {"bop"}
    assert all(reader.format == key for key, reader in READERS.items())


def test_every_form_stays_within(written, form: str, tmp_path: Path) -> None:
    path = written(form)
    assert len(read_recording(path, options=ReadOptions(within=tmp_path)).frames) == 6


def test_every_form_refuses_an_image_that_is_a_link_out(
    written, form: str, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = written(form)
    image = next(tmp_path.rglob("frame_003.png"))
    outside = tmp_path_factory.mktemp("outside") / "secret.png"
    shutil.move(image, outside)
    image.symlink_to(outside)
    with pytest.raises(RefusedPath, match=r"frame_003\.png leads outside"):
        read_recording(path, options=ReadOptions(within=tmp_path))
    assert len(read_recording(path).frames) == 6


def test_every_form_refuses_an_image_folder_that_leads_out(
    written, form: str, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = written(form)
    folder = next(tmp_path.rglob("images"))
    outside = tmp_path_factory.mktemp("outside") / "images"
    shutil.move(folder, outside)
    folder.symlink_to(outside)
    with pytest.raises(RefusedPath, match="leads outside"):
        read_recording(path, options=ReadOptions(within=tmp_path))


def test_every_form_takes_another_image_folder(written, form: str, tmp_path: Path) -> None:
    path = written(form)
    elsewhere = tmp_path / "elsewhere"
    shutil.move(next(tmp_path.rglob("images")), elsewhere)
    recording = read_recording(path, options=ReadOptions(images=elsewhere))
    assert len(recording.frames) == 6
    assert {frame.image.parent for frame in recording.frames} == {elsewhere}


def test_every_form_skips_an_image_of_another_size(written, form: str, tmp_path: Path, image_writer) -> None:
    path = written(form)
    image_writer(next(tmp_path.rglob("frame_002.png")), (32, 48))
    recording = read_recording(path)
    assert len(recording.frames) == 5
    assert [frame.name for frame in recording.skipped] == ["frame_002.png"]
    assert "32 x 48 pixels, its camera 64 x 48" in recording.skipped[0].reason
    assert recording.skipped[0].where


def test_every_form_skips_an_image_that_is_none(written, form: str, tmp_path: Path) -> None:
    path = written(form)
    next(tmp_path.rglob("frame_002.png")).write_bytes(b"GIF89a")
    recording = read_recording(path)
    assert [frame.name for frame in recording.skipped] == ["frame_002.png"]
    assert "neither a PNG nor a JPEG" in recording.skipped[0].reason


def test_a_recording_without_a_usable_frame_is_an_error(written, form: str, tmp_path: Path) -> None:
    path = written(form)
    for image in tmp_path.rglob("frame_*.png"):
        image.write_bytes(b"")
    with pytest.raises(BadFile, match=r"none of its 6 frames can be used; the first: frame_000\.png: .* empty"):
        read_recording(path)


def test_two_formats_in_one_folder_are_ambiguous(written, truth, tmp_path: Path) -> None:
    folder = written("ars")
    truth.nerfstudio(folder)
    with pytest.raises(BadInput, match=r"could be ars or nerfstudio; say which with the format"):
        read_recording(folder)
    assert read_recording(folder, format="ars").format == "ars"
    assert read_recording(folder, format="nerfstudio").format == "nerfstudio"
    assert read_recording(folder / "transforms.json").format == "nerfstudio"


def test_a_subfolder_does_not_make_a_folder_ambiguous(written, truth) -> None:
    folder = written("ars")
    truth.tum(folder / "formats")
    assert read_recording(folder).format == "ars"


def test_a_file_is_known_by_its_content_not_its_name(written, tmp_path: Path) -> None:
    folder = written("tum")
    renamed = (folder / "trajectory.txt").rename(folder / "poses.txt")
    assert detect_formats(renamed) == ["tum"]
    assert detect_formats(folder) == ["tum"]
    assert len(read_recording(folder).frames) == 6


def test_an_unknown_format_names_those_that_are_known(tmp_path: Path) -> None:
    with pytest.raises(
        BadInput, match=r"'kitti' is unknown; known are auto, ars, roars, tum, colmap, nerfstudio, bop, poses"
    ):
        read_recording(tmp_path, format="kitti")


@pytest.mark.parametrize("format", ["auto", *READERS])
def test_nothing_there(tmp_path: Path, format: str) -> None:  # noqa: A002 - the option's own name
    with pytest.raises(BadFile, match="nowhere: is missing"):
        read_recording(tmp_path / "nowhere", format=format)


def test_an_empty_folder_is_no_recording(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"is no recording that is known\. Known are: ars: .*poses: "):
        read_recording(tmp_path)


@pytest.mark.parametrize("format", READERS)
def test_an_empty_folder_as_any_format(tmp_path: Path, format: str) -> None:  # noqa: A002 - the option's own name
    with pytest.raises(BadFile, match=str(tmp_path)):
        read_recording(tmp_path, format=format)


@pytest.mark.parametrize("format", READERS)
def test_an_image_as_any_format(tmp_path: Path, image_writer: Callable[..., Path], format: str) -> None:  # noqa: A002
    with pytest.raises(BadFile, match=r"image\.png"):
        read_recording(image_writer(tmp_path / "image.png"), format=format)


def test_an_image_is_no_recording(tmp_path: Path, image_writer: Callable[..., Path]) -> None:
    with pytest.raises(BadInput, match="is no recording"):
        read_recording(image_writer(tmp_path / "image.png"))


def test_a_recording_outside_is_refused(written, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    path = written("ars")
    with pytest.raises(RefusedPath):
        read_recording(path, options=ReadOptions(within=tmp_path_factory.mktemp("root")))


def test_a_named_camera_outside_is_refused(written, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    path = written("tum")
    camera = tmp_path_factory.mktemp("outside") / "camera.txt"
    shutil.copy(path / "camera_intrinsics.txt", camera)
    with pytest.raises(RefusedPath, match=r"camera\.txt leads outside"):
        read_recording(path, options=ReadOptions(camera=camera, within=tmp_path))


def test_poses_cannot_be_written_to(written) -> None:
    frame = read_recording(written("ars")).frames[0]
    with pytest.raises(ValueError, match="read-only"):
        frame.T_world_camera[0, 0] = 2.0


def test_what_the_file_system_refuses_is_named(tmp_path: Path) -> None:
    unthinkable = tmp_path / ("x" * 300)
    with pytest.raises(BadFile, match="xxx: cannot be read: File name too long"):
        read_recording(unthinkable)
    with pytest.raises(BadFile, match="cannot be read: File name too long"):
        detect_formats(unthinkable)


def test_a_nul_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RefusedPath, match="has a NUL in it"):
        read_recording(tmp_path / "a\0b")


def test_every_form_tells_how_far_it_is(written, form: str) -> None:
    told: list[tuple[int, int]] = []
    read_recording(written(form), options=ReadOptions(progress=lambda done, total: told.append((done, total))))
    assert told == [(done, 6) for done in range(1, 7)]


def test_what_progress_raises_stops_the_reading(written, form: str) -> None:
    told: list[int] = []

    def stop(done: int, total: int) -> None:
        told.append(done)
        if done == 3:
            raise Cancelled("enough")

    with pytest.raises(Cancelled):
        read_recording(written(form), options=ReadOptions(progress=stop))
    assert told == [1, 2, 3]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("/data/root/scene/poses.txt:3: is not a number", "scene/poses.txt:3: is not a number"),
        ("/data/root: is missing", "the folder: is missing"),
        ("/data/root/x leads outside /data/root, and nothing", "x leads outside the folder, and nothing"),
        ("it could be in /data/root.", "it could be in the folder."),
        ("('/data/root/x')", "('x')"),
        ("/data/rooted/x and /mnt/data/root/x and /data/root.old/x", None),
        ("/data/other", None),
    ],
)
def test_paths_are_told_from_where_one_may_look(text: str, told: str | None) -> None:
    assert ReadOptions(within=Path("/data/root")).told(text) == (text if told is None else told)
    assert ReadOptions().told(text) == text
