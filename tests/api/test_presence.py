"""Who is at a session: told at each change, a few times a second at most, by names that hide nothing."""

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import replace

import pytest

from ars_web.api.presence import LONGEST_SHOWN_NAME, Person, Presence, shown_name

A, B = "a" * 32, "b" * 32
PAUSE = 0.1


def told_during(*steps: Callable[[Presence], None]) -> list[tuple[Person, ...]]:
    """What A is told while the steps are made, and until the presence has no more to say."""
    told: list[tuple[Person, ...]] = []

    async def make() -> None:
        presence = Presence(pause_seconds=PAUSE)
        presence.enter("s", Person(A, "api"), lambda people: told.append(tuple(people)))
        for step in steps:
            step(presence)
        await asyncio.sleep(5 * PAUSE)

    asyncio.run(make())
    return told


def test_each_change_is_told_to_all() -> None:
    heard: list[Sequence[Person]] = []
    first, *_, last = told_during(
        lambda presence: presence.enter("s", Person(B, "page-1"), heard.append),
        lambda presence: presence.update("s", B, name="Bea"),
        lambda presence: presence.update("s", B, place=("frame", 7, 3)),
    )
    assert first == (Person(A, "api"),)
    assert last == (Person(A, "api"), Person(B, "page-1", "Bea", 7, 3, "frame"))
    assert heard == [last]


def test_walking_through_the_frames_does_not_flood() -> None:
    walk = [lambda presence, i=i: presence.update("s", A, place=("frame", i, None)) for i in range(1000)]
    told = told_during(*walk)
    assert len(told) == 2
    assert told[-1][0].frame == 999


def test_what_changes_nothing_is_not_told() -> None:
    assert len(told_during(lambda presence: presence.update("s", A, place=("scene", 0, None)))) == 1


def test_who_leaves_is_told_to_those_who_stay() -> None:
    told = told_during(
        lambda presence: presence.enter("s", Person(B, "page-1"), lambda people: None),
        lambda presence: presence.leave("s", B),
    )
    assert told[-1] == (Person(A, "api"),)


def test_sessions_are_apart_and_an_empty_one_is_forgotten() -> None:
    there: list[list[str]] = []
    told = told_during(
        lambda presence: presence.enter("other", Person(B, "page-1"), lambda people: None),
        lambda presence: presence.update("other", B, name="Bea"),
        lambda presence: there.append([person.name for person in presence.people("other")]),
        lambda presence: presence.leave("other", B),
        lambda presence: there.append([person.name for person in presence.people("other")]),
    )
    assert there == [["Bea"], []]
    assert told == [(Person(A, "api"),)]


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("", ""),
        ("Ana", "Ana"),
        ("  Ana \t\n Lu ", "Ana Lu"),
        ("Zoe\u0308", "Zo\u00eb"),
        ("\u202eanA", "anA"),
        ("A\x00n\x1ba\x7f", "A n a"),
        ("Ana\u200b\u2060\ufeff", "Ana"),
        ("\u200d\u200c", ""),
        ("\ue000\U000e0041", ""),
        ("\U0001f469\u200d\U0001f52c", "\U0001f469\u200d\U0001f52c"),
        ("<img onerror=x>", "<img onerror=x>"),
        ("x" * 500, "x" * LONGEST_SHOWN_NAME),
        ("x" * (LONGEST_SHOWN_NAME - 1) + " y", "x" * (LONGEST_SHOWN_NAME - 1)),
    ],
)
def test_names_are_cleaned(name: str, shown: str) -> None:
    assert shown_name(name) == shown
    assert shown_name(shown) == shown


# Over the live line


@pytest.fixture
def line(server, live_page, sid: str):
    before = server.services
    server.app.state.services = replace(before, scene=live_page.RememberingScene())
    token = {"Authorization": f"Bearer {server.services.door.token}"}
    yield lambda view: live_page.line(server.url, sid, view, **token)
    server.app.state.services = before


def by_view(person: dict[str, object]) -> str:
    return str(person["view"])


def test_pages_see_who_else_is_there(line, live_page, client, sid: str) -> None:
    with line(A) as ana:
        with line(B) as bea:
            ana.say("hello", name="Ana")
            bea.say("hello", name="\u202eBea")
            bea.say("view", **{**live_page.VIEW, "frame": 5, "selected": 2})
            people = [
                {"view": A, "author": "api", "name": "Ana", "frame": 0, "selected": None, "mode": "scene"},
                {"view": B, "author": "api", "name": "Bea", "frame": 5, "selected": 2, "mode": "frame"},
            ]
            for page, view in ((ana, A), (bea, B)):
                seen = [{**one, "own": one["view"] == view} for one in people]
                # Who came first is not said: on a busy machine the second line may be up before the first is joined.
                page.people(lambda told, seen=seen: sorted(told, key=by_view) == seen)
            answer = client.get(f"/api/sessions/{sid}/people", params={"view": B})
            assert sorted(answer.json(), key=by_view) == [{**one, "own": one["view"] == B} for one in people]
        assert [one["view"] for one in ana.people(lambda told: len(told) == 1)] == [A]


def test_people_of_an_unknown_session_are_not_found(client) -> None:
    assert client.get("/api/sessions/nope/people").status_code == 404


def test_people_are_asked_for_by_a_view(client, sid: str) -> None:
    assert client.get(f"/api/sessions/{sid}/people").json() == []
    assert client.get(f"/api/sessions/{sid}/people?view=me").status_code == 422
