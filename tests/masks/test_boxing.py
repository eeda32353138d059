"""Boxes that follow their masks, when others change the same session at the same moment."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ars_web.errors import BadInput, Conflict, ViewsDisagree
from ars_web.geometry.polygon import Polygon
from ars_web.masks import boxing
from ars_web.masks.boxing import ObjectBoxes
from ars_web.masks.views import hull_of, photographs, views_of
from ars_web.recordings.registry import ReadOptions, read_recording
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.model import HullOptions, Mask
from ars_web.sessions.store import SessionStore


class Interrupting(SessionEditor):
    """An editor to whose session something happens just before an object or a mask is put, or one deleted."""

    def __init__(self, store: SessionStore) -> None:
        super().__init__(store)
        self.before_put: list[Any] = []

    def put_object(self, *positional: Any, **named: Any) -> Any:
        self._interrupt()
        return super().put_object(*positional, **named)

    def put_mask(self, *positional: Any, **named: Any) -> Any:
        self._interrupt()
        return super().put_mask(*positional, **named)

    def delete_mask(self, *positional: Any, **named: Any) -> Any:
        self._interrupt()
        return super().delete_mask(*positional, **named)

    def _interrupt(self) -> None:
        if self.before_put:
            self.before_put.pop(0)()


class Ball:
    """A session of the ball's recording, and what makes boxes of its masks."""

    def __init__(self, store: SessionStore, sid: str, scene: Any) -> None:
        self.store, self.sid, self.scene = store, sid, scene
        self.editor = Interrupting(store)
        self.objects = ObjectBoxes(store, self.editor)

    def outline(self, frame: int, **ball: Any) -> tuple[Polygon, ...]:
        return (Polygon(self.scene.outline(frame, **ball)),)

    def make(self, *frames: int, **options: Any) -> Any:
        outlines = [(frame, self.outline(frame)) for frame in frames]
        return self.objects.from_masks(self.sid, outlines, class_id=0, options=HullOptions(**options), author="ann")

    def mask(self, frame: int) -> Mask:
        return next(mask for mask in self.state.masks.values() if mask.frame == frame)

    def change(self, mask: Mask, author: str = "ann", **changes: Any) -> Mask:
        return self.objects.change_mask(self.sid, mask.id, expected_revision=mask.revision, author=author, **changes)

    @property
    def state(self) -> Any:
        return self.store.state(self.sid)

    @property
    def volume(self) -> float:
        (box,) = self.state.boxes.values()
        return hull_of(self.store, self.sid, box).volume


@pytest.fixture
def ball(tmp_path: Path, ring_scene) -> Iterator[Ball]:
    recording = read_recording(ring_scene.write(tmp_path / "ring"), format="ars", options=ReadOptions())
    with SessionStore(tmp_path / "sessions") as store:
        yield Ball(store, store.create(recording, name="ring", class_names=["ball"]).id, ring_scene)


def test_another_mask_that_changes_meanwhile_counts_too(ball: Ball) -> None:
    ball.make(0, 3, 7)
    first, second = ball.mask(0), ball.mask(3)
    smaller = ball.outline(3, radius=0.03)

    def meanwhile() -> None:
        ball.change(second, author="bob", polygons=smaller)

    ball.editor.before_put = [meanwhile]
    after = ball.change(first, polygons=ball.outline(0, radius=0.03))
    assert (after.frame, after.revision) == (0, 3)
    both = ball.volume
    assert [edit.author for edit in ball.store.edits(ball.sid)] == ["ann", "bob", "ann"]
    # What is there is what one who changes both gets.
    again = ball.objects.remake(
        ball.sid,
        after.box_id,
        options=HullOptions(),
        expected_revision=ball.state.boxes[after.box_id].revision,
        author="ann",
    )
    assert hull_of(ball.store, ball.sid, again).volume == pytest.approx(both, rel=1e-9)


def test_the_same_mask_changed_meanwhile_is_a_conflict(ball: Ball) -> None:
    ball.make(0, 3, 7)
    mask = ball.mask(0)
    ball.editor.before_put = [lambda: ball.change(mask, author="bob", polygons=ball.outline(0, radius=0.035))]
    with pytest.raises(Conflict) as conflict:
        ball.change(mask, polygons=ball.outline(0, radius=0.03))
    assert isinstance(conflict.value.current, Mask)
    assert conflict.value.current.revision == 2
    assert ball.state.revision == 2


def test_a_mask_added_to_the_same_frame_meanwhile_is_a_conflict(ball: Ball) -> None:
    box = ball.make(0, 3)

    def add(author: str) -> Mask:
        return ball.objects.add_mask(
            ball.sid, box_id=box.id, frame=7, class_id=None, polygons=ball.outline(7), author=author
        )

    ball.editor.before_put = [lambda: add("bob")]
    with pytest.raises(Conflict, match="has a mask in frame 7 already"):
        add("ann")
    assert ball.state.revision == 2


def test_what_another_drew_meanwhile_can_make_it_disagree(ball: Ball) -> None:
    box = ball.make(0, 3, widen=1.0)

    def meanwhile() -> None:
        shifted = (Polygon(ball.scene.outline(9) - np.array([40, 0])),)
        ball.objects.add_mask(ball.sid, box_id=box.id, frame=9, class_id=0, polygons=shifted, author="bob")

    ball.editor.before_put = [meanwhile]
    # With frame 0 alone it would do: frame 9 looks from the other side.
    shifted = (Polygon(ball.scene.outline(3) - np.array([65, 0])),)
    with pytest.raises(ViewsDisagree):
        ball.change(ball.mask(3), polygons=shifted)
    assert ball.state.revision == 2
    added = ball.mask(9)
    ball.objects.delete_mask(ball.sid, added.id, expected_revision=added.revision, author="bob")
    assert ball.change(ball.mask(3), polygons=shifted).frame == 3


def test_whoever_is_overtaken_again_and_again_is_told(ball: Ball) -> None:
    box = ball.make(0, 3, 7)
    mask = ball.mask(0)

    def rename() -> None:
        before = ball.state.boxes[box.id]
        name = f"{before.name}!"
        ball.editor.change_box(ball.sid, box.id, expected_revision=before.revision, name=name, author="bob")

    ball.editor.before_put = [rename] * boxing.TRIES
    with pytest.raises(Conflict):
        ball.change(mask, polygons=ball.outline(0, radius=0.03))
    ball.editor.before_put = [rename] * (boxing.TRIES - 1)
    assert ball.change(mask, polygons=ball.outline(0, radius=0.03)).frame == 0


@pytest.mark.parametrize("deed", ["add", "change", "delete"])
def test_a_box_that_is_made_meanwhile_follows_all_the_same(ball: Ball, deed: str) -> None:
    first = ball.objects.add_mask(ball.sid, box_id=None, frame=0, class_id=0, polygons=ball.outline(0), author="ann")
    for frame in (3, 9):
        ball.objects.add_mask(
            ball.sid, box_id=first.box_id, frame=frame, class_id=0, polygons=ball.outline(frame), author="ann"
        )

    def make() -> None:
        ball.objects.remake(ball.sid, first.box_id, options=HullOptions(), author="bob")

    ball.editor.before_put = [make]
    smaller = ball.outline(9, radius=0.03)
    if deed == "add":
        ball.objects.add_mask(
            ball.sid, box_id=first.box_id, frame=7, class_id=0, polygons=ball.outline(7), author="ann"
        )
    elif deed == "change":
        ball.change(ball.mask(9), polygons=smaller)
    else:
        ball.objects.delete_mask(ball.sid, ball.mask(9).id, expected_revision=ball.mask(9).revision, author="ann")
    left = ball.volume
    (box,) = ball.state.boxes.values()
    again = ball.objects.remake(ball.sid, box.id, options=HullOptions(), expected_revision=box.revision, author="ann")
    assert hull_of(ball.store, ball.sid, again).volume == pytest.approx(left, rel=1e-9)


def test_a_change_that_changes_nothing_makes_no_edit(ball: Ball) -> None:
    ball.make(0, 3, 7)
    mask = ball.mask(0)
    assert ball.change(mask, polygons=mask.polygons).revision == mask.revision
    assert ball.state.revision == 1


def test_views_hold_the_outlines_as_they_are_kept(ball: Ball) -> None:
    outline = (Polygon(np.array([[10.00049, 5.0], [60.0, 5.0], [40.0, 50.0]])),)
    (view,) = views_of(photographs(ball.store, ball.sid), [(4, outline)])
    assert view.polygons[0].outer[0, 0] == 10.0
    assert np.array_equal(view.T_world_camera, ball.store.frames(ball.sid).Ts_world_camera[4])
    for outlines, words in (
        ([(12, outline)], "no frame 12"),
        ([(-1, outline)], "no frame -1"),
        ([(2, outline), (2, outline)], "frame 2 is given twice"),
        ([(2, ())], "frame 2: an outline needs"),
    ):
        with pytest.raises(BadInput, match=words):
            views_of(ball.store.snapshot(ball.sid), outlines)
