"""Coverage over HTTP: numbers, the frames of a bin, the picture, and what is refused."""

from typing import Any

import httpx
import numpy as np
import pytest


@pytest.fixture
def ball(client: httpx.Client, ring: str) -> int:
    """The id of a box round the ball that all twelve frames see."""
    body = {
        "class_id": 0,
        "T_world_box": {"position": [0.0, 0.0, 0.05], "wxyz": [1.0, 0.0, 0.0, 0.0]},
        "size": [0.08, 0.08, 0.08],
    }
    answer = client.post(f"{ring}/boxes", json=body)
    assert answer.status_code == 201, answer.text
    return answer.json()["id"]


def read(client: httpx.Client, ring: str, query: str) -> dict[str, Any]:
    answer = client.get(f"{ring}/coverage?{query}")
    assert answer.status_code == 200, answer.text
    return answer.json()


def test_the_histogram_is_of_the_cameras_round_the_object(client: httpx.Client, ring: str, ball: int) -> None:
    found = read(client, ring, f"box_id={ball}&azimuth_bins=12&polar_bins=6")
    # Frame i stands at 30 i degrees, at 45 and 20 degrees above the horizon in turn: at 45 and 70 from +z.
    counts = np.array(found["counts"])
    assert counts.shape == (12, 6)
    assert counts.sum(axis=0).tolist() == [0, 6, 6, 0, 0, 0]
    assert counts.sum() == found["frames"] == found["views"] == 12
    assert found["empty_fraction"] == pytest.approx((counts == 0).mean())
    assert len(found["azimuth_edges"]) == 13
    assert found["polar_edges"][-1] == pytest.approx(np.pi)
    equal = found["equal_area"]
    assert len(equal["directions"]) == len(equal["counts"]) == 72
    assert sum(equal["counts"]) == 12
    assert np.allclose(np.linalg.norm(equal["directions"], axis=1), 1.0)


def test_boxes_classes_and_everything_can_be_asked_for(client: httpx.Client, ring: str, ball: int) -> None:
    of_box, of_class, of_all = (read(client, ring, query) for query in (f"box_id={ball}", "class_id=0", ""))
    assert of_box == of_class == of_all
    assert np.array(of_box["counts"]).shape == (36, 18)
    never = client.get(f"{ring}/coverage?class_id=1")
    assert never.status_code == 404
    assert "class 'cube' has no box: it is never labelled" in never.json()["detail"]


def test_the_frames_of_a_bin_are_its_views(client: httpx.Client, ring: str, ball: int) -> None:
    query = f"box_id={ball}&azimuth_bins=12&polar_bins=6"
    found = read(client, ring, query)
    seen: list[int] = []
    for azimuth, polar in np.argwhere(found["counts"]).tolist():
        answer = client.get(f"{ring}/coverage/frames?{query}&azimuth={azimuth}&polar={polar}").json()
        assert answer["total"] == len(answer["items"]) == found["counts"][azimuth][polar]
        assert {item["box_id"] for item in answer["items"]} == {ball}
        seen += [item["frame"] for item in answer["items"]]
    assert sorted(seen) == list(range(12))
    cell = int(np.flatnonzero(found["equal_area"]["counts"])[0])
    assert client.get(f"{ring}/coverage/frames?{query}&cell={cell}").json()["total"] > 0
    some = client.get(f"{ring}/coverage/frames?azimuth_bins=1&polar_bins=1&cell=0&limit=4").json()
    assert [item["frame"] for item in some["items"]] == [1, 4, 7, 10], "spread evenly over all twelve"


def test_an_edit_changes_the_coverage(client: httpx.Client, ring: str, ball: int) -> None:
    before = read(client, ring, f"box_id={ball}")
    revision = client.get(f"{ring}/boxes/{ball}").headers["ETag"]
    # Turned by a quarter about z, and out of nobody's sight.
    place = {"position": [0.0, 0.0, 0.05], "wxyz": [np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]}
    client.patch(f"{ring}/boxes/{ball}", json={"T_world_box": place}, headers={"If-Match": revision})
    after = read(client, ring, f"box_id={ball}")
    assert np.array_equal(np.roll(before["counts"], -9, axis=0).sum(axis=0), np.array(after["counts"]).sum(axis=0))
    assert before["counts"] != after["counts"]


def test_the_picture_is_a_png(client: httpx.Client, ring: str, ball: int) -> None:
    answer = client.get(f"{ring}/coverage/picture?box_id={ball}")
    assert answer.headers["Content-Type"] == "image/png"
    assert answer.content.startswith(b"\x89PNG")
    assert client.get(f"{ring}/coverage/picture?box_id={ball}").content == answer.content


@pytest.mark.parametrize(
    ("query", "status", "said"),
    [
        ("?box_id=99", 404, "has no box 99"),
        ("?class_id=99", 404, "has no class 99"),
        ("?box_id=1&class_id=0", 422, "not both"),
        ("?azimuth_bins=0", 422, "azimuth_bins"),
        ("?polar_bins=361", 422, "polar_bins"),
        ("?min_visible=1.5", 422, "min_visible"),
        ("?min_visible=nan", 422, "min_visible"),
        ("?shape=mesh", 422, "needs a mesh"),
        ("?shape=ball", 422, "shape"),
        ("?min_visble=0.5", 422, "query.min_visble: unknown field"),
        ("/frames", 422, "a bin of equal angles, or a cell"),
        ("/frames?azimuth=3", 422, "a bin of equal angles, or a cell"),
        ("/frames?azimuth=3&polar=2&cell=1", 422, "a bin of equal angles, or a cell"),
        ("/frames?azimuth=40&polar=2", 422, "no bin 40, 2"),
        ("/frames?cell=648", 404, "no bin 648"),
    ],
)
def test_what_is_wrong_is_named(client: httpx.Client, ring: str, ball: int, query: str, status: int, said: str) -> None:
    answer = client.get(f"{ring}/coverage{query}")
    assert answer.status_code == status, answer.text[:500]
    assert answer.headers["Content-Type"] == "application/problem+json"
    assert said in answer.text


def test_each_object_and_class_is_listed_with_what_is_unseen(client: httpx.Client, ring: str, ball: int) -> None:
    empty = client.get(f"{ring}/coverage/objects?azimuth_bins=12&polar_bins=6").json()["items"]
    of_box = read(client, ring, f"box_id={ball}&azimuth_bins=12&polar_bins=6")
    expected = {"frames": 12, "views": 12, "empty_fraction": of_box["equal_area"]["empty_fraction"]}
    assert empty == [{"class_id": 0, "box_id": ball, **expected}, {"class_id": 0, "box_id": None, **expected}]


def test_without_a_box_no_object_is_listed(client: httpx.Client, ring: str) -> None:
    assert client.get(f"{ring}/coverage/objects").json() == {"items": []}
