"""Where to look next, over HTTP."""

import math
from typing import Any

import httpx
import numpy as np
import pytest

from ars_web.studies.tour_json import TourJson

FEW = {"azimuth_bins": 12, "polar_bins": 6}


@pytest.fixture
def ball(client: httpx.Client, ring: str) -> int:
    """The id of a box round the ball that all twelve frames see."""
    place = {"position": [0.0, 0.0, 0.05], "wxyz": [1.0, 0.0, 0.0, 0.0]}
    answer = client.post(f"{ring}/boxes", json={"class_id": 0, "T_world_box": place, "size": [0.08, 0.08, 0.08]})
    assert answer.status_code == 201, answer.text
    return answer.json()["id"]


def test_a_tour_fills_empty_cells_and_stores_nothing(client: httpx.Client, ring: str, ball: int) -> None:
    before = client.get(ring).json()
    answer = client.post(f"{ring}/coverage/tour", json={"box_ids": [ball], "count": 5, "tilt": [0.2, 1.2], **FEW})
    assert answer.status_code == 200, answer.text
    tour = TourJson.model_validate(answer.json())
    assert client.get(ring).json() == before
    coverage = client.get(f"{ring}/coverage", params={"box_id": ball, **FEW}).json()["equal_area"]
    empty = {cell for cell, count in enumerate(coverage["counts"]) if count == 0}
    assert tour.cells_empty == len(empty)
    filled = [fill.cell for view in tour.views for fill in view.fills]
    assert len(set(filled)) == len(filled) == tour.cells_filled == 5
    assert {one.cell for one in tour.cells_left} == empty - set(filled)
    assert sum(tour.left_by_reason.values()) == len(tour.cells_left)
    assert tour.limits.from_recording == ["distance", "height"]
    for view in tour.views:
        assert view.box_id == ball
        assert view.boxes == [ball]
        assert 0.2 <= view.tilt <= 1.2
        eye = np.array(view.T_world_camera.position)
        assert view.distance == pytest.approx(np.linalg.norm(eye - [0.0, 0.0, 0.05]))
        # The scene's camera sits in the wrist itself.
        assert view.T_world_wrist == view.T_world_camera
        for fill in view.fills:
            x, y, z = (eye - [0.0, 0.0, 0.05]) / view.distance
            assert (fill.azimuth, fill.polar) == pytest.approx((math.atan2(y, x), math.acos(z)))
    path = np.array([tour.start.position, *(view.T_world_camera.position for view in tour.views)])
    assert tour.length == pytest.approx(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


def test_boxes_classes_and_everything_can_be_asked_for(client: httpx.Client, ring: str, ball: int) -> None:
    def of(body: dict[str, Any]) -> dict[str, Any]:
        return client.post(f"{ring}/coverage/tour", json={**body, **FEW, "count": 3}).json()

    assert of({"box_ids": [ball, ball]}) == of({"class_id": 0}) == of({}) == of({"min_visible": 0.5})


@pytest.mark.parametrize(
    ("body", "status", "said"),
    [
        ({"box_ids": [77]}, 404, "has no box 77"),
        ({"box_ids": []}, 422, "box_ids"),
        ({"class_id": 9}, 404, "has no class 9"),
        ({"class_id": 1}, 404, "class 'cube' has no box: it is never labelled"),
        ({"class_id": 0, "box_ids": [1]}, 422, "not both"),
        ({"count": 0}, 422, "count"),
        ({"count": 2001}, 422, "count"),
        ({"distance": [0.9, 0.3]}, 422, "the limits of distance are the wrong way round"),
        ({"distance": [-1, 1]}, 422, "a distance must be more than 0 m"),
        ({"distance": [1]}, 422, "distance"),
        ({"distance": ["0.3", 1]}, 422, "distance"),
        ({"height": [7, 8]}, 422, "no camera is 7 to 8 m high"),
        ({"tilt": [0, 90]}, 422, "a tilt lies between -90 degrees"),
        ({"min_visible": 1.1}, 422, "min_visible"),
        ({"azimuth_bins": 361}, 422, "azimuth_bins"),
        ({"azimuth_bins": 360, "polar_bins": 180}, 422, "at most 2592 cells"),
        ({"start_frame": 12}, 404, "no frame 12"),
        ({"hand_eye": "x"}, 422, "hand_eye"),
    ],
)
def test_what_is_wrong_is_said(
    client: httpx.Client, ring: str, ball: int, body: dict[str, Any], status: int, said: str
) -> None:
    answer = client.post(f"{ring}/coverage/tour", json=body)
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    assert said in answer.text


def test_numbers_that_are_none_are_refused(client: httpx.Client, ring: str, ball: int) -> None:
    for text in ('{"distance": [0.3, NaN]}', '{"height": [0, 1e999]}'):
        answer = client.post(f"{ring}/coverage/tour", content=text, headers={"Content-Type": "application/json"})
        assert answer.status_code == 422
    assert client.post("/api/sessions/nosuchsessin/coverage/tour", json={}).status_code == 404
