"""From two true outlines on the rendered cell to the rest: the figure that the benchmark prints for all objects, here
for three of them."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from ars_web.geometry.mask_regions import iou
from ars_web.geometry.visual_hull import visual_hull
from ars_web.masks.propagation import propagate
from ars_web.recordings.images import read_image

ROOT = Path(__file__).parents[2]
CELL = ROOT.parent / "shared" / "data" / "cell"

LEGO, BALL, TEDDY = 1, 5, 8


@pytest.fixture(scope="module")
def benchmark() -> ModuleType:
    spec = importlib.util.spec_from_file_location("propagation_benchmark", ROOT / "benchmarks" / "propagation.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("thing", [LEGO, BALL, TEDDY])
def test_two_outlines_become_labels_that_fit_all_frames(benchmark, thing):
    cell = benchmark.Cell.read(CELL)
    drawn = cell.drawn(thing, angle=80.0)
    before = cell.score(visual_hull(drawn), thing)
    found = propagate(drawn, cell.taken, read=lambda frame: read_image(cell.taken.frames.images[frame]))
    assert before < 0.8
    assert cell.score(found.hull, thing) > 0.93
    known = [view for view in found.accepted if thing in cell.outlines.get(view.frame, {})]
    assert np.mean([iou(view.polygons, cell.outlines[view.frame][thing]) for view in known] or [1.0]) > 0.85
