"""viser's page with our bridge, and what its policy lets run."""

import base64
import gzip
import hashlib
import re
from pathlib import Path

import pytest
import viser

from ars_web.errors import StoreError
from ars_web.scene import client_page
from ars_web.scene.client_page import decoded, inline_scripts, policy

HTML = (Path(viser.__file__).parent / "client" / "build" / "index.html").read_text(encoding="utf-8")


def encoded(data: bytes) -> str:
    """Base 88 as viser's build writes it: the slow way round."""
    alphabet = [chr(code) for code in range(0x21, 0x7F) if chr(code) not in "\"&<>'`"]
    text = ""
    for start in range(0, len(data), 4):
        group = data[start : start + 4]
        value = int.from_bytes(group, "big")
        digits = ""
        for _ in range(len(group) + 1):
            value, digit = divmod(value, 88)
            digits = alphabet[digit] + digits
        text += digits
    return text


@pytest.mark.parametrize("size", [0, 1, 2, 3, 4, 5, 7, 8, 255])
def test_the_attribute_is_read_as_the_loader_reads_it(size: int) -> None:
    data = bytes((37 * i + 11) % 256 for i in range(size))
    assert decoded(encoded(data)) == data
    assert decoded(encoded(b"\xff" * size)) == b"\xff" * size


def test_the_pages_scripts_are_found() -> None:
    loader, module = inline_scripts(HTML)
    assert b"document.currentScript.dataset" in loader
    assert b"WebGLRenderer" in module
    # Nothing else in the page would run: no further script, no handler in an attribute.
    assert len(re.findall(r"<script", HTML)) == 1
    assert not re.search(r"<[^>]*\son[a-z]+=", HTML.replace(re.search(r'data-p="[^"]*"', HTML)[0], ""))  # pyright: ignore


def test_the_page_is_visers_with_the_bridge() -> None:
    page = client_page.client_page()
    html = gzip.decompress(page.body).decode()
    assert html.replace(client_page.BRIDGE, "", 1) == HTML
    assert html.index(client_page.BRIDGE) < html.index("</head>")
    assert client_page.client_page() is page
    assert page.etag == f'"{hashlib.sha256(html.encode()).hexdigest()[:24]}"'


def test_the_policy_names_scripts_by_their_hashes_and_this_server_alone() -> None:
    told = dict(directive.split(" ", 1) for directive in policy([b"a", b"b"]).split("; "))
    hashes = [f"'sha256-{base64.b64encode(hashlib.sha256(s).digest()).decode()}'" for s in (b"a", b"b")]
    assert told["script-src"] == " ".join(["'self'", "'wasm-unsafe-eval'", *hashes])
    assert told["connect-src"] == "'self' data: blob:"
    assert told["frame-ancestors"] == "'self'"
    assert told["default-src"] == told["base-uri"] == told["form-action"] == "'none'"
    assert "'unsafe-eval'" not in policy([]).split()
    assert client_page.client_page().content_security_policy == policy(inline_scripts(HTML))


@pytest.mark.parametrize(
    "html",
    [
        "<html><head></head></html>",
        HTML.replace("data-cs=", "data-cx=", 1),
        re.sub(r'data-cs="(\d+)"', 'data-cs="1000"', HTML),
        HTML.replace('data-p="', 'data-p="!!!!!', 1),
    ],
    ids=["no script", "another attribute", "another size", "no Zstandard frame"],
)
def test_another_client_is_refused(html: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    build = tmp_path / "client" / "build"
    build.mkdir(parents=True)
    (build / "index.html").write_text(html, encoding="utf-8")
    monkeypatch.setattr(viser, "__file__", str(tmp_path / "__init__.py"))
    with pytest.raises(StoreError, match=r"not the client of viser 1\.1\.1"):
        client_page.client_page.__wrapped__()


def test_a_missing_client_is_said_so(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(viser, "__file__", str(tmp_path / "__init__.py"))
    with pytest.raises(StoreError, match="client is missing"):
        client_page.client_page.__wrapped__()
