"""Undo and redo follow one line per author, whatever order they come in."""

from hypothesis import given
from hypothesis import strategies as st

from ars_web.sessions.history import LogEntry, to_redo, to_undo


def test_nothing_done_leaves_nothing_to_undo_or_redo():
    assert to_undo([]) is None
    assert to_redo([]) is None


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
