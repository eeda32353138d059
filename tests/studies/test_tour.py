"""A tour of a recording with a known hole: it goes where frames are missing, and what it promises is really seen."""

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ars_web.datasets.coverage import SessionViews, coverage_of, session_views
from ars_web.demo import building, rendering, scene
from ars_web.errors import BadInput, NotFound
from ars_web.geometry import rigid_transform
from ars_web.geometry.sphere_bins import SphereBins
from ars_web.geometry.symmetry import NO_SYMMETRY, Symmetry
from ars_web.geometry.view_limits import ViewLimits, looking_at
from ars_web.geometry.view_proposals import Proposals, Reason
from ars_web.geometry.view_tour import nearest_neighbour_path, path_length, pose_distances
from ars_web.sessions.model import FrameTable, ObjectClass, SessionSnapshot, SessionState, VirtualBox
from ars_web.studies import tour as tour_study
from ars_web.studies.tour import Tour, TourRequest, plan_tour
from ars_web.studies.tour_json import tour_json, wrist_rows

CAMERA = scene.camera(128, 96)
BINS = SphereBins(12, 6)
HOLE = math.radians(60), math.radians(150)
MUG = 7


def session(Ts: np.ndarray, *, symmetry: Symmetry = NO_SYMMETRY) -> SessionSnapshot:
    """The demo's desk as cameras at `Ts` see it; all things are of one class."""
    things = scene.things()
    names = tuple(f"{i:05d}.jpg" for i in range(len(Ts)))
    one = ObjectClass(0, "thing", "#ff0000", 0, symmetry=symmetry)
    boxes = {i: VirtualBox(i, 0, thing.name, thing.box, 0) for i, thing in enumerate(things, start=1)}
    state = SessionState(0, "desk", {0: one}, boxes, 1, len(things) + 1)
    return SessionSnapshot("s", state, {0: CAMERA}, FrameTable(names, names, np.zeros(len(Ts), dtype=int), Ts))


def walk() -> np.ndarray:
    """The demo's walk round the desk without the end, where the camera looks away."""
    return scene.camera_path(160)[:144]


def with_hole() -> np.ndarray:
    Ts = walk()
    azimuth = np.arctan2(Ts[:, 1, 3], Ts[:, 0, 3])
    return Ts[(azimuth < HOLE[0]) | (azimuth > HOLE[1])]


def views_of(Ts: np.ndarray) -> SessionViews:
    return session_views(session(Ts), TourRequest().options)


def counts(views: SessionViews, row: int, bins: SphereBins = BINS) -> np.ndarray:
    return coverage_of(views, bins, [row]).cell_counts


def planned(Ts: np.ndarray, rows: list[int], request: TourRequest, *, symmetry: Symmetry = NO_SYMMETRY) -> Tour:
    snapshot = session(Ts, symmetry=symmetry)
    return plan_tour(snapshot, session_views(snapshot, request.options), rows, request)


@pytest.fixture(scope="module")
def found() -> Tour:
    """A tour for all things, of as many views as it takes."""
    return planned(with_hole(), list(range(9)), TourRequest(BINS, count=100))


def test_the_histogram_shows_the_hole_and_the_tour_fills_it(found: Tour) -> None:
    added = np.concatenate([with_hole(), [stop.T_world_camera for stop in found.stops]])
    whole, before, after = views_of(walk()), views_of(with_hole()), views_of(added)
    holes = 0
    for row in range(9):
        was_empty, is_seen = counts(before, row) == 0, counts(after, row) > 0
        hole = was_empty & (counts(whole, row) > 0)
        holes += int(hole.sum())
        left = {one.cell: one.reason for one in found.left if one.box_id == row + 1}
        assert is_seen[hole].all()
        promised = {fill.cell for stop in found.stops for fill in stop.fills if fill.box_id == row + 1}
        assert promised <= set(np.flatnonzero(was_empty & is_seen).tolist())
        assert promised | set(left) == set(np.flatnonzero(was_empty).tolist())
    assert holes >= 20


def test_what_the_tour_promises_is_seen_in_rendered_views(found: Tour) -> None:
    parts = building.place(scene.things(), desk=scene.desk())
    rays = rendering.ray_table(CAMERA)
    shares: list[float] = []
    for stop in found.stops:
        sight = rendering.look(parts, rays, stop.T_world_camera)
        for fill in stop.fills:
            seen, alone = sight.objects == fill.box_id - 1, sight.alone[fill.box_id - 1]
            shares.append(seen.sum() / alone.sum())
            assert not alone[[0, -1]].any()
            assert not alone[:, [0, -1]].any()
    # At least half of each box; what lies in the boxes may stand otherwise.
    assert min(shares) > 0.35
    assert np.mean(shares) > 0.85


def test_views_keep_to_the_limits(found: Tour) -> None:
    limits, things = found.limits, scene.things()
    assert found.from_recording == ("distance", "height", "tilt")
    away = np.linalg.norm(with_hole()[:, None, :3, 3] - [thing.box.T_world_box[:3, 3] for thing in things], axis=-1)
    assert limits.distance[0] == pytest.approx(away.min(), rel=0.6)
    assert away.max() < limits.distance[1] < 1.2 * away.max()
    for stop in found.stops:
        eye, forward = stop.T_world_camera[:3, 3], stop.T_world_camera[:3, 2]
        target = things[stop.box_id - 1].box.T_world_box[:3, 3]
        assert stop.distance == pytest.approx(np.linalg.norm(target - eye))
        assert np.cross(forward, target - eye) == pytest.approx(0.0, abs=1e-9)
        assert stop.T_world_camera[2, 0] == pytest.approx(0.0, abs=1e-12), "the image's x is horizontal"
        assert limits.distance[0] <= stop.distance <= limits.distance[1]
        assert limits.height[0] <= stop.height == eye[2] <= limits.height[1]
        assert limits.tilt[0] <= stop.tilt <= limits.tilt[1]
        assert stop.tilt == pytest.approx(math.asin(-forward[2]))
        assert set(stop.labelled) >= {fill.box_id for fill in stop.fills}


def test_the_way_is_short(found: Tour) -> None:
    path = np.array([found.start, *(stop.T_world_camera for stop in found.stops)])
    assert (found.start == with_hole()[-1]).all()
    assert found.length == pytest.approx(np.linalg.norm(np.diff(path[:, :3, 3], axis=0), axis=1).sum())
    distances = pose_distances(path)
    nearest = path_length(distances, nearest_neighbour_path(distances))
    assert path_length(distances, np.arange(len(path))) < nearest


def test_why_cells_stay_empty_is_counted(found: Tour) -> None:
    assert found.filled + len(found.left) == found.empty < found.cells == 9 * 72
    assert sum(found.left_by_reason.values()) == len(found.left)
    # No camera was below the desk.
    assert found.left_by_reason["height"] > 100
    assert "later" not in found.left_by_reason
    few = planned(with_hole(), list(range(9)), TourRequest(BINS, count=3))
    assert len(few.stops) == 3
    assert few.left_by_reason["later"] == found.filled - few.filled
    for lines, tour in ((found.lines(), found), (few.lines(), few)):
        assert f"{len(tour.stops)} views fill {tour.filled} of {tour.empty} empty cells" in lines[1]
        assert len(lines) == 2 + len(tour.left_by_reason)


def test_an_object_that_looks_alike_all_round_needs_no_view_of_its_back() -> None:
    tin = Symmetry("continuous", axis=(0.0, 0.0, 1.0))
    round_about = planned(with_hole(), [5], TourRequest(BINS, count=100), symmetry=tin)
    any_side = planned(with_hole(), [5], TourRequest(BINS, count=100))
    assert round_about.cells < 20
    assert len(round_about.stops) < len(any_side.stops)
    assert all(0.0 <= fill.azimuth <= 0.2 for stop in round_about.stops for fill in stop.fills)


def test_a_box_seen_from_everywhere_has_nothing_empty() -> None:
    tour = planned(with_hole(), [MUG], TourRequest(SphereBins(1, 1)))
    assert (tour.stops, tour.left, tour.empty, tour.length) == ((), (), 0, 0.0)
    assert "nothing is empty: frames lie in all of the 1 cells" in tour.lines()[-1]


def test_the_tour_of_a_box_that_no_frame_sees_keeps_to_what_the_frames_have() -> None:
    looking_away = with_hole()[:20].copy()
    looking_away[:, :3, 1:3] *= -1
    snapshot = session(looking_away)
    views = session_views(snapshot, TourRequest().options)
    assert not views.counted[MUG].any()
    request = TourRequest(BINS, count=5, tilt=(0.0, math.pi / 2))
    assert len(plan_tour(snapshot, views, [MUG], request).stops) == 5


def test_it_may_begin_at_another_frame() -> None:
    tour = planned(with_hole(), [MUG], TourRequest(BINS, count=2, start_frame=0))
    assert (tour.start == with_hole()[0]).all()
    with pytest.raises(NotFound, match="no frame 500; its frames are 0 to"):
        planned(with_hole(), [MUG], TourRequest(BINS, start_frame=500))


def test_the_wrist_goes_where_the_camera_is_to_be(found: Tour) -> None:
    T_wrist_camera = scene.T_WRIST_CAMERA
    rows = np.array([line.split() for line in wrist_rows(found, T_wrist_camera).splitlines()], dtype=float)
    assert rows.shape == (len(found.stops), 7)
    told = tour_json(found, T_wrist_camera=T_wrist_camera)
    for row, view, stop in zip(rows, told.views, found.stops, strict=True):
        T_world_wrist = rigid_transform.from_position_wxyz(row[:3], row[[6, 3, 4, 5]])
        assert T_world_wrist @ T_wrist_camera == pytest.approx(stop.T_world_camera)
        assert view.T_world_wrist is not None
        assert view.T_world_wrist.position == pytest.approx(row[:3])
        assert view.T_world_camera.position == pytest.approx(stop.T_world_camera[:3, 3])
    assert all(view.T_world_wrist is None for view in tour_json(found, T_wrist_camera=None).views)


def test_the_same_question_has_the_same_answer() -> None:
    one, other = (planned(with_hole(), [0, MUG], TourRequest(BINS, count=6)) for _ in range(2))
    said = [tour_json(tour, T_wrist_camera=None).model_dump_json() for tour in (one, other)]
    assert said[0] == said[1]


@pytest.mark.parametrize(
    ("request_", "said"),
    [
        ({"count": 0}, "number of views must be from 1 to 2000, not 0"),
        ({"min_visible": math.nan}, "visible is from 0 to 1, not nan"),
        ({"bins": SphereBins(100, 100)}, "at most 2592 cells, 72 x 36 bins, not in 100 x 100"),
        ({"distance": (0.9, 0.3)}, "limits of distance are the wrong way round: 0.9 is more than 0.3"),
        ({"distance": (-1.0, 0.3)}, "a distance must be more than 0 m, not -1 to 0.3"),
        ({"tilt": (0.0, math.inf)}, "limits of tilt must be finite numbers of degrees, not 0 and inf"),
        ({"height": (3.0, 4.0)}, "no camera is 3 to 4 m high and within"),
        ({"tilt": (-1.5, -1.2), "distance": (0.5, 0.6)}, "tilts of -85.9 to -68.8 degrees at distances of 0.5 to 0.6"),
        (
            {"distance": (0.02, 0.03), "height": (0.0, 1.0)},
            "from 0.02 to 0.03 m, the limits of distance, the camera would be nearer than",
        ),
        (
            {"distance": (0.11, 0.12), "height": (0.0, 1.0)},
            "from 0.11 to 0.12 m, the limits of distance, no object is whole in the image",
        ),
        (
            {"distance": (20.0, 21.0), "height": (0.0, 30.0)},
            "from 20 to 21 m, the limits of distance, every object is too small in the image; allow less",
        ),
    ],
)
def test_what_cannot_be_is_refused(request_: dict[str, Any], said: str) -> None:
    with pytest.raises(BadInput, match=re.escape(said)):
        planned(with_hole()[:10], [MUG], TourRequest(**{"bins": BINS, **request_}))


def looking(eyes: list[tuple[float, float, float]]) -> np.ndarray:
    """Cameras at these places about the mug's centre that look at it."""
    centre = scene.things()[MUG].box.T_world_box[:3, 3]
    return looking_at(centre + np.array(eyes), np.tile(centre, (len(eyes), 1)))


def limits_of(Ts: np.ndarray, **given: Any) -> ViewLimits:
    snapshot = session(Ts)
    views = session_views(snapshot, TourRequest().options)
    views = replace(views, counted=np.ones_like(views.counted))
    return tour_study._limits(snapshot, views, [MUG], TourRequest(**given))


def test_limits_taken_from_frames_stay_what_can_be() -> None:
    # From 2 cm, straight above, to 3 m: a tenth of that less than 2 cm would be behind the object.
    found = limits_of(looking([(0.0, 0.0, 0.02), (3.0, 0.0, 0.0)]))
    assert found.distance == pytest.approx((0.01, 3.0 + 0.298))
    assert found.tilt == pytest.approx((-tour_study.WIDENED_TILT, math.pi / 2))
    up = limits_of(looking([(0.0, 0.0, -0.5), (0.5, 0.0, 0.0)]))
    assert up.tilt == pytest.approx((-math.pi / 2, tour_study.WIDENED_TILT))
    height = scene.things()[MUG].box.T_world_box[2, 3]
    assert up.height == pytest.approx((height - 0.5 - 0.05, height + 0.05))
    # What all frames have alike is widened by a hundredth of the distance.
    alike = limits_of(looking([(0.5, 0.0, 0.0), (0.0, 0.5, 0.0)]))
    assert alike.distance == pytest.approx((0.495, 0.505))
    assert alike.height == pytest.approx((height - 0.005, height + 0.005))


@pytest.mark.parametrize(("asked", "least"), [(None, 0.5), (0.0, 0.1), (0.05, 0.1), (0.6, 0.6)])
def test_views_show_more_than_next_to_nothing(asked: float | None, least: float) -> None:
    assert limits_of(looking([(0.5, 0.0, 0.2), (0.0, 0.5, 0.2)]), min_visible=asked).min_visible == least


def test_the_usual_distance_is_tried_first_then_further_then_nearer() -> None:
    snapshot = session(looking([(0.4, 0.0, 0.0), (0.0, 0.5, 0.0), (0.6, 0.0, 0.0)]))
    views = session_views(snapshot, TourRequest().options)
    views = replace(views, counted=np.ones_like(views.counted))
    centre = scene.things()[MUG].box.T_world_box[:3, 3]

    def tried(near: float, far: float) -> list[float]:
        limits = ViewLimits((near, far), (-9.0, 9.0), (-1.0, 1.0))
        return list(tour_study._distances(snapshot, views, MUG, centre, limits))

    assert tried(0.3, 0.9) == pytest.approx([0.5, 0.7, 0.9, 0.4, 0.3])
    assert tried(0.0, 0.5) == pytest.approx([0.5, 0.2525, 0.005])
    assert tried(0.8, 0.8) == [0.8]
    assert tried(0.7, 0.9) == pytest.approx([0.7, 0.8, 0.9])


def test_distances_are_refused_only_where_nothing_else_is_at_fault() -> None:
    request, limits = TourRequest(distance=(1.0, 2.0)), ViewLimits((1.0, 2.0), (-9.0, 9.0), (-1.0, 1.0))

    def refuse(*reasons: Reason, asked: TourRequest = request) -> None:
        left = tuple((0, cell, reason) for cell, reason in enumerate(reasons))
        tour_study._refuse_nothing(Proposals((), left), asked, limits)

    with pytest.raises(BadInput, match="every object is too small"):
        refuse("small", "height", "near")
    refuse("small", "hidden")
    refuse("small", "large")
    refuse("height", "tilt")
    refuse("small", asked=TourRequest())
    refuse()
