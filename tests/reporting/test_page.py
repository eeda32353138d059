"""Pages of reports: written whole, with their pictures inside."""

from pathlib import Path

import pytest

from ars_web.errors import BadInput
from ars_web.reporting.page import data_uri, write_page


def test_a_page_is_written_whole_and_its_folder_made(tmp_path: Path) -> None:
    file = tmp_path / "new" / "report.html"
    write_page("<p>first</p>", file)
    write_page("<p>second</p>", file)
    assert file.read_text() == "<p>second</p>"
    assert [one.name for one in file.parent.iterdir()] == ["report.html"]


def test_a_page_that_cannot_be_written_is_named_and_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "report.html" / "inside").mkdir(parents=True)
    with pytest.raises(BadInput, match=r"/report\.html cannot be written: Is a directory; name a file in a folder"):
        write_page("<p>first</p>", tmp_path / "report.html")
    assert [one.name for one in tmp_path.iterdir()] == ["report.html"]


def test_bytes_become_an_address() -> None:
    assert data_uri(b"abc", media_type="image/png") == "data:image/png;base64,YWJj"
