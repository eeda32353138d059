"""Every error is a problem document, and tells no more than it should."""

import logging
import math

import httpx
import pytest

import ars_web.sessions.editing
from ars_web import errors
from ars_web.api import frames
from ars_web.api.problems import STATUS, of_error


def test_every_error_has_its_row() -> None:
    raised = [e for e in vars(errors).values() if isinstance(e, type) and issubclass(e, errors.ArsError)]
    assert set(raised) <= set(STATUS)
    assert ars_web.sessions.editing.NothingToUndo in STATUS


@pytest.mark.parametrize("error", STATUS)
def test_a_row_is_what_is_answered(error: type[errors.ArsError]) -> None:
    more = {errors.BadFile: ("is wrong",), errors.BadOption: ("shape",), errors.ViewsDisagree: (((3, 1.5),),)}
    made = error("here is wrong", *more.get(error, ()))
    answer = of_error(made)
    body = httpx.Response(200, content=answer.body).json()
    assert answer.status_code == body["status"] == STATUS[error][0]
    assert body["type"] == f"urn:ars-web:problem:{STATUS[error][1]}"
    assert body["title"] == STATUS[error][2]
    assert "is wrong" in body["detail"]


def test_views_that_disagree_are_named_with_their_pixels_if_any_number_helps() -> None:
    answer = of_error(errors.ViewsDisagree("frames 4 and 2 do not meet", ((4, 12.5), (2, math.nan))))
    views = httpx.Response(200, content=answer.body).json()["views"]
    assert views == [{"frame": 4, "misfit_px": 12.5}, {"frame": 2, "misfit_px": None}]


def test_an_option_is_named() -> None:
    answer = of_error(errors.BadOption("no object has a mesh", "shape"))
    assert answer.status_code == 422
    assert httpx.Response(200, content=answer.body).json()["errors"] == [
        {"where": "options.shape", "message": "no object has a mesh"}
    ]


def test_a_conflict_is_a_failed_precondition_only_where_there_was_one() -> None:
    conflict = errors.Conflict("changed")
    assert (of_error(conflict).status_code, of_error(conflict, conditional=True).status_code) == (409, 412)


def test_an_address_that_is_not_there(client: httpx.Client) -> None:
    answer = client.get("/api/nothing")
    assert answer.status_code == 404
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["type"] == "urn:ars-web:problem:not-found"


def test_a_method_that_is_not_possible(client: httpx.Client) -> None:
    answer = client.put("/api/sessions", json={})
    assert answer.status_code == 405
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.headers["allow"] == "GET, POST"
    assert answer.json()["detail"] == "PUT is not possible here; possible is GET, POST"


def test_every_method_that_is_possible_is_named(client: httpx.Client, sid: str) -> None:
    assert client.put(f"/api/sessions/{sid}/boxes/1", json={}).headers["allow"] == "DELETE, GET, PATCH"
    assert client.delete(f"/api/sessions/{sid}/frames").headers["allow"] == "GET"
    assert client.post("/static/main.js").headers["allow"] == "GET"


def test_a_request_that_does_not_fit_names_each_field_and_echoes_nothing(client: httpx.Client, sid: str) -> None:
    body = {"class_id": "<b>x</b>", "size": [1, "y"], "T_world_box": {"position": [0, 0, 0], "wxyz": [1, 0, 0, 0]}}
    answer = client.post(f"/api/sessions/{sid}/boxes", json=body)
    assert answer.status_code == 422
    assert {"body.class_id", "body.size.1", "body.size.2"} <= {error["where"] for error in answer.json()["errors"]}
    assert "<b>" not in answer.text


def test_a_very_wrong_request_is_answered_shortly(client: httpx.Client, sid: str) -> None:
    answer = client.post(f"/api/sessions/{sid}/boxes", json={f"field {i}" * 50: i for i in range(1000)})
    assert answer.status_code == 422
    assert len(answer.content) < 20_000


def test_a_fault_is_logged_whole_and_told_by_its_number(
    client: httpx.Client, sid: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def fault(*args: object, **more: object) -> None:
        raise ZeroDivisionError("/secret/path")

    monkeypatch.setattr(frames, "frame_labels", fault)
    with caplog.at_level(logging.ERROR, logger="ars_web.api.problems"):
        answer = client.get(f"/api/sessions/{sid}/frames/0/labels")
    assert answer.status_code == 500
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert "secret" not in answer.text
    assert "ZeroDivisionError" not in answer.text
    (record,) = caplog.records
    assert record.getMessage().split()[1] in answer.json()["detail"]
    assert record.exc_info is not None


def test_a_database_that_is_no_database_is_said_so(server, client: httpx.Client, sid: str) -> None:
    client.post(f"/api/sessions/{sid}/classes", json={"name": "x"})
    folder = server.services.store.folder / sid
    server.services.store.close()
    for file in folder.iterdir():
        file.write_bytes(b"nonsense" * 1000)
    answer = client.get(f"/api/sessions/{sid}")
    assert answer.status_code == 503
    assert answer.json()["type"].endswith("store")
    assert sid not in [session["id"] for session in client.get("/api/sessions").json()]
