"""Which frames tell most of a box, over HTTP."""

from typing import Any

import httpx
import numpy as np
import pytest

from ars_web.api import telling as module
from ars_web.geometry.box_sensitivity import telling_frames


@pytest.fixture
def box_path(client: httpx.Client, sid: str, box_json: dict[str, Any]) -> str:
    return client.post(f"/api/sessions/{sid}/boxes", json=box_json).headers["location"]


def test_the_frames_are_those_of_the_geometry(server, client: httpx.Client, sid: str, box_path: str) -> None:
    found = client.get(f"{box_path}/telling-frames?count=3").json()
    store = server.services.store
    frames, box = store.frames(sid), store.state(sid).boxes[1].box
    want = telling_frames(store.cameras(sid), frames.camera_ids, frames.Ts_world_camera, box, count=3)
    assert [(one["frame"], one["px_per_mm"]) for one in found] == [
        (one.frame, round(one.px_per_metre / 1000, 4)) for one in sorted(want, key=lambda one: one.frame)
    ]
    for one in found:
        label = client.get(f"/api/sessions/{sid}/frames/{one['frame']}/labels").json()[0]
        x0, y0, x1, y1 = one["crop"]
        assert 0 <= x0 <= label["bbox"][0] - 4
        assert 0 <= y0 <= label["bbox"][1] - 4
        assert 160 >= x1 >= label["bbox"][2] + 4
        assert 120 >= y1 >= label["bbox"][3] + 4
        assert 3 * (x1 - x0) == 4 * (y1 - y0)
        picture = client.get(
            f"/api/sessions/{sid}/frames/{one['frame']}/image", params={"crop": f"{x0},{y0},{x1},{y1}"}
        )
        assert picture.status_code == 200


def test_six_are_given_where_nothing_else_is_asked_for(client: httpx.Client, box_path: str) -> None:
    assert [one["frame"] for one in client.get(f"{box_path}/telling-frames").json()] == list(range(6))
    assert len(client.get(f"{box_path}/telling-frames?count=24").json()) == 6  # the recording has no more


def test_the_answer_is_that_of_the_box_as_it_is(client: httpx.Client, box_path: str) -> None:
    before = client.get(f"{box_path}/telling-frames").json()
    assert client.get(f"{box_path}/telling-frames").json() == before
    nearer = {"T_world_box": {"position": [0, 0, -0.4], "wxyz": [1, 0, 0, 0]}}
    client.patch(box_path, json=nearer, headers={"If-Match": '"1"'})
    after = client.get(f"{box_path}/telling-frames").json()
    assert min(one["px_per_mm"] for one in after) > max(one["px_per_mm"] for one in before)


def test_what_was_found_is_kept_while_the_box_stays(server, client: httpx.Client, box_path: str, monkeypatch) -> None:
    client.get(f"{box_path}/telling-frames")

    def fail(*args: object, **options: object) -> None:
        raise AssertionError("looked for again")

    monkeypatch.setattr(module, "telling_frames", fail)
    assert client.get(f"{box_path}/telling-frames").status_code == 200
    renamed = client.patch(box_path, json={"name": "another"}, headers={"If-Match": '"1"'})
    assert renamed.status_code == 200
    assert client.get(f"{box_path}/telling-frames").status_code == 200


def test_a_box_that_no_frame_shows_has_none(client: httpx.Client, sid: str, box_json: dict[str, Any]) -> None:
    behind = {**box_json, "T_world_box": {"position": [0, 0, -3], "wxyz": [1, 0, 0, 0]}}
    path = client.post(f"/api/sessions/{sid}/boxes", json=behind).headers["location"]
    assert client.get(f"{path}/telling-frames").json() == []


@pytest.mark.parametrize(("tail", "status"), [("boxes/9/telling-frames", 404), ("boxes/x/telling-frames", 422)])
def test_an_unknown_box_is_not_found(client: httpx.Client, sid: str, tail: str, status: int) -> None:
    assert client.get(f"/api/sessions/{sid}/{tail}").status_code == status


@pytest.mark.parametrize("count", ["0", "25", "-1", "x", "1.5"])
def test_a_count_that_cannot_be_is_refused(client: httpx.Client, box_path: str, count: str) -> None:
    assert client.get(f"{box_path}/telling-frames?count={count}").status_code == 422


def test_the_generated_recording_has_frames_from_all_sides(server, client: httpx.Client, demo_recording) -> None:
    import shutil

    shutil.copytree(demo_recording.folder, server.root / "generated")
    made = client.post(
        "/api/sessions", json={"name": "generated", "root": "data", "path": "generated", "classes": ["thing"]}
    )
    sid = made.json()["id"]
    box = demo_recording.objects[0].box
    from ars_web.sessions.boxes_json import transform_json

    draft = {"class_id": 0, "T_world_box": transform_json(box.T_world_box), "size": box.size.tolist()}
    path = client.post(f"/api/sessions/{sid}/boxes", json=draft).headers["location"]
    found = client.get(f"{path}/telling-frames?count=4").json()
    centres = demo_recording.Ts_world_camera[[one["frame"] for one in found], :3, 3] - box.T_world_box[:3, 3]
    sides = centres / np.linalg.norm(centres, axis=1, keepdims=True)
    assert len(found) == 4
    assert np.degrees(np.arccos((sides @ sides.T - 2 * np.eye(4)).max())) >= 10
