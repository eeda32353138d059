"""Which edit an author's undo or redo is about. Each author has one line of history, as in any editor."""

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class LogEntry:
    """What undo needs to know of an edit: its revision, and `undoes` and `redoes` as in `Edit`."""

    revision: int
    undoes: int | None
    redoes: int | None


def to_undo(newest_first: Iterable[LogEntry]) -> int | None:
    """The revision of the newest edit that stands: done or redone, and not taken back since; None without one."""
    taken_back: set[int] = set()
    for entry in newest_first:
        if entry.revision in taken_back:
            continue
        if entry.undoes is None:
            return entry.revision
        taken_back.add(entry.undoes)
    return None


def to_redo(newest_first: Iterable[LogEntry]) -> int | None:
    """The revision of the newest undo that was not redone; None without one, or once something new was done."""
    redone: set[int] = set()
    for entry in newest_first:
        if entry.redoes is not None:
            redone.add(entry.redoes)
        elif entry.undoes is None:
            return None
        elif entry.revision not in redone:
            return entry.revision
    return None
