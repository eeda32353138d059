"""The OpenAPI document: what FastAPI derives from the routes; the problems, the live line's messages and the ways to
log in are added."""

from typing import Any, cast

from fastapi import FastAPI, Response
from fastapi.openapi.utils import get_openapi
from pydantic import BaseModel
from pydantic.json_schema import models_json_schema

from ars_web.api.dependencies import JsonResponse
from ars_web.api.live_models import LiveFromPage, LiveToPage
from ars_web.api.models import EditJson
from ars_web.api.problems import DESCRIPTIONS, ViewsProblem
from ars_web.api.security import OPEN_PATHS

_DESCRIPTION = (
    "Reads of a changeable thing carry an ETag; its PATCH and DELETE need it in `If-Match`. A POST may carry"
    " `Idempotency-Key`. Image coordinates have (0, 0) at the image's top left corner; lengths are metres."
)


def install(app: FastAPI) -> None:
    """Answer `/api/openapi.json`, to those who are logged in."""
    app.openapi = lambda: document(app)

    def answer() -> Response:
        return JsonResponse(document(app))

    app.add_api_route("/api/openapi.json", answer, include_in_schema=False)


def document(app: FastAPI) -> dict[str, Any]:
    """The OpenAPI document of the routes of `app`, made once."""
    if app.openapi_schema is None:
        schema = get_openapi(title=app.title, version=app.version, description=_DESCRIPTION, routes=app.routes)
        components = cast(dict[str, Any], schema.setdefault("components", {}))
        answers: list[type[BaseModel]] = [
            *{model for model, _ in DESCRIPTIONS.values()},
            ViewsProblem,
            EditJson,
            LiveToPage,
        ]
        _, found = models_json_schema(
            [(LiveFromPage, "validation"), *((model, "serialization") for model in answers)],
            ref_template="#/components/schemas/{model}",
        )
        components["schemas"] = {**components.get("schemas", {}), **found["$defs"]}
        # FastAPI's own words for a refused request; ours is ValidationProblem.
        for name in ("HTTPValidationError", "ValidationError"):
            components["schemas"].pop(name, None)
        components["securitySchemes"] = {
            "token": {"type": "http", "scheme": "bearer"},
            "cookie": {"type": "apiKey", "in": "cookie", "name": "ars_web_PORT"},
        }
        schema["security"] = [{"token": []}, {"cookie": []}]
        for path, operations in cast(dict[str, dict[str, Any]], schema["paths"]).items():
            if path in OPEN_PATHS:
                for operation in operations.values():
                    operation["security"] = []
        app.openapi_schema = schema
    return app.openapi_schema
