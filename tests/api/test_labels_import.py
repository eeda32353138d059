"""Labels of other programs over HTTP: from a root and sent, tried and taken, refused as a whole."""

import io
import json
import zipfile
from pathlib import Path
from types import ModuleType
from typing import Any

import httpx
import pytest


def coco(ring_scene: ModuleType, *, frames: int = 3, **more: Any) -> dict[str, Any]:
    """A ball's outlines as COCO."""
    return {
        "images": [
            {"id": i, "file_name": f"{i:05d}.jpg", "width": ring_scene.WIDTH, "height": ring_scene.HEIGHT}
            for i in range(frames)
        ],
        "categories": [{"id": 1, "name": "marble"}],
        "annotations": [
            {"id": i, "image_id": i, "category_id": 1, "segmentation": [ring_scene.outline(i).ravel().tolist()], **more}
            for i in range(frames)
        ],
    }


def send(client: httpx.Client, ring: str, content: bytes, name: str = "labels.json", **more: Any) -> httpx.Response:
    headers = more.pop("headers", None)
    return client.post(f"{ring}/labels/upload", files={"file": (name, content)}, data=more, headers=headers)


def zipped(files: dict[str, bytes]) -> bytes:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return data.getvalue()


def left_behind(server) -> list[str]:
    building = server.services.store.folder / ".building"
    return sorted(entry.name for entry in building.iterdir() if entry.name != "lock") if building.exists() else []


def test_a_file_below_a_root_is_tried_and_then_taken(server, client: httpx.Client, ring: str, ring_scene) -> None:
    (server.root / "marble.json").write_text(json.dumps(coco(ring_scene)))
    body = {"root": "data", "path": "marble.json"}
    tried = client.post(f"{ring}/labels/import", json={**body, "dry_run": True})
    assert tried.status_code == 200, tried.text
    assert (tried.json()["revision"], tried.json()["objects"][0]["box_id"]) == (None, None)
    assert client.get(f"{ring}/boxes").json() == []
    made = client.post(f"{ring}/labels/import", json=body, headers={"Idempotency-Key": "a"}).json()
    again = client.post(f"{ring}/labels/import", json=body, headers={"Idempotency-Key": "a"}).json()
    assert made == {**again, "classes": ["marble"]}
    assert (made["format"], made["boxes"], made["masks"], made["revision"]) == ("coco", 1, 3, 1)
    (one,) = made["objects"]
    (box,) = client.get(f"{ring}/boxes").json()
    assert (box["id"], box["name"], box["size"], box["has_hull"]) == (one["box_id"], "marble", one["size"], True)
    assert one["T_world_box"] == tried.json()["objects"][0]["T_world_box"] == box["T_world_box"]
    assert client.post(f"{ring}/undo").status_code == 200
    assert client.get(f"{ring}/masks").json() == []


def test_a_file_that_is_sent_is_taken_and_not_kept(server, client: httpx.Client, ring: str, ring_scene) -> None:
    content = coco(ring_scene)
    content["annotations"].append({"id": 9, "image_id": 0, "category_id": 1, "iscrowd": 1, "bbox": [1, 1, 9, 9]})
    made = send(client, ring, json.dumps(content).encode(), dry_run="false", format="coco")
    assert made.status_code == 200, made.text
    assert (made.json()["boxes"], made.json()["masks"], made.json()["classes"]) == (1, 3, ["marble"])
    (left_out,) = made.json()["left_out"]
    assert (left_out["count"], left_out["examples"]) == (1, ["annotation 9"])
    assert "crowd" in left_out["reason"]
    assert left_behind(server) == []


def test_a_zip_with_a_bop_scene_and_its_models(
    client: httpx.Client, ring: str, ring_scene, bop_scene, tmp_path: Path
) -> None:
    bop_scene.write(ring_scene, tmp_path / "bop", frames=4, images=False)
    files = {
        f"set/{file.relative_to(tmp_path / 'bop')}": file.read_bytes()
        for file in (tmp_path / "bop").rglob("*")
        if file.is_file()
    }
    made = send(client, ring, zipped(files), name="scene.zip")
    assert made.status_code == 200, made.text
    assert (made.json()["format"], made.json()["boxes"]) == ("bop", 3)
    assert [box["name"] for box in client.get(f"{ring}/boxes").json()] == ["obj_000001", "obj_000001 2", "obj_000007"]


@pytest.mark.parametrize(
    ("content", "name", "said"),
    [
        (b"{", "a.json", "a.json holds no labels that are known"),
        (b'{"images": [], "annotations": [{}], "categories": []}', "a.json", "a.json: annotations[0].image_id: Field"),
        (b"<!DOCTYPE a [<!ENTITY x 'y'>]><annotations/>", "b.xml", "b.xml:1: has a document type"),
        (b"PK\x03\x04 no zip", "c.zip", "zip"),
        (zipped({"a/b.txt": b"x"}), "d.zip", "holds no labels that are known"),
    ],
)
def test_what_cannot_be_read_is_named_by_what_its_sender_calls_it(
    server, client: httpx.Client, ring: str, content: bytes, name: str, said: str
) -> None:
    refused = send(client, ring, content, name=name)
    assert refused.status_code == 422, refused.text
    assert said in refused.json()["detail"]
    assert str(server.services.store.folder) not in refused.text
    assert client.get(f"{ring}/boxes").json() == []
    assert left_behind(server) == []


@pytest.mark.parametrize(
    ("path", "status", "kind"),
    [("../x.json", 422, "refused-path"), ("/etc/passwd", 422, "refused-path"), ("nowhere.json", 404, "not-found")],
)
def test_paths_stay_below_their_root(client: httpx.Client, ring: str, path: str, status: int, kind: str) -> None:
    refused = client.post(f"{ring}/labels/import", json={"root": "data", "path": path})
    assert (refused.status_code, refused.json()["type"]) == (status, f"urn:ars-web:problem:{kind}")


def test_a_link_out_of_the_root_is_not_followed(
    server, client: httpx.Client, ring: str, ring_scene, bop_scene, tmp_path: Path
) -> None:
    scene = bop_scene.write(ring_scene, server.root / "linked", frames=2, images=False)
    secret = tmp_path / "secret.json"
    (scene / "scene_camera.json").rename(secret)
    (scene / "scene_camera.json").symlink_to(secret)
    refused = client.post(f"{ring}/labels/import", json={"root": "data", "path": "linked/test/000001"})
    assert (refused.status_code, refused.json()["type"]) == (422, "urn:ars-web:problem:refused-path")
    assert str(tmp_path) not in refused.text


def test_a_sessions_own_limits_hold(client: httpx.Client, ring: str) -> None:
    assert send(client, "/api/sessions/nosuch", b"{}").status_code == 404
    assert send(client, ring, b"{}", format="kitti").status_code == 422
    assert send(client, ring, b"{}", dry_run="perhaps").status_code == 422
    assert send(client, ring, b" " * (10 * 2**20 + 1)).status_code == 413
    refused = client.post(f"{ring}/labels/import", json={"root": "data", "path": "x", "dry_run": "yes"})
    assert refused.status_code == 422
