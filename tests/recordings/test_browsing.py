"""Folders to choose a recording from."""

import os
from pathlib import Path

import pytest

from ars_web.errors import BadFile
from ars_web.recordings import browsing
from ars_web.recordings.browsing import BrowsedFile, BrowsedFolder, browse


def test_every_form_is_found(written, form: str, tmp_path: Path) -> None:
    path = written(form)
    here = path if path.is_dir() else path.parent
    found = browse(here, within=tmp_path)
    expected = form.removesuffix("_binary")
    by_file = {name for file in found.files for name in file.formats}
    assert expected in {*found.formats, *by_file}
    if path.is_file():
        assert BrowsedFile(path.name, (expected,)) in found.files


def test_folders_are_named_with_what_they_may_be(written, tmp_path: Path) -> None:
    scene = written("ars")
    (scene / ".hidden").mkdir()
    (scene / "empty").mkdir()
    parent = browse(scene.parent, within=tmp_path)
    # Its images lie in images/, which a person thinks of as the recording's.
    assert BrowsedFolder(scene.name, ("ars",), 6) in parent.folders
    found = browse(scene, within=tmp_path)
    assert found.formats == ("ars",)
    assert found.folders == (BrowsedFolder("empty", (), 0), BrowsedFolder("images", (), 6))
    assert (found.images, found.more) == (0, False)
    assert browse(scene / "images", within=tmp_path).images == 6


def test_links_that_lead_out_are_left_out(tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    outside = tmp_path_factory.mktemp("outside")
    (outside / "robot_poses.txt").write_text("0 0 0 0 0 0 1\n")
    (outside / "poses.txt").write_text("1 0 0 0 0 1 0 0 0 0 1 0\n")
    (tmp_path / "inside").mkdir()
    (tmp_path / "way-out").symlink_to(outside)
    (tmp_path / "poses.txt").symlink_to(outside / "poses.txt")
    (tmp_path / "way-in").symlink_to(tmp_path / "inside")
    (tmp_path / "round").symlink_to(tmp_path / "round")
    (tmp_path / "to-nothing.txt").symlink_to(tmp_path / "nothing")
    found = browse(tmp_path, within=tmp_path)
    assert [folder.name for folder in found.folders] == ["inside", "way-in"]
    assert found.files == ()


def test_a_listing_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(browsing, "MOST_FOLDERS", 3)
    for name in ("d", "a", "c", "b"):
        (tmp_path / name).mkdir()
    found = browse(tmp_path, within=tmp_path)
    assert ([folder.name for folder in found.folders], found.more) == (["a", "b", "c"], True)


def test_images_are_counted_by_name_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    images = tmp_path / "images"
    images.mkdir()
    for i in range(500):
        (images / f"{i:05d}.JPG").touch()
    asked: list[object] = []
    stat = os.stat
    monkeypatch.setattr(os, "stat", lambda path, *a, **k: asked.append(path) or stat(path, *a, **k))
    assert browse(tmp_path, within=tmp_path).folders == (BrowsedFolder("images", (), 500),)
    assert browse(images, within=tmp_path).images == 500
    assert not [path for path in asked if str(path).endswith(".JPG")]


def test_a_folder_of_label_files_is_not_read_through(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for i in range(5):
        (tmp_path / f"{i}.txt").write_text("0 0 0 0 0 0 0 1\n")
    assert browse(tmp_path, within=tmp_path).formats == ("tum",)
    monkeypatch.setattr(browsing, "MOST_TEXTS", 4)
    found = browse(tmp_path, within=tmp_path)
    assert (found.formats, found.files) == ((), ())


def test_a_file_too_large_for_a_manifest_is_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "some.json").write_text('{"frames": [{"transform_matrix": []}]}')
    assert browse(tmp_path, within=tmp_path).files == (BrowsedFile("some.json", ("nerfstudio",)),)
    monkeypatch.setattr(browsing, "MOST_BYTES", 10)
    assert browse(tmp_path, within=tmp_path).files == ()


def test_a_name_that_is_no_text_is_left_out(tmp_path: Path) -> None:
    os.mkdir(os.fsencode(tmp_path) + b"/bad\xff")  # noqa: PTH102 - bytes
    (tmp_path / "größe").mkdir()
    assert [folder.name for folder in browse(tmp_path, within=tmp_path).folders] == ["größe"]


def test_a_file_is_no_folder(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(BadFile, match="file: the folder cannot be read: Not a directory"):
        browse(tmp_path / "file", within=tmp_path)


def test_a_folder_that_cannot_be_read_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Permissions do not hold for root, who runs these tests in many places."""
    (tmp_path / "closed").mkdir()
    scandir = os.scandir

    def refuse(path):
        if Path(path).name == "closed":
            raise PermissionError(13, "Permission denied", str(path))
        return scandir(path)

    monkeypatch.setattr(os, "scandir", refuse)
    (closed,) = browse(tmp_path, within=tmp_path).folders
    assert closed == BrowsedFolder("closed", (), 0, "cannot be read: Permission denied")
