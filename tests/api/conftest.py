"""A real server on a free port of this machine, in a thread, with a small recording to import."""

import importlib.util
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Any

import cv2
import httpx
import numpy as np
import pytest
import uvicorn
from fastapi import FastAPI

from ars_web.api.dependencies import Services
from ars_web.app import WEBSOCKETS, create_app, listening
from ars_web.settings import Settings

TOKEN = "a-token-for-tests"
WIDTH, HEIGHT = 160, 120


@dataclass(frozen=True)
class Server:
    """A running server, and a client that has its token."""

    url: str
    app: FastAPI
    client: httpx.Client
    root: Path

    @property
    def services(self) -> Services:
        return self.app.state.services

    @property
    def host(self) -> str:
        return self.url.removeprefix("http://")

    def stranger(self, **headers: str) -> httpx.Client:
        """A client without a token."""
        return httpx.Client(base_url=self.url, headers=headers, timeout=120)

    def browser(self, **headers: str) -> httpx.Client:
        """A client with a login cookie, as a browser's page on this server sends it."""
        door = self.services.door
        return httpx.Client(
            base_url=self.url,
            cookies={door.cookie_name: door.cookies.issue()},
            headers={"Origin": self.url, "Sec-Fetch-Site": "same-origin", **headers},
            timeout=120,
        )


def write_scene(folder: Path, *, frames: int = 6) -> Path:
    """An ARS scene: a camera that steps to the right while it looks along the world's z, a metre before its origin."""
    (folder / "images").mkdir(parents=True)
    for i in range(frames):
        image = np.full((HEIGHT, WIDTH, 3), 20 * i, dtype=np.uint8)
        image[: HEIGHT // 2, : WIDTH // 2] = (0, 0, 255)
        assert cv2.imwrite(str(folder / "images" / f"{i:05d}.jpg"), image)
    rows = [f"{0.01 * i} 0 -1 0 0 0 1" for i in range(frames)]
    (folder / "robot_poses.txt").write_text("\n".join(rows) + "\n")
    (folder / "camera_extrinsics.txt").write_text("0 0 0 0 0 0 1\n")
    (folder / "camera_intrinsics.txt").write_text(f"{WIDTH} {HEIGHT} 150 150 79.5 59.5 -0.1 0.01 0 0\n")
    return folder


def until(condition: Callable[[], bool], *, seconds: float = 60.0) -> None:
    """Return once `condition` holds; fail after `seconds`."""
    deadline = time.monotonic() + seconds
    pause = threading.Event()
    while not condition():
        assert time.monotonic() < deadline, "it did not come true in time"
        pause.wait(0.01)


def run_server(
    folder: Path, *, websockets: Mapping[str, Any] = MappingProxyType({}), **settings: Any
) -> Iterator[Server]:
    root = folder / "root"
    if not root.exists():
        write_scene(root / "scene")
    listener = listening("127.0.0.1", 0)
    port = listener.getsockname()[1]
    app = create_app(
        Settings(
            **{
                "sessions": folder / "sessions",
                "roots": {"data": root},
                "token": TOKEN,
                "port": port,
                "largest_upload": 10 * 2**20,
                "largest_body": 2**20,
                **settings,
            }
        )
    )
    server = uvicorn.Server(uvicorn.Config(app, log_level="warning", access_log=False, **{**WEBSOCKETS, **websockets}))
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
    thread.start()
    try:
        until(lambda: server.started)
        url = f"http://127.0.0.1:{port}"
        with httpx.Client(base_url=url, headers={"Authorization": f"Bearer {TOKEN}"}, timeout=120) as client:
            yield Server(url, app, client, root)
    finally:
        app.state.services.events.close()
        server.should_exit = True
        thread.join()
        listener.close()


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One for all tests of a module."""
    yield from run_server(tmp_path_factory.mktemp("server"))


@pytest.fixture(name="until")
def _until() -> Callable[..., None]:
    return until


@pytest.fixture(name="run_server")
def _run_server() -> Callable[..., AbstractContextManager[Server]]:
    """For a test that needs a server with settings of its own: `with run_server(folder, **settings) as server`."""
    return contextmanager(run_server)


@pytest.fixture(name="write_scene")
def _write_scene() -> Callable[..., Path]:
    return write_scene


@pytest.fixture(scope="session")
def live_page() -> ModuleType:
    """`live_page.py`, a page's end of the live line."""
    spec = importlib.util.spec_from_file_location("live_page", Path(__file__).parent / "live_page.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def client(server: Server) -> httpx.Client:
    return server.client


@pytest.fixture
def sid(client: httpx.Client) -> str:
    """A new session of the scene, with the class `cube` of id 0."""
    made = client.post("/api/sessions", json={"name": "scene", "root": "data", "path": "scene", "classes": ["cube"]})
    assert made.status_code == 201, made.text
    return made.json()["id"]


@pytest.fixture
def ring(client: httpx.Client, server: Server, ring_scene: ModuleType) -> str:
    """Where a new session is of the recording round the ball; it has the class `ball` of id 0, and `cube` of id 1."""
    if not (server.root / "ring").exists():
        ring_scene.write(server.root / "ring")
    body = {"name": "ring", "root": "data", "path": "ring", "classes": ["ball", "cube"]}
    made = client.post("/api/sessions", json=body)
    assert made.status_code == 201, made.text
    return f"/api/sessions/{made.json()['id']}"


@pytest.fixture
def box_json() -> dict[str, Any]:
    """A box to add, in the middle of the images."""
    place = {"position": [0.0, 0.0, 0.0], "wxyz": [1.0, 0.0, 0.0, 0.0]}
    return {"class_id": 0, "T_world_box": place, "size": [0.2, 0.2, 0.2]}
