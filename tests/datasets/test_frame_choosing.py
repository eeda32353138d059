"""Frames that exports choose by what they show, where their cameras stand, and how near they are to others."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from ars_web.datasets.coverage import frames_in_bin, session_views
from ars_web.datasets.forecast import Forecast, forecast
from ars_web.datasets.frame_choosing import choose_frames, directions_in_frames
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.plan import plan_export
from ars_web.datasets.plan_files import digest_of
from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.splits import SPLITS
from ars_web.errors import BadInput, NotFound
from ars_web.geometry import camera as geometry_camera
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.even_spacing import evenly
from ars_web.geometry.frame_selection import NOTHING, covered
from ars_web.geometry.sphere_bins import SphereBins
from ars_web.sessions.model import SessionSnapshot

Make = Callable[..., SessionSnapshot]
CUBE = [Box(np.eye(4), np.full(3, 0.2))]


def options(**changes: object) -> ExportOptions:
    return ExportOptions.model_validate({"images": "none", **changes})


def plan_of(*snapshots: SessionSnapshot, out: Path, **changes: object) -> ExportPlan:
    return plan_export(snapshots, format="yolo", options=options(**changes), out=out)


def standing(snapshot: SessionSnapshot, azimuths: np.ndarray, *, up: float = 0.5) -> SessionSnapshot:
    """The session with cameras at these degrees round the origin, a metre away, looking at it."""
    turn = np.radians(azimuths)
    centre = np.column_stack([np.cos(turn), np.sin(turn), np.full(len(turn), up)])
    z = -centre / np.linalg.norm(centre, axis=1, keepdims=True)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    Ts = rigid_transform.from_rotation(np.stack([x, np.cross(z, x), z], axis=-1), centre)
    return replace(snapshot, frames=replace(snapshot.frames, Ts_world_camera=Ts))


@pytest.fixture
def lopsided(make_snapshot: Make) -> SessionSnapshot:
    """A recording that dwells on one side, and sees the other in two frames that are no neighbours."""
    azimuths = np.linspace(0.0, 40.0, 60)
    azimuths[[17, 44]] = [200.0, 215.0]
    return standing(make_snapshot(60, objects=CUBE, one_camera=True), azimuths)


def test_what_is_rare_is_kept(lopsided: SessionSnapshot, tmp_path: Path) -> None:
    chosen = plan_of(lopsided, out=tmp_path / "d", frames={"count": 6}).frames.index.tolist()
    assert len(chosen) == 6
    assert {17, 44} <= set(chosen)
    even = plan_of(lopsided, out=tmp_path / "d", frames={"count": 6, "by": "even"}).frames.index.tolist()
    assert even == evenly(60, 6).tolist()
    assert not {17, 44} & set(even)


@pytest.mark.parametrize("count", [1, 5, 13, 40])
def test_the_choice_covers_no_less_than_even_spacing(make_snapshot: Make, tmp_path: Path, count: int) -> None:
    snapshot = make_snapshot(40)
    elements = directions_in_frames(session_views(snapshot, options()))
    plan = plan_of(snapshot, out=tmp_path / "d", frames={"count": count})
    assert plan.choice is not None
    assert plan.choice.directions == covered(elements[plan.frames.index])
    assert plan.choice.directions_evenly == covered(elements[evenly(40, count)])
    assert plan.choice.directions_of_candidates == covered(elements)
    assert plan.choice.directions_evenly <= plan.choice.directions <= plan.choice.directions_of_candidates
    assert len(plan.frames) == plan.choice.chosen == count


def test_only_labels_that_are_written_count(make_snapshot: Make) -> None:
    snapshot = make_snapshot(24)
    every = directions_in_frames(session_views(snapshot, options()))
    strict = directions_in_frames(session_views(snapshot, options(max_truncated=0.1)))
    assert (every[20:] == NOTHING).all()  # which look away
    assert (strict != NOTHING).sum() < (every != NOTHING).sum()
    _, made = choose_frames([snapshot], options(max_truncated=0.1, frames={"count": 24}))
    assert made is not None
    assert made.directions_of_candidates == covered(strict)


def test_near_twins_by_time_are_not_chosen(lopsided: SessionSnapshot, tmp_path: Path) -> None:
    plan = plan_of(lopsided, out=tmp_path / "d", frames={"near_frames": 4})
    assert plan.frames.index.tolist() == list(range(0, 60, 5))
    assert plan.choice is not None
    assert (plan.choice.near_twins, plan.choice.chosen) == (48, 12)
    few = plan_of(lopsided, out=tmp_path / "d", frames={"near_frames": 4, "count": 8}).frames.index
    assert (np.diff(few) > 4).all()
    assert {17, 44} <= set(few.tolist())


def test_near_twins_by_view_are_not_chosen(make_snapshot: Make, tmp_path: Path) -> None:
    # Round and round in steps of 15 degrees: the second and the third turn show nothing new.
    snapshot = standing(make_snapshot(72, objects=CUBE, one_camera=True), np.arange(72) * 15.0)
    plan = plan_of(snapshot, out=tmp_path / "d", frames={"near_degrees": 3.0})
    assert plan.frames.index.tolist() == list(range(24))
    assert plan.choice is not None
    assert plan.choice.near_twins == 48
    # At cos(elevation) of 0.894 steps of 15 degrees are 13.4 apart.
    assert len(plan_of(snapshot, out=tmp_path / "d", frames={"near_degrees": 13.0}).frames) == 24
    assert len(plan_of(snapshot, out=tmp_path / "d", frames={"near_degrees": 14.0}).frames) == 12
    short = forecast(plan_of(snapshot, out=tmp_path / "d", frames={"near_degrees": 3, "count": 50}))
    assert short.frames == 24
    assert short.notes == ["50 frames are asked for, and 24 are left to choose from: all are taken"]


def test_half_the_sphere_is_what_stands_on_one_side(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = standing(make_snapshot(36, objects=CUBE, one_camera=True), np.arange(36) * 10.0)

    def chosen(**choice: object) -> list[int]:
        return plan_of(snapshot, out=tmp_path / "d", frames=choice).frames.index.tolist()

    assert chosen(sector=[0, 180]) == list(range(18))
    assert chosen(sector=[270, 90]) == [*range(9), *range(27, 36)]
    assert chosen(sector=[0, 360]) == list(range(36))
    plan = plan_of(snapshot, out=tmp_path / "d", frames={"sector": [0, 180], "count": 6})
    assert plan.frames.index.max() < 18
    assert plan.choice is not None
    assert (plan.choice.candidates, plan.choice.outside_sector, plan.choice.chosen) == (36, 18, 6)


def test_a_sector_is_round_the_middle_of_the_boxes_or_one_of_them(make_snapshot: Make, tmp_path: Path) -> None:
    aside = np.eye(4)
    aside[0, 3] = 6.0
    snapshot = make_snapshot(36, objects=[*CUBE, Box(aside, np.full(3, 0.2))], one_camera=True)
    snapshot = standing(snapshot, np.arange(36) * 10.0)
    right = {"sector": [-90, 90]}
    # Their middle is at x = 3, beyond all cameras.
    with pytest.raises(BadInput, match=r"all 36 stand outside the sector from -90 to 90 degrees"):
        plan_of(snapshot, out=tmp_path / "d", frames=right)
    assert len(plan_of(snapshot, out=tmp_path / "d", frames={**right, "sector_box": 1}).frames) == 18
    with pytest.raises(NotFound, match="session s1 has no box 7"):
        plan_of(snapshot, out=tmp_path / "d", frames={**right, "sector_box": 7})


def test_a_sector_round_a_box_is_counted_as_its_coverage_is(make_snapshot: Make, tmp_path: Path) -> None:
    # The box lies on its side, as in a world whose z axis is not up.
    T_world_box = np.eye(4)
    T_world_box[:3, :3] = [[0, 0, 1], [1, 0, 0], [0, 1, 0]]
    snapshot = make_snapshot(36, objects=[Box(T_world_box, np.full(3, 0.2))], one_camera=True)
    snapshot = standing(snapshot, np.arange(36) * 10.0)
    plan = plan_of(snapshot, out=tmp_path / "d", frames={"sector": [0, 90], "sector_box": 1})
    bins, seen = SphereBins(36, 18), session_views(snapshot, options())
    inside = {
        frame
        for azimuth in range(18, 27)  # the bins count from -180 degrees
        for polar in range(18)
        for frame, _ in frames_in_bin(seen, bins, [0], angle=azimuth * 18 + polar)
    }
    assert set(plan.frames.index.tolist()) == inside
    assert 0 < len(inside) < 36


def test_frames_of_merged_sessions_are_chosen_together(make_snapshot: Make, tmp_path: Path) -> None:
    first = standing(make_snapshot(40, objects=CUBE, one_camera=True), np.linspace(0.0, 5.0, 40))
    other = standing(make_snapshot(10, sid="s2", objects=CUBE, one_camera=True), np.arange(10) * 36.0)
    plan = plan_of(first, other, out=tmp_path / "d", frames={"count": 11, "near_degrees": 1.0})
    # Nearly all that there is to see is in the short one; the same view in two sessions is no twin.
    assert np.bincount(plan.frames.session).tolist() == [1, 10]
    assert plan_of(first, other, out=tmp_path / "d", frames={"near_frames": 39}).frames.index.tolist() == [0, 0]


def test_a_session_that_nothing_is_chosen_of_is_no_trouble(make_snapshot: Make, tmp_path: Path) -> None:
    first, other = make_snapshot(6, objects=CUBE), make_snapshot(3, sid="s2", objects=[])
    plan = plan_of(first, other, out=tmp_path / "d", frames={"count": 4})
    assert np.bincount(plan.frames.session, minlength=2).tolist() == [4, 0]
    assert forecast(plan).sessions[1].frames == 0


def test_the_same_choice_is_the_same_plan(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(30)
    choice = {"count": 9, "near_degrees": 2.0, "near_frames": 1, "sector": [0, 300]}
    one, again = (plan_of(snapshot, out=tmp_path / "d", frames=choice) for _ in range(2))
    assert digest_of(one) == digest_of(again) != digest_of(plan_of(snapshot, out=tmp_path / "d"))


def test_choosing_goes_by_the_images_as_they_are_written(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(24)
    plan = plan_of(snapshot, out=tmp_path / "d", frames={"count": 24}, max_truncated=0.2, images="rectify")
    assert plan.choice is not None
    assert forecast(plan).directions.all == plan.choice.directions


@pytest.mark.parametrize(
    "changes", [{}, {"frames": {"count": 7}}, {"split": {"by": "sector", "val": 0.3, "train": 0.7}}]
)
def test_the_forecast_counts_directions_of_each_split(
    make_snapshot: Make, tmp_path: Path, changes: dict[str, object]
) -> None:
    snapshot = make_snapshot(24)
    plan = plan_of(snapshot, out=tmp_path / "d", **changes)
    elements = directions_in_frames(session_views(snapshot, options()))[plan.frames.index]
    found = forecast(plan)
    assert found.directions.all == covered(elements)
    assert found.directions.splits == {
        name: covered(elements[plan.frames.split == SPLITS.index(name)]) for name in ("train", "val")
    }
    assert (found.choice is None) == ("frames" not in changes)
    assert found.lines()
    assert Forecast.model_validate_json(found.model_dump_json()) == found


def test_a_side_of_the_objects_is_held_out(make_snapshot: Make, tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    azimuths = rng.permutation(np.arange(100) * 3.6)
    snapshot = standing(make_snapshot(100, objects=CUBE, one_camera=True), azimuths)
    shares = {"train": 0.6, "val": 0.25, "test": 0.15, "by": "sector"}
    plan = plan_of(snapshot, out=tmp_path / "d", split=shares)
    assert np.bincount(plan.frames.split).tolist() == [60, 25, 15]
    round_ = plan.frames.split[np.argsort(azimuths)]
    assert int((np.diff(np.append(round_, round_[0])) != 0).sum()) == 3
    assert (plan_of(snapshot, out=tmp_path / "d", split={**shares, "seed": 1}).frames.split != plan.frames.split).any()


def test_a_session_without_boxes_has_no_sides(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(4, objects=[])
    for changes in ({"frames": {"sector": [0, 90]}}, {"split": {"by": "sector"}}):
        with pytest.raises(BadInput, match="session s1 has no box"):
            plan_of(snapshot, out=tmp_path / "d", **changes)


def test_a_recording_is_held_out(make_snapshot: Make, tmp_path: Path) -> None:
    sessions = [make_snapshot(n, sid=sid) for n, sid in ((6, "s1"), (5, "s2"), (4, "s3"))]

    def held(*ids: str, **shares: float) -> list[int]:
        split = {"by": "session", "hold_out": ids, **shares}
        plan = plan_of(*sessions, out=tmp_path / "d", split=split)
        return [int(plan.frames.split[plan.frames.session == i].min()) for i in range(3)]

    assert held("s2") == [0, 1, 0]
    assert held("s1", "s3") == [1, 0, 1]
    assert held("s3", train=0.8, val=0.0, test=0.2) == [0, 0, 2]
    assert sorted(held("s2", "s3", train=0.8, val=0.1, test=0.1)[1:]) == [1, 2]
    with pytest.raises(BadInput, match=r"session s9 is to be held out, but is not in this export of s1, s2, s3"):
        held("s9")
    with pytest.raises(BadInput, match="all sessions are held out"):
        held("s1", "s2", "s3")
    with pytest.raises(BadInput, match="val and test need a session each, and s2 alone is held out"):
        held("s2", train=0.8, val=0.1, test=0.1)


def test_a_recording_that_gives_no_frame_cannot_be_held_out(make_snapshot: Make, tmp_path: Path) -> None:
    sessions = make_snapshot(6), make_snapshot(3, sid="s2")
    split = {"by": "session", "hold_out": ["s2"]}
    with pytest.raises(BadInput, match="s2 is to be held out, but no frame of it is chosen"):
        plan_of(*sessions, out=tmp_path / "d", frames={"start": 3}, split=split)


def test_a_split_that_gets_no_frame_is_told(lopsided: SessionSnapshot, tmp_path: Path) -> None:
    found = forecast(plan_of(lopsided, out=tmp_path / "d", frames={"count": 1}))
    assert found.notes == ["val has a share of 0.2, but gets no frame of the 1 chosen"]
    assert found.lines()[-1] == f"note: {found.notes[0]}"


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"frames": {"count": 0}}, "greater than or equal to 1"),
        ({"frames": {"count": 2.0}}, "valid integer"),
        ({"frames": {"near_degrees": -1}}, "greater than or equal to 0"),
        ({"frames": {"near_degrees": float("nan")}}, "finite"),
        ({"frames": {"near_degrees": 91}}, "less than or equal to 90"),
        ({"frames": {"near_frames": -1}}, "greater than or equal to 0"),
        ({"frames": {"sector": [30, 30]}}, "the sector from 30 to 30 degrees is empty"),
        ({"frames": {"sector": [float("nan"), 1]}}, "finite"),
        ({"frames": {"sector": [0, 361]}}, "less than or equal to 360"),
        ({"frames": {"sector": [0]}}, "Field required"),
        ({"frames": {"by": "even"}}, "by 'even' says how count frames are chosen"),
        ({"frames": {"sector_box": 1}}, "give a sector, too"),
        ({"split": {"hold_out": ["s2"]}}, "hold_out names whole sessions, but the split is by 'block'"),
        ({"split": {"hold_out": ["s2"], "by": "session", "train": 1.0, "val": 0.0}}, "needs a share of val or test"),
    ],
)
def test_what_cannot_be_or_would_be_ignored_is_refused(changes: dict[str, object], said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        options(**changes)


def test_twins_of_a_choice_are_counted_and_distances_part_them(make_snapshot: Make, tmp_path: Path) -> None:
    # Each direction twice, the second time from four fifths as far.
    snapshot = standing(make_snapshot(24, objects=CUBE, one_camera=True), np.repeat(np.arange(12) * 30.0, 2))
    apart = snapshot.frames.Ts_world_camera.copy()
    apart[1::2, :3, 3] *= 0.8
    nearer = replace(snapshot, frames=replace(snapshot.frames, Ts_world_camera=apart))
    for session, twins in ((snapshot, 12), (nearer, 0)):
        made = plan_of(session, out=tmp_path / "d", frames={"near_degrees": 3.0}).choice
        assert made is not None
        assert (made.near_twins, made.chosen) == (twins, 24 - twins)
    made = plan_of(snapshot, out=tmp_path / "d", frames={"near_degrees": 3.0, "count": 5}).choice
    assert made is not None
    assert (made.near_twins, made.chosen) == (5, 5)


def test_frames_are_chosen_by_the_images_as_they_are_written(make_snapshot: Make) -> None:
    """The first camera's lens bends: a box at the border is cut more, or less, in its rectified image."""
    snapshot = make_snapshot(24)
    flat = replace(snapshot, cameras={i: geometry_camera.rectified(one) for i, one in snapshot.cameras.items()})
    differ = 0
    for cut in (0.0, 0.05, 0.1, 0.3, 0.5):
        choice = {"frames": {"count": 24}, "max_truncated": cut}
        (_, as_taken), (_, expected) = (choose_frames([one], options(**choice)) for one in (snapshot, flat))
        _, rectified = choose_frames([snapshot], options(**choice, images="rectify"))
        assert rectified == expected
        differ += expected != as_taken
    assert differ


def test_a_camera_at_the_centre_of_a_box_adds_no_direction(make_snapshot: Make, tmp_path: Path) -> None:
    T_world_box = np.eye(4)
    T_world_box[:3, 3] = make_snapshot(30).frames.Ts_world_camera[4, :3, 3]
    snapshot = make_snapshot(30, objects=[*CUBE, Box(T_world_box, np.full(3, 0.1))])
    views = session_views(snapshot, options())
    elements = directions_in_frames(views)
    assert views.counted[1, 4]
    assert elements[4, 1] == NOTHING
    assert set(np.unique(elements[:, 1])) <= {NOTHING, *range(648, 2 * 648)}
    assert forecast(plan_of(snapshot, out=tmp_path / "d")).directions.all == covered(elements)
