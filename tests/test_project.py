"""The project's own files: what gets installed, what the pages promise, and what must not be committed."""

import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
from packaging.requirements import Requirement

import ars_web

CHECKOUT = Path(__file__).parents[1]

NOT_OURS = {".git", ".venv", ".hypothesis", "build", "dist", "demo-output", "node_modules", "sessions"}
"""Folders at the root that hold what tools or users put there."""

FOREIGN_TRACES = re.compile(
    r"(?:extra-)?index-url|find-links|https?://[^/\s]*(?:pypi|npm|registry|mirror|deb\.)[^/\s]*|"
    r"(?<![\w.])/(?:root|home/(?!ars\b)\w+|Users/\w+|work)/"
)
"""Addresses of package indexes, and paths that exist on one machine only."""


def own_files(*suffixes: str) -> Iterator[Path]:
    for folder, folders, names in os.walk(CHECKOUT):
        at_root = Path(folder) == CHECKOUT
        folders[:] = [
            name
            for name in folders
            if not (at_root and name in NOT_OURS) and not name.endswith(("__pycache__", "_cache", ".egg-info"))
        ]
        yield from (Path(folder) / name for name in names if not suffixes or Path(name).suffix in suffixes)


def project() -> dict[str, object]:
    return tomllib.loads((CHECKOUT / "pyproject.toml").read_text())["project"]


def pages() -> list[Path]:
    return sorted(own_files(".md"))


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel that `pip install .` would install, built from a copy so that nothing is left in the checkout."""
    source, built = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("wheel")
    for name in ("pyproject.toml", "setup.py", "README.md", "LICENSE"):
        shutil.copy(CHECKOUT / name, source)
    for name in ("ars_web", "static"):
        shutil.copytree(CHECKOUT / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    line = ["-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--no-index", "--wheel-dir", built]
    subprocess.run([sys.executable, *map(str, [*line, source])], check=True, capture_output=True)
    (path,) = built.glob("*.whl")
    return path


def test_the_wheel_holds_the_whole_program(wheel: Path) -> None:
    held = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    program = {
        path.relative_to(CHECKOUT).as_posix() for path in own_files() if path.is_relative_to(CHECKOUT / "ars_web")
    }
    static = CHECKOUT / "static"
    page = {f"ars_web/static/{path.relative_to(static).as_posix()}" for path in static.rglob("*") if path.is_file()}
    assert page
    assert held == program | page


def test_the_installed_program_finds_its_page_and_its_migrations(wheel: Path, tmp_path: Path) -> None:
    installed, scene = tmp_path / "installed", tmp_path / "scene"
    zipfile.ZipFile(wheel).extractall(installed)
    (scene / "images").mkdir(parents=True)
    cv2.imwrite(str(scene / "images" / "0.jpg"), np.zeros((48, 64, 3), dtype=np.uint8))
    (scene / "robot_poses.txt").write_text("0 0 0 0 0 0 1\n")
    (scene / "camera_extrinsics.txt").write_text("0 0 0 0 0 0 1\n")
    (scene / "camera_intrinsics.txt").write_text("64 48 60 60 31.5 23.5 0 0 0 0\n")
    environment = {**os.environ, "PYTHONPATH": str(installed)}

    def run(*arguments: str) -> str:
        line = [sys.executable, "-m", "ars_web", *arguments]
        return subprocess.run(line, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True).stdout

    run("import", "scene")
    found = {finding["subject"]: finding["found"] for finding in json.loads(run("check", "--json"))}
    assert found["page"] == str(installed / "ars_web" / "static")
    assert found["sessions"] == "1, all sound"


def test_the_readme_names_every_part_of_the_program() -> None:
    readme = (CHECKOUT / "README.md").read_text()
    folder_map = readme.partition("## Folder map")[2].partition("## ")[0]
    package = CHECKOUT / "ars_web"
    parts = {path.relative_to(package).parts[0] for path in own_files() if path.is_relative_to(package)}
    assert {part for part in parts if not part.startswith("__") and part not in folder_map} == set()


def test_every_dependency_is_pinned_within_its_range() -> None:
    lines = [line for line in (CHECKOUT / "constraints.txt").read_text().splitlines() if not line.startswith("#")]
    assert lines == sorted(lines, key=str.lower)
    pinned: dict[str, str] = {}
    for line in lines:
        name, version = re.fullmatch(r"([\w.-]+)==([\w.+!]+)", line).groups()
        pinned[re.sub(r"[-_.]+", "-", name).lower()] = version
    table = project()
    wanted = [Requirement(line) for line in [*table["dependencies"], *table["optional-dependencies"]["dev"]]]
    unmet = [str(r) for r in wanted if not r.specifier.contains(pinned.get(r.name.lower(), "0"))]
    assert unmet == []


def test_the_changelog_tells_of_this_version() -> None:
    headings = re.findall(r"^## \[(.+?)\]", (CHECKOUT / "CHANGELOG.md").read_text(), flags=re.MULTILINE)
    assert ars_web.__version__ in headings


def test_every_command_and_option_is_documented() -> None:
    spec = importlib.util.spec_from_file_location("command_line", CHECKOUT / "docs" / "command_line.py")
    command_line = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(command_line)
    assert (CHECKOUT / "docs" / "command-line.md").read_text() == command_line.page(), (
        "run: python docs/command_line.py > docs/command-line.md"
    )


@pytest.mark.parametrize("page", pages(), ids=lambda page: str(page.relative_to(CHECKOUT)))
def test_a_page_names_only_what_is_there(page: Path) -> None:
    text = page.read_text()
    reference = (CHECKOUT / "docs" / "command-line.md").read_text()
    commands = re.findall(r"^## (\w+)", reference, flags=re.MULTILINE)
    options = re.findall(r"--[\w-]+", reference)
    targets = re.findall(r"^(\w+):", (CHECKOUT / "Makefile").read_text(), flags=re.MULTILINE)
    links = re.findall(r"\]\((?!https?://|#)([^)#]+)", text)
    assert [link for link in links if not (page.parent / link).exists()] == []
    for block in re.findall(r"```(?:sh)?\n(.*?)```|`([^`\n]+)`", text, flags=re.DOTALL):
        for line in "".join(block).splitlines():
            called = re.match(r"(?:\$ )?ars-web ([a-z]\w*)(.*)", line)
            if called:
                assert called[1] in commands, line
                assert [o for o in re.findall(r"--[\w-]+", called[2].partition("#")[0]) if o not in options] == [], line
            made = re.match(r"(?:\$ )?make (\w+)", line)
            if made:
                assert made[1] in targets, line


def test_no_file_names_a_machine_or_a_package_index() -> None:
    found: list[str] = []
    for path in own_files():
        if path == Path(__file__) or path.suffix in {".png", ".jpg", ".ico", ".woff2"}:
            continue
        # Golden files of some formats are no text, but may hold some.
        for number, line in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), start=1):
            if FOREIGN_TRACES.search(line):
                found.append(f"{path.relative_to(CHECKOUT)}:{number}: {line.strip()[:80]}")
    assert found == []


def test_no_source_file_is_longer_than_500_lines() -> None:
    lengths = {path: len(path.read_text().splitlines()) for path in own_files(".py", ".js", ".css")}
    assert {str(path): length for path, length in lengths.items() if length > 500} == {}


def test_ci_runs_what_the_readme_says() -> None:
    ci = (CHECKOUT / ".ci" / "run").read_text()
    assert "make check" in ci
    assert "make test" in ci
    assert os.access(CHECKOUT / ".ci" / "run", os.X_OK)
    assert "make test" in (CHECKOUT / "README.md").read_text()


def test_the_image_is_built_only_from_what_is_let_in() -> None:
    allowed = {line[1:] for line in (CHECKOUT / ".dockerignore").read_text().splitlines() if line.startswith("!")}
    copied = {
        name
        for line in re.findall(r"^COPY (?!--from)(.+)$", (CHECKOUT / "Dockerfile").read_text(), flags=re.MULTILINE)
        for name in line.split()[:-1]
    }
    assert copied == allowed
    assert all((CHECKOUT / name).exists() for name in copied)
