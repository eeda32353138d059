"""viser's client, as this program serves it: its one page with our bridge, and a policy for the scripts in it.

The page unpacks itself: a loader decodes an attribute, 88 characters for 4 bytes in 5, into a Zstandard frame of a
style sheet and a module, which it adds to the page. Both scripts are named in the policy by their hashes, so that no
other inline script runs, whatever a label in the scene, or a server that a foreign link names, would like to add.
"""

import base64
import gzip
import hashlib
import re
from functools import cache
from pathlib import Path

import numpy as np
import viser
import zstandard

from ars_web.errors import StoreError
from ars_web.workspace import ScenePage

BRIDGE = '<link rel="stylesheet" href="/static/scene/bridge.css"><script src="/static/scene/bridge.js"></script>'
"""Ours, added to the head of viser's page: hides its panels, tells the page around it about keys and pointers."""

_LOADER = re.compile(r'<script data-p="([^"]*)" data-ss="(\d+)" data-cs="(\d+)">(.*?)</script>', re.DOTALL)

_ALPHABET = bytes(code for code in range(0x21, 0x7F) if code not in b"\"&<>'`")


@cache
def client_page() -> ScenePage:
    """The page and its policy, made once a process.

    Raises:
        StoreError: viser's client is missing, or not as that of version 1.1.1.
    """
    path = Path(viser.__file__).parent / "client" / "build" / "index.html"
    try:
        html = path.read_text(encoding="utf-8")
    except OSError as error:
        raise StoreError(f"{path}: viser's client is missing; install viser 1.1.1 again") from error
    scripts = inline_scripts(html)
    if len(scripts) != 2 or html.count("</head>") != 1:
        raise StoreError(f"{path}: this is not the client of viser 1.1.1; install that version")
    body = html.replace("</head>", BRIDGE + "</head>").encode()
    return ScenePage(
        body=gzip.compress(body, compresslevel=6, mtime=0),
        etag=f'"{hashlib.sha256(body).hexdigest()[:24]}"',
        content_security_policy=policy(scripts),
    )


def inline_scripts(html: str) -> list[bytes]:
    """The page's scripts: its loader, then the module that the loader unpacks; empty where it is none of viser's."""
    match = _LOADER.search(html)
    if match is None:
        return []
    packed, style_size, script_size, loader = match.groups()
    size = int(style_size) + int(script_size)
    try:
        unpacked = zstandard.ZstdDecompressor().decompress(decoded(packed), max_output_size=size)
    except zstandard.ZstdError:
        return []
    return [loader.encode(), unpacked[int(style_size) :]] if len(unpacked) == size else []


def decoded(text: str) -> bytes:
    """The bytes that viser's loader reads from its attribute: base 88, big end first, the last group shorter."""
    values = np.zeros(256, dtype=np.uint64)
    values[list(_ALPHABET)] = np.arange(len(_ALPHABET), dtype=np.uint64)
    digits = values[np.frombuffer(text.encode(), dtype=np.uint8)]
    whole = len(digits) // 5 * 5
    weights = np.uint64(88) ** np.arange(4, -1, -1, dtype=np.uint64)
    data = (digits[:whole].reshape(-1, 5) * weights).sum(axis=1, dtype=np.uint64).astype(">u4").tobytes()
    last = digits[whole:]
    value = sum(int(digit) * 88**place for place, digit in enumerate(last[::-1]))
    return data + value.to_bytes(max(len(last) - 1, 0), "big")


def policy(scripts: list[bytes]) -> str:
    """What the scene's page may do: run these scripts and ours, and talk to this server alone.

    Its styles are made while it runs, so they cannot be named. `wasm-unsafe-eval` lets it unpack itself, no more.
    """
    hashes = [f"'sha256-{base64.b64encode(hashlib.sha256(script).digest()).decode()}'" for script in scripts]
    return "; ".join(
        [
            "default-src 'none'",
            f"script-src 'self' 'wasm-unsafe-eval' {' '.join(hashes)}",
            "style-src 'self' 'unsafe-inline'",
            "img-src 'self' data: blob:",
            "font-src 'self' data:",
            "connect-src 'self' data: blob:",
            "worker-src blob:",
            "base-uri 'none'",
            "form-action 'none'",
            "frame-ancestors 'self'",
        ]
    )
