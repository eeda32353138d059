"""What a sphere round an object shows: the coverage's cells, folded ones as what they are folded to."""

import numpy as np
import pytest

from ars_web.datasets.coverage import chosen_boxes, coverage_of
from ars_web.datasets.options import ExportOptions
from ars_web.demo import scene
from ars_web.errors import NotFound
from ars_web.geometry.sphere_bins import SphereBins
from ars_web.geometry.symmetry import NO_SYMMETRY, Symmetry
from ars_web.sessions.model import FrameTable, ObjectClass, SessionSnapshot, SessionState, VirtualBox
from ars_web.studies.kept_views import KeptViews
from ars_web.studies.sphere_counts import sphere_counts

BINS = SphereBins(18, 9)


def session(*, symmetry: Symmetry = NO_SYMMETRY) -> SessionSnapshot:
    """The demo's first three things, of one class, seen from its walk."""
    Ts = scene.camera_path(40)
    names = tuple(f"{i:05d}.jpg" for i in range(len(Ts)))
    boxes = {i: VirtualBox(i, 0, thing.name, thing.box, 0) for i, thing in enumerate(scene.things()[:3], start=1)}
    state = SessionState(0, "desk", {0: ObjectClass(0, "thing", "#ff0000", 0, symmetry=symmetry)}, boxes, 1, 4)
    frames = FrameTable(names, names, np.zeros(len(Ts), dtype=int), Ts)
    return SessionSnapshot("s", state, {0: scene.camera(128, 96)}, frames)


def test_the_sphere_has_the_coverages_cells() -> None:
    snapshot, kept = session(), KeptViews()
    views = kept.find(snapshot, ExportOptions.model_validate({"min_visible": 0.5}))
    for whole_class, rows in ((False, chosen_boxes(snapshot, box_id=2)), (True, chosen_boxes(snapshot))):
        found = sphere_counts(snapshot, kept, BINS, box_id=2, whole_class=whole_class, min_visible=0.5)
        assert found.counts.tolist() == coverage_of(views, BINS, rows).cell_counts.tolist()
        assert found.counts.sum() > 0
    with pytest.raises(NotFound, match="no box 99"):
        sphere_counts(snapshot, kept, BINS, box_id=99)


def test_all_round_an_axis_of_symmetry_the_counts_are_the_same() -> None:
    snapshot = session(symmetry=Symmetry("continuous", axis=(0.0, 0.0, 1.0)))
    found = sphere_counts(snapshot, KeptViews(), BINS, box_id=1)
    bands = np.split(found.counts, BINS.cell_starts[1:-1])
    assert all(len(set(band.tolist())) == 1 for band in bands)
    assert found.counts.sum() > 0
