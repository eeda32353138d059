"""COLMAP's text files: cameras.txt, images.txt, rigs.txt, frames.txt."""

from collections.abc import Iterator
from pathlib import Path

from ars_web.errors import BadFile
from ars_web.recordings.colmap_model import (
    CAMERA_SENSOR,
    MODEL_PARAMS,
    ColmapCamera,
    ColmapFrame,
    ColmapImage,
    ColmapRig,
    Sensor,
)
from ars_web.recordings.number_rows import file_bytes

_SENSORS = {b"CAMERA": CAMERA_SENSOR, b"IMU": 1}
_IDENTITY = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

_LONGEST_IMAGE_LINE = 4096
"""A longer line holds 2D points without a look: images have ten words."""


class _Words:
    """The words of one line, taken one after the other; every error says file and line."""

    def __init__(self, path: Path, line: int, words: list[bytes], kind: str) -> None:
        self.path, self.line, self.kind = path, line, kind
        self._words = words
        self._next = 0

    def word(self) -> bytes:
        if self._next >= len(self._words):
            raise self.error(f"the {self.kind} ends after {len(self._words)} words")
        self._next += 1
        return self._words[self._next - 1]

    def whole(self) -> int:
        word = self.word()
        # int() would read 1_000 and other scripts' digits too
        if len(word) > 20 or not (word.isdigit() or (word[:1] == b"-" and word[1:].isdigit())):
            raise self.error(f"{word.decode('utf-8', 'replace')!r} is not a whole number")
        return int(word)

    def numbers(self, count: int) -> tuple[float, ...]:
        words = [self.word() for _ in range(count)]
        try:
            return tuple(map(float, words))
        except ValueError as error:
            raise self.error(
                f"among {b' '.join(words).decode('utf-8', 'replace')!r} is something that is no number"
            ) from error

    def sensor(self) -> Sensor:
        kind = self.word()
        if kind not in _SENSORS:
            raise self.error(f"sensor type {kind.decode('utf-8', 'replace')!r} is unknown")
        return _SENSORS[kind], self.whole()

    def end(self) -> None:
        if self._next != len(self._words):
            raise self.error(f"the {self.kind} has {len(self._words)} words, {self._next} are expected")

    def error(self, message: str) -> BadFile:
        return BadFile(self.path, message, line=self.line)

    @property
    def where(self) -> str:
        return f"{self.path}:{self.line}"


def _lines(path: Path, kind: str) -> Iterator[_Words]:
    for number, line in enumerate(file_bytes(path).splitlines(), 1):
        words = line.split()
        if words and not words[0].startswith(b"#"):
            yield _Words(path, number, words, kind)


def read_cameras(path: Path) -> tuple[ColmapCamera, ...]:
    """`CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]` a line.

    Raises:
        BadFile: with the line that is wrong.
    """
    cameras: list[ColmapCamera] = []
    for words in _lines(path, "camera"):
        camera_id = words.whole()
        model = words.word().decode("utf-8", "replace")
        if model not in MODEL_PARAMS:
            raise words.error(f"camera model {model!r} is unknown; known are {', '.join(MODEL_PARAMS)}")
        width, height = words.whole(), words.whole()
        params = words.numbers(len(MODEL_PARAMS[model]))
        words.end()
        cameras.append(ColmapCamera(camera_id, model, width, height, params, words.where))
    return tuple(cameras)


def read_images(path: Path) -> tuple[ColmapImage, ...]:
    """`IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME`, each followed by one line of 2D points, which are left unread.

    Raises:
        BadFile: with the line that is wrong.
    """
    if not path.is_file():
        raise BadFile(path, "is missing")
    images: list[ColmapImage] = []
    points_next = False
    try:
        with path.open("rb") as file:
            for number, line in enumerate(file, 1):
                if points_next:
                    points_next = False
                    if len(line) <= _LONGEST_IMAGE_LINE and len(line.split()) % 3:
                        raise BadFile(
                            path,
                            "is no line of 2D points (X Y POINT3D_ID, three numbers each); one follows every image,"
                            " if only an empty one",
                            line=number,
                        )
                    continue
                words = (line.removeprefix(b"\xef\xbb\xbf") if number == 1 else line).split(None, 9)
                if not words or words[0].startswith(b"#"):
                    continue
                images.append(_image(_Words(path, number, words, "image")))
                points_next = True
    except OSError as error:
        raise BadFile(path, f"cannot be read: {error.strerror}") from error
    return tuple(images)


def _image(words: _Words) -> ColmapImage:
    image_id = words.whole()
    pose = words.numbers(7)
    camera_id = words.whole()
    # The name is the rest of the line: it may hold spaces.
    name = words.word().rstrip()
    words.end()
    try:
        return ColmapImage(image_id, name.decode(), camera_id, pose, words.where)
    except UnicodeDecodeError as error:
        raise words.error(f"the image's name {name!r} is not UTF-8") from error


def read_rigs(path: Path) -> tuple[ColmapRig, ...]:
    """`RIG_ID NUM_SENSORS REF_TYPE REF_ID (TYPE ID HAS_POSE [QW QX QY QZ TX TY TZ])*` a line.

    Raises:
        BadFile: with the line that is wrong.
    """
    rigs: list[ColmapRig] = []
    for words in _lines(path, "rig"):
        rig_id, count = words.whole(), words.whole()
        sensors: dict[Sensor, tuple[float, ...] | None] = {}
        for place in range(count):
            sensor = words.sensor()
            if place == 0:
                sensors[sensor] = _IDENTITY
            else:
                sensors[sensor] = words.numbers(7) if words.whole() else None
        words.end()
        rigs.append(ColmapRig(rig_id, sensors, words.where))
    return tuple(rigs)


def read_frames(path: Path) -> tuple[ColmapFrame, ...]:
    """`FRAME_ID RIG_ID QW QX QY QZ TX TY TZ NUM_DATA_IDS (TYPE SENSOR_ID DATA_ID)*` a line.

    Raises:
        BadFile: with the line that is wrong.
    """
    frames: list[ColmapFrame] = []
    for words in _lines(path, "frame"):
        frame_id, rig_id = words.whole(), words.whole()
        pose = words.numbers(7)
        images = tuple((words.sensor(), words.whole()) for _ in range(words.whole()))
        words.end()
        frames.append(ColmapFrame(frame_id, rig_id, pose, images, words.where))
    return tuple(frames)
