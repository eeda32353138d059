"""A frame's labels of an object that has a hull: the hull's, unless the box's are asked for."""

from typing import Any

import httpx
import numpy as np
import pytest


@pytest.fixture
def ball(client: httpx.Client, ring: str, ring_scene) -> dict[str, Any]:
    """The box of a ball, made from its outlines in six frames."""
    views = [{"frame": frame, "polygons": ring_scene.polygons(frame)} for frame in (0, 1, 3, 4, 6, 7)]
    answer = client.post(f"{ring}/boxes/from-masks", json={"class_id": 0, "views": views})
    assert answer.status_code == 201, answer.text
    return answer.json()


def area(ring: list[list[float]]) -> float:
    x, y = np.array(ring).T
    return float(abs((x * np.roll(y, -1) - np.roll(x, -1) * y).sum() / 2))


def label(client: httpx.Client, ring: str, query: str = "", frame: int = 2) -> dict[str, Any]:
    answer = client.get(f"{ring}/frames/{frame}/labels{query}")
    assert answer.status_code == 200, answer.text
    (found,) = answer.json()
    return found


def test_the_hull_is_what_labels_are_of_unless_the_box_is_asked_for(
    client: httpx.Client, ring: str, ball: dict[str, Any], ring_scene
) -> None:
    usual, box = label(client, ring), label(client, ring, "?shape=box")
    assert label(client, ring, "?shape=hull") == usual
    assert usual["wireframe"] == box["wireframe"]
    truth = np.array(ring_scene.polygons(2)[0]["outer"])
    # No outline was drawn in this frame: the hull's is a little larger than the ball's, the box's much larger.
    true_area = area(truth.tolist())
    assert true_area < area(usual["outline"]) < 1.2 * true_area
    assert area(box["outline"]) > 1.3 * true_area
    sides = np.array([*truth.min(axis=0), *truth.max(axis=0)])
    worst, worst_box = (np.abs(np.array(one["bbox"]) - sides).max() for one in (usual, box))
    assert worst < worst_box
    ring_points = np.array(usual["outline"])
    assert np.abs([*ring_points.min(axis=0), *ring_points.max(axis=0)] - np.array(usual["bbox"])).max() < 0.11


def test_labels_follow_the_hull_as_its_box_is_moved_and_deleted(
    client: httpx.Client, ring: str, ball: dict[str, Any]
) -> None:
    before = np.array(label(client, ring)["bbox"])
    path = f"{ring}/boxes/{ball['id']}"
    grown = client.patch(path, json={"size": [1.2 * s for s in ball["size"]]}, headers={"If-Match": '"1"'})
    assert grown.status_code == 200, grown.text
    after = np.array(label(client, ring)["bbox"])
    assert (after[2:] - after[:2]) / (before[2:] - before[:2]) == pytest.approx(1.2, abs=0.05)
    client.post(f"{ring}/undo")
    assert label(client, ring)["bbox"] == before.tolist()
    client.post(f"{ring}/undo")
    assert client.get(f"{ring}/frames/2/labels").json() == []
