"""What every test stands on: shapes checked at run time, and the recorded data where it is present."""

import importlib.util
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import IO

import pytest
from hypothesis import settings
from jaxtyping import install_import_hook
from xdist.remote import Producer
from xdist.scheduler import LoadFileScheduling

# Property tests look at what is answered, not at how busy the machine is. They try the same cases every time, so that
# what a change breaks is told from what was always so; `--hypothesis-profile=search` tries others on purpose.
settings.register_profile("search", deadline=None)
settings.register_profile("repeatable", settings.get_profile("search"), derandomize=True, database=None)
settings.load_profile("repeatable")

# Every annotated shape in geometry/ is checked while the tests run. Kernel modules hold numba code, which takes
# no such wrapper.
install_import_hook(
    [
        f"ars_web.geometry.{name}"
        for name in (
            "rigid_transform",
            "camera",
            "projection_jacobian",
            "box",
            "labels",
            "occlusion",
            "triangulation",
            "epipolar",
            "box_sensitivity",
            "box_parameters",
            "box_sighting",
            "box_fit",
            "view_guess",
            "next_view",
            "mask_outlines",
            "viewing_cone",
            "cone_intersection",
            "view_disagreement",
            "visual_hull",
            "hull_box",
            "mesh_silhouette",
            "resting_objects",
            "symmetry_of_turns",
            "projected_points",
            "convex_outlines",
            "rings",
            "minimum_rectangles",
            "mesh_outlines",
            "mesh_labels",
            "two_sided",
            "flat_mesh",
            "box_mesh",
            "shape_stack",
            "shape_occlusion",
            "instance_masks",
            "run_lengths",
            "hidden_points",
            "cell_samples",
            "even_spacing",
            "frame_selection",
            "rectangle_overlap",
            "sphere_bins",
            "sphere_tiles",
            "view_directions",
            "view_limits",
            "view_proposals",
            "view_sector",
            "view_tour",
        )
    ],
    "beartype.beartype",
)

SHARED = Path(__file__).parents[2] / "shared"
"""Recorded data and checks beside the checkout; absent on a user's machine."""

# Tests under recorded/ read that data. They are not collected where it is absent: nothing is skipped, and the
# header says so.
collect_ignore = [] if (SHARED / "data").is_dir() else ["recorded"]


@pytest.fixture(scope="session")
def demo_recording(tmp_path_factory: pytest.TempPathFactory):
    """A small generated recording with its truth (`DemoTruth`; its `.folder` is an ARS scene folder): nine objects
    of five classes in nine images of 480 x 360, the last of which shows none. Made once a test run; read only."""
    from ars_web.demo.recording import make_demo

    root = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        root = root.parent  # shared by the workers; make_demo lets one of them make it
    return make_demo(root / "demo-recording", frames=9, size=(480, 360))


@contextmanager
def _served(sessions: Path, *options: str, log: IO[str] | None = None) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """`log` is where what it says of errors goes; without one a pipe, which stops a server that has much to say."""
    command = [sys.executable, "-m", "ars_web", "serve", "--sessions", str(sessions), "--port", "0", *options]
    # The ars_web beside this file, whether or not one is installed.
    search = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[1])}
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE if log is None else log, text=True, env=search
    )
    try:
        said = [process.stdout.readline() for _ in range(2)]
        if "/login?code=" not in said[-1]:
            process.kill()
            raise AssertionError("".join(said) + (process.communicate()[1] or ""))
        yield process, said[-1].split()[-1]
    finally:
        process.kill()
        process.communicate()


@pytest.fixture(scope="session")
def served():
    """`with served(sessions, *options) as (process, login_url)`: a server process on a free port, killed at the end."""
    return _served


def _beside(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, Path(__file__).parent / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # where dataclasses look for their annotations
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def ring_scene() -> ModuleType:
    """`ring_scene.py`: a recording round an object, with the object's outlines."""
    return _beside("ring_scene")


@pytest.fixture(scope="session")
def bop_scene() -> ModuleType:
    """`bop_scene.py`: the ring of cameras as a BOP dataset, with objects."""
    return _beside("bop_scene")


@pytest.fixture(scope="session")
def painted_ring() -> ModuleType:
    """`painted_ring.py`: the same recording with the object in its pictures."""
    return _beside("painted_ring")


@pytest.fixture(scope="session")
def tiny_network() -> ModuleType:
    """`tiny_network.py`: writes small ONNX files."""
    return _beside("tiny_network")


@pytest.fixture(scope="session")
def dask_cluster() -> ModuleType:
    """`dask_cluster.py`: a Dask cluster with TLS on loopback."""
    return _beside("dask_cluster")


@pytest.fixture(scope="module")
def s3(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, str]]:
    """An S3 server with an empty bucket called `bucket`, and the environment variables by which it is found."""
    with _beside("s3_server").running_s3(tmp_path_factory.mktemp("s3") / "log") as found:
        yield found


SCENES = ("tests/browser/scene/", "tests/browser/workspace/", "tests/browser/test_scene_security.py")
"""Tests that have scenes drawn in software, which takes most of a machine: no two of them run at once."""

LONG = ("tests/faults/", "tests/recorded/", "tests/demo/", "tests/datasets/test_cluster.py", "tests/test_cli.py")
"""Few tests that take long: begun early, so that none is all that is left in the end."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Scenes first, then what takes long; the other browser tests last."""

    def place(item: pytest.Item) -> int:
        if item.nodeid.startswith(SCENES):
            return 0
        if item.nodeid.startswith("tests/browser/"):
            return 3
        return 1 if item.nodeid.startswith(LONG) else 2

    items.sort(key=place)


class ByFile(LoadFileScheduling):
    """Deals each file to one of several processes, and all scenes to one."""

    def _split_scope(self, nodeid: str) -> str:
        return "scenes" if nodeid.startswith(SCENES) else super()._split_scope(nodeid)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Producer) -> ByFile | None:
    return ByFile(config, log) if config.getoption("dist") == "loadfile" else None


def pytest_report_header() -> str:
    return f"recorded data: {SHARED if (SHARED / 'data').is_dir() else 'absent, tests/recorded/ is not collected'}"
