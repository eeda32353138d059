"""One browser's view of a session's scene: what its page wants to see, and how that comes about."""

import asyncio
import logging
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
import viser
from jaxtyping import Float, UInt8

from ars_web.errors import ArsError
from ars_web.scene.box_editor import BoxEditor, Commit
from ars_web.scene.boxes import BoxNodes, OwnBoxes
from ars_web.scene.cameras import CAMERAS, CurrentCamera, frustum_photo
from ars_web.scene.coverage_sphere import CoverageSphere, Read
from ars_web.scene.extent import FIELD_OF_VIEW, Extent, Viewpoint, behind_camera, close_up, free_lens, overview
from ars_web.scene.frame_view import FrameView
from ars_web.scene.ground import AXES, GROUND
from ars_web.scene.hardening import Visitor, is_gone
from ars_web.scene.photos import Photos
from ars_web.scene.picking import Ray, box_hit, camera_hit
from ars_web.scene.placing import Sight, frame_sight, free_sight
from ars_web.scene.shared_nodes import SharedNodes
from ars_web.scene.tour_path import TourPath
from ars_web.sessions.model import SessionSnapshot
from ars_web.workspace import DirectionPicked, Look, Picked, Refused, ViewAction, ViewEvent, ViewState

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
        tell: says what happens in a visitor's view to the page of it, and of drags to the others' as well; for any
            thread.
        coverage: counts what a sphere shows; it blocks.
    """

    recording: SessionSnapshot
    extent: Extent
    boxes: BoxNodes
    photos: Photos
    workers: Executor
    tell: Callable[[Visitor, ViewEvent], None]
    coverage: Read

    @property
    def centres(self) -> Float[np.ndarray, "n 3"]:
        """Of all cameras, in the world."""
        return self.recording.frames.Ts_world_camera[:, :3, 3]

    def overview(self) -> Viewpoint:
        """Of the whole recording with its boxes as they are now."""
        corners = [box.corners_world for box in self.boxes.drawn().values()]
        return overview(self.extent, self.centres, np.concatenate(corners) if corners else np.zeros((0, 3)))


class ClientView:
    """What one connected browser is shown. Every method belongs to the server's event loop."""

    def __init__(
        self, client: viser.ClientHandle, visitor: Visitor, surroundings: Surroundings, *, commit: Commit
    ) -> None:
        self.client = client
        self.visitor = visitor
        self._around = surroundings
        self._state = ViewState()
        self._dark: bool | None = None
        self._entered: int | None = None
        self._began_in_frame: bool | None = None
        self._thumbnail: asyncio.Task[None] | None = None
        self._closed = False
        recording = surroundings.recording
        self._camera = CurrentCamera(client, recording.frames, recording.cameras, surroundings.extent)
        self._shared = SharedNodes(client, (CAMERAS, GROUND, AXES))
        self._boxes = OwnBoxes(client, surroundings.boxes)
        self._sphere = CoverageSphere(
            client, surroundings.boxes, read=surroundings.coverage, workers=surroundings.workers
        )
        first = recording.cameras[int(recording.frames.camera_ids[0])]
        self._tour = TourPath(client, first, surroundings.extent)
        self._editor = BoxEditor(
            client,
            surroundings.boxes,
            by=visitor.view,
            commit=commit,
            workers=surroundings.workers,
            tell=self.tell,
        )
        self._frame = FrameView(
            client,
            photos=surroundings.photos,
            nodes=surroundings.boxes,
            poses=recording.frames.Ts_world_camera,
            lens=free_lens(surroundings.extent),
            send=self.tell,
        )

    def show(self, state: ViewState) -> None:
        """Show this, whatever was shown before; photos follow."""
        if self._closed or is_gone(self.client):
            return
        self._state = state
        self._show_theme(dark=state.dark)
        self._boxes.show(hidden=state.hidden, selected=state.selected)
        self._editor.show(state)
        in_frame = state.mode == "frame"
        if self._began_in_frame is None:
            self._began_in_frame = in_frame
        try:
            if not in_frame:
                self._entered = None
                self._frame.leave()
                if self._began_in_frame:
                    # The browser had not yet put its free camera anywhere when it stepped into the frame.
                    self._began_in_frame = False
                    self._look(Look("all"))
            elif self._entered != state.frame:
                self._entered = state.frame
                self._frame.enter(state.frame)
        except ArsError as error:
            self.tell(Refused(str(error)))
        self._sphere.show(None if in_frame else state.coverage, dark=state.dark)
        with self.client.atomic():
            self._tour.show(() if in_frame else state.tour, dark=state.dark)
            self._shared.show(not in_frame)
            if in_frame:
                self._camera.hide()
        self.client.flush()
        if not in_frame and self._thumbnail is None:
            self._thumbnail = asyncio.create_task(self._follow_frame())

    def act(self, action: ViewAction) -> None:
        """Do this once."""
        if self._closed or is_gone(self.client):
            return
        if isinstance(action, Look):
            self._look(action)

    def edited(self) -> None:
        """The session may be another than before."""
        self._sphere.edited()

    def sight(self) -> Sight:
        """What this view looks along."""
        state, recording = self._state, self._around.recording
        if state.mode == "frame" and 0 <= state.frame < len(recording.frames):
            camera = recording.cameras[int(recording.frames.camera_ids[state.frame])]
            T_world_camera = recording.frames.Ts_world_camera[state.frame]
            boxes = self._around.boxes.drawn().values()
            return frame_sight(camera, T_world_camera, boxes=boxes, extent=self._around.extent)
        free = self.client.camera
        return free_sight(np.array(free.position), np.array(free.look_at))

    def pick(self, ray: Ray) -> None:
        """Tell the page what a click's ray meets first of what this view shows."""
        state = self._state
        boxes = {box_id: box for box_id, box in self._around.boxes.drawn().items() if box_id not in state.hidden}
        box = box_hit(ray, boxes)
        camera = None if state.mode == "frame" else camera_hit(ray, self._around.centres)
        sphere = None if state.mode == "frame" else self._sphere.meets(ray)
        if sphere is not None and all(hit is None or sphere.distance < hit.distance for hit in (box, camera)):
            self.tell(DirectionPicked(sphere.bin, sphere.cell))
        elif camera is not None and (box is None or camera.distance < box.distance):
            self.tell(Picked(frame=camera.key))
        else:
            self.tell(Picked(box_id=None if box is None else box.key))

    def cancel(self) -> None:
        """The page's live line is gone: a drag in progress is as if it had not been."""
        self._editor.cancel()

    def tell(self, event: ViewEvent) -> None:
        """Tell the page, and of drags the other pages; for any thread."""
        self._around.tell(self.visitor, event)

    def close(self) -> list[asyncio.Task[None]]:
        """The browser is gone; what was being done for it is cancelled, and ends soon."""
        self._closed = True
        self._editor.close()
        self._frame.close()
        self._boxes.close()
        tasks = self._sphere.close()
        if self._thumbnail is not None:
            self._thumbnail.cancel()
            tasks.append(self._thumbnail)
        return tasks

    def _look(self, look: Look) -> None:
        viewpoint = self._viewpoint(look)
        if viewpoint is None or self._state.mode == "frame":
            return
        with self.client.atomic():
            self.client.camera.position = viewpoint.position
            self.client.camera.look_at = viewpoint.look_at
            self.client.camera.fov = FIELD_OF_VIEW
        self.client.flush()

    def _viewpoint(self, look: Look) -> Viewpoint | None:
        around, state = self._around, self._state
        if look.at == "all":
            return around.overview()
        if look.at == "selected":
            box = None if state.selected is None else around.boxes.box(state.selected)
            return None if box is None else close_up(around.extent, box.corners_world)
        poses = around.recording.frames.Ts_world_camera
        return behind_camera(around.extent, poses[state.frame]) if 0 <= state.frame < len(poses) else None

    def _show_theme(self, *, dark: bool) -> None:
        if dark != self._dark:
            self._dark = dark
            self.client.gui.configure_theme(dark_mode=dark, show_logo=False, show_share_button=False)

    async def _follow_frame(self) -> None:
        """Show the current frame's camera; of the frames that become current meanwhile only the last one."""
        shown: int | None = None
        try:
            while self._state.mode == "scene" and shown != self._state.frame:
                shown = self._state.frame
                if 0 <= shown < len(self._around.recording.frames):
                    await self._show_frame(shown)
        finally:
            self._thumbnail = None

    async def _show_frame(self, frame: int) -> None:
        recording = self._around.recording
        image, camera = recording.frames.images[frame], recording.cameras[int(recording.frames.camera_ids[frame])]
        photo: UInt8[np.ndarray, "h w 3"] | None = None
        try:
            loop = asyncio.get_running_loop()
            photo = await loop.run_in_executor(self._around.workers, frustum_photo, image, camera)
        except ArsError as error:
            self.tell(Refused(str(error)))
        if self._closed or is_gone(self.client) or self._state.mode != "scene":
            return
        with self.client.atomic():
            self._camera.show(frame, photo)
        self.client.flush()
