"""Labels of the true boxes of the rendered cell, against the oracle and against its true surfaces."""

import importlib.util
import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.labels import NEAR, BoxLabels, labels_of_boxes
from ars_web.geometry.occlusion import visible_fractions

TRUTH = Path(__file__).parents[3] / "shared" / "data" / "cell" / "truth" / "truth.json"
ORACLE = Path(__file__).parents[1] / "geometry" / "label_oracle.py"


@dataclass(frozen=True)
class Cell:
    """The truth, and what we say; arrays by frame and object, image coordinates."""

    camera: Camera
    boxes: list[Box]
    Ts_world_camera: np.ndarray
    bbox_amodal: np.ndarray
    px_in_image: np.ndarray
    visible_fraction: np.ndarray
    labels: BoxLabels
    visible: np.ndarray


@pytest.fixture(scope="module")
def cell() -> Cell:
    truth = json.loads(TRUTH.read_bytes())
    K, (k1, k2, p1, p2) = truth["K"], truth["dist"]
    camera = Camera(*truth["size"], K[0][0], K[1][1], K[0][2], K[1][2], "brown", (k1, k2, p1, p2, 0.0))
    boxes = [Box(np.array(thing["T_world_box"]), np.array(thing["size"])) for thing in truth["objects"]]
    frames = truth["frames"]
    Ts = np.array([frame["T_world_camera"] for frame in frames])
    labels = labels_of_boxes(camera, Ts, boxes)

    def of(name: str) -> np.ndarray:
        return np.array([[thing[name] for thing in frame["objects"]] for frame in frames], dtype=np.float64)

    # The truth's pixels have their centres at integers: half a pixel less than image coordinates.
    amodal = of("bbox_amodal") + 0.5
    visible = visible_fractions(camera, Ts, boxes, labels.bbox)
    return Cell(camera, boxes, Ts, amodal, of("px_in_image"), of("visible_fraction"), labels, visible)


@pytest.fixture(scope="module")
def oracle() -> ModuleType:
    spec = importlib.util.spec_from_file_location("label_oracle", ORACLE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("frame", range(0, 60, 15))
def test_labels_are_the_exact_projection(cell: Cell, oracle: ModuleType, frame: int):
    for number, box in enumerate(cell.boxes):
        want = oracle.label(cell.camera, cell.Ts_world_camera[frame], box, near=NEAR, step=0.1)
        found = cell.labels.bbox[frame, number], cell.labels.bbox_amodal[frame, number]
        np.testing.assert_allclose(found[0], want.bbox, atol=0.1, rtol=0)
        np.testing.assert_allclose(found[1], want.bbox_amodal, atol=0.1, rtol=0)
        assert cell.labels.truncated[frame, number] == pytest.approx(want.truncated, abs=0.01)


def is_sound(cell: Cell) -> np.ndarray:
    """Where the truth is one: in two frames it projects vertices at the camera's own depth, to 1e18 pixels."""
    return (np.abs(cell.bbox_amodal) < 1e4).all(axis=-1)


def test_labels_contain_the_true_surfaces(cell: Cell):
    sound = is_sound(cell)
    assert sound.mean() > 0.98
    ours, true = cell.labels.bbox_amodal[sound], cell.bbox_amodal[sound]
    assert (ours[:, :2] <= true[:, :2] + 0.1).all()
    assert (ours[:, 2:] >= true[:, 2:] - 0.1).all()
    # And no more than boxes must: a brick fills its box, so some sides are the surface's own.
    assert (np.abs(ours - true).max(axis=-1) < 0.1).sum() > 50


def test_what_has_pixels_has_a_label(cell: Cell):
    labelled = ~np.isnan(cell.labels.bbox[..., 0])
    assert labelled[is_sound(cell) & (cell.px_in_image > 0)].all()
    assert (cell.visible[labelled] >= 0).all()
    assert (cell.visible[labelled] <= 1).all()


def test_visible_follows_the_true_visible_fraction(
    cell: Cell, record_testsuite_property: Callable[[str, object], None]
):
    """As far as boxes can tell: they hide, and are hidden, where the objects in them are not."""
    seen = cell.px_in_image > 200
    correlation = float(np.corrcoef(cell.visible[seen], cell.visible_fraction[seen])[0, 1])
    record_testsuite_property("visible among boxes, correlation with the truth", round(correlation, 3))
    assert seen.sum() > 400
    assert correlation > 0.75
    assert np.median(np.abs(cell.visible - cell.visible_fraction)[seen]) < 0.05
    # What nothing hides, no box says is hidden by much; what is nearly gone, no box says is free.
    assert cell.visible[seen & (cell.visible_fraction < 0.2)].max() < 0.8
