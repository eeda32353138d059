"""A browser's end of a scene's websocket, without a browser; a session to look at; waiting."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

import cv2
import msgspec
import numpy as np
import pytest
import viser
import zstandard
from viser import _messages
from websockets.sync.client import ClientConnection, connect

from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.recordings.recording import Frame, RecordedBox, Recording
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.store import SessionStore
from ars_web.workspace import SceneAddress

SUBPROTOCOL = f"viser-v{viser.__version__}"


class Visitor:
    """Speaks viser's protocol as its client does; `nodes` is what the scene has shown it so far, by name."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.nodes: dict[str, dict[str, Any]] = {}
        self.told: list[dict[str, Any]] = []

    def say(self, message: _messages.Message) -> None:
        self.socket.send(msgspec.msgpack.encode(message.as_serializable_dict([])))

    def arrive(self, *, fov: float = 0.9, height: int = 720) -> None:
        """What a client says first; until then viser does not count it."""
        self.say(
            _messages.ViewerCameraMessage(
                wxyz=(1.0, 0.0, 0.0, 0.0),
                position=(0.0, 0.0, 2.0),
                fov=fov,
                near=0.01,
                far=1000.0,
                image_height=height,
                image_width=1280,
                look_at=(0.0, 0.0, 0.0),
                up_direction=(0.0, 0.0, 1.0),
            )
        )

    def click(self, origin: np.ndarray, towards: np.ndarray) -> None:
        self.click_along(origin, (towards - origin) / np.linalg.norm(towards - origin))

    def click_along(self, origin: np.ndarray, direction: np.ndarray) -> None:
        self.say(
            _messages.ScenePointerMessage(
                event_type="click",
                ray_origin=tuple(map(float, origin)),
                ray_direction=tuple(map(float, direction)),
                screen_pos=((0.5, 0.5),),
                modifier=None,
            )
        )

    def listen_until(self, condition: Callable[["Visitor"], bool], *, seconds: float = 60.0) -> None:
        """Take in messages until `condition(self)`."""
        deadline = time.monotonic() + seconds
        while not condition(self):
            for message in _unpacked(self.socket.recv(timeout=max(0.0, deadline - time.monotonic()))):
                self._take_in(message)

    def _take_in(self, message: dict[str, Any]) -> None:
        self.told.append(message)
        name = message.get("name")
        if not isinstance(name, str):
            return
        if "props" in message:
            self.nodes[name] = {**message["props"], "type": message["type"], "visible": True}
        elif message["type"] == "SceneNodeUpdateMessage":
            self.nodes[name].update(message["updates"])
        elif message["type"] == "SetSceneNodeVisibilityMessage" and name in self.nodes:
            self.nodes[name]["visible"] = message["visible"]
        elif message["type"] == "RemoveSceneNodeMessage":
            self.nodes.pop(name, None)
        elif message["type"] in ("SetPositionMessage", "SetOrientationMessage") and name in self.nodes:
            self.nodes[name].update({key: message[key] for key in ("position", "wxyz") if key in message})


def _unpacked(raw: str | bytes) -> list[dict[str, Any]]:
    """Messages with their arrays, which follow them on the wire: each padded to eight bytes, named by its place."""
    assert isinstance(raw, bytes)
    packed = int.from_bytes(raw[8:16], "little")
    inner = zstandard.ZstdDecompressor().decompress(raw[16 : 16 + packed])
    told = msgspec.msgpack.decode(inner)
    buffers: list[bytes] = []
    at = 16 + packed
    for length in told["binaryBufferLengths"]:
        at += -at % 8
        buffers.append(raw[at : at + length])
        at += length
    return _filled(told["messages"], buffers)


def _filled(value: Any, buffers: list[bytes]) -> Any:
    if isinstance(value, dict) and "__binary_index" in value:
        return np.frombuffer(buffers[value["__binary_index"]], dtype=value["dtype"])
    if isinstance(value, dict):
        return {name: _filled(part, buffers) for name, part in value.items()}
    return [_filled(part, buffers) for part in value] if isinstance(value, list) else value


@pytest.fixture
def visit() -> Callable[[SceneAddress], AbstractContextManager[Visitor]]:
    """`with visit(address) as visitor`: connected as the proxy connects, and counted by viser."""

    @contextmanager
    def visiting(address: SceneAddress) -> Iterator[Visitor]:
        with connect(
            address.url,
            additional_headers=address.headers,
            subprotocols=[SUBPROTOCOL],
            max_size=None,
            compression=None,
            proxy=None,
        ) as socket:
            visitor = Visitor(socket)
            visitor.arrive()
            yield visitor

    return visiting


def until(condition: Callable[[], bool], *, seconds: float = 60.0) -> None:
    """Return once `condition` holds; fail after `seconds`."""
    deadline = time.monotonic() + seconds
    pause = threading.Event()
    while not condition():
        assert time.monotonic() < deadline, "it did not come true in time"
        pause.wait(0.01)


@pytest.fixture(name="until")
def _until() -> Callable[..., None]:
    return until


def look_at(centre: np.ndarray, target: np.ndarray) -> np.ndarray:
    """`T_world_camera` (4, 4) of an upright camera."""
    forward = (target - centre) / np.linalg.norm(target - centre)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return rigid_transform.from_rotation(np.stack([right, np.cross(forward, right), forward], axis=-1), centre)


@pytest.fixture(name="look_at")
def _look_at() -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    return look_at


@pytest.fixture
def recording(tmp_path: Path) -> Recording:
    """Eight frames half round a table, with photos, and a box on it; the last camera bends its lines."""
    images = tmp_path / "images"
    images.mkdir()
    frames: list[Frame] = []
    for i in range(8):
        image = images / f"{i:05d}.jpg"
        assert cv2.imwrite(str(image), np.full((120, 160, 3), 30 * i, dtype=np.uint8))
        angle = np.pi * i / 8
        pose = look_at(np.array([np.cos(angle), np.sin(angle), 0.8]), np.array([0.1, 0.2, 0.05]))
        frames.append(Frame(image.name, image, int(i == 7), pose))
    cameras = {
        0: Camera(160, 120, 150.0, 150.0, 79.5, 59.5),
        1: Camera(160, 120, 150.0, 152.0, 83.0, 55.0, "brown", (-0.2, 0.03, 1e-3, -1e-3, 0.0)),
    }
    place = rigid_transform.from_rotation(np.eye(3), np.array([0.1, 0.2, 0.05]))
    boxes = (RecordedBox("cube", Box(place, np.array([0.1, 0.1, 0.1]))),)
    return Recording("ars", tmp_path, cameras, tuple(frames), class_names=("cube",), boxes=boxes)


@pytest.fixture
def store(tmp_path: Path) -> Iterator[SessionStore]:
    with SessionStore(tmp_path / "sessions") as store:
        yield store


@pytest.fixture
def editor(store: SessionStore) -> SessionEditor:
    return SessionEditor(store)


@pytest.fixture
def sid(store: SessionStore, recording: Recording) -> str:
    return store.create(recording, name="table").id
