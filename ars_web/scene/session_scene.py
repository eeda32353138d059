"""The scene of one session: a viser server with what all views share, and the views of those who are there.

Whatever is asked of it by other threads is done on the viser server's event loop, one thing at a time.
"""

import asyncio
import logging
import math
from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import replace
from functools import partial

import numpy as np
import viser

from ars_web.errors import ArsError, NotFound
from ars_web.geometry.rigid_transform import Transform
from ars_web.geometry.sphere_bins import SphereBins
from ars_web.scene import hardening
from ars_web.scene.boxes import BoxNodes
from ars_web.scene.cameras import add_cameras
from ars_web.scene.extent import free_lens, recording_extent
from ars_web.scene.ground import add_ground
from ars_web.scene.hardening import Visitor
from ars_web.scene.photos import Photos
from ars_web.scene.picking import Ray, pixel_angle
from ars_web.scene.placing import NOT_CONNECTED, Sight, placed, usual_size
from ars_web.scene.surfaces import SurfaceNodes
from ars_web.scene.views import ClientView, Page, Surroundings
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.model import VirtualBox
from ars_web.sessions.store import SessionStore
from ars_web.studies.kept_views import KeptViews
from ars_web.studies.sphere_counts import SphereCounts, sphere_counts
from ars_web.workspace import (
    BoxPreview,
    CoverageSight,
    Dragged,
    NewBox,
    Picked,
    Refused,
    ViewAction,
    ViewEvent,
    ViewState,
)

log = logging.getLogger(__name__)

CLOSING_SECONDS = 5.0


class SessionScene:
    """One session's scene, served on loopback from the moment it is made until `close`. Thread-safe."""

    def __init__(
        self, sid: str, *, store: SessionStore, editor: SessionEditor, workers: Executor, kept_views: KeptViews
    ) -> None:
        """
        Args:
            workers: for what may block.
            kept_views: of all sessions, shared with the API.

        Raises:
            NotFound: there is no such session.
        """
        recording = store.snapshot(sid)
        self._store = store
        self._edits = editor
        self._workers = workers
        self._kept_views = kept_views
        self._pages: dict[str, Page] = {}
        self._states: dict[str, ViewState] = {}
        self._clients: dict[int, ClientView] = {}
        self._refreshing: asyncio.Task[None] | None = None
        self._stale = False
        self._closing = False
        self._revision = recording.state.revision
        self.server = hardening.guarded_server()
        extent = recording_extent(recording.frames.Ts_world_camera)
        boxes = BoxNodes(self.server)
        self._hulls = SurfaceNodes(self.server, boxes, kind="hull")
        self._meshes = SurfaceNodes(self.server, boxes, kind="mesh")
        self._around = Surroundings(
            recording=recording,
            extent=extent,
            boxes=boxes,
            photos=Photos(recording.cameras, recording.frames),
            workers=workers,
            tell=self._tell,
            coverage=self._coverage,
        )
        self._loop = self.server.get_event_loop()
        try:
            self._furnish()
        except BaseException:
            self.server.stop()
            raise

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
        try:
            asyncio.run_coroutine_threadsafe(self._end(), self._loop).result(CLOSING_SECONDS)
        except RuntimeError:
            pass  # the loop has ended by itself
        except TimeoutError:
            log.warning("session %s: its scene is busy, and is stopped all the same", self._around.recording.id)
        self.server.stop()
        self._around.photos.close()

    def _furnish(self) -> None:
        around, server = self._around, self.server
        with server.atomic():
            # Lines, points and photos need no light. Without sun, shadows and reflections a frame takes half as long
            # to draw without a graphics card, and far less to compile.
            server.scene.configure_default_lights(enabled=False, cast_shadow=False)
            server.scene.configure_environment_map(None)
            server.scene.add_light_ambient("/light", intensity=math.pi)  # a face has its own colour, from all sides
            add_ground(server.scene, around.extent)
            add_cameras(server.scene, around.recording.frames, around.recording.cameras, around.extent)
        self._hulls.know(around.recording.hulls)
        self._meshes.know(around.recording.meshes)
        around.boxes.show(around.recording.state)
        self._set_initial_camera()
        server.gui.configure_theme(dark_mode=True, show_logo=False, show_share_button=False)
        server.on_client_connect(self._connected)
        server.on_client_disconnect(self._disconnected)
        server.scene.on_click()(self._clicked)  # pyright: ignore[reportArgumentType] viser takes both kinds

    def _set_initial_camera(self) -> None:
        viewpoint = self._around.overview()
        camera = self.server.initial_camera
        camera.position, camera.look_at = viewpoint.position, viewpoint.look_at
        lens = free_lens(self._around.extent)
        camera.fov, camera.near, camera.far = lens.fov, lens.near, lens.far

    def _page(self, visitor: Visitor) -> Page | None:
        """The page that a visitor's view belongs to: its author may have named somebody else's."""
        page = self._pages.get(visitor.view)
        return None if page is None or page.author != visitor.author else page

    def _tell(self, visitor: Visitor, event: ViewEvent) -> None:
        """Tell a view's page of what happens there, and of drags all pages; by any thread."""
        page = self._page(visitor)
        if page is not None:
            page.send(event)
        if isinstance(event, Dragged):
            for other in list(self._pages.values()):
                if other is not page:
                    other.send(replace(event, own=False))

    def _post(self, callback: Callable[..., None], *args: object) -> None:
        with suppress(RuntimeError):  # the scene was closed meanwhile
            self._loop.call_soon_threadsafe(callback, *args)

    def _commit(self, author: str, box_id: int, revision: int, T_world_box: Transform, size: np.ndarray) -> VirtualBox:
        return self._edits.change_box(
            self._around.recording.id,
            box_id,
            expected_revision=revision,
            T_world_box=T_world_box,
            size=size,
            author=author,
        )

    def _coverage(self, sight: CoverageSight) -> SphereCounts:
        """What a sphere shows of the session as it is now; on a worker."""
        return sphere_counts(
            self._store.snapshot(self._around.recording.id),
            self._kept_views,
            SphereBins(sight.azimuth_bins, sight.polar_bins),
            box_id=sight.box_id,
            whole_class=sight.whole_class,
            min_visible=sight.min_visible,
        )

    def _add_box(self, view: ClientView, sight: Sight, class_id: int) -> None:
        """Add a box where the view looks, and let its page select it; on a worker."""
        around, sid = self._around, self._around.recording.id
        try:
            state = self._store.state(sid)
            known = state.classes.get(class_id)
            if known is None:
                raise NotFound(f"there is no class {class_id}; choose another one for the new box")
            size = usual_size(known, state.boxes.values(), extent=around.extent)
            box = placed(sight, size=size, ground=around.extent.ground)
            added = self._edits.add_box(sid, class_id=class_id, box=box, author=view.visitor.author)
        except ArsError as error:
            view.tell(Refused(str(error)))
            return
        around.boxes.settle(added)
        view.tell(Picked(box_id=added.id))

    # What follows runs on the event loop.

    async def _connected(self, client: viser.ClientHandle) -> None:
        if self._closing:
            return
        hardening.hear_only_what_is_needed(client)
        visitor = hardening.visitor()
        view = ClientView(client, visitor, self._around, commit=partial(self._commit, visitor.author))
        self._clients[client.client_id] = view
        state = None if self._page(visitor) is None else self._states.get(visitor.view)
        if state is not None or not visitor.view:
            view.show(state or ViewState())

    async def _disconnected(self, client: viser.ClientHandle) -> None:
        view = self._clients.pop(client.client_id, None)
        if view is not None:
            view.close()

    def _views(self, name: str) -> list[ClientView]:
        return [
            view
            for view in self._clients.values()
            if view.visitor.view == name and self._page(view.visitor) is not None
        ]

    def _attach(self, page: Page) -> None:
        self._pages[page.view] = page

    def _detach(self, name: str) -> None:
        for view in self._views(name):
            view.cancel()
        self._around.boxes.preview(None, by=name)
        self._pages.pop(name, None)
        self._states.pop(name, None)

    def _show(self, name: str, state: ViewState) -> None:
        self._states[name] = state
        for view in self._views(name):
            view.show(state)

    def _act(self, name: str, action: ViewAction) -> None:
        views = self._views(name)
        if isinstance(action, NewBox):
            # Once, by the newest: a page that is loaded again may still be there twice.
            view = next((view for view in reversed(views) if not hardening.is_gone(view.client)), None)
            if view is None:
                page = self._pages.get(name)
                if page is not None:
                    page.send(NOT_CONNECTED)
            else:
                self._workers.submit(self._add_box, view, view.sight(), action.class_id)
            return
        for view in views:
            view.act(action)

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
                loop = asyncio.get_running_loop()
                now = await loop.run_in_executor(self._workers, self._store.snapshot, self._around.recording.id)
                self._hulls.know(now.hulls)
                self._meshes.know(now.meshes)
                self._around.boxes.show(now.state)
                self._revision = now.state.revision
                for view in tuple(self._clients.values()):
                    view.edited()
        except ArsError as error:  # deleted, or the disk is full: those who ask for the session are told
            log.info("session %s: %s", self._around.recording.id, error)
        finally:
            self._refreshing = None

    async def _clicked(self, event: viser.SceneClickEvent) -> None:
        view = self._clients.get(event.client_id)
        if view is None:
            return
        camera = event.client.camera
        origin, direction = np.array(event.ray_origin, dtype=float), np.array(event.ray_direction, dtype=float)
        length, angle = float(np.linalg.norm(direction)), pixel_angle(camera.fov, camera.image_height)
        if np.isfinite(origin).all() and np.isfinite([length, angle]).all() and length > 0:
            view.pick(Ray(origin=origin, direction=direction / length, pixel_angle=angle))

    async def _end(self) -> None:
        self._closing = True
        tasks = [task for view in self._clients.values() for task in view.close()]
        if self._refreshing is not None:
            self._refreshing.cancel()
            tasks.append(self._refreshing)
        await asyncio.gather(*tasks, return_exceptions=True)
