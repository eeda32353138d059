"""`POST …/frames/{index}/segment`: the smart tool."""

import httpx
import numpy as np
import pytest

from ars_web.geometry.mask_regions import iou
from ars_web.geometry.polygon import Polygon


@pytest.fixture
def frames(client: httpx.Client, server, ring_scene, painted_ring) -> str:
    """Where the frames are of a session of the recording with a ball in its pictures."""
    if not (server.root / "painted").exists():
        painted_ring.write(ring_scene, server.root / "painted")
    body = {"name": "painted", "root": "data", "path": "painted", "classes": ["ball"]}
    made = client.post("/api/sessions", json=body)
    assert made.status_code == 201, made.text
    return f"/api/sessions/{made.json()['id']}/frames"


def rough(outline: np.ndarray) -> list[float]:
    (x0, y0), (x1, y1) = outline.min(axis=0), outline.max(axis=0)
    return [x0 - 7.0, y0 - 3.0, x1 + 4.0, y1 + 6.0]


def found(answer: httpx.Response) -> list[Polygon]:
    assert answer.status_code == 200, answer.text
    return [
        Polygon(np.array(one["outer"]), tuple(np.array(hole) for hole in one["holes"]))
        for one in answer.json()["polygons"]
    ]


def test_a_rough_rectangle_finds_the_object(client, frames, ring_scene):
    truth = ring_scene.outline(2)
    answer = client.post(f"{frames}/2/segment", json={"rectangle": rough(truth)})
    assert iou(found(answer), [Polygon(truth)]) > 0.92
    assert answer.json()["seconds"] > 0
    assert sum(len(one["outer"]) for one in answer.json()["polygons"]) < 100


def test_strokes_and_the_answer_before_are_kept_to(client, frames, ring_scene):
    truth = ring_scene.outline(2)
    rectangle = rough(truth)
    before = client.post(f"{frames}/2/segment", json={"rectangle": rectangle}).json()["polygons"]
    x, y = truth.mean(axis=0)
    body = {
        "rectangle": rectangle,
        "start": before,
        "outside": [[[x, y - 20], [x, y + 20]]],
        "inside": [[[rectangle[0] + 2, rectangle[1] + 2]]],
        "brush_width": 4.0,
    }
    polygons = found(client.post(f"{frames}/2/segment", json=body))
    dab = Polygon(np.array([[x - 1, y - 15], [x + 1, y - 15], [x + 1, y + 15], [x - 1, y + 15]]))
    assert iou(polygons, [dab]) == 0
    assert iou(polygons, [Polygon(truth)]) > 0.7


@pytest.mark.parametrize(
    ("body", "told"),
    [
        ({}, "give a rectangle"),
        ({"rectangle": [400, 0, 500, 90]}, "lies outside the image, which is 320 x 240"),
        ({"rectangle": [90, 0, 10, 90]}, "x0 < x1"),
        ({"inside": [[[900, 900]]]}, "lies outside the image"),
        ({"outside": [[[9, 9]]]}, "give a rectangle"),
        ({"rectangle": [1, 2, 3]}, ""),
        ({"rectangle": [10, 10, 50, 50], "brush_width": 0}, ""),
        ({"rectangle": [10, 10, 50, 50], "colour": "red"}, ""),
        ({"rectangle": [10, 10, 50, 50], "inside": [[]]}, ""),
        ({"start": []}, "give a rectangle"),
    ],
)
def test_what_cannot_be_asked_is_refused_with_the_remedy(client, frames, body, told):
    answer = client.post(f"{frames}/2/segment", json=body)
    assert answer.status_code == 422, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    assert told in answer.json()["detail"]


def test_a_frame_that_is_not_there_is_told(client, frames):
    assert client.post(f"{frames}/12/segment", json={"rectangle": [1, 1, 30, 30]}).status_code == 404


def test_a_segmenter_of_ones_own_is_asked(run_server, tmp_path, ring_scene, painted_ring, tiny_network):
    """The network finds what is red, and so leaves out the ball's orange middle, which GrabCut does not."""
    painted_ring.write(ring_scene, tmp_path / "root" / "painted")
    with run_server(tmp_path, segmenter=tiny_network.redness(tmp_path / "red.onnx")) as server:
        body = {"name": "painted", "root": "data", "path": "painted", "classes": ["ball"]}
        sid = server.client.post("/api/sessions", json=body).json()["id"]
        truth = ring_scene.outline(2)
        polygons = found(server.client.post(f"/api/sessions/{sid}/frames/2/segment", json={"rectangle": rough(truth)}))
    assert iou(polygons, [Polygon(truth)]) > 0.9
