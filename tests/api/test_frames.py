"""Frames, cameras, images and labels over HTTP."""

import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import cv2
import httpx
import numpy as np
import pytest

from ars_web.api import frames as frames_module
from ars_web.api.models import FrameJson, FramePage, LabelJson
from ars_web.geometry.camera import rectified


def decoded(answer: httpx.Response) -> np.ndarray:
    assert answer.status_code == 200, answer.text
    return cv2.imdecode(np.frombuffer(answer.content, np.uint8), cv2.IMREAD_COLOR)


def test_frames_come_in_pages(client: httpx.Client, sid: str) -> None:
    path = f"/api/sessions/{sid}/frames"
    page = FramePage.model_validate(client.get(path).json())
    assert (page.offset, page.limit, page.total, len(page.items)) == (0, 1000, 6, 6)
    some = client.get(path, params={"offset": 4, "limit": 5}).json()
    assert [frame["index"] for frame in some["items"]] == [4, 5]
    assert client.get(path, params={"offset": 6}).json()["items"] == []
    assert client.get(path, params={"offset": 2**53 - 1}).json()["items"] == []
    frame = FrameJson.model_validate(some["items"][0])
    assert (frame.name, frame.camera_id) == ("00004.jpg", 0)
    assert frame.T_world_camera.position == pytest.approx((0.04, 0, -1))
    assert frame.T_world_camera.wxyz == (1, 0, 0, 0)


@pytest.mark.parametrize(
    "query", ["offset=-1", "offset=9007199254740992", "limit=0", "limit=10001", "limit=x", "offset=1.5"]
)
def test_a_page_that_cannot_be_is_refused(client: httpx.Client, sid: str, query: str) -> None:
    assert client.get(f"/api/sessions/{sid}/frames?{query}").status_code == 422


def test_cameras_are_opencvs(client: httpx.Client, sid: str) -> None:
    (camera,) = client.get(f"/api/sessions/{sid}/cameras").json()
    assert camera == {
        "id": 0,
        "width": 160,
        "height": 120,
        "fx": 150.0,
        "fy": 150.0,
        "cx": 79.5,
        "cy": 59.5,
        "model": "brown",
        "distortion": [-0.1, 0.01, 0.0, 0.0, 0.0],
    }


def test_an_image_as_it_is_comes_byte_for_byte(server, client: httpx.Client, sid: str) -> None:
    answer = client.get(f"/api/sessions/{sid}/frames/2/image")
    assert answer.content == (server.root / "scene" / "images" / "00002.jpg").read_bytes()
    assert answer.headers["content-type"] == "image/jpeg"
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert answer.headers["cache-control"].startswith("private, max-age=")


@pytest.mark.parametrize(
    ("width", "size"), [(160, (160, 120)), (80, (80, 60)), (50, (50, 38)), (20, (20, 15)), (1, (1, 1))]
)
def test_an_image_comes_as_small_as_asked(client: httpx.Client, sid: str, width: int, size: tuple[int, int]) -> None:
    image = decoded(client.get(f"/api/sessions/{sid}/frames/3/image?width={width}"))
    assert image.shape[1::-1] == size
    if width >= 20:  # its top left is red
        assert np.abs(image[size[1] // 8, size[0] // 8].astype(int) - (0, 0, 255)).max() < 12


def test_an_image_is_never_enlarged(client: httpx.Client, sid: str) -> None:
    assert decoded(client.get(f"/api/sessions/{sid}/frames/3/image?width=5000")).shape == (120, 160, 3)


def test_a_rectified_image_is_what_the_pinhole_camera_sees(server, client: httpx.Client, sid: str) -> None:
    path = f"/api/sessions/{sid}/frames/3/image"
    image = decoded(client.get(f"{path}?rectified=true"))
    camera = server.services.store.cameras(sid)[0]
    flat = rectified(camera)
    assert image.shape == (120, 160, 3)
    # The red corner's edge is a straight line through the principal point, which undistorting leaves in place.
    row = image[int(flat.cy) - 10]
    edge = int(np.argmax(row[:, 2] < 128))
    assert edge == pytest.approx(flat.cx, abs=1.5)
    small = decoded(client.get(f"{path}?rectified=true&width=80"))
    assert small.shape == (60, 80, 3)


def test_an_image_that_is_known_is_not_sent_again(server, client: httpx.Client, write_scene) -> None:
    scene = write_scene(server.root / "known")
    made = client.post("/api/sessions", json={"name": "known", "root": "data", "path": "known"}).json()
    path = f"/api/sessions/{made['id']}/frames/1/image"
    tags = [client.get(path + query).headers["etag"] for query in ("", "?width=80", "?rectified=1", "?width=81")]
    assert len(set(tags)) == 4
    assert all(tag.startswith('"') for tag in tags)
    again = client.get(path, headers={"If-None-Match": f'"other", {tags[0]}'})
    assert (again.status_code, again.content, again.headers["etag"]) == (304, b"", tags[0])
    assert client.get(path, headers={"If-None-Match": tags[1]}).status_code == 200
    shutil.copy(scene / "images" / "00004.jpg", scene / "images" / "00001.jpg")
    assert client.get(path, headers={"If-None-Match": tags[0]}).status_code == 200


@pytest.mark.parametrize(("index", "status"), [("6", 404), ("-1", 404), ("9" * 30, 404), ("x", 422)])
def test_an_unknown_frame_is_not_found(client: httpx.Client, sid: str, index: str, status: int) -> None:
    assert client.get(f"/api/sessions/{sid}/frames/{index}/image").status_code == status
    assert client.get(f"/api/sessions/{sid}/frames/{index}/labels").status_code == status


@pytest.mark.parametrize("query", ["width=0", "width=-5", "width=99999", "width=x", "rectified=perhaps"])
def test_a_picture_that_cannot_be_is_refused(client: httpx.Client, sid: str, query: str) -> None:
    assert client.get(f"/api/sessions/{sid}/frames/0/image?{query}").status_code == 422


@pytest.fixture
def swapped(server, client: httpx.Client, write_scene, request: pytest.FixtureRequest) -> tuple[str, Path]:
    """A session, and its scene's image folder, which a test is going to swap for something else."""
    name = f"swapped-{request.node.name.replace('/', '-')[:60]}"
    scene = write_scene(server.root / name)
    made = client.post("/api/sessions", json={"name": name, "root": "data", "path": name})
    secret = server.root.parent / "secrets" / "images"
    if not secret.exists():
        shutil.copytree(server.root / "scene" / "images", secret)
    return made.json()["id"], scene / "images"


@pytest.mark.parametrize("query", ["", "?width=80", "?rectified=1"])
def test_an_image_swapped_for_a_link_later_is_not_followed(
    server, client: httpx.Client, swapped: tuple[str, Path], query: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    sid, images = swapped
    (images / "00000.jpg").unlink()
    (images / "00000.jpg").symlink_to(server.root.parent / "secrets" / "images" / "00000.jpg")
    path = f"/api/sessions/{sid}/frames/0/image{query}"
    answer = client.get(path)
    assert answer.status_code == 422
    assert "link" in answer.json()["detail"]
    monkeypatch.setattr(frames_module, "recorded_image", lambda path, own: path)
    assert client.get(path).status_code == 200  # what stops it is that check alone


def test_a_folder_swapped_for_a_link_later_is_not_followed(
    server, client: httpx.Client, swapped: tuple[str, Path]
) -> None:
    sid, images = swapped
    shutil.rmtree(images)
    images.symlink_to(server.root.parent / "secrets" / "images")
    assert client.get(f"/api/sessions/{sid}/frames/0/image").status_code == 422


def test_an_image_that_was_a_link_shows_what_it_led_to(server, client: httpx.Client, write_scene) -> None:
    scene = write_scene(server.root / "farm")
    store = server.root / "farm-store"
    store.mkdir()
    for image in sorted((scene / "images").iterdir()):
        shutil.move(image, store / f"raw-{image.name}")
        image.symlink_to(store / f"raw-{image.name}")
    made = client.post("/api/sessions", json={"name": "farm", "root": "data", "path": "farm"}).json()
    path = f"/api/sessions/{made['id']}/frames/0/image"
    expected = (store / "raw-00000.jpg").read_bytes()
    assert client.get(path).content == expected
    link = scene / "images" / "00000.jpg"
    link.unlink()
    link.symlink_to("/etc/hostname")
    assert client.get(path).content == expected


def test_an_image_that_is_gone_or_spoiled_is_said_so(client: httpx.Client, swapped: tuple[str, Path]) -> None:
    sid, images = swapped
    path = f"/api/sessions/{sid}/frames"
    (images / "00000.jpg").unlink()
    assert client.get(f"{path}/0/image").status_code == 404
    (images / "00001.jpg").write_bytes(b"<script>alert(1)</script>")
    for query in ("", "?width=80", "?rectified=1"):
        answer = client.get(f"{path}/1/image{query}")
        assert answer.status_code == 422
        assert answer.headers["content-type"] == "application/problem+json"
    whole = (images / "00002.jpg").read_bytes()
    (images / "00002.jpg").write_bytes(whole[: len(whole) // 2])
    for query in ("?width=80", "?width=20", "?rectified=1"):
        assert client.get(f"{path}/2/image{query}").status_code == 422


def test_labels_of_a_frame(client: httpx.Client, sid: str, box_json: dict[str, Any]) -> None:
    boxes = f"/api/sessions/{sid}/boxes"
    client.post(boxes, json=box_json)
    behind = {**box_json, "T_world_box": {"position": [0, 0, -3], "wxyz": [1, 0, 0, 0]}}
    client.post(boxes, json=behind)
    answer = client.get(f"/api/sessions/{sid}/frames/0/labels")
    seen, unseen = (LabelJson.model_validate(label) for label in answer.json())
    assert (seen.box_id, seen.class_id, unseen.box_id) == (1, 0, 2)
    # A cube of 0.2 m, its near face 0.9 m off, before a lens of 150 px: 16.7 px to each side, a little less by k1.
    half = 150 * 0.1 / 0.9
    assert seen.bbox == pytest.approx((80 - half, 60 - half, 80 + half, 60 + half), abs=0.3)
    assert seen.bbox_amodal == pytest.approx(seen.bbox)
    assert (seen.truncated, seen.visible) == (0, 1)
    assert len(seen.wireframe) > 3
    xs, ys = zip(*seen.outline, strict=True)
    assert (min(xs), min(ys), max(xs), max(ys)) == pytest.approx(seen.bbox, abs=0.3)
    assert (unseen.bbox, unseen.outline, unseen.wireframe, unseen.truncated, unseen.visible) == (None, [], [], 1, 0)
    for shape in ("box", "hull"):
        assert client.get(f"/api/sessions/{sid}/frames/0/labels?shape={shape}").json() == answer.json()
    assert client.get(f"/api/sessions/{sid}/frames/0/labels?shape=mesh").status_code == 422
    assert client.get(f"/api/sessions/{sid}/frames/0/labels?shape=ball").status_code == 422


def test_labels_are_those_of_the_newest_revision(client: httpx.Client, sid: str, box_json: dict[str, Any]) -> None:
    labels = f"/api/sessions/{sid}/frames/0/labels"
    assert client.get(labels).json() == []
    one = client.post(f"/api/sessions/{sid}/boxes", json=box_json).headers["location"]
    before = client.get(labels).json()[0]["bbox"]
    client.patch(one, json={"size": [0.1, 0.1, 0.1]}, headers={"If-Match": '"1"'})
    after = client.get(labels).json()[0]["bbox"]
    assert after[0] > before[0] + 5


def test_many_may_ask_for_labels_at_once(client: httpx.Client, sid: str, box_json: dict[str, Any]) -> None:
    """numba's threads do not take two callers at once unless they are told how."""
    client.post(f"/api/sessions/{sid}/boxes", json=box_json)
    path = f"/api/sessions/{sid}/frames"
    with ThreadPoolExecutor(8) as pool:
        answers = list(pool.map(lambda i: client.get(f"{path}/{i % 6}/labels").json(), range(48)))
    assert all(answers[i] == answers[i % 6] for i in range(48))
