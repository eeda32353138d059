"""How soon an edit over HTTP is at the other pages, and what lines cost that nobody uses: python benchmarks/live.py"""

import asyncio
import json
import os
import secrets
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import AsyncExitStack, asynccontextmanager, contextmanager
from pathlib import Path
from typing import Any

import httpx
import psutil
from websockets.asyncio.client import ClientConnection, connect

from ars_web.demo.recording import make_demo

EDITS = 200
IDLE_LINES = 50
IDLE_SECONDS = 20
TOKEN = "token-of-the-benchmark"
HEADERS = {"Authorization": f"Bearer {TOKEN}"}
PLACE = {"position": [0.0, 0.0, 0.5], "wxyz": [1.0, 0.0, 0.0, 0.0]}


@contextmanager
def server(folder: Path) -> Iterator[tuple[psutil.Process, str]]:
    """A server process and its address."""
    options = ["--sessions", str(folder / "sessions"), "--root", f"data={folder}", "--token", TOKEN, "--port", "0"]
    process = subprocess.Popen(
        [sys.executable, "-m", "ars_web", "serve", *options], stdout=subprocess.PIPE, text=True, env=os.environ
    )
    try:
        assert process.stdout is not None
        url = next(word for word in process.stdout.readline().split() if word.startswith("http://"))
        yield psutil.Process(process.pid), url.rstrip("/")
    finally:
        process.terminate()
        process.wait()


@asynccontextmanager
async def line(url: str, sid: str) -> AsyncIterator[ClientConnection]:
    """A page's line, ready."""
    address = f"{url.replace('http', 'ws', 1)}/api/sessions/{sid}/live?view={secrets.token_hex(16)}"
    async with connect(address, additional_headers=HEADERS, proxy=None, max_queue=None) as connection:
        await message(connection, "ready")
        yield connection


async def message(connection: ClientConnection, kind: str) -> dict[str, Any]:
    """The next message of a kind."""
    while (found := json.loads(await connection.recv()))["type"] != kind:
        pass
    return found


async def latencies(client: httpx.AsyncClient, path: str, listening: ClientConnection) -> list[float]:
    """Milliseconds from before each PATCH of a box to when the edit is at another page."""
    place = {"class_id": 0, "T_world_box": PLACE, "size": [0.1, 0.1, 0.1]}
    made = await client.post(f"{path}/boxes", json=place)
    box, revision = made.headers["location"], made.json()["revision"]
    await message(listening, "edit")
    found: list[float] = []
    for i in range(EDITS):
        begin = time.perf_counter()
        change = client.patch(box, json={"size": [0.1, 0.1, 0.2 + i / 1000]}, headers={"If-Match": f'"{revision}"'})
        answer, _ = await asyncio.gather(change, told(listening, begin, found))
        revision = answer.json()["revision"]
    return found


async def told(listening: ClientConnection, begin: float, found: list[float]) -> None:
    await message(listening, "edit")
    found.append(1000 * (time.perf_counter() - begin))


def row(what: str, times: list[float]) -> str:
    p95 = statistics.quantiles(times, n=20)[-1]
    return f"{what:46} {statistics.median(times):7.1f} ms median {p95:7.1f} ms p95 {max(times):7.1f} ms longest"


async def measure(process: psutil.Process, url: str) -> None:
    async with httpx.AsyncClient(base_url=url, headers=HEADERS, timeout=60) as client, AsyncExitStack() as lines:
        made = await client.post(
            "/api/sessions", json={"name": "demo", "root": "data", "path": "demo", "classes": ["thing"]}
        )
        sid = made.json()["id"]
        path = f"/api/sessions/{sid}"
        await lines.enter_async_context(line(url, sid))
        second = await lines.enter_async_context(line(url, sid))
        print(row(f"PATCH to the second of 2 lines, {EDITS} edits", await latencies(client, path, second)))
        before, threads = process.memory_info().rss, process.num_threads()
        for _ in range(IDLE_LINES):
            await lines.enter_async_context(line(url, sid))
        await asyncio.sleep(2)
        each = (process.memory_info().rss - before) / IDLE_LINES / 1024
        process.cpu_percent()
        await asyncio.sleep(IDLE_SECONDS)
        print(
            f"{IDLE_LINES} idle lines more: {each:.0f} KiB each, {process.num_threads() - threads} threads more,"
            f" {process.cpu_percent():.1f} % of a core over {IDLE_SECONDS} s"
        )
        print(row(f"PATCH to the second of {IDLE_LINES + 2} lines", await latencies(client, path, second)))


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        make_demo(Path(place) / "demo", frames=9, size=(480, 360))
        with server(Path(place)) as (running, address):
            asyncio.run(measure(running, address))
