"""Two people at one session: each sees what the other does, undoes only what is their own, and overwrites nothing."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import expect

FRAME = 4
PLACE = """(name) => {
    const node = window.__viserMutable.nodeRefFromName[name];
    return node && node.position.toArray();
}"""


@pytest.fixture
def together(open_workspace, mug) -> Iterator[tuple[Any, Any, int]]:
    """Ada's page and Bob's, both with the mug selected; Ada stands at a frame's camera, Bob looks on."""
    sessions, sid, mug_id = mug
    with open_workspace(sessions) as (_, _, page_of):
        ada, bob = page_of(sid), page_of(sid)
        for workspace, name in ((ada, "Ada"), (bob, "Bob")):
            workspace.page.add_init_script(f"localStorage.setItem('ars-web.name', '{name}')")
        bob.open(f"#frame=2&box={mug_id}")
        ada.open(f"#frame={FRAME}&box={mug_id}").enter(FRAME)
        yield ada, bob, mug_id


def in_scene(workspace, box_id: int) -> list[float] | None:
    """Where the scene draws a box's centre, metres in the world."""
    return workspace.scene.evaluate(PLACE, f"/boxes/{box_id}/at")


def drawn_at(workspace, box_id: int, position: list[float]) -> bool:
    """Whether the scene draws a box there; its numbers have single precision."""
    return in_scene(workspace, box_id) == pytest.approx(position, abs=1e-6)


def number(workspace, name: str) -> float:
    """A number of the selected box as the page shows it, mm or degrees."""
    return float(workspace.page.get_by_role("spinbutton", name=name, exact=True).input_value().rstrip("°"))


def numbers_are(workspace, position: list[float]) -> bool:
    shown = [number(workspace, f"Position {axis}") for axis in "XYZ"]
    return shown == pytest.approx([1000 * metres for metres in position], abs=0.051)


def typed(workspace, name: str, text: str) -> None:
    field = workspace.page.get_by_role("spinbutton", name=name, exact=True)
    field.fill(text)
    field.press("Enter")


def position(workspace, box_id: int) -> list[float]:
    """As the server has it."""
    return workspace.box(box_id)["T_world_box"]["position"]


def take_arrow(workspace) -> tuple[np.ndarray, np.ndarray]:
    """Press the mouse on the gizmo's x arrow; where that is, and the way along it."""
    workspace.page.keyboard.press("g")
    centre = workspace.on_screen("/edit/gizmo")
    along = workspace.on_screen("/edit/gizmo", 0.05) - centre
    along /= np.linalg.norm(along)
    start = centre + along * 70
    workspace.page.mouse.move(*start)
    workspace.page.wait_for_timeout(300)  # what is under the pointer is found once it rests
    workspace.page.mouse.down()
    return start, along


def pull(workspace, start: np.ndarray, along: np.ndarray, *, pixels: float) -> None:
    """Move the pressed mouse, and wait until the page's own numbers follow."""
    before = number(workspace, "Position X")
    for step in range(1, 9):
        workspace.page.mouse.move(*(start + along * pixels * step / 8))
        workspace.page.wait_for_timeout(30)
    workspace.until(lambda: number(workspace, "Position X") != before)


def changed_by_somebody(workspace, box_id: int, changes: dict[str, Any]) -> dict[str, Any]:
    box = workspace.box(box_id)
    answer = workspace.client.patch(
        f"/api/sessions/{workspace.sid}/boxes/{box_id}", json=changes, headers={"If-Match": f'"{box["revision"]}"'}
    )
    assert answer.status_code == 200, answer.text
    return answer.json()


def test_each_sees_who_else_is_there_and_where(together) -> None:
    ada, bob, _ = together
    expect(ada.page.get_by_role("group", name="Also here: Bob", exact=True)).to_be_visible()
    expect(bob.page.get_by_role("group", name="Also here: Ada", exact=True)).to_be_visible()
    expect(bob.page.get_by_title("Ada is at frame 4", exact=True)).to_be_attached()
    expect(bob.page.get_by_role("img", name="Selected by Ada")).to_be_visible()
    ada.page.keyboard.press(".")
    mark = bob.page.get_by_title("Ada is at frame 5", exact=True)
    expect(mark).to_be_attached()
    track = bob.page.get_by_role("slider", name="Frame", exact=True).bounding_box()
    seen = mark.bounding_box()
    assert seen is not None
    assert track is not None
    assert (seen["x"] + seen["width"] / 2 - track["x"]) / track["width"] == pytest.approx(5.5 / 9, abs=0.01)
    bob.page.get_by_role("group", name="Also here: Ada").get_by_role("button").click()
    expect(bob.page.get_by_role("slider", name="Frame", exact=True)).to_have_attribute("aria-valuenow", "5")
    ada.page.close()
    expect(bob.page.get_by_role("group", name="Also here")).to_have_count(0)
    expect(bob.page.locator(".person-mark")).to_have_count(0)


def test_an_edit_is_seen_by_the_other_and_undone_by_its_author_alone(together) -> None:
    ada, bob, mug_id = together
    first = position(ada, mug_id)
    typed(ada, "Position X", "12.5")
    ada.until(lambda: ada.revision() == 1)
    moved = position(ada, mug_id)
    assert moved == pytest.approx([0.0125, *first[1:]], abs=1e-12)
    bob.until(lambda: numbers_are(bob, moved))
    bob.until(lambda: drawn_at(bob, mug_id, moved))
    expect(bob.page.locator(".saved")).to_have_text("Saved, revision 1")

    other = mug_id - 1
    bob.page.locator(f"[data-box='{other}']").click()
    typed(bob, "Size Z", "77")
    bob.until(lambda: bob.revision() == 2)
    expect(ada.page.locator(".saved")).to_have_text("Saved, revision 2")
    expect(ada.page.locator(f"[data-box='{other}']")).to_contain_text("77 mm")

    # The newest edit is Bob's, and stays; Ada takes back her own.
    ada.page.keyboard.press("Control+z")
    ada.until(lambda: ada.revision() == 3)
    assert position(ada, mug_id) == first
    assert ada.box(other)["size"][2] == pytest.approx(0.077, abs=1e-12)
    bob.until(lambda: drawn_at(bob, mug_id, first))
    ada.page.keyboard.press("Control+y")
    ada.until(lambda: ada.revision() == 4)
    assert position(ada, mug_id) == moved

    # What was Ada's is built upon by Bob: taking it back would take his with it, so she is told and nothing happens.
    bob.page.locator(f"[data-box='{mug_id}']").click()
    bob.until(lambda: numbers_are(bob, moved))
    typed(bob, "Size Z", "66")
    bob.until(lambda: bob.revision() == 5)
    expect(ada.page.locator(".saved")).to_have_text("Saved, revision 5")
    ada.page.keyboard.press("Control+z")
    history = ada.page.get_by_role("region", name="History", exact=True)
    expect(history.get_by_role("alert")).to_contain_text("changed")
    expect(history.get_by_role("listitem").filter(has_text="Bob")).to_have_count(2)
    assert ada.revision() == 5
    bob.page.get_by_role("button", name="Undo", exact=True).click()
    bob.until(lambda: bob.revision() == 6)
    ada.page.keyboard.press("Control+z")
    ada.until(lambda: ada.revision() == 7)
    assert position(ada, mug_id) == first


def test_a_drag_is_seen_by_the_other_before_it_is_released(together) -> None:
    ada, bob, mug_id = together
    first = position(ada, mug_id)
    start, along = take_arrow(ada)
    pull(ada, start, along, pixels=60)
    bob.until(lambda: not numbers_are(bob, first))
    bob.until(lambda: not drawn_at(bob, mug_id, first))
    assert ada.revision() == 0
    assert position(ada, mug_id) == first
    shown = ada.page.locator(".readout")
    expect(shown).to_contain_text("mm")
    expect(bob.page.locator(".readout")).to_have_count(0)

    ada.page.mouse.up()
    ada.until(lambda: ada.revision() == 1)
    dragged = position(ada, mug_id)
    assert dragged != pytest.approx(first, abs=1e-3)
    for workspace in (ada, bob):
        workspace.until(lambda seen=workspace: numbers_are(seen, dragged) and drawn_at(seen, mug_id, dragged))
    expect(shown).to_have_count(0)
    bob.page.keyboard.press("Control+z")  # nothing of Bob's
    ada.page.keyboard.press("Control+z")
    ada.until(lambda: ada.revision() == 2)
    assert position(ada, mug_id) == first


def test_a_drag_that_met_another_edit_is_refused_with_both_shown(together) -> None:
    ada, bob, mug_id = together
    first = ada.box(mug_id)
    for attempt, theirs_mm in enumerate((41.5, 87.5)):
        revision = ada.revision()
        start, along = take_arrow(ada)
        pull(ada, start, along, pixels=50)
        typed(bob, "Position Z", str(theirs_mm))
        bob.until(lambda before=revision: bob.revision() == before + 1)
        theirs = bob.box(mug_id)
        assert theirs["T_world_box"]["position"][2] == pytest.approx(theirs_mm / 1000, abs=1e-12)
        ada.page.mouse.up()

        card = ada.page.get_by_role("region", name="Conflict", exact=True)
        expect(card.get_by_role("alert")).to_be_visible()
        yours = ada.page.evaluate("import('/static/store.js').then((store) => store.conflict.value.yours)")
        cells = card.get_by_role("row").filter(has_text="Position mm").get_by_role("cell").all_inner_texts()
        shown = [float(text.partition(",")[0]) for text in cells]
        mine = yours["T_world_box"]["position"]
        assert shown == pytest.approx([1000 * theirs["T_world_box"]["position"][0], 1000 * mine[0]], abs=0.051)
        assert mine != pytest.approx(theirs["T_world_box"]["position"], abs=1e-3)
        assert ada.box(mug_id) == theirs
        ada.until(lambda now=theirs: drawn_at(ada, mug_id, now["T_world_box"]["position"]))

        if attempt == 0:
            card.get_by_role("button", name="Keep theirs").click()
            expect(card).to_have_count(0)
            ada.until(lambda now=theirs: numbers_are(ada, now["T_world_box"]["position"]))
            assert ada.box(mug_id) == theirs
        else:
            card.get_by_role("button", name="Use mine").click()
            expect(card).to_have_count(0)
            ada.until(lambda before=revision: ada.revision() == before + 2)
            assert position(ada, mug_id) == pytest.approx(mine, abs=1e-12)
            bob.until(lambda now=mine: numbers_are(bob, now) and drawn_at(bob, mug_id, now))
            # Theirs is one step back, in the history of both.
            ada.page.keyboard.press("Control+z")
            ada.until(lambda before=revision: ada.revision() == before + 3)
            assert _place(ada.box(mug_id)) == _place(theirs)
    assert _place(ada.box(mug_id)) != _place(first)


def test_a_typed_number_that_met_another_edit_is_refused_too(together) -> None:
    ada, _, mug_id = together
    held: list[Any] = []
    ada.page.route(
        "**/boxes/*", lambda route: held.append(route) if route.request.method == "PATCH" else route.continue_()
    )
    typed(ada, "Position X", "30")
    ada.until(lambda: held)
    theirs = changed_by_somebody(ada, mug_id, {"size": [0.2, 0.21, 0.22]})
    held.pop().continue_()
    card = ada.page.get_by_role("region", name="Conflict", exact=True)
    expect(card).to_be_visible()
    assert ada.box(mug_id) == theirs
    ada.page.unroute("**/boxes/*")
    card.get_by_role("button", name="Use mine").click()
    ada.until(lambda: ada.revision() == 2)
    assert position(ada, mug_id)[0] == pytest.approx(0.030, abs=1e-12)


def _place(box) -> tuple:
    return tuple(box["T_world_box"]["position"]), tuple(box["T_world_box"]["wxyz"]), tuple(box["size"])
