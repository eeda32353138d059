"""Bodies beyond the limit are refused, whatever their headers say."""

from collections.abc import Iterator
from contextlib import suppress

import httpx
import pytest

LIMIT = 2**20


def pieces(size: int) -> Iterator[bytes]:
    """Sent chunked: nothing declares the size."""
    yield b'{"name": "'
    for _ in range(size // 2**16):
        yield b"x" * 2**16
    yield b'"}'


def post(client: httpx.Client, sid: str, body: object) -> httpx.Response:
    headers = {"Content-Type": "application/json"}
    return client.post(f"/api/sessions/{sid}/classes", content=body, headers=headers)


@pytest.mark.parametrize("declared", [True, False])
def test_a_body_beyond_the_limit_is_refused(client: httpx.Client, sid: str, declared: bool) -> None:
    body = b"".join(pieces(2 * LIMIT)) if declared else pieces(2 * LIMIT)
    answer = post(client, sid, body)
    assert answer.status_code == 413
    assert answer.headers["content-type"] == "application/problem+json"
    assert str(LIMIT) in answer.json()["detail"]


@pytest.mark.parametrize("declared", [True, False])
def test_a_body_within_it_is_read_whole(client: httpx.Client, sid: str, declared: bool) -> None:
    body = b"".join(pieces(LIMIT // 2)) if declared else pieces(LIMIT // 2)
    answer = post(client, sid, body)
    assert answer.status_code == 422  # such a long name
    assert "name" in answer.json()["detail"]


def test_a_stranger_is_not_listened_to_for_ever(server) -> None:
    """The server hangs up on a refused request that goes on sending."""
    sent = 0

    def much() -> Iterator[bytes]:
        nonlocal sent
        for _ in range(5000):
            sent += 1
            yield b"x" * 2**16

    with server.stranger() as client:
        with suppress(httpx.WriteError, httpx.ReadError):  # where it hangs up before the answer could be read
            assert client.post("/api/sessions", content=much()).status_code == 401
    assert sent < 1000
