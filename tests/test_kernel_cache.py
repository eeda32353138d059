"""Where compiled kernels go; a path below a file stands for a folder that cannot be written, for root too."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from ars_web.kernel_cache import VARIABLE, find_place


@pytest.fixture
def closed(tmp_path: Path) -> Path:
    (tmp_path / "file").touch()
    return tmp_path / "file" / "folder"


@pytest.mark.parametrize("open_one", ["given", "package", "home"])
def test_a_place_that_can_be_written_is_left_to_numba(closed: Path, tmp_path: Path, open_one: str) -> None:
    places = {name: str(closed) for name in ("given", "package", "home")} | {open_one: str(tmp_path / "new" / "one")}
    environment = {VARIABLE: places["given"], "HOME": places["home"]}
    find_place(environment, package=Path(places["package"]))
    assert environment == {VARIABLE: places["given"], "HOME": places["home"]}


def test_without_any_place_one_is_made_for_this_process_alone(closed: Path) -> None:
    environment = {"HOME": str(closed)}
    find_place(environment, package=closed)
    made = Path(environment[VARIABLE])
    assert made.is_dir()
    assert made.stat().st_mode & 0o777 == 0o700


def test_the_place_goes_with_the_process(closed: Path) -> None:
    code = (
        "import sys; from pathlib import Path; from ars_web.kernel_cache import *;"
        " env = {'HOME': sys.argv[1]}; find_place(env, package=Path(sys.argv[1])); print(env[VARIABLE])"
    )
    environment = {key: value for key, value in os.environ.items() if key != VARIABLE}
    line = [sys.executable, "-c", code, str(closed)]
    done = subprocess.run(line, capture_output=True, text=True, check=True, env=environment)
    assert not Path(done.stdout.strip()).exists()
