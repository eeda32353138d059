"""Coverage of sessions: histograms beside ones that were counted frame by frame, and what does not count."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ars_web.datasets.coverage import called, chosen_boxes, coverage_of, frames_in_bin, session_views
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.samples import frame_labels
from ars_web.errors import BadInput, NotFound
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.sphere_bins import SphereBins
from ars_web.geometry.symmetry import Symmetry
from ars_web.sessions.model import SessionSnapshot

Make = Callable[..., SessionSnapshot]

BINS = SphereBins(36, 18)
PLAIN = ExportOptions()


def counted_one_by_one(snapshot: SessionSnapshot, box_ids: list[int], *, min_visible: float = 0.0) -> Counter:
    """The paper's histogram, a frame and a box at a time."""
    found: Counter = Counter()
    for index in range(len(snapshot.frames)):
        for label in frame_labels(snapshot, index):
            if label.box_id not in box_ids or label.bbox is None or label.visible < min_visible:
                continue
            x0, y0, x1, y1 = label.bbox
            if (x1 - x0) * (y1 - y0) < 4.0:
                continue
            T_box_world = rigid_transform.invert(snapshot.state.boxes[label.box_id].box.T_world_box)
            ((x, y, z),) = rigid_transform.transform_points(
                T_box_world, snapshot.frames.Ts_world_camera[index][None, :3, 3]
            )
            phi, theta = np.arctan2(y, x), np.arccos(z / np.sqrt(x * x + y * y + z * z))
            found[min(int((phi + np.pi) / (2 * np.pi) * 36), 35), min(int(theta / np.pi * 18), 17)] += 1
    return found


@pytest.mark.parametrize("min_visible", [0.0, 0.6])
def test_histograms_are_those_counted_frame_by_frame(make_snapshot: Make, min_visible: float) -> None:
    snapshot = make_snapshot(40)
    views = session_views(snapshot, ExportOptions(min_visible=min_visible))
    for box_ids in ([1], [2], [3], [1, 3]):
        rows = [views.box_ids.index(i) for i in box_ids]
        found = coverage_of(views, BINS, rows)
        expected = counted_one_by_one(snapshot, box_ids, min_visible=min_visible)
        places = {(int(a), int(p)): int(found.counts[a, p]) for a, p in np.argwhere(found.counts)}
        assert places == expected
        assert found.counts.sum() == found.cell_counts.sum() == found.views == sum(expected.values())
        assert found.empty_fraction == 1 - len(expected) / (36 * 18)


def test_frames_that_do_not_show_the_object_do_not_count(make_snapshot: Make) -> None:
    snapshot = make_snapshot(40)
    found = coverage_of(session_views(snapshot, PLAIN), BINS, [1])
    # The last sixth looks away.
    assert 0 < found.frames <= 34


def test_a_hidden_object_counts_only_where_it_shows(make_snapshot: Make) -> None:
    def at(x: float, side: float) -> Box:
        return Box(rigid_transform.from_rotation(np.eye(3), np.array([x, 0.0, 0.0])), np.full(3, side))

    snapshot = make_snapshot(40, objects=[at(0.0, 0.1), at(0.25, 0.3)])
    all_of_it = coverage_of(session_views(snapshot, PLAIN), BINS, [0])
    seen = coverage_of(session_views(snapshot, ExportOptions(min_visible=0.5)), BINS, [0])
    # The larger one stands on the side where the camera begins, at azimuth 0.
    assert seen.counts[18:20].sum() == 0 < all_of_it.counts[18:20].sum()
    assert np.array_equal(seen.counts[28:], all_of_it.counts[28:])


def test_symmetry_folds_views_into_a_part_of_the_sphere(make_snapshot: Make) -> None:
    quarter = Symmetry("discrete", (((0.0, 0.0, 1.0), 4),))
    plain = coverage_of(session_views(make_snapshot(60), PLAIN), BINS, [1])
    folded_views = session_views(make_snapshot(60, sid="s2", symmetries={1: quarter}), PLAIN)
    folded = coverage_of(folded_views, BINS, [1])
    assert folded.views == plain.views
    assert folded.reachable.sum() == 9 * 18
    assert folded.counts[18:27].sum() == folded.views
    assert folded.counts.sum(axis=0).tolist() == plain.counts.sum(axis=0).tolist()
    assert folded.empty_area < plain.empty_area


def test_a_known_hole_is_empty(make_snapshot: Make) -> None:
    """The camera goes half a turn round: the other half is a hole."""
    snapshot = make_snapshot(200, objects=[Box(np.eye(4), np.full(3, 0.1))])
    found = coverage_of(session_views(snapshot, PLAIN), SphereBins(12, 6), [0])
    assert (found.counts[:6] == 0).all()
    assert (found.counts[6:11].sum(axis=1) > 0).all()


def test_the_frames_of_a_bin_are_those_that_were_counted(make_snapshot: Make) -> None:
    snapshot = make_snapshot(60)
    views = session_views(snapshot, PLAIN)
    found = coverage_of(views, BINS, [0, 1, 2])
    for azimuth, polar in np.argwhere(found.counts).tolist():
        listed = frames_in_bin(views, BINS, [0, 1, 2], angle=azimuth * 18 + polar)
        assert len(listed) == found.counts[azimuth, polar]
        assert listed == sorted(listed)
    for cell in np.flatnonzero(found.cell_counts).tolist():
        assert len(frames_in_bin(views, BINS, [0, 1, 2], cell=cell)) == found.cell_counts[cell]
    assert frames_in_bin(views, BINS, [0], angle=0) == []
    with pytest.raises(NotFound, match="no bin 648"):
        frames_in_bin(views, BINS, [0], angle=648)


def test_some_frames_can_be_looked_at_alone(make_snapshot: Make) -> None:
    snapshot = make_snapshot(40)
    some, all_of_them = session_views(snapshot, PLAIN, indices=[3, 7, 8]), session_views(snapshot, PLAIN)
    assert np.array_equal(some.counted, all_of_them.counted[:, [3, 7, 8]])
    assert np.array_equal(some.directions, all_of_them.directions[:, [3, 7, 8]])


def test_objects_are_chosen_and_called_by_what_they_are(make_snapshot: Make) -> None:
    snapshot = make_snapshot(2)
    assert chosen_boxes(snapshot) == [0, 1, 2]
    assert chosen_boxes(snapshot, box_id=2) == [1]
    assert chosen_boxes(snapshot, class_id=0) == [0, 2]
    assert called(snapshot, box_id=2) == "box 2"
    assert called(snapshot, class_id=1) == "tall one"
    assert called(snapshot) == "all objects"


def test_objects_that_are_not_there_are_named(make_snapshot: Make) -> None:
    snapshot = make_snapshot(2, classes=("cube", "tall one", "never"), objects=[Box(np.eye(4), np.ones(3))])
    with pytest.raises(NotFound, match="has no box 9"):
        chosen_boxes(snapshot, box_id=9)
    with pytest.raises(NotFound, match="has no class 9"):
        chosen_boxes(snapshot, class_id=9)
    with pytest.raises(NotFound, match="class 'never' has no box: it is never labelled"):
        chosen_boxes(snapshot, class_id=2)
    with pytest.raises(BadInput, match="not both"):
        chosen_boxes(snapshot, class_id=0, box_id=1)
    with pytest.raises(NotFound, match="no box yet"):
        chosen_boxes(make_snapshot(2, sid="s3", objects=[]))


def test_a_camera_at_the_centre_of_a_box_sees_it_from_no_direction(make_snapshot: Make) -> None:
    T_world_box = np.eye(4)
    T_world_box[:3, 3] = make_snapshot(30).frames.Ts_world_camera[4, :3, 3]
    snapshot = make_snapshot(30, objects=[Box(T_world_box, np.full(3, 0.1))])
    views = session_views(snapshot, PLAIN)
    assert views.counted[0, 4]
    assert np.isnan(views.directions[0, 4]).all()
    found = coverage_of(views, BINS, [0])
    assert found.counts.sum() == found.cell_counts.sum() == found.views - 1


def test_of_objects_with_other_symmetries_all_that_any_can_be_seen_from_is_reachable(make_snapshot: Make) -> None:
    half, quarter = (Symmetry("discrete", (((0.0, 0.0, 1.0), order),)) for order in (2, 4))
    views = session_views(make_snapshot(30, symmetries={0: half, 1: quarter}), PLAIN)
    for rows in ([0, 1, 2], [1, 0], [2, 1]):
        found = coverage_of(views, BINS, rows)
        assert np.flatnonzero(found.reachable.any(axis=1)).tolist() == list(range(18, 36))
        alone = coverage_of(views, BINS, [0])
        assert (found.cells_reachable == alone.cells_reachable).all()
    assert coverage_of(views, BINS, [1]).reachable.sum() == 9 * 18


def test_a_view_lies_in_a_bin_that_can_be_reached_whatever_is_rounded(make_snapshot: Make) -> None:
    views = session_views(make_snapshot(4, objects=[Box(np.eye(4), np.full(3, 0.1))]), PLAIN)
    quarter = Symmetry("discrete", (((0.0, 0.0, 1.0), 4),))
    # A hair below the azimuth of 0 that folding leads to, as rounding may put it.
    edge = np.tile([1.0, -1e-12, 0.3], (1, 4, 1))
    rounded = replace(views, symmetries=(quarter,), directions=edge, counted=np.ones((1, 4), dtype=bool))
    found = coverage_of(rounded, BINS, [0])
    assert found.counts[17].sum() == 4
    assert found.reachable[found.counts > 0].all()
    assert found.cells_reachable[found.cell_counts > 0].all()
