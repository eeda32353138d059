"""COLMAP's binary files: cameras.bin, images.bin, rigs.bin, frames.bin; little-endian throughout."""

import mmap
import struct
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from ars_web.errors import BadFile
from ars_web.recordings.colmap_model import (
    MODEL_PARAMS,
    ColmapCamera,
    ColmapFrame,
    ColmapImage,
    ColmapRig,
    Sensor,
)

_IDENTITY = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
_BYTES_OF_A_POINT = 24  # x, y as doubles and a 64-bit id


class _Cursor:
    """A place in a mapped file; reading beyond its end is a BadFile."""

    def __init__(self, path: Path, data: mmap.mmap) -> None:
        self.path = path
        self._data = data
        self._place = 0

    def take(self, layout: struct.Struct) -> tuple[float, ...]:
        """Numbers of `layout`; whole ones come as int."""
        if self._place + layout.size > len(self._data):
            raise self.truncated()
        values = layout.unpack_from(self._data, self._place)
        self._place += layout.size
        return values

    def name(self) -> str:
        end = self._data.find(b"\0", self._place)
        if end < 0:
            raise self.truncated()
        name = self._data[self._place : end]
        self._place = end + 1
        try:
            return name.decode()
        except UnicodeDecodeError as error:
            raise BadFile(self.path, f"an image's name {name!r} is not UTF-8") from error

    def skip(self, count: int) -> None:
        self._place += count
        if self._place > len(self._data):
            raise self.truncated()

    def count(self, smallest: int) -> int:
        """A 64-bit count of records that take at least `smallest` bytes each."""
        count = int(self.take(_U64)[0])
        if count * smallest > len(self._data):
            raise BadFile(self.path, f"says that it holds {count} records, for which it is too short (damaged)")
        return count

    def end(self) -> None:
        if self._place != len(self._data):
            raise BadFile(self.path, f"has {len(self._data) - self._place} bytes after its last record (damaged)")

    def truncated(self) -> BadFile:
        return BadFile(self.path, f"ends at byte {len(self._data)}, in the middle of a record (truncated)")


_U32 = struct.Struct("<I")
_U64 = struct.Struct("<Q")
_SENSOR = struct.Struct("<iI")
_HAS_POSE = struct.Struct("<B")
_POSE = struct.Struct("<7d")
_CAMERA = struct.Struct("<IiQQ")
_IMAGE = struct.Struct("<I7dI")
_FRAME = struct.Struct("<II7dI")
_DATA_ID = struct.Struct("<iIQ")


@contextmanager
def _opened(path: Path) -> Generator[_Cursor]:
    if not path.is_file():
        raise BadFile(path, "is missing")
    try:
        file = path.open("rb")
    except OSError as error:
        raise BadFile(path, f"cannot be read: {error.strerror}") from error
    with file:
        if path.stat().st_size == 0:
            raise BadFile(path, "is empty")
        # Mapped, so that point data is stepped over without being read.
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            yield _Cursor(path, data)


def read_cameras(path: Path) -> tuple[ColmapCamera, ...]:
    """Raises BadFile where the file is truncated or a camera's model is unknown."""
    names = tuple(MODEL_PARAMS)
    cameras: list[ColmapCamera] = []
    with _opened(path) as cursor:
        for _ in range(cursor.count(_CAMERA.size)):
            camera_id, number, width, height = map(int, cursor.take(_CAMERA))
            if not 0 <= number < len(names):
                raise BadFile(path, f"camera {camera_id} is of model number {number}, which is unknown")
            model = names[number]
            params = cursor.take(struct.Struct(f"<{len(MODEL_PARAMS[model])}d"))
            cameras.append(ColmapCamera(camera_id, model, width, height, params, str(path)))
        cursor.end()
    return tuple(cameras)


def read_images(path: Path) -> tuple[ColmapImage, ...]:
    """Images without their 2D points. Raises BadFile where the file is truncated or a name is not UTF-8."""
    where = str(path)
    images: list[ColmapImage] = []
    with _opened(path) as cursor:
        for _ in range(cursor.count(_IMAGE.size + 1 + _U64.size)):
            image_id, *pose, camera_id = cursor.take(_IMAGE)
            name = cursor.name()
            cursor.skip(int(cursor.take(_U64)[0]) * _BYTES_OF_A_POINT)
            images.append(ColmapImage(int(image_id), name, int(camera_id), tuple(pose), where))
        cursor.end()
    return tuple(images)


def read_rigs(path: Path) -> tuple[ColmapRig, ...]:
    """Raises BadFile where the file is truncated."""
    rigs: list[ColmapRig] = []
    with _opened(path) as cursor:
        for _ in range(cursor.count(2 * _U32.size)):
            rig_id, count = int(cursor.take(_U32)[0]), int(cursor.take(_U32)[0])
            sensors: dict[Sensor, tuple[float, ...] | None] = {}
            for place in range(count):
                kind, sensor_id = map(int, cursor.take(_SENSOR))
                if place == 0:
                    sensors[kind, sensor_id] = _IDENTITY
                else:
                    sensors[kind, sensor_id] = cursor.take(_POSE) if cursor.take(_HAS_POSE)[0] else None
            rigs.append(ColmapRig(rig_id, sensors, str(path)))
        cursor.end()
    return tuple(rigs)


def read_frames(path: Path) -> tuple[ColmapFrame, ...]:
    """Raises BadFile where the file is truncated."""
    where = str(path)
    frames: list[ColmapFrame] = []
    with _opened(path) as cursor:
        for _ in range(cursor.count(_FRAME.size)):
            frame_id, rig_id, *pose, count = cursor.take(_FRAME)
            images: list[tuple[Sensor, int]] = []
            for _ in range(int(count)):
                kind, sensor_id, data_id = map(int, cursor.take(_DATA_ID))
                images.append(((kind, sensor_id), data_id))
            frames.append(ColmapFrame(int(frame_id), int(rig_id), tuple(pose), tuple(images), where))
        cursor.end()
    return tuple(frames)
