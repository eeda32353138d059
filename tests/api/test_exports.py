"""Exports over HTTP: started, watched, cancelled, downloaded."""

import hashlib
import io
import json
import shutil
import threading
import zipfile
from typing import Any

import httpx
import pytest

from ars_web.api.models import ExportJson
from ars_web.errors import Cancelled


@pytest.fixture
def labelled(client: httpx.Client, sid: str, box_json: dict[str, Any]) -> str:
    client.post(f"/api/sessions/{sid}/boxes", json=box_json)
    return sid


def finished(client: httpx.Client, job: httpx.Response, until) -> dict[str, Any]:
    assert job.status_code == 202, job.text
    path = job.headers["location"]
    until(lambda: client.get(path).json()["state"] in ("done", "failed", "cancelled"), seconds=60)
    return client.get(path).json()


def test_an_export_is_made_and_downloaded(client: httpx.Client, labelled: str, until) -> None:
    started = client.post(f"/api/sessions/{labelled}/exports", json={"format": "yolo"})
    assert started.json()["state"] in ("queued", "running", "done")
    job = ExportJson.model_validate(finished(client, started, until))
    assert (job.state, job.done, job.total, job.error, job.session_id) == ("done", 6, 6, None, labelled)
    assert job.report is not None
    answer = client.get(f"/api/exports/{job.id}/download")
    assert answer.headers["content-type"] == "application/zip"
    assert answer.headers["content-disposition"] == f'attachment; filename="{labelled}-yolo-{job.id}.zip"'
    with zipfile.ZipFile(io.BytesIO(answer.content)) as archive:
        assert archive.testzip() is None
        names = [name.partition("/")[2] for name in archive.namelist()]
        assert {info.compress_type for info in archive.infolist()} == {zipfile.ZIP_STORED}
        report = json.loads(archive.read(f"{labelled}-yolo-{job.id}/dataset.json"))
    assert names == sorted(names, key=lambda name: name.split("/"))
    assert sum(name.startswith("images/") for name in names) == 6
    assert sum(name.startswith("labels/") for name in names) == 6
    assert report["sessions"][0]["id"] == labelled
    assert client.get(f"/api/exports/{job.id}/download").content == answer.content


def test_a_sessions_exports_are_listed(client: httpx.Client, labelled: str, until) -> None:
    path = f"/api/sessions/{labelled}/exports"
    jobs = [
        finished(client, client.post(path, json={"format": f, "options": {"images": "none"}}), until)
        for f in ("coco", "voc")
    ]
    assert [job["id"] for job in client.get(path).json()] == [job["id"] for job in reversed(jobs)]


@pytest.mark.parametrize(
    ("options", "where"),
    [
        ({"frames": {"step": True}}, "frames.step"),
        ({"frames": {"start": "1"}}, "frames.start"),
        ({"frames": {"stop": 2.0}}, "frames.stop"),
        ({"frames": {"list": [0, "1"]}}, "frames.list.1"),
        ({"min_visible": "0.5"}, "min_visible"),
        ({"max_truncated": True}, "max_truncated"),
        ({"min_area_px": "4"}, "min_area_px"),
        ({"split": {"train": True, "val": False}}, "split.train"),
        ({"split": {"seed": "0"}}, "split.seed"),
    ],
)
def test_an_option_takes_no_other_kind_of_value(
    client: httpx.Client, sid: str, options: dict[str, Any], where: str
) -> None:
    answer = client.post(f"/api/sessions/{sid}/exports", json={"format": "coco", "options": options})
    assert answer.status_code == 422, answer.text
    assert answer.json()["errors"][0]["where"] == f"body.options.{where}"


def test_a_repeat_with_the_same_key_starts_no_second_export(client: httpx.Client, labelled: str, until) -> None:
    path, key = f"/api/sessions/{labelled}/exports", {"Idempotency-Key": f"export {labelled}"}
    body = {"format": "coco", "options": {"images": "none"}}
    first, again = (client.post(path, json=body, headers=key) for _ in range(2))
    assert first.json()["id"] == again.json()["id"]
    assert client.post(path, json={**body, "format": "voc"}, headers=key).status_code == 422
    finished(client, first, until)


@pytest.mark.parametrize(
    ("body", "told"),
    [
        ({"format": "nope"}, "yolo"),
        ({"format": None}, "format"),
        ({}, "format"),
        ({"format": "coco", "options": {"nope": 1}}, "nope"),
        ({"format": "coco", "option": {}}, "option"),
        ({"format": "coco", "options": {"images": "all"}}, "images"),
        ({"format": "coco", "options": {"frames": {"step": 0}}}, "step"),
        ({"format": "coco", "options": {"split": {"train": 0.9, "val": 0.9}}}, "1"),
        ({"format": "coco", "options": {"min_visible": 2}}, "min_visible"),
        ({"format": "coco", "options": {"shape": "mesh"}}, "mesh"),
    ],
)
def test_an_export_that_cannot_be_is_refused(
    client: httpx.Client, labelled: str, body: dict[str, Any], told: str
) -> None:
    answer = client.post(f"/api/sessions/{labelled}/exports", json=body)
    assert answer.status_code == 422, answer.text
    assert told in answer.json()["detail"]
    assert client.get(f"/api/sessions/{labelled}/exports").json() == []


def test_what_is_not_there_is_not_found(client: httpx.Client, labelled: str) -> None:
    assert client.post("/api/sessions/nope/exports", json={"format": "coco"}).status_code == 404
    assert client.get("/api/sessions/nope/exports").status_code == 404
    merged = {"format": "coco", "options": {"sessions": ["nope"]}}
    assert client.post(f"/api/sessions/{labelled}/exports", json=merged).status_code == 404
    for export_id in ("nope", "..", "%2e%2e%2f", "x" * 3000):
        assert client.get(f"/api/exports/{export_id}").status_code == 404
        assert client.get(f"/api/exports/{export_id}/download").status_code == 404
        assert client.post(f"/api/exports/{export_id}/cancel").status_code == 404


def test_a_failed_export_says_why_and_has_no_download(server, client: httpx.Client, write_scene, until) -> None:
    scene = write_scene(server.root / "spoiled")
    made = client.post("/api/sessions", json={"name": "spoiled", "root": "data", "path": "spoiled"}).json()
    shutil.rmtree(scene / "images")
    job = finished(client, client.post(f"/api/sessions/{made['id']}/exports", json={"format": "coco"}), until)
    assert job["state"] == "failed"
    assert "00000.jpg" in job["error"]
    answer = client.get(f"/api/exports/{job['id']}/download")
    assert answer.status_code == 409
    assert "failed" in answer.json()["detail"]


def test_an_export_that_has_ended_is_not_cancelled(client: httpx.Client, labelled: str, until) -> None:
    started = client.post(f"/api/sessions/{labelled}/exports", json={"format": "coco", "options": {"images": "none"}})
    job = finished(client, started, until)
    assert client.post(f"/api/exports/{job['id']}/cancel").json() == job


def test_a_queued_export_is_cancelled_at_once(client: httpx.Client, labelled: str, until) -> None:
    path = f"/api/sessions/{labelled}/exports"
    jobs = [client.post(path, json={"format": "voc", "options": {"images": "rectify"}}) for _ in range(4)]
    last = jobs[-1].json()["id"]
    state = client.post(f"/api/exports/{last}/cancel").json()["state"]
    assert state in ("cancelled", "done")
    for job in jobs:
        finished(client, job, until)
    assert client.get(f"/api/exports/{last}").json()["state"] == state


def test_an_export_is_of_the_session_as_it_was_when_asked_for(
    client: httpx.Client, labelled: str, box_json: dict[str, Any], until
) -> None:
    path = f"/api/sessions/{labelled}/exports"
    body = {"format": "coco", "options": {"images": "none"}}
    first = client.post(path, json=body)
    client.post(f"/api/sessions/{labelled}/boxes", json=box_json)
    second = client.post(path, json=body)
    revisions = [finished(client, job, until)["report"]["sessions"][0]["revision"] for job in (first, second)]
    assert revisions == [1, 2]


def test_an_export_survives_a_restart(run_server, tmp_path, until) -> None:
    """The next server on the folder still has it, byte for byte."""
    digests = []
    with run_server(tmp_path) as server:
        made = server.client.post(
            "/api/sessions", json={"name": "s", "root": "data", "path": "scene", "classes": ["c"]}
        )
        job = finished(
            server.client, server.client.post(f"{made.headers['location']}/exports", json={"format": "ars"}), until
        )
        digests.append(hashlib.sha256(server.client.get(f"/api/exports/{job['id']}/download").content).hexdigest())
    with run_server(tmp_path) as server:
        assert server.client.get(f"/api/exports/{job['id']}").json() == job
        digests.append(hashlib.sha256(server.client.get(f"/api/exports/{job['id']}/download").content).hexdigest())
    assert digests[0] == digests[1]


def test_a_preview_says_what_the_export_then_writes(client: httpx.Client, labelled: str, until) -> None:
    path = f"/api/sessions/{labelled}/exports"
    body = {"format": "coco", "options": {"frames": {"step": 2}, "min_visible": 0.1, "images": "copy"}}
    preview = client.post(f"{path}/preview", json=body)
    assert preview.status_code == 200, preview.text
    found = preview.json()
    assert client.get(path).json() == []
    report = finished(client, client.post(path, json=body), until)["report"]
    for same in ("format", "options", "sessions", "classes", "splits", "dropped"):
        assert found[same] == report[same], same
    assert (found["frames"], found["images"]) == (3, {"linked": 0, "copied": 3, "encoded": 0})
    assert found["image_bytes"] == found["new_bytes"] > 0
    assert found["directions"]["all"] > 0
    assert found["choice"] is None
    chosen = client.post(f"{path}/preview", json={"format": "coco", "options": {"frames": {"count": 2}}}).json()
    assert (chosen["frames"], chosen["choice"]["asked"], chosen["choice"]["chosen"]) == (2, 2, 2)
    assert chosen["choice"]["directions"] == chosen["directions"]["all"] >= chosen["choice"]["directions_evenly"]
    for bad in (
        {"format": "nope"},
        {"format": "coco", "options": {"frames": {"count": 0}}},
        {"format": "coco", "options": {"frames": {"sector": [5, 5]}}},
        {"format": "coco", "options": {"split": {"by": "session", "hold_out": ["s9"]}}},
        {"format": "coco", "options": {"frames": {"start": 99}}},
        {"format": "coco", "x": 1},
    ):
        assert client.post(f"{path}/preview", json=bad).status_code == 422
    assert client.post("/api/sessions/nope/exports/preview", json=body).status_code == 404


def test_a_preview_ends_when_nobody_waits_for_it(
    server, client: httpx.Client, labelled: str, until, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun, ended = threading.Event(), threading.Event()

    def slow(sid: str, *, cancelled, **more: object) -> None:
        begun.set()
        until(cancelled)
        ended.set()
        raise Cancelled("nobody waits")

    monkeypatch.setattr(server.services.exports, "forecast", slow)
    with server.stranger(Authorization=client.headers["authorization"]) as impatient:
        with pytest.raises(httpx.ReadTimeout):
            impatient.post(f"/api/sessions/{labelled}/exports/preview", json={"format": "coco"}, timeout=0.5)
        assert begun.is_set()
    assert ended.wait(20)
    assert client.get("/api/health").status_code == 200


def test_an_export_is_deleted_once_it_has_ended(client: httpx.Client, labelled: str, until) -> None:
    path = f"/api/sessions/{labelled}/exports"
    job = finished(client, client.post(path, json={"format": "voc"}), until)
    assert job["ended"] >= job["created"]
    assert job["bytes"] == sum(
        info.file_size
        for info in zipfile.ZipFile(io.BytesIO(client.get(f"/api/exports/{job['id']}/download").content)).infolist()
    )
    assert client.delete(f"/api/exports/{job['id']}").status_code == 204
    assert client.get(path).json() == []
    for gone in (client.get(f"/api/exports/{job['id']}"), client.delete(f"/api/exports/{job['id']}")):
        assert gone.status_code == 404


def test_an_export_that_is_not_over_is_not_deleted(
    client: httpx.Client, labelled: str, until, server, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened = threading.Event()
    make = server.services.exports._plan
    monkeypatch.setattr(server.services.exports, "_plan", lambda *given: (opened.wait(30), make(*given))[1])
    job = client.post(f"/api/sessions/{labelled}/exports", json={"format": "voc"})
    refused = client.delete(job.headers["location"])
    assert (refused.status_code, refused.json()["type"]) == (409, "urn:ars-web:problem:conflict")
    assert "cancel it before" in refused.json()["detail"]
    opened.set()
    assert finished(client, job, until)["state"] == "done"
    assert client.delete(job.headers["location"]).status_code == 204
