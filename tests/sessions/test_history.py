"""Undo and redo follow one line per author, whatever order they come in, and the history says what stands."""

from collections.abc import Callable

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from sqlalchemy import event
from sqlalchemy.engine import Engine

from ars_web.errors import NotFound
from ars_web.recordings.recording import Recording
from ars_web.sessions.editing import NothingToUndo, SessionEditor
from ars_web.sessions.history import LogEntry, taken_back, to_redo, to_undo
from ars_web.sessions.store import SessionStore


def test_nothing_done_leaves_nothing_to_undo_or_redo():
    assert to_undo([]) is None
    assert to_redo([]) is None


def stands(entry: LogEntry, log: list[LogEntry]) -> bool:
    """Whether nothing that stands inverts the entry, as the words say it."""
    return not any(stands(later, log) for later in log if entry.revision in (later.undoes, later.redoes))


@given(st.lists(st.sampled_from(["do", "undo", "redo"]), max_size=60))
def test_the_log_gives_what_two_stacks_would(steps: list[str]):
    log: list[LogEntry] = []
    done: list[int] = []
    undone: list[int] = []
    for step in steps:
        newest = list(reversed(log))
        revision = len(log) + 1
        assert to_undo(newest) == (done[-1] if done else None)
        assert to_redo(newest) == (undone[-1] if undone else None)
        assert taken_back(newest) == {entry.revision for entry in log if not stands(entry, log)}
        if step == "do":
            log.append(LogEntry(revision, None, None))
            done.append(revision)
            undone.clear()
        elif step == "undo" and done:
            log.append(LogEntry(revision, done.pop(), None))
            undone.append(revision)
        elif step == "redo" and undone:
            log.append(LogEntry(revision, None, undone.pop()))
            done.append(revision)


@settings(max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(st.tuples(st.sampled_from(["do", "undo", "undo", "redo"]), st.sampled_from(["ann", "bob"])), max_size=30),
    st.integers(1, 9),
)
def test_a_history_is_the_log_in_pages_with_what_stands(
    store: SessionStore, make_recording: Callable[..., Recording], steps: list[tuple[str, str]], limit: int
):
    sid = store.create(make_recording(), name="table").id
    editor = SessionEditor(store)
    for i, (step, author) in enumerate(steps):
        try:
            if step == "do":
                editor.add_class(sid, name=f"{author} {i}", author=author)
            else:
                (editor.undo if step == "undo" else editor.redo)(sid, author=author)
        except NothingToUndo:
            continue
    edits = store.edits(sid)
    log = [LogEntry(edit.revision, edit.undoes, edit.redoes) for edit in edits]
    seen: list[tuple[int, bool]] = []
    before = None
    while before is None or seen[-1][0] > 1:
        page = store.history(sid, author="ann", before=before, limit=limit)
        assert page.revision == len(edits)
        if not page.edits:
            break
        seen += [(edit.revision, edit.revision in page.taken_back) for edit in page.edits]
        before = page.edits[-1].revision
        own = [entry for entry, edit in zip(log, edits, strict=True) if edit.author == "ann"]
        assert (page.can_undo and page.can_undo.revision) == to_undo(reversed(own))
        assert (page.can_redo and page.can_redo.revision) == to_redo(reversed(own))
    assert seen == [(entry.revision, not stands(entry, log)) for entry in reversed(log)]


def test_what_takes_an_edit_back_is_found_by_index(store: SessionStore, editor: SessionEditor, sid: str):
    for name in ("ball", "ring"):
        editor.add_class(sid, name=name, author="me")
        editor.undo(sid, author="me")
    asked: list[str] = []

    def look(connection, cursor, statement: str, parameters: object, context: object, many: bool) -> None:
        if statement.lstrip().startswith(("SELECT", "WITH")) and "edit" in statement:
            plan = connection.exec_driver_sql(f"EXPLAIN QUERY PLAN {statement}", parameters)
            asked.extend(row.detail for row in plan)

    event.listen(Engine, "before_cursor_execute", look)
    try:
        assert store.history(sid, author="me", before=2).taken_back == {1}
    finally:
        event.remove(Engine, "before_cursor_execute", look)
    assert any("edit_by_undone" in step for step in asked)
    assert any("edit_by_redone" in step for step in asked)
    assert [step for step in asked if step.startswith("SCAN edit")] == []


def test_a_history_of_no_session_is_not_found(store: SessionStore, sid: str):
    assert store.history(sid, author="me").edits == ()
    with pytest.raises(NotFound):
        store.history("nosuchsession", author="me")
