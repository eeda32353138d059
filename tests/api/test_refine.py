"""Boxes fitted to where their objects are seen, and the frame to outline next, over HTTP."""

from typing import Any

import httpx
import numpy as np
import pytest

from ars_web.geometry.box import Box
from ars_web.geometry.labels import labels_of_boxes
from ars_web.geometry.rigid_transform import from_rotation, rotation_about_z

SIZE = [0.07, 0.05, 0.04]


@pytest.fixture
def brick(ring_scene) -> Box:
    """The true box."""
    place = np.add(ring_scene.CENTRE, [0.004, -0.006, 0.002])
    return Box(from_rotation(rotation_about_z(0.4), place), np.array(SIZE))


@pytest.fixture
def views(ring_scene, brick: Box):
    """What one sees of the brick in some frames, as boxes, to a third of a pixel."""
    labels = labels_of_boxes(ring_scene.CAMERA, ring_scene.poses(), [brick]).bbox[:, 0]
    labels += np.random.default_rng(0).normal(0, 0.3, labels.shape)
    return lambda *frames: [{"frame": frame, "bbox": labels[frame].round(2).tolist()} for frame in frames]


@pytest.fixture
def rough(client: httpx.Client, ring: str, brick: Box) -> dict[str, Any]:
    """The brick's box as somebody placed it: 2 cm off, turned by 20 degrees."""
    x, y, z = (brick.T_world_box[:3, 3] + [0.015, 0.01, -0.008]).tolist()
    half = (0.4 - np.radians(20)) / 2
    place = {"position": [x, y, z], "wxyz": [float(np.cos(half)), 0.0, 0.0, float(np.sin(half))]}
    made = client.post(f"{ring}/boxes", json={"class_id": 0, "T_world_box": place, "size": [0.06, 0.06, 0.05]})
    assert made.status_code == 201, made.text
    return made.json()


def refine(
    client: httpx.Client, ring: str, box: dict[str, Any], body: dict[str, Any], **headers: str
) -> httpx.Response:
    sent = {"If-Match": f'"{box["revision"]}"', **headers}
    return client.post(f"{ring}/boxes/{box['id']}/refine", json=body, headers=sent)


def test_a_rough_box_is_fitted_in_one_edit(client: httpx.Client, ring: str, rough, views, brick: Box) -> None:
    answer = refine(client, ring, rough, {"views": views(0, 2, 4, 7, 9), "orientation": "upright"})
    assert answer.status_code == 200, answer.text
    found = answer.json()
    assert found["box"]["T_world_box"]["position"] == pytest.approx(brick.T_world_box[:3, 3].tolist(), abs=5e-4)
    assert found["box"]["size"] == pytest.approx(SIZE, abs=1e-3)
    assert [row["frame"] for row in found["residuals"]] == [0, 2, 4, 7, 9]
    assert found["rms_px"] < 0.6
    assert 15 < found["moved_mm"] < 60
    assert 0 < found["corner_error_mm"] < 3
    assert not any(row["outlier"] for row in found["residuals"])
    assert found["warnings"] == []
    # It is stored, with its name, and one undo takes it back.
    box = client.get(f"{ring}/boxes/{rough['id']}")
    assert box.json() == found["box"]
    assert answer.headers["ETag"] == box.headers["ETag"] == f'"{found["box"]["revision"]}"'
    assert found["box"]["revision"] == rough["revision"] + 1
    newest = client.get(f"{ring}/history").json()["items"][0]
    assert newest["summary"] == f"Fit {rough['name']} to 5 frames"
    assert client.post(f"{ring}/undo").status_code == 200
    assert client.get(f"{ring}/boxes/{rough['id']}").json()["size"] == rough["size"]


def test_a_dry_run_changes_nothing(client: httpx.Client, ring: str, rough, views) -> None:
    path = f"{ring}/boxes/{rough['id']}"
    answer = client.post(f"{path}/refine", json={"views": views(0, 2, 4, 7), "dry_run": True})
    assert answer.status_code == 200, answer.text
    assert answer.json()["box"]["size"] == pytest.approx(SIZE, abs=1e-3)
    assert answer.json()["box"]["revision"] == rough["revision"]
    assert client.get(path).json() == rough


def test_a_repeat_with_its_key_changes_nothing_more(client: httpx.Client, ring: str, rough, views) -> None:
    body = {"views": views(0, 2, 4, 7)}
    first = refine(client, ring, rough, body, **{"Idempotency-Key": "once"})
    again = refine(client, ring, rough, body, **{"Idempotency-Key": "once"})
    assert again.status_code == 200, again.text
    assert again.json() == first.json()
    other = refine(client, ring, rough, {"views": views(0, 2, 4)}, **{"Idempotency-Key": "once"})
    assert other.status_code == 422
    assert client.get(ring).json()["revision"] == first.json()["box"]["revision"]


def test_an_outlier_is_named(client: httpx.Client, ring: str, rough, views) -> None:
    seen = views(0, 2, 4, 5, 7, 9)
    seen[3]["bbox"] = [side + 18 for side in seen[3]["bbox"]]
    found = refine(client, ring, rough, {"views": seen, "dry_run": True}).json()
    assert [row["frame"] for row in found["residuals"] if row["outlier"]] == [5]
    (warning,) = found["warnings"]
    assert warning.startswith("Frame 5 is up to ")
    assert "look whether its mask is right" in warning


def test_a_box_made_from_masks_is_fitted_to_them_and_keeps_its_hull_in_place(
    client: httpx.Client, ring: str, ring_scene
) -> None:
    outlines = [{"frame": frame, "polygons": ring_scene.polygons(frame)} for frame in (0, 2, 5, 7, 9)]
    made = client.post(f"{ring}/boxes/from-masks", json={"class_id": 0, "views": outlines}).json()
    path = f"{ring}/boxes/{made['id']}"
    before = client.get(f"{path}/hull").json()
    answer = refine(client, ring, made, {"orientation": "upright"})
    assert answer.status_code == 200, answer.text
    found = answer.json()
    assert [row["frame"] for row in found["residuals"]] == [0, 2, 5, 7, 9]
    # The box that labels a ball rightly is smaller than the one round it.
    assert np.prod(found["box"]["size"]) < 0.8 * np.prod(made["size"])
    assert found["box"]["has_hull"]
    assert found["box"]["hull_options"] == {**made["hull_options"], "fitted": True}
    assert any("does not fill a box" in warning for warning in found["warnings"])
    after = client.get(f"{path}/hull").json()
    np.testing.assert_allclose(after["vertices"], before["vertices"], atol=1e-7)
    assert after["faces"] == before["faces"]


def test_a_fitted_box_stays_when_its_masks_change_and_its_hull_follows(
    client: httpx.Client, ring: str, ring_scene
) -> None:
    outlines = [{"frame": frame, "polygons": ring_scene.polygons(frame)} for frame in (0, 2, 5, 7, 9)]
    made = client.post(f"{ring}/boxes/from-masks", json={"class_id": 0, "views": outlines}).json()
    path = f"{ring}/boxes/{made['id']}"
    fitted = refine(client, ring, made, {"orientation": "upright"}).json()["box"]
    hull = client.get(f"{path}/hull").json()
    mask = next(mask for mask in client.get(f"{ring}/masks").json() if mask["frame"] == 5)
    smaller = ring_scene.polygons(5)
    middle = np.mean(smaller[0]["outer"], axis=0)
    smaller[0]["outer"] = (middle + 0.8 * (np.array(smaller[0]["outer"]) - middle)).tolist()
    tag = {"If-Match": f'"{mask["revision"]}"'}
    assert client.put(f"{ring}/masks/{mask['id']}", json={"polygons": smaller}, headers=tag).status_code == 200
    kept = client.get(path).json()
    assert (kept["T_world_box"], kept["size"]) == (fitted["T_world_box"], fitted["size"])
    assert client.get(f"{path}/hull").json()["volume"] < 0.95 * hull["volume"]

    def make(body: dict[str, Any]) -> dict[str, Any]:
        tag = {"If-Match": f'"{client.get(path).json()["revision"]}"'}
        answer = client.put(f"{path}/hull", json=body, headers=tag)
        assert answer.status_code == 200, answer.text
        return client.get(path).json()

    assert make({"widen_px": 1.0})["size"] == fitted["size"]
    anew = make({"orientation": "world"})
    assert anew["hull_options"] == {**made["hull_options"], "widen_px": 1.0}
    assert np.prod(anew["size"]) > np.prod(fitted["size"])


def test_masks_and_pictures_of_masks_may_be_given(client: httpx.Client, ring: str, rough, ring_scene) -> None:
    seen = [
        *({"frame": frame, "polygons": ring_scene.polygons(frame)} for frame in (0, 2, 4, 6)),
        *({"frame": frame, "mask_png": ring_scene.png(frame)} for frame in (8, 10, 11)),
    ]
    found = refine(client, ring, rough, {"views": seen}).json()
    assert found["box"]["T_world_box"]["position"] == pytest.approx(list(ring_scene.CENTRE), abs=2e-3)


def test_what_cannot_be_fitted_is_refused_and_not_stored(client: httpx.Client, ring: str, rough, views) -> None:
    def refused(body: dict[str, Any], words: str) -> None:
        answer = refine(client, ring, rough, body)
        assert answer.status_code == 422, answer.text
        assert words in answer.json()["detail"]

    refused({}, "has no masks to be fitted to")
    refused({"views": views(0)}, "two frames at least")
    refused({"views": []}, "at least 1")
    refused({"views": views(0, 3), "orientation": "free"}, "add a frame from another side")
    refused({"views": views(0, 0, 3)}, "frame 0 is given twice")
    refused({"views": [*views(0), {"frame": 12, "bbox": [1, 2, 30, 40]}]}, "there is no frame 12")
    refused({"views": [*views(0), {"frame": 1}]}, "give bbox, polygons or mask_png")
    refused({"views": [*views(0), {"frame": 1, "bbox": [1, 2, 30, 40], "mask_png": ""}]}, "one of them")
    refused({"views": [*views(0), {"frame": 1, "bbox": [50, 2, 30, 40]}]}, "frame 1: [50, 2, 30, 40] is no box")
    refused({"views": [*views(0), {"frame": 1, "bbox": [1, 2, 30]}]}, "views.1.bbox")
    refused({"views": views(0, 1), "orientation": "world"}, "orientation")
    refused({"views": views(0, 1), "what": 1}, "what")
    assert client.get(f"{ring}/boxes/{rough['id']}").json() == rough


def test_revisions_and_locks_are_kept(client: httpx.Client, ring: str, rough, views) -> None:
    path, body = f"{ring}/boxes/{rough['id']}", {"views": views(0, 2, 4, 7)}
    assert client.post(f"{path}/refine", json=body).status_code == 428
    stale = client.post(f"{path}/refine", json=body, headers={"If-Match": '"999"'})
    assert stale.status_code == 412
    assert stale.json()["current"] == rough
    assert client.post(f"{ring}/boxes/99/refine", json=body, headers={"If-Match": '"1"'}).status_code == 404
    headers = {"If-Match": f'"{rough["revision"]}"'}
    locked = client.patch(path, json={"locked": True}, headers=headers).json()
    answer = refine(client, ring, locked, body)
    assert answer.status_code == 409
    assert answer.json()["type"].endswith(":locked")


def test_the_next_view_is_from_another_side(client: httpx.Client, ring: str, rough, ring_scene) -> None:
    path = f"{ring}/boxes"
    first = client.get(f"{path}/{rough['id']}/next-view").json()
    assert first["degrees"] is None
    # An object that has one mask and no box yet.
    mask = {"box_id": None, "class_id": 0, "frame": 0, "polygons": ring_scene.polygons(0)}
    ball = client.post(f"{ring}/masks", json=mask).json()["box_id"]
    assert client.delete(f"{path}/{rough['id']}", headers={"If-Match": f'"{rough["revision"]}"'}).status_code == 204
    second = client.get(f"{path}/{ball}/next-view").json()
    assert 55 < second["degrees"] < 110
    assert f"frame {second['frame']} " in second["reason"]
    more = {**mask, "box_id": ball, "frame": second["frame"], "polygons": ring_scene.polygons(second["frame"])}
    assert client.post(f"{ring}/masks", json=more).status_code == 201
    third = client.get(f"{path}/{ball}/next-view").json()
    assert third["frame"] not in (0, second["frame"])
    assert client.get(f"{path}/99/next-view").status_code == 404
