"""`safe_join`: what is below a root, and nothing else."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ars_web.api.roots import safe_join
from ars_web.errors import NotFound, RefusedPath


@pytest.fixture
def root(tmp_path: Path) -> Path:
    inside = tmp_path / "root"
    (inside / "scene" / "images").mkdir(parents=True)
    (inside / "scene" / "poses.txt").write_text("inside")
    (tmp_path / "secret").mkdir()
    (tmp_path / "secret" / "poses.txt").write_text("outside")
    (inside / "way-out").symlink_to(tmp_path / "secret")
    (inside / "file-out").symlink_to(tmp_path / "secret" / "poses.txt")
    (inside / "way-in").symlink_to(inside / "scene")
    (inside / "round").symlink_to(inside / "round")
    return inside


@pytest.mark.parametrize("relative", ["scene", "scene/", "./scene", "scene//images", "way-in/poses.txt", "", "."])
def test_what_is_below_the_root_is_found(root: Path, relative: str) -> None:
    found = safe_join(root, relative)
    assert found.is_relative_to(root)
    assert found == found.resolve()


@pytest.mark.parametrize(
    "relative",
    [
        "/etc/passwd",
        "//etc/passwd",
        "..",
        "../secret",
        "scene/../../secret",
        "scene/..",
        "way-out",
        "way-out/poses.txt",
        "file-out",
        "scene\\..\\..\\secret",
        "scene\0/../../secret",
        "\0",
    ],
)
def test_what_leaves_the_root_is_refused(root: Path, relative: str) -> None:
    with pytest.raises(RefusedPath):
        safe_join(root, relative)


@pytest.mark.parametrize("relative", ["nothing", "scene/poses.txt/more", "round", "x" * 5000, "~", "%2e%2e/secret"])
def test_what_is_not_there_is_not_found(root: Path, relative: str) -> None:
    with pytest.raises(NotFound):
        safe_join(root, relative)


@given(st.lists(st.sampled_from(["..", ".", "scene", "way-out", "way-in", "/", "//", "poses.txt", "", "\\", "secret"])))
def test_no_path_made_of_such_parts_leaves_the_root(tmp_path_factory: pytest.TempPathFactory, parts: list[str]) -> None:
    folder = tmp_path_factory.getbasetemp() / "joined"
    root = folder / "root"
    if not root.exists():
        (root / "scene").mkdir(parents=True)
        (root / "scene" / "poses.txt").write_text("inside")
        (folder / "secret").mkdir()
        (root / "way-out").symlink_to(folder / "secret")
        (root / "way-in").symlink_to(root / "scene")
    try:
        found = safe_join(root, "/".join(parts))
    except (RefusedPath, NotFound):
        return
    assert found.resolve().is_relative_to(root.resolve())
