"""Places of the world from clicks in images, over HTTP."""

from typing import Any

import httpx
import numpy as np
import pytest

from ars_web.geometry import camera as cameras
from ars_web.geometry import rigid_transform


@pytest.fixture
def seen(server, sid: str):
    """Where frame i shows a point of the world, as an observation."""
    store = server.services.store
    camera, Ts = store.cameras(sid)[0], store.frames(sid).Ts_world_camera

    def observe(frame: int, point: tuple[float, float, float]) -> dict[str, Any]:
        T = rigid_transform.invert(Ts[frame])
        pixels = cameras.pixels_from_camera_points(camera, rigid_transform.transform_points(T, np.array([point])))
        x, y = cameras.image_from_pixels(pixels)[0].tolist()
        return {"frame": frame, "x": x, "y": y}

    return observe


def test_a_point_seen_in_two_frames_is_found(client: httpx.Client, sid: str, seen) -> None:
    point = (0.03, -0.05, -0.6)  # near enough for five centimetres between the cameras to be 7 degrees
    answer = client.post(f"/api/sessions/{sid}/points", json={"observations": [seen(0, point), seen(5, point)]})
    assert answer.status_code == 200, answer.text
    found = answer.json()
    assert found["point"] == pytest.approx(point, abs=1e-9)
    assert found["residuals_px"] == pytest.approx([0, 0], abs=1e-6)
    assert found["angle_degrees"] == pytest.approx(7.07, abs=0.2)
    assert found["warnings"] == []


def test_views_from_one_side_are_warned_of(client: httpx.Client, sid: str, seen) -> None:
    point = (0.0, 0.0, 0.0)
    found = client.post(f"/api/sessions/{sid}/points", json={"observations": [seen(0, point), seen(1, point)]}).json()
    assert found["warnings"] == [
        "The frames see the point from nearly the same side, 0.6 degrees apart, so its distance is uncertain."
        " Mark it in a frame from further round, too."
    ]


def test_a_wrong_place_is_warned_of_by_its_frame(client: httpx.Client, sid: str, seen) -> None:
    point = (0.03, -0.05, -0.6)
    observations = [seen(frame, point) for frame in (0, 2, 3, 5)]
    observations[1]["y"] += 12
    found = client.post(f"/api/sessions/{sid}/points", json={"observations": observations}).json()
    (warning,) = found["warnings"]
    assert warning.startswith(f"The place in frame 2 is {found['residuals_px'][1]:.1f} px off")
    pair = client.post(
        f"/api/sessions/{sid}/points",
        json={"observations": [observations[0] | {"y": observations[0]["y"] + 9}, observations[3]]},
    ).json()
    (warning,) = pair["warnings"]
    assert warning.startswith("The places in frames 0 and 5 do not belong together: they are 4.5 px off any one point")


@pytest.mark.parametrize(
    ("observations", "words"),
    [
        ([(0, 80, 60)], "at least 2"),
        ([(0, 80, 60), (6, 80, 60)], "has no frame 6; its frames are 0 to 5"),
        ([(0, 80, 60), (0, 90, 60)], "frame 0 is given twice"),
        ([(0, 80, 60), (1, 170, 60)], "(170, 60) is not in the image of frame 1, which is 160 x 120 pixels"),
        ([(0, 80, 60), (1, 80, 60)], "frames 0 and 1 are parallel"),
        ([(0, 60, 60), (5, 100, 60)], "meet behind the camera of frame 0"),
        ([(i, 80, 60) for i in range(101)], "at most 100"),
        ([(0, 80, 60), (True, 80, 60)], "observations.1.frame"),
        ([(0, 80, 60), (1, "80", 60)], "observations.1.x"),
    ],
)
def test_places_that_give_no_point_are_refused(client: httpx.Client, sid: str, observations, words: str) -> None:
    body = {"observations": [{"frame": frame, "x": x, "y": y} for frame, x, y in observations]}
    answer = client.post(f"/api/sessions/{sid}/points", json=body)
    assert answer.status_code == 422
    assert words in answer.json()["detail"]


def test_the_curve_in_another_frame_passes_through_the_point(client: httpx.Client, sid: str, seen) -> None:
    point = (0.03, -0.05, -0.6)
    here, there = seen(1, point), seen(4, point)
    answer = client.get(f"/api/sessions/{sid}/frames/4/epipolar", params={"of": 1, "x": here["x"], "y": here["y"]})
    assert answer.status_code == 200, answer.text
    (line,) = answer.json()["lines"]
    line = np.array(line)
    a, along = line[:-1], np.diff(line, axis=0)
    t = np.clip(((np.array([there["x"], there["y"]]) - a) * along).sum(axis=1) / (along**2).sum(axis=1), 0, 1)
    off = np.linalg.norm(a + t[:, None] * along - [there["x"], there["y"]], axis=1)
    assert off.min() < 0.1
    assert len(line) > 2  # bent by the lens


@pytest.mark.parametrize(
    ("index", "query", "status", "words"),
    [
        ("6", "of=0&x=1&y=1", 404, "no frame 6"),
        ("0", "of=6&x=1&y=1", 422, "no frame 6"),
        ("0", "of=-1&x=1&y=1", 422, "no frame -1"),
        ("2", "of=2&x=1&y=1", 422, "another frame"),
        ("0", "of=1&x=-1&y=1", 422, "(-1, 1) is not in the image of frame 1"),
        ("0", "of=1&x=nan&y=1", 422, "query.x"),
        ("0", "of=1&x=inf&y=1", 422, "query.x"),
        ("0", "of=1&x=1", 422, "query.y"),
        ("x", "of=1&x=1&y=1", 422, "path.index"),
    ],
)
def test_a_curve_that_cannot_be_is_refused(
    client: httpx.Client, sid: str, index: str, query: str, status: int, words: str
) -> None:
    answer = client.get(f"/api/sessions/{sid}/frames/{index}/epipolar?{query}")
    assert answer.status_code == status
    assert words in answer.json()["detail"]
