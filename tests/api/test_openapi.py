"""The OpenAPI document: whole, and in agreement with the contract."""

import json
from typing import Any

import httpx
import pytest

CONTRACT = """
GET /api/health
GET /api/sessions
POST /api/sessions
POST /api/sessions/upload
GET /api/sessions/{sid}
PATCH /api/sessions/{sid}
DELETE /api/sessions/{sid}
GET /api/sessions/{sid}/classes
POST /api/sessions/{sid}/classes
PATCH /api/sessions/{sid}/classes/{class_id}
DELETE /api/sessions/{sid}/classes/{class_id}
GET /api/sessions/{sid}/frames
GET /api/sessions/{sid}/cameras
GET /api/sessions/{sid}/frames/{index}/image
GET /api/sessions/{sid}/frames/{index}/labels
GET /api/sessions/{sid}/boxes
POST /api/sessions/{sid}/boxes
GET /api/sessions/{sid}/boxes/{box_id}
PATCH /api/sessions/{sid}/boxes/{box_id}
DELETE /api/sessions/{sid}/boxes/{box_id}
POST /api/sessions/{sid}/boxes/from-masks
POST /api/sessions/{sid}/boxes/from-points
POST /api/sessions/{sid}/undo
POST /api/sessions/{sid}/redo
GET /api/sessions/{sid}/events
POST /api/sessions/{sid}/exports
GET /api/exports/{export_id}
POST /api/exports/{export_id}/cancel
GET /api/exports/{export_id}/download
"""


@pytest.fixture(scope="module")
def document(server) -> dict[str, Any]:
    return server.client.get("/api/openapi.json").json()


@pytest.fixture(scope="module")
def operations(document: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return {
        f"{method.upper()} {path}": operation
        for path, methods in document["paths"].items()
        for method, operation in methods.items()
    }


def test_the_contract_is_in_it(operations: dict[str, dict[str, Any]]) -> None:
    assert set(CONTRACT.split("\n")[1:-1]) <= set(operations)


def test_operations_read_resource_verb(operations: dict[str, dict[str, Any]]) -> None:
    ids = [operation["operationId"] for operation in operations.values()]
    assert len(set(ids)) == len(ids)
    assert all("-" in i and i == i.lower() and "_" not in i for i in ids)
    assert all(operation["description"] for operation in operations.values())


def test_every_reference_leads_somewhere(document: dict[str, Any]) -> None:
    text = json.dumps(document)
    for name in {part.split('"')[0] for part in text.split("#/components/schemas/")[1:]}:
        assert name in document["components"]["schemas"], name
    assert "HTTPValidationError" not in text


def test_errors_are_documented_as_problems(operations: dict[str, dict[str, Any]]) -> None:
    for name, operation in operations.items():
        for status, answer in operation["responses"].items():
            if int(status) >= 400:
                assert list(answer["content"]) == ["application/problem+json"], (name, status)
        if "/{sid}" in name:
            assert "404" in operation["responses"], name
        # An export that has ended cannot change any more: nobody's change can be lost by deleting it.
        if name.startswith(("PATCH", "DELETE")) and name != "DELETE /api/exports/{export_id}":
            assert {"412", "428"} <= set(operation["responses"]), name
            assert "if-match" in [p["name"] for p in operation["parameters"]], name
        if name.startswith("POST") and name != "POST /login":
            assert "idempotency-key" in [p["name"] for p in operation["parameters"]], name


def test_answers_have_schemas(operations: dict[str, dict[str, Any]]) -> None:
    for name, operation in operations.items():
        for status, answer in operation["responses"].items():
            if status in ("200", "201", "202"):
                for media, content in answer["content"].items():
                    assert content.get("schema") or media.startswith(("image/", "application/zip")), name


def test_requests_refuse_unknown_fields(document: dict[str, Any], operations: dict[str, dict[str, Any]]) -> None:
    for name, operation in operations.items():
        body = operation.get("requestBody", {}).get("content", {}).get("application/json")
        if body is not None:
            schema = document["components"]["schemas"][body["schema"]["$ref"].rpartition("/")[2]]
            assert schema["additionalProperties"] is False, name


def test_cameras_say_whose_pixels_they_mean(document: dict[str, Any]) -> None:
    camera = document["components"]["schemas"]["CameraJson"]
    assert "OpenCV" in camera["description"]
    assert "integers" in camera["properties"]["cx"]["description"]


def test_all_but_health_and_login_need_a_login(document: dict[str, Any], operations: dict[str, dict[str, Any]]) -> None:
    assert document["security"] == [{"token": []}, {"cookie": []}]
    assert {name for name, o in operations.items() if o.get("security") == []} == {"GET /api/health", "POST /login"}


def test_every_documented_address_is_refused_to_strangers(server, operations: dict[str, dict[str, Any]]) -> None:
    with server.stranger() as client:
        for name in operations:
            method, path = name.split(" ")
            if path not in ("/api/health", "/login"):
                answer = client.request(method, path.replace("{", "").replace("}", ""))
                assert answer.status_code == 401, name


def test_answers_fit_their_schemas(
    client: httpx.Client, sid: str, box_json: dict[str, Any], document: dict[str, Any]
) -> None:
    made = client.post(f"/api/sessions/{sid}/boxes", json=box_json).json()
    schema = document["components"]["schemas"]["BoxAnswer"]
    assert set(made) == set(schema["properties"]) == set(schema["required"])


def test_the_live_line_s_messages_are_in_it(document: dict[str, Any]) -> None:
    schemas = document["components"]["schemas"]
    for name, types in {
        "LiveFromPage": {"hello", "view", "look", "new-box", "preview"},
        "LiveToPage": {
            "ready",
            "reset",
            "edit",
            "gone",
            "here",
            "picked",
            "entered",
            "dragged",
            "conflicted",
            "direction",
            "refused",
        },
    }.items():
        union = schemas[name]
        assert union["discriminator"]["propertyName"] == "type"
        assert set(union["discriminator"]["mapping"]) == types
        for member in union["oneOf"]:
            message = schemas[member["$ref"].rpartition("/")[2]]
            assert message["properties"]["type"]["const"] in types
            assert "type" in message["required"]
            assert name == "LiveToPage" or message["additionalProperties"] is False
