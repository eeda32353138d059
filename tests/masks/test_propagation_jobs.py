"""Outlining the rest by a thread: what is stored, in one edit, and that nothing is where it does not end well."""

import threading
from collections.abc import Iterator

import numpy as np
import pytest

from ars_web.errors import BadInput, Locked, NotFound
from ars_web.geometry.box import Box
from ars_web.masks import propagation_jobs
from ars_web.masks.boxing import ObjectBoxes
from ars_web.masks.propagation_jobs import MOST_FRAMES, OutlineJob, OutlineJobs
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.model import HullOptions, Mask
from ars_web.sessions.store import SessionStore

SECONDS = 60.0
DRAWN = (0, 4)


@pytest.fixture
def jobs(painted_store: SessionStore, painted_editor: SessionEditor) -> Iterator[OutlineJobs]:
    made = OutlineJobs(painted_store, painted_editor)
    yield made
    made.close()


@pytest.fixture
def drawn(painted, painted_editor: SessionEditor, painted_sid: str) -> int:
    """The id that two masks of a new object keep for its box."""
    box_id = None
    for frame in DRAWN:
        mask = draw(painted, painted_editor, painted_sid, frame, box_id=box_id)
        box_id = mask.box_id
    assert box_id is not None
    return box_id


def draw(painted, editor: SessionEditor, sid: str, frame: int, *, box_id: int | None, **more: object) -> Mask:
    return editor.put_mask(
        sid,
        box_id=box_id,
        frame=frame,
        class_id=0,
        polygons=painted.view(frame).polygons,
        expected_revision=None,
        author="ann",
        **more,
    )


@pytest.fixture
def paused(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[threading.Event, threading.Event]]:
    """Jobs that tell when they read their first photograph, and wait there: (reached, go on)."""
    reached, go_on = threading.Event(), threading.Event()
    photograph = propagation_jobs.photograph

    def wait_first(*given: object) -> np.ndarray:
        reached.set()
        assert go_on.wait(SECONDS)
        return photograph(*given)

    monkeypatch.setattr(propagation_jobs, "photograph", wait_first)
    yield reached, go_on
    go_on.set()


def run(jobs: OutlineJobs, sid: str, box_id: int, **more: object) -> OutlineJob:
    return jobs.wait(jobs.start(sid, box_id, author="ann", **{"frames_most": 3, **more}).id, timeout=SECONDS)


def test_two_masks_become_a_box_with_more_masks_in_one_edit(jobs, painted_store, painted_editor, painted_sid, drawn):
    before = painted_store.state(painted_sid)
    job = run(jobs, painted_sid, drawn)
    assert (job.state, job.error, job.seconds_left) == ("done", None, None)
    assert job.done == job.total > 0
    after = painted_store.state(painted_sid)
    assert after.revision == before.revision + 1
    masks = {mask.frame: mask for mask in after.masks_of(drawn)}
    assert 1 <= len(job.accepted) <= 3
    assert set(masks) == {*DRAWN, *job.accepted, *job.doubtful}
    for frame in job.accepted:
        assert (masks[frame].origin, masks[frame].accepted) == ("proposed", True)
    for frame in job.doubtful:
        assert (masks[frame].origin, masks[frame].accepted) == ("proposed", False)
    box = after.boxes[drawn]
    assert box.hull is not None
    assert box.hull_options == HullOptions()
    np.testing.assert_allclose(box.box.T_world_box[:3, 3], (0, 0, 0.05), atol=0.004)
    np.testing.assert_allclose(box.box.size, 0.08, atol=0.02)
    assert painted_store.edits(painted_sid, after=before.revision, limit=9)[0].author == "ann"
    painted_editor.undo(painted_sid, author="ann")
    undone = painted_store.state(painted_sid)
    assert drawn not in undone.boxes
    assert {mask.frame for mask in undone.masks_of(drawn)} == set(DRAWN)


def test_the_box_is_what_its_masks_make_it(jobs, painted_store, painted_editor, painted_sid, drawn):
    """Made again from the stored masks it is the same."""
    run(jobs, painted_sid, drawn)
    made = painted_store.state(painted_sid).boxes[drawn]
    again = ObjectBoxes(painted_store, painted_editor).remake(
        painted_sid, drawn, options=HullOptions(), expected_revision=made.revision, author="ann"
    )
    assert again.hull == made.hull
    np.testing.assert_array_equal(again.box.size, made.box.size)


def test_a_box_made_of_masks_keeps_its_name_and_options(jobs, painted_store, painted_editor, painted_sid, drawn):
    options = HullOptions(orientation="upright", widen=1.5, ground=0.012)
    ObjectBoxes(painted_store, painted_editor).remake(painted_sid, drawn, options=options, name="marble", author="ann")
    assert run(jobs, painted_sid, drawn).state == "done"
    box = painted_store.state(painted_sid).boxes[drawn]
    assert (box.name, box.hull_options) == ("marble", options)
    low = box.box.corners_world[:, 2].min()
    assert low == pytest.approx(0.012, abs=1e-6)


def test_a_box_placed_by_hand_stays_where_it_is(jobs, painted, painted_store, painted_editor, painted_sid):
    placed = painted_editor.add_box(painted_sid, class_id=0, box=Box(np.eye(4), np.full(3, 0.1)), author="ann")
    for frame in DRAWN:
        draw(painted, painted_editor, painted_sid, frame, box_id=placed.id)
    job = run(jobs, painted_sid, placed.id)
    state = painted_store.state(painted_sid)
    assert job.accepted
    assert len(state.masks_of(placed.id)) == 2 + len(job.accepted) + len(job.doubtful)
    np.testing.assert_array_equal(state.boxes[placed.id].box.T_world_box, np.eye(4))
    assert state.boxes[placed.id].hull_options is None


def test_a_second_run_adds_to_the_first(jobs, painted_store, painted_sid, drawn):
    first = run(jobs, painted_sid, drawn, frames_most=1)
    second = run(jobs, painted_sid, drawn, frames_most=1)
    assert second.state == "done"
    assert not set(first.accepted) & set(second.accepted)
    frames = {mask.frame for mask in painted_store.state(painted_sid).masks_of(drawn) if mask.accepted}
    assert frames == {*DRAWN, *first.accepted, *second.accepted}


def test_masks_changed_meanwhile_are_not_overwritten(
    jobs, painted, painted_store, painted_editor, painted_sid, drawn, paused
):
    reached, go_on = paused
    job = jobs.start(painted_sid, drawn, frames_most=2, author="ann")
    assert reached.wait(SECONDS)
    draw(painted, painted_editor, painted_sid, 2, box_id=drawn)
    before = painted_store.state(painted_sid)
    go_on.set()
    ended = jobs.wait(job.id, timeout=SECONDS)
    assert ended.state == "failed"
    assert ended.error is not None
    assert "changed meanwhile" in ended.error
    assert painted_store.state(painted_sid).revision == before.revision


def test_a_cancelled_job_leaves_nothing(jobs, painted_store, painted_sid, drawn, paused):
    reached, go_on = paused
    before = painted_store.state(painted_sid).revision
    job = jobs.start(painted_sid, drawn, frames_most=2, author="ann")
    assert reached.wait(SECONDS)
    assert jobs.cancel(painted_sid, job.id).state == "cancelled"
    go_on.set()
    assert jobs.wait(job.id, timeout=SECONDS).state == "cancelled"
    assert painted_store.state(painted_sid).revision == before
    assert run(jobs, painted_sid, drawn, frames_most=1).state == "done"


def test_a_job_that_has_ended_is_not_cancelled(jobs, painted_sid, drawn):
    job = run(jobs, painted_sid, drawn, frames_most=1)
    assert jobs.cancel(painted_sid, job.id) == job


def test_closing_ends_the_work_and_stores_nothing(painted_store, painted_editor, painted_sid, drawn, paused):
    reached, go_on = paused
    jobs = OutlineJobs(painted_store, painted_editor)
    before = painted_store.state(painted_sid).revision
    job = jobs.start(painted_sid, drawn, frames_most=2, author="ann")
    assert reached.wait(SECONDS)
    closing = threading.Thread(target=jobs.close)
    closing.start()
    go_on.set()
    closing.join(SECONDS)
    assert not closing.is_alive()
    assert jobs.get(painted_sid, job.id).state in ("cancelled", "running")
    assert painted_store.state(painted_sid).revision == before


def test_while_one_is_at_work_on_an_object_it_is_answered(jobs, painted_sid, drawn, paused):
    reached, go_on = paused
    first = jobs.start(painted_sid, drawn, frames_most=1, author="ann")
    assert reached.wait(SECONDS)
    assert jobs.start(painted_sid, drawn, frames_most=1, author="bob").id == first.id
    go_on.set()
    jobs.wait(first.id, timeout=SECONDS)
    assert jobs.start(painted_sid, drawn, frames_most=1, author="bob").id != first.id


def test_a_repeat_with_the_same_key_answers_the_first(jobs, painted_sid, drawn):
    first = run(jobs, painted_sid, drawn, frames_most=1, key="once")
    assert jobs.start(painted_sid, drawn, frames_most=1, author="ann", key="once") == first
    with pytest.raises(BadInput, match="used for something else"):
        jobs.start(painted_sid, drawn, frames_most=2, author="ann", key="once")


def test_a_photograph_of_another_size_fails_the_job_with_its_name(jobs, painted_store, painted_sid, drawn, monkeypatch):
    monkeypatch.setattr("ars_web.masks.photographs.read_image", lambda _: np.zeros((7, 9, 3), np.uint8))
    job = run(jobs, painted_sid, drawn)
    assert job.state == "failed"
    assert job.error is not None
    assert "9 x 7, not its camera's 320 x 240" in job.error


def test_outlines_of_no_one_object_fail_the_job_with_the_frames(jobs, painted, painted_editor, painted_sid):
    box_id = None
    for frame, y in ((0, 0), (4, 190)):
        outer = painted.view(frame).polygons[0].outer * (1, 0.2) + (0, y)
        mask = painted_editor.put_mask(
            painted_sid,
            box_id=box_id,
            frame=frame,
            class_id=0,
            polygons=(type(painted.view(0).polygons[0])(outer),),
            expected_revision=None,
            author="ann",
        )
        box_id = mask.box_id
    job = run(jobs, painted_sid, box_id)
    assert job.state == "failed"
    assert job.error is not None
    assert "frame" in job.error


def test_fewer_than_two_masks_that_count_are_refused(jobs, painted, painted_editor, painted_sid):
    first = draw(painted, painted_editor, painted_sid, 0, box_id=None)
    draw(painted, painted_editor, painted_sid, 4, box_id=first.box_id, accepted=False, origin="proposed")
    with pytest.raises(BadInput, match="has 1 outline that counts, and two are needed"):
        jobs.start(painted_sid, first.box_id, author="ann")


def test_what_is_not_there_is_told(jobs, painted_sid, drawn):
    with pytest.raises(NotFound, match="has no object 99"):
        jobs.start(painted_sid, 99, author="ann")
    with pytest.raises(NotFound):
        jobs.get(painted_sid, "o123")
    job = run(jobs, painted_sid, drawn, frames_most=1)
    with pytest.raises(NotFound):
        jobs.get("another", job.id)


def test_a_locked_box_is_left_alone(jobs, painted_store, painted_editor, painted_sid, drawn):
    box = ObjectBoxes(painted_store, painted_editor).remake(painted_sid, drawn, options=HullOptions(), author="ann")
    painted_editor.change_box(painted_sid, drawn, expected_revision=box.revision, locked=True, author="ann")
    with pytest.raises(Locked):
        jobs.start(painted_sid, drawn, author="ann")


@pytest.mark.parametrize("frames_most", [0, -1, MOST_FRAMES + 1])
def test_numbers_of_frames_that_cannot_be_are_refused(jobs, painted_sid, drawn, frames_most):
    with pytest.raises(BadInput, match="frames can be outlined at a time"):
        jobs.start(painted_sid, drawn, frames_most=frames_most, author="ann")
