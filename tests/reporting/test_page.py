"""Pages of reports: written whole, with their pictures inside."""

from pathlib import Path

from ars_web.reporting.page import data_uri, write_page


def test_a_page_is_written_whole_and_its_folder_made(tmp_path: Path) -> None:
    file = tmp_path / "new" / "report.html"
    write_page("<p>first</p>", file)
    write_page("<p>second</p>", file)
    assert file.read_text() == "<p>second</p>"
    assert [one.name for one in file.parent.iterdir()] == ["report.html"]


def test_bytes_become_an_address() -> None:
    assert data_uri(b"abc", media_type="image/png") == "data:image/png;base64,YWJj"
