"""What formats there are, over HTTP."""

from typing import Any

import httpx
import pytest

from ars_web.datasets.option_list import export_options
from ars_web.datasets.registry import WRITERS
from ars_web.recordings.registry import READERS


@pytest.fixture
def formats(client: httpx.Client) -> dict[str, Any]:
    answer = client.get("/api/formats")
    assert answer.status_code == 200
    return answer.json()


def test_all_readers_are_named_with_what_they_need(formats: dict[str, Any]) -> None:
    assert [reader["format"] for reader in formats["readers"]] == list(READERS)
    tum = next(reader for reader in formats["readers"] if reader["format"] == "tum")
    assert tum["title"] == "TUM trajectory"
    assert "camera file" in tum["needs"]


def test_all_writers_are_described_with_their_options(formats: dict[str, Any]) -> None:
    assert [writer["format"] for writer in formats["writers"]] == list(WRITERS)
    for writer in formats["writers"]:
        assert writer["title"]
        assert writer["description"].endswith(".")
        assert writer["shapes"] == ["box", "hull", "mesh"]
        assert writer["shows"]
        every = [option.name for option in export_options()]
        said = [option["name"] for option in writer["options"]]
        owners = {"heading_bins": "compass", "masks": "bop"}
        assert said == [name for name in every if owners.get(name, writer["format"]) == writer["format"]]
    options = {option["name"]: option for option in formats["writers"][0]["options"]}
    assert [choice["value"] for choice in options["images"]["choices"]] == ["link", "copy", "rectify", "none"]
    assert (options["split.train"]["default"], options["split.train"]["maximum"]) == (0.8, 1.0)


def test_an_export_takes_every_default(client: httpx.Client, formats: dict[str, Any], sid: str) -> None:
    options: dict[str, Any] = {}
    for option in formats["writers"][0]["options"]:
        group, dot, key = option["name"].partition(".")
        (options.setdefault(group, {}) if dot else options)[key if dot else group] = option["default"]
    body = {"format": "yolo", "options": options}
    assert client.post(f"/api/sessions/{sid}/exports/preview", json=body).status_code == 200
