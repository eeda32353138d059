"""Which of a session's frames the images are that a file of labels is about."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import PurePosixPath

import numpy as np

from ars_web.annotations.foreign import ForeignImage, ForeignLabels, LeftOut
from ars_web.errors import BadFile
from ars_web.geometry.camera import Camera
from ars_web.geometry.polygon import Polygon
from ars_web.sessions.model import FrameTable

NO_FRAME = "it is in an image that is none of the session's frames"
TWO_IMAGES = "it is in an image whose name fits a frame that another image of the file fits as well"

SAME_CENTRE = 0.5
"""Pixels, by which two principal points may differ and be one."""

SAME_FOCAL = 1e-3
"""Of a focal length."""

_NOT_PLAIN = re.compile(r"[^A-Za-z0-9._-]")
_DIGITS = re.compile(r"\d+")


@dataclass(frozen=True, eq=False)
class Matching:
    """The frames that images are.

    Attributes:
        frames: frame index by place in the file's images.
        problems: why an image is no frame, by place.
        notes: how numbers were understood and in what cameras differ, in words.
    """

    frames: Mapping[int, int]
    problems: Mapping[int, str]
    notes: tuple[str, ...]

    def left_out(self, image: int, where: str) -> LeftOut:
        """A label in an image that is no frame."""
        return LeftOut(self.problems[image], where)


def matched_images(labels: ForeignLabels, frames: FrameTable, cameras: Mapping[int, Camera]) -> Matching:
    """Find the frames by the images' names, or by their numbers.

    A name is that of a frame, or else its file name is, or else that without its ending, or else what exports make of a
    frame's name (`a/1.png` becomes `a_1`), where only one frame has it.
    A number is the digits in a frame's name, where every number has one frame; else it counts the frames from 0, where
    the file has as many images as the session has frames. Numbers of a video count the frames in the first place.

    Raises:
        BadFile: no image is a frame, or one has another size than its frame's camera.
    """
    named = [place for place, image in enumerate(labels.images) if image.name is not None]
    numbered = [place for place, image in enumerate(labels.images) if image.name is None]
    found, notes = _by_name([(place, labels.images[place].name or "") for place in named], frames.names), list[str]()
    if numbered:
        by_number, how = _by_number(labels.images, numbered, frames.names)
        found |= by_number
        notes.append(how)
    if labels.images and not found:
        first = labels.images[0].called
        raise BadFile(
            labels.source,
            f"none of its {len(labels.images)} images is a frame of the session: its first is {first}, the session's"
            f" first {frames.names[0]}; are these the labels of another recording?",
        )
    taken = Counter(found.values())
    exact = {place for place in named if place in found and frames.names[found[place]] == labels.images[place].name}
    once = Counter(found[place] for place in exact)
    certain = {p: frame for p, frame in found.items() if taken[frame] == 1 or (p in exact and once[frame] == 1)}
    problems = {
        place: TWO_IMAGES if place in found else NO_FRAME for place in range(len(labels.images)) if place not in certain
    }
    _refuse_other_sizes(labels, certain, frames, cameras)
    notes.extend(_other_cameras(labels, certain, frames, cameras))
    return Matching(certain, problems, tuple(notes))


def in_pixels(
    labels: ForeignLabels, matching: Matching, frames: FrameTable, cameras: Mapping[int, Camera]
) -> ForeignLabels:
    """The same labels with outlines and rectangles in image coordinates, by the cameras of the frames that images are.

    Those in images that are no frames stay as they are.
    """
    if not labels.in_shares:
        return labels
    sizes = {place: cameras[int(frames.camera_ids[index])] for place, index in matching.frames.items()}

    def scale(image: int) -> np.ndarray:
        camera = sizes.get(image)
        return np.ones(2) if camera is None else np.array([camera.width, camera.height], dtype=np.float64)

    outlines = [
        replace(
            one,
            polygons=tuple(
                Polygon(p.outer * scale(one.image), tuple(hole * scale(one.image) for hole in p.holes))
                for p in one.polygons
            ),
        )
        for one in labels.outlines
    ]
    rectangles = [replace(one, bbox=one.bbox * np.tile(scale(one.image), 2)) for one in labels.rectangles]
    return replace(labels, outlines=tuple(outlines), rectangles=tuple(rectangles), in_shares=False)


def _by_name(named: Sequence[tuple[int, str]], names: Sequence[str]) -> dict[int, int]:
    whole = {name: index for index, name in enumerate(names)}
    files = _unique([PurePosixPath(name).name for name in names])
    stems = _unique([PurePosixPath(name).stem for name in names])
    plain = _unique([_plain(PurePosixPath(name)) for name in names])
    found: dict[int, int] = {}
    for place, name in named:
        path = PurePosixPath(name.replace("\\", "/"))
        exported = plain.get(_plain(PurePosixPath(path.name)))
        for index in (whole.get(name), files.get(path.name), stems.get(path.stem), exported):
            if index is not None:
                found[place] = index
                break
    return found


def _plain(path: PurePosixPath) -> str:
    """A name without its ending as `datasets.file_names` spells it."""
    return _NOT_PLAIN.sub("_", str(path.with_suffix("") if path.name else path))


def _unique(keys: Sequence[str]) -> dict[str, int]:
    counts = Counter(keys)
    return {key: index for index, key in enumerate(keys) if counts[key] == 1}


def _by_number(
    images: Sequence[ForeignImage], numbered: Sequence[int], names: Sequence[str]
) -> tuple[dict[int, int], str]:
    numbers = {place: images[place].number or 0 for place in numbered}
    digits = _unique([_last_digits(name) for name in names])
    by_digits = {place: digits[str(number)] for place, number in numbers.items() if str(number) in digits}
    by_index = {place: number for place, number in numbers.items() if number < len(names)}
    counts_agree = len(numbered) == len(names) and len(by_index) == len(numbered)
    is_index = all(images[place].is_index for place in numbered)
    if is_index and len(by_index) == len(numbered) and len(by_digits) < len(numbered):
        return by_index, "The file numbers its images; a number was taken for a frame's index, from 0."
    if counts_agree and (is_index or len(by_digits) < len(numbered)):
        return by_index, "The file numbers its images; a number was taken for a frame's index, from 0."
    return by_digits, "The file numbers its images; a number was taken for the digits in a frame's name."


def _last_digits(name: str) -> str:
    """The number in a name: the last run of digits of its stem, without zeros before it; the name itself where there
    is none."""
    runs = _DIGITS.findall(PurePosixPath(name).stem)
    return str(int(runs[-1])) if runs and len(runs[-1]) < 19 else name


def _refuse_other_sizes(
    labels: ForeignLabels, found: Mapping[int, int], frames: FrameTable, cameras: Mapping[int, Camera]
) -> None:
    for place, index in found.items():
        image, camera = labels.images[place], cameras[int(frames.camera_ids[index])]
        if image.size not in (None, (camera.width, camera.height)):
            width, height = image.size or (0, 0)
            raise BadFile(
                labels.source,
                f"{image.called} has {width} x {height} pixels there, frame {index} ({frames.names[index]})"
                f" {camera.width} x {camera.height}; labels for images of another size would lie elsewhere",
            )


def _other_cameras(
    labels: ForeignLabels, found: Mapping[int, int], frames: FrameTable, cameras: Mapping[int, Camera]
) -> list[str]:
    other: list[tuple[str, str]] = []
    for place, index in found.items():
        image, camera = labels.images[place], cameras[int(frames.camera_ids[index])]
        if image.K is None:
            continue
        fx, fy, cx, cy = image.K
        focal = max(abs(fx / camera.fx - 1), abs(fy / camera.fy - 1))
        centre = max(abs(cx - camera.cx), abs(cy - camera.cy))
        if focal > SAME_FOCAL or centre > SAME_CENTRE:
            theirs, ours = (fx, fy, cx, cy), (camera.fx, camera.fy, camera.cx, camera.cy)
            shown = [", ".join(f"{value:.1f}" for value in values) for values in (theirs, ours)]
            other.append((image.called, f"fx, fy, cx, cy {shown[0]} there, {shown[1]} here"))
    if not other:
        return []
    return [
        f"The cameras of {len(other)} images differ from the session's ({other[0][0]}: {other[0][1]}): poses were"
        " taken as they are; look whether the boxes fit the pictures."
    ]
