"""Photos of frames as the scene shows them: full size, rectified, encoded; made by workers, the last ones kept.

photos = Photos(cameras, frames)               one a session, for all its views
photos.get(frame) -> Future[Photo]             at once where it is kept
photos.prefetch(frames)                        so that the next step finds its photo made
photos.close()
"""

import threading
from collections import OrderedDict
from collections.abc import Iterable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import cv2

from ars_web.datasets.image_stamps import source_stamp
from ars_web.datasets.images import rectify
from ars_web.errors import ArsError, BadFile, NotFound
from ars_web.geometry.camera import Camera, rectified
from ars_web.recordings.image_header import read_header
from ars_web.recordings.images import read_image
from ars_web.recordings.stored_images import local
from ars_web.sessions.model import FrameTable

JPEG_QUALITY = 92

KEPT_BYTES = 64 << 20
"""Of encoded photos: some forty of a full HD recording."""


@dataclass(frozen=True)
class Photo:
    """A frame's photo.

    Attributes:
        frame: its index.
        flat: the pinhole camera that would have taken it.
        content: encoded.
        format: of the content.
    """

    frame: int
    flat: Camera
    content: bytes
    format: Literal["jpeg", "png"]


class Photos:
    """The photos of one session. Thread-safe."""

    def __init__(self, cameras: Mapping[int, Camera], frames: FrameTable, *, workers: int = 2) -> None:
        self._cameras = cameras
        self._frames = frames
        self._lock = threading.Lock()
        self._kept: OrderedDict[int, tuple[tuple[int, int], Photo]] = OrderedDict()
        self._making: dict[int, Future[Photo]] = {}
        self._bytes = 0
        self._closed = False
        self._pool = ThreadPoolExecutor(workers, thread_name_prefix="ars-photos")

    def __len__(self) -> int:
        return len(self._frames)

    def get(self, frame: int) -> "Future[Photo]":
        """A frame's photo, which is in the making; its ArsError where it cannot be made. Cancelled after `close`.

        Raises:
            NotFound: the session has no such frame.
        """
        if not 0 <= frame < len(self._frames):
            raise NotFound(f"there is no frame {frame}; frames are numbered 0 to {len(self._frames) - 1}")
        with self._lock:
            making = self._making.get(frame)
            if making is not None:
                return making
            kept = self._kept_photo(frame)
            if kept is not None:
                made = Future[Photo]()
                made.set_result(kept)
                return made
            if self._closed:
                made = Future[Photo]()
                made.cancel()
                return made
            making = self._making[frame] = self._pool.submit(self._photo, frame)
        making.add_done_callback(lambda _: self._forget(frame))
        return making

    def prefetch(self, frames: Iterable[int]) -> None:
        """Make photos that will be wanted soon; frames that are not there are left out."""
        for frame in frames:
            if 0 <= frame < len(self._frames):
                self.get(frame)

    def close(self) -> None:
        """Make no more photos; what is being made is finished first."""
        with self._lock:
            self._closed = True
        self._pool.shutdown(cancel_futures=True)

    def _forget(self, frame: int) -> None:
        with self._lock:
            self._making.pop(frame, None)

    def _kept_photo(self, frame: int) -> Photo | None:
        """The photo that is kept, where its image is as it was."""
        kept = self._kept.get(frame)
        if kept is None:
            return None
        stamp, photo = kept
        try:
            if source_stamp(str(local(self._frames.images[frame]))) != stamp:
                return None
        except BadFile:
            return None  # making it anew says what is wrong with it
        self._kept.move_to_end(frame)
        return photo

    def _photo(self, frame: int) -> Photo:
        path = local(self._frames.images[frame])
        stamp = source_stamp(str(path))
        photo = make_photo(frame, path, self._cameras[int(self._frames.camera_ids[frame])])
        self._keep(stamp, photo)
        return photo

    def _keep(self, stamp: tuple[int, int], photo: Photo) -> None:
        with self._lock:
            before = self._kept.pop(photo.frame, None)
            self._bytes += len(photo.content) - (0 if before is None else len(before[1].content))
            self._kept[photo.frame] = stamp, photo
            while self._bytes > KEPT_BYTES and len(self._kept) > 1:
                _, (_, dropped) = self._kept.popitem(last=False)
                self._bytes -= len(dropped.content)


def make_photo(frame: int, path: Path, camera: Camera) -> Photo:
    """The photo of an image: its own bytes where it is a JPEG without distortion, else made anew.

    Raises:
        BadFile, TooLarge: the image cannot be used (see `recordings.images`), or is not of its camera's size.
        BadInput: the camera cannot be rectified.
    """
    header = read_header(path)
    if (header.width, header.height) != (camera.width, camera.height):
        raise BadFile(
            path,
            f"the image has {header.width} x {header.height} pixels, its camera {camera.width} x {camera.height}",
        )
    flat = rectified(camera)
    if camera.model == "pinhole" and header.orientation == 1 and header.whole:
        content = path.read_bytes()
        if content.startswith(b"\xff\xd8"):
            return Photo(frame, flat, content, "jpeg")
    image = read_image(path)
    if camera.model != "pinhole":
        image = rectify(image, camera)
    done, encoded = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    if not done:
        raise BadFile(path, "OpenCV cannot encode the image as JPEG")
    return Photo(frame, flat, encoded.tobytes(), "jpeg")


def failure(photo: "Future[Photo]") -> ArsError | None:
    """What went wrong with a photo, where something did that a person can mend."""
    error = photo.exception()
    if error is None or isinstance(error, ArsError):
        return error
    raise error
