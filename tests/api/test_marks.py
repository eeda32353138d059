"""Marks of a frame over HTTP, and pictures of formats."""

from typing import Any

import cv2
import httpx
import numpy as np
import pytest

FUNCTIONS = ("box", "convex", "outline", "silhouette", "rectangle", "mask", "keypoints")


@pytest.fixture
def ball(client: httpx.Client, ring: str, ring_scene) -> dict[str, Any]:
    """The box of a ball, made from its outlines in six frames."""
    views = [{"frame": frame, "polygons": ring_scene.polygons(frame)} for frame in (0, 1, 3, 4, 6, 7)]
    answer = client.post(f"{ring}/boxes/from-masks", json={"class_id": 0, "views": views})
    assert answer.status_code == 201, answer.text
    return answer.json()


def marks(client: httpx.Client, ring: str, function: str, query: str = "") -> list[dict[str, Any]]:
    answer = client.get(f"{ring}/frames/2/marks?function={function}{query}")
    assert answer.status_code == 200, answer.text
    return answer.json()


@pytest.mark.parametrize("function", FUNCTIONS)
def test_each_function_marks_the_object(client: httpx.Client, ring: str, ball: dict[str, Any], function: str) -> None:
    label = client.get(f"{ring}/frames/2/labels").json()[0]
    (mark,) = marks(client, ring, function)
    assert (mark["box_id"], mark["class_id"]) == (ball["id"], 0)
    if function == "keypoints":
        assert mark["rings"] == []
        assert [point["name"] for point in mark["points"]] == ["centre", *(f"corner {i}" for i in range(8))]
        assert {point["state"] for point in mark["points"]} <= {"unseen", "hidden", "seen"}
        return
    assert mark["points"] == []
    points = np.concatenate([np.array(ring) for ring in mark["rings"]])
    found = [*points.min(axis=0), *points.max(axis=0)]
    # Traced pixels lie within a pixel of the outline; a turned rectangle reaches beyond it.
    slack = {"mask": 1.0, "rectangle": 30.0}.get(function, 0.25)
    assert np.abs(np.array(found) - label["bbox"]).max() <= slack


def test_the_shape_can_be_chosen(client: httpx.Client, ring: str, ball: dict[str, Any]) -> None:
    assert marks(client, ring, "silhouette", "&shape=box") != marks(client, ring, "silhouette")
    answer = client.get(f"{ring}/frames/2/marks?function=silhouette&shape=mesh")
    assert answer.status_code == 422
    assert "needs a mesh" in answer.json()["detail"]


def test_what_is_unknown_is_refused(client: httpx.Client, ring: str) -> None:
    assert client.get(f"{ring}/frames/2/marks?function=oval").status_code == 422
    assert client.get(f"{ring}/frames/2/marks").status_code == 422
    assert client.get(f"{ring}/frames/99/marks?function=box").status_code == 404
    assert client.get(f"{ring}/exports/picture?format=xyz").status_code == 422
    assert client.get(f"{ring}/exports/picture?format=yolo&frame=99").status_code == 404


def test_a_format_is_shown_in_a_picture(client: httpx.Client, ring: str, ball: dict[str, Any]) -> None:
    seen: dict[str, bytes] = {}
    for kind in ("yolo", "coco"):
        answer = client.get(f"{ring}/exports/picture?format={kind}&frame=2")
        assert (answer.status_code, answer.headers["content-type"]) == (200, "image/jpeg")
        assert cv2.imdecode(np.frombuffer(answer.content, np.uint8), 1) is not None
        seen[kind] = answer.content
    assert seen["yolo"] != seen["coco"]


def test_the_formats_say_how_they_are_drawn(client: httpx.Client) -> None:
    found = client.get("/api/formats").json()
    assert [function["name"] for function in found["label_functions"]] == list(FUNCTIONS)
    shows = {writer["format"]: writer["shows"] for writer in found["writers"]}
    assert shows["yolo"] == ["box"]
    assert "outline" in shows["coco"]
