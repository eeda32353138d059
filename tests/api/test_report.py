"""A session's report over HTTP."""

import json
from typing import Any

import httpx
import pytest

from ars_web.api.security import HEADERS


@pytest.fixture
def boxed(client: httpx.Client, sid: str, box_json: dict[str, Any]) -> str:
    """Where the report of a session with a box is."""
    made = client.post(f"/api/sessions/{sid}/boxes", json=box_json)
    assert made.status_code == 201, made.text
    return f"/api/sessions/{sid}/report"


def test_the_page_is_shown_in_a_sandbox_and_can_be_saved(client: httpx.Client, boxed: str) -> None:
    answer = client.get(boxed)
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"] == "text/html; charset=utf-8"
    assert answer.headers["content-disposition"] == 'inline; filename="scene-report.html"'
    policy = answer.headers["content-security-policy"].split("; ")
    assert {"default-src 'none'", "style-src 'unsafe-inline'", "img-src data:", "sandbox"} <= set(policy)
    assert not any(part.startswith("script-src") for part in policy)
    for name, value in HEADERS.items():
        assert name == "Content-Security-Policy" or answer.headers[name] == value
    assert answer.headers["cache-control"] == "no-store"
    assert "scene: before training" in answer.text
    assert answer.text.count("data:image/jpeg;base64,") == 6
    assert client.get(f"{boxed}?save=true").headers["content-disposition"].startswith("attachment; ")


def test_options_decide_what_it_tells_of(client: httpx.Client, boxed: str) -> None:
    options = {
        "frames": {"step": 2, "start": 1, "near_frames": 1},
        "shape": "box",
        "min_visible": 0.1,
        "split": {"train": 0.6, "val": 0.4, "by": "frame"},
    }
    page = client.get(boxed, params={"options": json.dumps(options)}).text
    assert (
        "--frames-step 2 --frames-start 1 --frames-near-frames 1 --shape box --min-visible 0.1 --split-train 0.6"
        " --split-val 0.4 --split-by frame" in page
    )
    assert page.count("data:image/jpeg;base64,") == 3


def test_a_session_without_boxes_says_so(client: httpx.Client, sid: str) -> None:
    answer = client.get(f"/api/sessions/{sid}/report")
    assert answer.status_code == 200
    assert "The session has no boxes, so there is nothing to label" in answer.text


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ('{"frames": {"start": 99}}', "no frame is chosen"),
        ('{"shape": "mesh"}', "needs a mesh"),
        ('{"split": {"train": 0.5}}', "train + val + test must be 1, not 0.7"),
        ('{"frames": {"step": 0}}', "frames.step"),
        ('{"min_visible": NaN}', "min_visible"),
        ('{"split": {"by": "half"}}', "split.by"),
        ('{"frame": {"step": 2}}', "options.frame"),
        ('{"sessions": ["aaaaaaaaaaaa"]}', "a report is of one session"),
        ("frames.step=2", "options: not JSON"),
    ],
)
def test_what_cannot_be_is_refused(client: httpx.Client, boxed: str, options: str, says: str) -> None:
    answer = client.get(boxed, params={"options": options})
    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"
    assert says in answer.text


def test_a_session_that_is_not_there_is_not_found(client: httpx.Client) -> None:
    assert client.get("/api/sessions/aaaaaaaaaaaa/report").status_code == 404
