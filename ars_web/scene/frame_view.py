"""Frame mode of one view: the camera stands where a frame's stood, and the frame's photo hangs behind all boxes.

    view = FrameView(client, photos=…, nodes=…, poses=Ts_world_camera, lens=…, send=…)   one a client
    view.enter(frame)      returns at once; a newer call overtakes one that waits. `send(Entered | Refused)` follows
    view.leave()           the free camera is where it was
    view.frame             the frame that is shown; None: the camera is free
    view.close()           the client is gone

The bridge in the page locks the camera meanwhile, and zooms.
"""

import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass

import numpy as np
import viser
from jaxtyping import Float

from ars_web.errors import NotFound
from ars_web.geometry.rigid_transform import Transform
from ars_web.scene.boxes import BoxNodes
from ars_web.scene.extent import Lens
from ars_web.scene.hardening import is_gone
from ars_web.scene.photo_plane import fitting_fov, photo_plane, plane_depth
from ars_web.scene.photos import Photo, Photos, failure
from ars_web.scene.poses import place
from ars_web.workspace import Entered, Refused

PHOTO = "/photo"
"""The node of the photo; the bridge fades it."""

NEAREST = 1e-3
"""Metres: what is nearer to a frame's camera is not drawn."""


@dataclass(frozen=True)
class _FreeCamera:
    """Where the free camera was, before a frame was entered.

    Not how wide it saw: a browser that comes back after an interruption is in its frame still, zoomed perhaps.
    """

    position: tuple[float, ...]
    look_at: tuple[float, ...]
    up_direction: tuple[float, ...]


@dataclass(frozen=True)
class _Wanted:
    """A frame that is to be entered.

    Attributes:
        begun: when it was asked for, `time.perf_counter`.
        turn: since the last `leave`; it counts only in its own.
    """

    frame: int
    begun: float
    turn: int


class FrameView:
    """Enters and leaves frames for one view. Thread-safe."""

    def __init__(
        self,
        client: viser.ClientHandle,
        *,
        photos: Photos,
        nodes: BoxNodes,
        poses: Float[np.ndarray, "n 4 4"],
        lens: Lens,
        send: Callable[[Entered | Refused], None],
    ) -> None:
        self._client = client
        self._photos = photos
        self._nodes = nodes
        self._poses = poses
        self._lens = lens
        self._send = send
        self._lock = nodes.lock
        self._wanted: _Wanted | None = None
        self._busy = False
        self._turn = 0
        self._closed = False
        self._free: _FreeCamera | None = None
        self._shown: Photo | None = None
        self._fov = 0.0
        self._depth = 0.0
        self._plane: viser.ImageHandle | None = None
        # The first photo of a distorted camera takes a second, for the maps that all others use as well.
        photos.prefetch((0,))
        self._stop = nodes.watch(self._keep_behind)
        client.camera.on_update(self._fit)

    @property
    def frame(self) -> int | None:
        """The frame that is shown; None: the camera is free."""
        shown = self._shown
        return None if shown is None else shown.frame

    def enter(self, frame: int) -> None:
        """Show a frame as soon as its photo is made.

        Raises:
            NotFound: there is no such frame.
        """
        begun = time.perf_counter()
        if not 0 <= frame < len(self._photos):
            raise NotFound(f"there is no frame {frame}; frames are numbered 0 to {len(self._photos) - 1}")
        with self._lock:
            self._wanted = _Wanted(frame, begun, self._turn)
        self._next()

    def leave(self) -> None:
        """Put the free camera back to where it was before the first frame was entered."""
        with self._lock:
            self._turn += 1
            self._wanted = None
            free, self._free, self._shown, self._fov = self._free, None, None, 0.0
            if free is None or self._closed or is_gone(self._client):
                return
            with self._client.atomic():
                if self._plane is not None:
                    self._plane.visible = False
                camera = self._client.camera
                camera.near, camera.far, camera.fov = self._lens.near, self._lens.far, self._lens.fov
                _look(camera, np.array(free.position), np.array(free.look_at), np.array(free.up_direction))
            self._client.flush()

    def close(self) -> None:
        """Show nothing more; the client is gone."""
        self._stop()
        with self._lock:
            self._turn += 1
            self._wanted = None
            self._closed = True

    def _next(self) -> None:
        """Have the wanted photo made, one at a time: whoever holds a key down would else wait for all in between."""
        with self._lock:
            wanted = self._wanted
            if self._busy or wanted is None:
                return
            self._busy, self._wanted = True, None
        self._photos.get(wanted.frame).add_done_callback(lambda made: self._made(made, wanted))

    def _made(self, made: "Future[Photo]", wanted: "_Wanted") -> None:
        """Show a photo that is made, unless the frame has been left meanwhile, and go on with what is wanted since."""
        with self._lock:
            self._busy = False  # before all else: whatever went wrong with this photo, the next one can be had
        error = None if made.cancelled() else failure(made)
        with self._lock:
            current = wanted.turn == self._turn and not self._closed and not made.cancelled()
            current = current and not is_gone(self._client)
            if current and error is None:
                self._show(made.result())
            idle = self._wanted is None
        if current and error is not None:
            self._send(Refused(str(error)))
        elif current:
            self._send(Entered(wanted.frame, (time.perf_counter() - wanted.begun) * 1e3))
            if idle:
                self._photos.prefetch((wanted.frame + 1, wanted.frame - 1))
        self._next()

    def _show(self, photo: Photo) -> None:
        camera = self._client.camera
        if self._free is None:
            self._free = _FreeCamera(
                position=tuple(camera.position),
                look_at=tuple(camera.look_at),
                up_direction=tuple(camera.up_direction),
            )
        T_world_camera = self._poses[photo.frame]
        before, self._shown = self._shown, photo
        with self._client.atomic():
            if self._plane is None:
                self._plane = self._client.scene.add_image(
                    PHOTO,
                    np.zeros((1, 1, 3), dtype=np.uint8),
                    render_width=1.0,
                    render_height=1.0,
                    cast_shadow=False,
                    receive_shadow=False,
                )
            # The handle's own setter would take pixels and encode them once more.
            if before is None or before.content is not photo.content:
                self._plane._format, self._plane._data = photo.format, photo.content  # pyright: ignore[reportPrivateUsage]
            self._depth = 0.0
            self._hang(photo, T_world_camera)
            self._plane.visible = True
            # As far to the point looked at as before, or orbiting would begin elsewhere after leaving.
            distance = max(float(np.linalg.norm(np.subtract(self._free.look_at, self._free.position))), 1e-2)
            R, centre = T_world_camera[:3, :3], T_world_camera[:3, 3]
            _look(camera, centre, centre + R[:, 2] * distance, -R[:, 1])
            self._widen(photo)
        self._client.flush()

    def _hang(self, photo: Photo, T_world_camera: Transform) -> None:
        """Put the photo behind all boxes, where it is not."""
        needed = plane_depth(self._nodes.drawn().values(), T_world_camera)
        if self._plane is None or needed <= self._depth:
            return
        self._depth = needed
        plane = photo_plane(photo.flat, T_world_camera, depth=self._depth)
        self._plane.render_width, self._plane.render_height = plane.width, plane.height
        place(self._plane, plane.T_world_plane)
        self._client.camera.near = NEAREST
        self._client.camera.far = 2.0 * self._depth

    def _widen(self, photo: Photo) -> None:
        """Make the view as wide as the photo needs; say nothing where it is, since the bridge may have zoomed."""
        fov = fitting_fov(photo.flat, aspect=self._client.camera.aspect)
        if abs(fov - self._fov) > 1e-9:
            self._fov = fov
            self._client.camera.fov = fov

    async def _fit(self, camera: viser.CameraHandle) -> None:
        del camera
        with self._lock:
            if self._shown is not None and not self._closed and not is_gone(self._client):
                self._widen(self._shown)

    def _keep_behind(self, box_ids: frozenset[int]) -> None:
        del box_ids
        with self._lock:
            if self._shown is not None and not self._closed and not is_gone(self._client):
                self._hang(self._shown, self._poses[self._shown.frame])


def _look(
    camera: viser.CameraHandle,
    position: Float[np.ndarray, "3"],
    look_at: Float[np.ndarray, "3"],
    up_direction: Float[np.ndarray, "3"],
) -> None:
    """Place the camera to the last digit: viser sends nothing for what is within 1e-5 of what it was."""
    forward = look_at - position
    away = 1.0 + np.abs(position).max() + float(np.linalg.norm(forward))
    camera.position = position + away
    camera.position = position
    camera.look_at = look_at + 2.0 * forward
    camera.look_at = look_at
    camera.up_direction = up_direction + 0.5 * forward / float(np.linalg.norm(forward))
    camera.up_direction = up_direction
