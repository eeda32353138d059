"""Edits: every change to a session is one of these, and its inverse is one too.

An `Edit` is a list of changes, each holding what it found and what it left. So the inverse swaps the two, undo
appends an inverse edit, and an edit that no longer finds what it expects is a conflict, never a silent loss.
"""

from dataclasses import dataclass
from datetime import datetime

from ars_web.sessions.model import ObjectClass, VirtualBox


@dataclass(frozen=True, eq=False)
class BoxChange:
    """One box from `before` to `after`; None before: it is added; None after: it is deleted."""

    box_id: int
    before: VirtualBox | None
    after: VirtualBox | None


@dataclass(frozen=True)
class ClassChange:
    """One class from `before` to `after`; None before: it is added; None after: it is deleted."""

    class_id: int
    before: ObjectClass | None
    after: ObjectClass | None


@dataclass(frozen=True)
class NameChange:
    """The session's own name."""

    before: str
    after: str


Change = BoxChange | ClassChange | NameChange


@dataclass(frozen=True, eq=False)
class Edit:
    """One entry of the log; applying it makes `revision`.

    Attributes:
        revision: the session's revision after it, gap-free from 1.
        author: who, as the door that took it in calls them (`local`, `cli`, a page's user); undo is each author's own.
        summary: one line for the history, such as `Move cube`.
        changes: applied together or not at all.
        undoes: the revision whose edit this one inverts, for undo; None otherwise.
        redoes: the revision of the undo that this one inverts, for redo; None otherwise.
        at: UTC.
    """

    revision: int
    author: str
    summary: str
    changes: tuple[Change, ...]
    undoes: int | None
    redoes: int | None
    at: datetime
