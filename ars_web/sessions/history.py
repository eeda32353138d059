"""Which edits stand, and which one an author's undo or redo is about. Each author has one line of history, as in any
editor."""

from collections.abc import Iterable
from dataclasses import dataclass

from ars_web.sessions.edits import Edit


@dataclass(frozen=True)
class LogEntry:
    """What undo needs to know of an edit: its revision, and `undoes` and `redoes` as in `Edit`."""

    revision: int
    undoes: int | None
    redoes: int | None


@dataclass(frozen=True, eq=False)
class History:
    """Some of a session's log, as one author sees it.

    Attributes:
        revision: of the session.
        edits: newest first.
        taken_back: revisions of those edits whose effect does not stand any more.
        can_undo, can_redo: what the author's next undo or redo is about; None: nothing.
    """

    revision: int
    edits: tuple[Edit, ...]
    taken_back: frozenset[int]
    can_undo: Edit | None
    can_redo: Edit | None


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


def taken_back(newest_first: Iterable[LogEntry]) -> set[int]:
    """The revisions, of these or earlier edits, whose effect does not stand: undone, or redone and undone again.

    An undo is taken back by its redo, and a redo by an undo of it, so newer edits are settled before older ones.
    """
    gone: set[int] = set()
    for entry in newest_first:
        inverted = entry.redoes if entry.undoes is None else entry.undoes
        if inverted is not None and entry.revision not in gone:
            gone.add(inverted)
    return gone


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
