"""Views that are kept: found once for a question, and never another session's, revision's or option's."""

from dataclasses import replace
from typing import Any

import pytest

from ars_web.datasets.coverage import SessionViews
from ars_web.datasets.options import ExportOptions
from ars_web.sessions.model import FrameTable, SessionSnapshot, SessionState
from ars_web.studies import kept_views
from ars_web.studies.kept_views import KEPT, KeptViews

NOTHING: Any = None
"""In place of frames: what finds views is replaced."""


def session(sid: str, revision: int) -> SessionSnapshot:
    state = SessionState(revision, "a session", {}, {}, 0, 1)
    return SessionSnapshot(sid, state, {}, FrameTable((), (), NOTHING, NOTHING))


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, int, ExportOptions]]:
    """What views were looked for of, each time."""
    looked: list[tuple[str, int, ExportOptions]] = []

    def find(snapshot: SessionSnapshot, options: ExportOptions) -> SessionViews:
        looked.append((snapshot.id, snapshot.state.revision, options))
        return SessionViews((), (), (), NOTHING, NOTHING)

    monkeypatch.setattr(kept_views, "session_views", find)
    return looked


def test_the_same_question_is_answered_from_what_is_kept(asked: list[object]) -> None:
    views, options = KeptViews(), ExportOptions.model_validate({})
    first = views.find(session("s1", 4), options)
    assert views.find(session("s1", 4), options) is first
    # How images come, and how frames are split, decides of no view.
    other = ExportOptions.model_validate({"images": "copy", "split": {"train": 0.5, "val": 0.5}})
    assert views.find(session("s1", 4), other) is first
    assert len(asked) == 1


@pytest.mark.parametrize(
    ("sid", "revision", "given"),
    [
        ("s2", 4, {}),
        ("s1", 5, {}),
        ("s1", 4, {"min_visible": 0.2}),
        ("s1", 4, {"shape": "box"}),
        ("s1", 4, {"max_truncated": 0.2}),
        ("s1", 4, {"min_area_px": 40.0}),
    ],
)
def test_another_question_is_looked_at_anew(
    asked: list[tuple[str, int, ExportOptions]], sid: str, revision: int, given: dict[str, object]
) -> None:
    views, options = KeptViews(), ExportOptions.model_validate({})
    views.find(session("s1", 4), options)
    wanted = ExportOptions.model_validate(given)
    views.find(session(sid, revision), wanted)
    assert asked[1:] == [(sid, revision, wanted)]


def test_no_more_are_kept_than_said(asked: list[object]) -> None:
    views, options = KeptViews(), ExportOptions.model_validate({})
    for revision in (*range(KEPT + 1), KEPT, 0):
        views.find(session("s1", revision), options)
    # The last is still known, the first is not.
    assert len(asked) == KEPT + 2


def test_what_cannot_be_found_is_asked_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept_views, "session_views", lambda snapshot, options: 1 / snapshot.state.revision)
    views, options = KeptViews(), ExportOptions.model_validate({})
    for _ in range(2):
        with pytest.raises(ZeroDivisionError):
            views.find(session("s1", 0), options)
    assert views.find(replace(session("s1", 0), state=session("s1", 2).state), options) == 0.5
