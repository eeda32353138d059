"""One browser's view of a session's scene: what its page wants to see, and how that comes about.

All of a scene's views live on its viser server's event loop; what takes time runs on worker threads. Of several wishes
that arrive while one is being fulfilled, only the last counts.
"""

import asyncio
import logging
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
import viser
from jaxtyping import Float, UInt8

from ars_web.errors import ArsError
from ars_web.scene.boxes import BoxNodes, OwnBoxes
from ars_web.scene.cameras import CurrentCamera, frustum_photo
from ars_web.scene.extent import FIELD_OF_VIEW, Extent, Viewpoint, behind_camera, close_up, overview
from ars_web.scene.hardening import Visitor, is_gone
from ars_web.scene.picking import Ray, box_hit, camera_hit
from ars_web.sessions.model import SessionSnapshot
from ars_web.workspace import Look, Picked, Refused, ViewEvent, ViewState

log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class Page:
    """A page whose live line is up.

    Attributes:
        view: its name for its view.
        author: of what is edited there.
        send: tells the page what happens in its scene; for any thread.
    """

    view: str
    author: str
    send: Callable[[ViewEvent], None]


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What all views of a scene share.

    Attributes:
        recording: the session as it was when the scene was opened; its frames and cameras never change.
        workers: for what would hold up the event loop.
    """

    recording: SessionSnapshot
    extent: Extent
    boxes: BoxNodes
    workers: Executor

    @property
    def centres(self) -> Float[np.ndarray, "n 3"]:
        """Of all cameras, in the world."""
        return self.recording.frames.Ts_world_camera[:, :3, 3]


class ClientView:
    """What one connected browser is shown. Every method belongs to the server's event loop."""

    def __init__(self, client: viser.ClientHandle, visitor: Visitor, surroundings: Surroundings) -> None:
        self.client = client
        self.visitor = visitor
        self.page: Page | None = None
        self.state: ViewState | None = None
        self._around = surroundings
        self._camera = CurrentCamera(
            client, surroundings.recording.frames, surroundings.recording.cameras, surroundings.extent
        )
        self._boxes = OwnBoxes(client, surroundings.boxes)
        self._dark: bool | None = None
        self._following: asyncio.Task[None] | None = None
        self._closed = False

    def show(self, state: ViewState) -> None:
        """Show this as soon as what is being shown now is shown."""
        self.state = state
        if self._following is None and not self._closed:
            self._following = asyncio.create_task(self._follow())

    def look(self, look: Look) -> None:
        """Turn the free camera; the frame's camera stays where it is."""
        if self._closed or (self.state is not None and self.state.mode == "frame"):
            return
        viewpoint = self._viewpoint(look)
        if viewpoint is None or is_gone(self.client):
            return
        with self.client.atomic():
            self.client.camera.position = viewpoint.position
            self.client.camera.look_at = viewpoint.look_at
            self.client.camera.fov = FIELD_OF_VIEW
        self.client.flush()

    def tell(self, event: ViewEvent) -> None:
        """Tell the page, if it is there."""
        if self.page is not None:
            self.page.send(event)

    def pick(self, ray: Ray) -> None:
        """Tell the page what a click's ray meets first of what this view shows."""
        state = self.state or ViewState()
        boxes = {box_id: box for box_id, box in self._around.boxes.drawn().items() if box_id not in state.hidden}
        box = box_hit(ray, boxes)
        camera = None if state.mode == "frame" else camera_hit(ray, self._around.centres)
        if camera is not None and (box is None or camera.distance < box.distance):
            self.tell(Picked(frame=camera.key))
        else:
            self.tell(Picked(box_id=None if box is None else box.key))

    def close(self) -> list[asyncio.Task[None]]:
        """The browser is gone; what was being done for it is cancelled, and ends soon."""
        self._closed = True
        self._boxes.close()
        if self._following is None:
            return []
        self._following.cancel()
        return [self._following]

    async def _follow(self) -> None:
        shown: ViewState | None = None
        try:
            while self.state is not None and self.state is not shown:
                shown = self.state
                await self._show(shown)
        except ArsError as error:
            self.tell(Refused(str(error)))
        except Exception:
            # What happens to one view must not end the others.
            log.exception("a view of session %s cannot be shown", self._around.recording.id)
        finally:
            self._following = None
            if self.state is not shown and not self._closed:
                self._following = asyncio.create_task(self._follow())

    async def _show(self, state: ViewState) -> None:
        self._show_theme(dark=state.dark)
        self._boxes.show(hidden=state.hidden, selected=state.selected)
        recording = self._around.recording
        if not 0 <= state.frame < len(recording.frames):
            return
        photo = await self._photo(state.frame)
        if is_gone(self.client):
            return
        with self.client.atomic():
            self._camera.show_others(state.mode == "scene")
            if state.mode == "scene":
                self._camera.show(state.frame, photo)
            else:
                self._camera.hide()
        self.client.flush()

    async def _photo(self, frame: int) -> UInt8[np.ndarray, "h w 3"] | None:
        recording = self._around.recording
        image, camera = recording.frames.images[frame], recording.cameras[int(recording.frames.camera_ids[frame])]
        try:
            loop = asyncio.get_running_loop()
            return await loop.run_in_executor(self._around.workers, frustum_photo, image, camera)
        except ArsError as error:
            self.tell(Refused(str(error)))
            return None

    def _show_theme(self, *, dark: bool) -> None:
        if dark != self._dark and not is_gone(self.client):
            self._dark = dark
            self.client.gui.configure_theme(dark_mode=dark, show_logo=False, show_share_button=False)

    def _viewpoint(self, look: Look) -> Viewpoint | None:
        around, state = self._around, self.state
        if look.at == "all" or state is None:
            corners = [box.corners_world for box in around.boxes.drawn().values()]
            return overview(around.extent, np.concatenate(corners) if corners else np.zeros((0, 3)))
        if look.at == "selected":
            box = None if state.selected is None else around.boxes.box(state.selected)
            return None if box is None else close_up(around.extent, box.corners_world)
        frames = around.recording.frames
        return behind_camera(around.extent, frames.Ts_world_camera[state.frame]) if state.frame < len(frames) else None
