"""Who is at which session, told to all who are there, a few times a second at most."""

import asyncio
import unicodedata
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

LONGEST_SHOWN_NAME = 40
"""Characters of a person's name."""

PAUSE_SECONDS = 0.2
"""Between two tellings of one session; who walks through the frames changes far more often."""

_JOINERS = "\u200c\u200d"
"""Invisible, but part of words and of emoji."""


@dataclass(frozen=True)
class Person:
    """One page that is at a session.

    Attributes:
        view: the page's name for itself.
        author: whose edits are made there.
        name: the person's, cleaned; empty: none given.
        frame: the page's current frame.
        selected: the box that is selected there.
    """

    view: str
    author: str
    name: str = ""
    frame: int = 0
    selected: int | None = None
    mode: Literal["scene", "frame"] = "scene"


Told = Callable[[Sequence[Person]], None]


@dataclass(eq=False)
class _Room:
    """One session: the people by view, how each is told, and when all may be told next."""

    people: dict[str, Person] = field(default_factory=dict[str, Person])
    told: dict[str, Told] = field(default_factory=dict[str, Told])
    not_before: float = 0.0
    waiting: asyncio.TimerHandle | None = None


class Presence:
    """The people of all sessions. Used on the event loop's thread alone.

    A change is told at once, or `pause_seconds` after the one before it was, whatever came between.
    """

    def __init__(self, *, pause_seconds: float = PAUSE_SECONDS) -> None:
        self._pause_seconds = pause_seconds
        self._rooms: dict[str, _Room] = {}

    def people(self, sid: str) -> list[Person]:
        """Who is at the session, in the order they came."""
        room = self._rooms.get(sid)
        return [] if room is None else list(room.people.values())

    def enter(self, sid: str, person: Person, told: Told) -> None:
        """Somebody came; `told` is called with everybody, this one included, now or soon, and at each change."""
        room = self._rooms.setdefault(sid, _Room())
        room.people[person.view] = person
        room.told[person.view] = told
        self._changed(room)

    def update(
        self,
        sid: str,
        view: str,
        *,
        name: str | None = None,
        place: tuple[Literal["scene", "frame"], int, int | None] | None = None,
    ) -> None:
        """Somebody's name, or `place`: mode, frame and selected box; None stays as it is."""
        room = self._rooms[sid]
        before = room.people[view]
        person = before if name is None else replace(before, name=shown_name(name))
        if place is not None:
            mode, frame, selected = place
            person = replace(person, mode=mode, frame=frame, selected=selected)
        if person != before:
            room.people[view] = person
            self._changed(room)

    def leave(self, sid: str, view: str) -> None:
        """Somebody went."""
        room = self._rooms[sid]
        del room.people[view], room.told[view]
        if room.people:
            self._changed(room)
            return
        if room.waiting is not None:
            room.waiting.cancel()
        del self._rooms[sid]

    def _changed(self, room: _Room) -> None:
        if room.waiting is not None:
            return
        loop = asyncio.get_running_loop()
        if loop.time() >= room.not_before:
            self._tell(room)
        else:
            room.waiting = loop.call_at(room.not_before, self._tell, room)

    def _tell(self, room: _Room) -> None:
        room.waiting = None
        room.not_before = asyncio.get_running_loop().time() + self._pause_seconds
        everybody = tuple(room.people.values())
        for told in room.told.values():
            told(everybody)


def shown_name(name: str) -> str:
    """A person's name as others may see it: one line, nothing invisible in it that could make it read as another's,
    at most LONGEST_SHOWN_NAME characters."""
    visible = "".join(character if _is_shown(character) else " " for character in unicodedata.normalize("NFC", name))
    return " ".join(visible.split())[:LONGEST_SHOWN_NAME].strip(" " + _JOINERS)


def _is_shown(character: str) -> bool:
    # C*: control and format characters, among them those that turn the direction of writing; Z*: all kinds of blanks.
    return character in _JOINERS or unicodedata.category(character)[0] not in "CZ"
