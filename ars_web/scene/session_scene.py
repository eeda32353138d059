"""The scene of one session: a viser server with what all views share, and the views of those who are there.

Whatever is asked of it by other threads is done on the viser server's event loop, one thing at a time.
"""

import asyncio
import logging
from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import suppress

import numpy as np
import viser

from ars_web.errors import ArsError
from ars_web.scene import hardening
from ars_web.scene.boxes import BoxNodes
from ars_web.scene.cameras import add_cameras
from ars_web.scene.extent import FIELD_OF_VIEW, overview, recording_extent
from ars_web.scene.ground import add_ground
from ars_web.scene.picking import Ray, pixel_angle
from ars_web.scene.views import ClientView, Page, Surroundings
from ars_web.sessions.model import SessionSnapshot, SessionState
from ars_web.workspace import BoxPreview, Look, ViewAction, ViewState

log = logging.getLogger(__name__)

CLOSING_SECONDS = 5.0


class SessionScene:
    """One session's scene, served on loopback from the moment it is made until `close`. Thread-safe."""

    def __init__(
        self, recording: SessionSnapshot, *, read_state: Callable[[], SessionState], workers: Executor
    ) -> None:
        """
        Args:
            read_state: the session as it is now; may block.
            workers: for what may block.
        """
        self._read_state = read_state
        self._workers = workers
        self._pages: dict[str, Page] = {}
        self._states: dict[str, ViewState] = {}
        self._clients: dict[int, ClientView] = {}
        self._refreshing: asyncio.Task[None] | None = None
        self._stale = False
        self._revision = recording.state.revision
        self.server = hardening.guarded_server()
        extent = recording_extent(recording.frames.Ts_world_camera)
        boxes = BoxNodes(self.server)
        self._around = Surroundings(recording=recording, extent=extent, boxes=boxes, workers=workers)
        with self.server.atomic():
            add_ground(self.server.scene, extent)
            add_cameras(self.server.scene, recording.frames, recording.cameras, extent)
        boxes.show(recording.state)
        self._set_initial_camera()
        self.server.gui.configure_theme(dark_mode=True, show_logo=False, show_share_button=False)
        self.server.on_client_connect(self._connected)
        self.server.on_client_disconnect(self._disconnected)
        self.server.scene.on_click()(self._clicked)  # pyright: ignore[reportArgumentType] viser takes both kinds
        self._loop = self.server.get_event_loop()

    @property
    def port(self) -> int:
        """On 127.0.0.1."""
        return self.server.get_port()

    @property
    def is_watched(self) -> bool:
        """Whether a browser is connected."""
        return bool(self._clients)

    @property
    def revision(self) -> int:
        """Of what was last read from the store."""
        return self._revision

    def attach(self, page: Page) -> None:
        """A page is there, or there again, by the name of its view."""
        self._post(self._attach, page)

    def detach(self, view: str) -> None:
        """The page is gone."""
        self._post(self._detach, view)

    def show(self, view: str, state: ViewState) -> None:
        """Show this in a view, now or once it connects."""
        self._post(self._show, view, state)

    def act(self, view: str, action: ViewAction) -> None:
        """Do this in a view, if it is connected."""
        self._post(self._act, view, action)

    def preview(self, view: str, preview: BoxPreview | None) -> None:
        """Draw a box as a page would have it, for all views."""
        self._post(self._preview, view, preview)

    def refresh(self) -> None:
        """The session may have been edited: draw it as it is now."""
        self._post(self._refresh)

    def close(self) -> None:
        """Let go of all browsers and stop the server; its thread has ended then."""
        with suppress(RuntimeError):  # the loop has ended by itself
            asyncio.run_coroutine_threadsafe(self._end(), self._loop).result(CLOSING_SECONDS)
        self.server.stop()

    def _post(self, callback: Callable[..., None], *args: object) -> None:
        with suppress(RuntimeError):  # the scene was closed meanwhile
            self._loop.call_soon_threadsafe(callback, *args)

    # What follows runs on the event loop.

    async def _connected(self, client: viser.ClientHandle) -> None:
        hardening.hear_only_what_is_needed(client)
        visitor = hardening.visitor()
        view = ClientView(client, visitor, self._around)
        view.page = self._pages.get(visitor.view)
        self._clients[client.client_id] = view
        state = self._states.get(visitor.view)
        if state is not None or not visitor.view:
            view.show(state or ViewState())

    async def _disconnected(self, client: viser.ClientHandle) -> None:
        view = self._clients.pop(client.client_id, None)
        if view is not None:
            view.close()

    def _views(self, name: str) -> list[ClientView]:
        return [view for view in self._clients.values() if view.visitor.view == name]

    def _attach(self, page: Page) -> None:
        self._pages[page.view] = page
        for view in self._views(page.view):
            view.page = page

    def _detach(self, name: str) -> None:
        self._pages.pop(name, None)
        self._states.pop(name, None)
        self._around.boxes.preview(None, by=name)
        for view in self._views(name):
            view.page = None

    def _show(self, name: str, state: ViewState) -> None:
        self._states[name] = state
        for view in self._views(name):
            view.show(state)

    def _act(self, name: str, action: ViewAction) -> None:
        for view in self._views(name):
            if isinstance(action, Look):
                view.look(action)

    def _preview(self, name: str, preview: BoxPreview | None) -> None:
        self._around.boxes.preview(preview, by=name)

    def _refresh(self) -> None:
        self._stale = True
        if self._refreshing is None:
            self._refreshing = asyncio.create_task(self._read_and_draw())

    async def _read_and_draw(self) -> None:
        try:
            while self._stale:
                self._stale = False
                state = await asyncio.get_running_loop().run_in_executor(self._workers, self._read_state)
                self._around.boxes.show(state)
                self._revision = state.revision
        except ArsError as error:  # deleted, or the disk is full: those who ask for the session are told
            log.info("session %s: %s", self._around.recording.id, error)
        finally:
            self._refreshing = None

    async def _clicked(self, event: viser.SceneClickEvent) -> None:
        view = self._clients.get(event.client_id)
        if view is None:
            return
        camera = event.client.camera
        direction = np.array(event.ray_direction)
        ray = Ray(
            origin=np.array(event.ray_origin),
            direction=direction / np.linalg.norm(direction),
            pixel_angle=pixel_angle(camera.fov, camera.image_height),
        )
        view.pick(ray)

    def _set_initial_camera(self) -> None:
        around = self._around
        corners = [box.corners_world for box in around.boxes.drawn().values()]
        viewpoint = overview(around.extent, np.concatenate(corners) if corners else np.zeros((0, 3)))
        camera = self.server.initial_camera
        camera.position, camera.look_at = viewpoint.position, viewpoint.look_at
        camera.fov = FIELD_OF_VIEW
        camera.near = min(0.01, 0.002 * around.extent.radius)
        camera.far = max(1000.0, 200 * around.extent.radius)

    async def _end(self) -> None:
        tasks = [task for view in self._clients.values() for task in view.close()]
        if self._refreshing is not None:
            self._refreshing.cancel()
            tasks.append(self._refreshing)
        await asyncio.gather(*tasks, return_exceptions=True)
