"""What browsers are sent of an object's coverage and of proposed cameras, and what clicks on the sphere mean."""

import dataclasses
import json
import queue
import re
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ars_web.geometry.sphere_bins import SphereBins
from ars_web.geometry.symmetry import Symmetry
from ars_web.scene import coverage_sphere, session_scene
from ars_web.scene.coverage_sphere import chosen_lines, heat_colors, sphere_glb
from ars_web.scene.server import SceneServers
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.store import SessionStore
from ars_web.studies.sphere_counts import SphereCounts
from ars_web.workspace import CoverageSight, DirectionPicked, Picked, ProposedCamera, ViewEvent, ViewState

VIEW = "a" * 32
SPHERE = "/coverage/sphere"
BINS = SphereBins(12, 6)
SIGHT = CoverageSight(box_id=1, azimuth_bins=12, polar_bins=6)
TOKENS = Path(__file__).parents[2] / "static" / "styles" / "tokens.css"


@pytest.fixture
def events() -> "queue.Queue[ViewEvent]":
    return queue.Queue()


@pytest.fixture
def scenes(
    store: SessionStore, editor: SessionEditor, sid: str, events: "queue.Queue[ViewEvent]"
) -> Iterator[SceneServers]:
    with SceneServers(store, editor) as scenes:
        scenes.attach(sid, VIEW, author="page-a", send=events.put)
        yield scenes


@pytest.fixture
def visitor(scenes: SceneServers, sid: str, visit: Callable[..., Any]) -> Iterator[Any]:
    scenes.show(sid, VIEW, ViewState(coverage=SIGHT))
    with visit(scenes.address(sid, view=VIEW, author="page-a")) as visitor:
        visitor.listen_until(lambda v: SPHERE in v.nodes)
        yield visitor


def of_cells(glb: bytes, bins: SphereBins = BINS) -> tuple[list[tuple[int, ...]], int]:
    """The colours that cells have, and how many vertices dots have."""
    length = int.from_bytes(glb[12:16], "little")
    told, data = json.loads(glb[20 : 20 + length]), glb[28 + length :]
    assert told["materials"][0]["alphaMode"] == "BLEND"

    def read(name: str, dtype: type, columns: int) -> np.ndarray:
        accessor = told["accessors"][told["meshes"][0]["primitives"][0]["attributes"][name]]
        start = told["bufferViews"][accessor["bufferView"]].get("byteOffset", 0)
        return np.frombuffer(data, dtype, accessor["count"] * columns, start).reshape(-1, columns)

    colors, vertices = read("COLOR_0", np.uint8, 4), read("POSITION", np.float32, 3).astype(float)
    on_sphere = np.linalg.norm(vertices, axis=1) < 1.002
    # Corners lie within their cells, since there is a gap between two.
    cells = bins.of(vertices[on_sphere])[1]
    found = [{tuple(color) for color in colors[on_sphere][cells == cell].tolist()} for cell in range(bins.cells)]
    assert all(len(of_one) == 1 for of_one in found)
    return [one.pop() for one in found], int((~on_sphere).sum())


def mesh_of(visitor: Any) -> bytes:
    data = visitor.nodes[SPHERE]["glb_data"]
    return data if isinstance(data, bytes) else bytes(bytearray(data))


def test_cells_have_the_colours_of_their_counts_and_holes_a_dot() -> None:
    counts = np.zeros(BINS.cells, dtype=np.int64)
    counts[[3, 20, 40]] = [1, 8, 64]
    for dark in (True, False):
        colors, dots = of_cells(sphere_glb(BINS, counts, dark=dark))
        assert dots == (BINS.cells - 3) * 9
        assert len(set(colors)) == 4
        assert len({colors[cell] for cell in range(BINS.cells) if counts[cell] == 0}) == 1
        assert colors[3] != colors[0]
        assert colors[40][3] > colors[0][3]  # what is seen is less transparent
        assert len({tuple(color[:3]) for color in colors}) == 4
    assert of_cells(sphere_glb(BINS, counts, dark=True))[0][0] != of_cells(sphere_glb(BINS, counts, dark=False))[0][0]
    assert of_cells(sphere_glb(BINS, counts + 1, dark=True))[1] == 0


def test_heat_grows_with_the_logarithm_and_is_the_pages() -> None:
    tokens = dict(
        re.findall(r"--(heat-\d|hole-dot|proposed): (#\w{6})", TOKENS.read_text().partition('data-theme="light"')[0])
    )
    assert tuple(tokens[f"heat-{i + 1}"] for i in range(7)) == coverage_sphere.HEAT
    assert tokens["hole-dot"] == coverage_sphere.HOLE_DOT[True]
    low, middle, high = heat_colors(np.array([1, 8, 64])).tolist()
    assert [low, middle, high] == [list(bytes.fromhex(coverage_sphere.HEAT[i][1:])) for i in (0, 3, 6)]
    assert heat_colors(np.array([1, 1, 0])).tolist()[:2] == [high, high]


def test_the_sphere_stands_round_the_box_and_is_drawn_anew_only_for_another_count(
    visitor: Any, scenes: SceneServers, editor: SessionEditor, store: SessionStore, sid: str
) -> None:
    box = store.state(sid).boxes[1]
    assert np.allclose(visitor.nodes["/coverage"]["position"], box.box.T_world_box[:3, 3])
    assert visitor.nodes[SPHERE]["scale"] == pytest.approx(coverage_sphere.RADIUS * np.linalg.norm(box.box.size))
    colors, dots = of_cells(mesh_of(visitor))
    assert dots == 9 * (BINS.cells - sum(color != colors[-1] for color in colors))
    before = len([one for one in visitor.told if one.get("name") == SPHERE and "glb_data" in one.get("updates", {})])
    scenes.show(sid, VIEW, ViewState(coverage=dataclasses.replace(SIGHT, chosen_cell=20)))
    visitor.listen_until(lambda v: "/coverage/chosen" in v.nodes)
    assert before == len(
        [one for one in visitor.told if one.get("name") == SPHERE and "glb_data" in one.get("updates", {})]
    )
    T = box.box.T_world_box.copy()
    T[:3, 3] += [0.0, 0.0, 0.3]
    was = mesh_of(visitor)
    editor.change_box(sid, 1, expected_revision=box.revision, T_world_box=T, author="a")
    visitor.listen_until(lambda v: np.allclose(v.nodes["/coverage"]["position"], T[:3, 3]))
    visitor.listen_until(lambda v: mesh_of(v) != was)
    scenes.show(sid, VIEW, ViewState())
    visitor.listen_until(lambda v: v.nodes["/coverage"]["visible"] is False)


def test_in_the_other_theme_holes_have_its_colours(visitor: Any, scenes: SceneServers, sid: str) -> None:
    was = mesh_of(visitor)
    scenes.show(sid, VIEW, ViewState(coverage=SIGHT, dark=not ViewState().dark))
    visitor.listen_until(lambda v: mesh_of(v) != was)
    before, after = of_cells(was)[0], of_cells(mesh_of(visitor))[0]
    hole = min(after, key=lambda color: color[3])
    assert hole not in before


def test_a_click_on_the_sphere_is_a_direction_and_beside_it_is_not(
    visitor: Any, store: SessionStore, sid: str, events: "queue.Queue[ViewEvent]"
) -> None:
    box = store.state(sid).boxes[1].box
    centre = box.T_world_box[:3, 3]
    towards = box.T_world_box[:3, :3] @ np.array([0.3, -0.5, 0.6])
    angles, cells = BINS.of(np.array([[0.3, -0.5, 0.6]]))
    visitor.click(centre + 3.0 * towards, centre)
    assert events.get(timeout=20) == DirectionPicked(int(angles[0]), int(cells[0]))
    # From within, beside the box, it is the wall ahead.
    visitor.click(centre + 0.1 * towards, centre + towards)
    assert events.get(timeout=20) == DirectionPicked(int(angles[0]), int(cells[0]))
    visitor.click(centre + 5.0, centre + np.array([9.0, 5.0, 5.0]))
    assert events.get(timeout=20) == Picked()


def test_until_another_sphere_is_counted_there_is_none_to_click(
    visitor: Any,
    scenes: SceneServers,
    store: SessionStore,
    sid: str,
    events: "queue.Queue[ViewEvent]",
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    counted, go = session_scene.sphere_counts, threading.Event()

    def slow(*given: Any, **more: Any) -> SphereCounts:
        assert go.wait(20)
        return counted(*given, **more)

    monkeypatch.setattr(session_scene, "sphere_counts", slow)
    box = store.state(sid).boxes[1].box
    centre = box.T_world_box[:3, 3]
    eye = centre + 3.0 * box.T_world_box[:3, :3] @ np.array([0.3, -0.5, 0.6])
    few = SphereBins(6, 3)
    scenes.show(sid, VIEW, ViewState(coverage=dataclasses.replace(SIGHT, azimuth_bins=6, polar_bins=3)))
    visitor.listen_until(lambda v: v.nodes["/coverage"]["visible"] is False)
    visitor.click(eye, centre)
    assert isinstance(events.get(timeout=20), Picked)
    go.set()
    visitor.listen_until(lambda v: v.nodes["/coverage"]["visible"] is True)
    visitor.click(eye, centre)
    angles, cells = few.of(np.array([[0.3, -0.5, 0.6]]))
    assert events.get(timeout=20) == DirectionPicked(int(angles[0]), int(cells[0]))


def test_a_box_that_is_not_there_has_no_sphere(
    visitor: Any, scenes: SceneServers, sid: str, events: "queue.Queue[ViewEvent]"
) -> None:
    scenes.show(sid, VIEW, ViewState(coverage=dataclasses.replace(SIGHT, box_id=99)))
    visitor.listen_until(lambda v: v.nodes["/coverage"]["visible"] is False)
    visitor.click(np.array([9.0, 9.0, 9.0]), np.array([10.0, 10.0, 10.0]))
    assert events.get(timeout=20) == Picked()


def test_all_that_are_drawn_as_the_chosen_one_are_outlined() -> None:
    chosen = dataclasses.replace(SIGHT, chosen_bin=8)
    one, both = (
        len(chosen_lines(chosen, symmetry))
        for symmetry in (Symmetry(), Symmetry("discrete", rotations=(((0.0, 0.0, 1.0), 2),)))
    )
    assert one > 0
    assert both in (one, 2 * one)
    assert len(chosen_lines(SIGHT, Symmetry())) == 0


def test_proposed_cameras_are_shown_in_their_order_and_go(visitor: Any, scenes: SceneServers, sid: str) -> None:
    cameras = tuple(ProposedCamera((0.1 * i, 0.2, 0.9), (0.0, 1.0, 0.0, 0.0)) for i in range(3))
    scenes.show(sid, VIEW, ViewState(coverage=SIGHT, tour=cameras))
    visitor.listen_until(lambda v: "/tour/way" in v.nodes)
    way = np.array(visitor.nodes["/tour/way"]["points"], dtype=float).reshape(-1, 2, 3)
    focus = visitor.nodes["/tour"]["position"]
    assert np.allclose(way + focus, [[cameras[i].position, cameras[i + 1].position] for i in range(2)], atol=1e-5)
    assert np.array(visitor.nodes["/tour/cameras"]["points"]).reshape(-1, 2, 3).shape == (24, 2, 3)
    scenes.show(sid, VIEW, ViewState(tour=cameras[:1]))
    visitor.listen_until(lambda v: np.array(v.nodes["/tour/cameras"]["points"]).size == 8 * 6)
    scenes.show(sid, VIEW, ViewState())
    visitor.listen_until(lambda v: v.nodes["/tour"]["visible"] is False)
