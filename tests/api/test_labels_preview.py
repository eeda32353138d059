"""Labels of boxes that are not stored, over HTTP."""

from typing import Any

import httpx
import pytest

from ars_web.api.labels_preview import FramePreviewJson


def unstored(box_json: dict[str, Any], **changes: Any) -> dict[str, Any]:
    return {"T_world_box": box_json["T_world_box"], "size": box_json["size"], **changes}


def test_a_box_looks_as_it_would_if_it_were_stored(client: httpx.Client, sid: str, box_json: dict[str, Any]) -> None:
    draft = {"boxes": [unstored(box_json)], "frames": [4, 0]}
    answer = client.post(f"/api/sessions/{sid}/labels", json=draft)
    assert answer.status_code == 200, answer.text
    previews = [FramePreviewJson.model_validate(one) for one in answer.json()]
    assert [one.frame for one in previews] == [4, 0]
    client.post(f"/api/sessions/{sid}/boxes", json=box_json)
    for preview in previews:
        (label,) = preview.labels
        (stored,) = client.get(f"/api/sessions/{sid}/frames/{preview.frame}/labels").json()
        assert label.bbox == pytest.approx(stored["bbox"], abs=0.01)
        assert label.truncated == stored["truncated"]
        assert len(label.wireframe) == 12
        for ours, theirs in (
            (label.outline, stored["outline"]),
            *zip(label.wireframe, stored["wireframe"], strict=True),
        ):
            for point, want in zip(ours, theirs, strict=True):
                assert point == pytest.approx(want, abs=0.01)


def test_nothing_is_stored(server, client: httpx.Client, sid: str, box_json: dict[str, Any]) -> None:
    before = client.get(f"/api/sessions/{sid}").json()
    client.post(f"/api/sessions/{sid}/labels", json={"boxes": [unstored(box_json)], "frames": [0]})
    assert client.get(f"/api/sessions/{sid}").json() == before
    assert client.get(f"/api/sessions/{sid}/boxes").json() == []
    assert server.services.store.edits(sid) == []


def test_boxes_come_in_the_order_given_those_out_of_sight_included(
    client: httpx.Client, sid: str, box_json: dict[str, Any]
) -> None:
    behind = unstored(box_json, T_world_box={"position": [0, 0, -3], "wxyz": [1, 0, 0, 0]})
    small = unstored(box_json, size=[0.02, 0.02, 0.02])
    draft = {"boxes": [behind, small, unstored(box_json)], "frames": [1]}
    (one,) = client.post(f"/api/sessions/{sid}/labels", json=draft).json()
    unseen, little, large = one["labels"]
    assert unseen == {"bbox": None, "outline": [], "wireframe": [], "truncated": 1.0}
    assert little["bbox"][0] > large["bbox"][0] + 5


def test_as_many_as_are_allowed(client: httpx.Client, sid: str, box_json: dict[str, Any]) -> None:
    draft = {"boxes": [unstored(box_json)] * 50, "frames": [i % 6 for i in range(300)]}
    answer = client.post(f"/api/sessions/{sid}/labels", json=draft)
    assert answer.status_code == 200
    assert [len(one["labels"]) for one in answer.json()] == [50] * 300


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"frames": []}, "frames"),
        ({"frames": [0] * 301}, "at most 300"),
        ({"boxes": []}, "boxes"),
        ({"boxes": 51}, "at most 50"),
        ({"frames": [6]}, "there is no frame 6; the session's frames are 0 to 5"),
        ({"frames": [-1]}, "frames.0"),
        ({"frames": [2**70]}, "frames.0"),
        ({"frames": [True]}, "frames.0"),
        ({"frames": ["0"]}, "frames.0"),
        ({"class_id": 0}, "class_id"),
    ],
)
def test_what_cannot_be_is_refused(
    client: httpx.Client, sid: str, box_json: dict[str, Any], changes: dict[str, Any], words: str
) -> None:
    draft: dict[str, Any] = {"boxes": [unstored(box_json)], "frames": [0], **changes}
    if draft["boxes"] == 51:
        draft["boxes"] = [unstored(box_json)] * 51
    answer = client.post(f"/api/sessions/{sid}/labels", json=draft)
    assert answer.status_code == 422
    assert words in answer.json()["detail"]


@pytest.mark.parametrize("size", [[0, 1, 1], [1, 1], [1e9, 1, 1], [None, 1, 1]])
def test_a_box_that_cannot_be_is_refused(client: httpx.Client, sid: str, box_json: dict[str, Any], size: Any) -> None:
    answer = client.post(f"/api/sessions/{sid}/labels", json={"boxes": [unstored(box_json, size=size)], "frames": [0]})
    assert answer.status_code == 422
    assert "boxes.0.size" in answer.json()["detail"]


def test_an_unknown_session_is_not_found(client: httpx.Client, box_json: dict[str, Any]) -> None:
    draft = {"boxes": [unstored(box_json)], "frames": [0]}
    assert client.post("/api/sessions/aaaaaaaaaaaa/labels", json=draft).status_code == 404
