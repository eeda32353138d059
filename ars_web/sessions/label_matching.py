"""Which of a session's frames the images are that a file of labels is about."""

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
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


def matched_images(
    labels: ForeignLabels, frames: FrameTable, cameras: Mapping[int, Camera], *, session: str = ""
) -> Matching:
    """Find the frames by the images' names, or by their numbers.

    A name is that of a frame, or else ends as one does, folders included, where only one frame ends so; endings of
    files may differ (`labels/left/1.txt` is `images/left/1.png`, and so is `1.jpg` where there is no second 1). Or
    else it is what exports make of a frame's name (`a/1.png` becomes `a_1`, and `SESSION_a_1` where they hold several
    sessions; `session` is this one's id). Of several images that fit one frame the one whose name shares the most
    folders with the frame's is it.
    A number is the digits in a frame's name, where every number has one frame; else it counts the frames from 0, where
    the file has as many images as the session has frames. Numbers of a video count the frames in the first place.

    Raises:
        BadFile: no image is a frame, or one has another size than its frame's camera.
    """
    named = [place for place, image in enumerate(labels.images) if image.name is not None]
    numbered = [place for place, image in enumerate(labels.images) if image.name is None]
    names, notes = [(place, labels.images[place].name or "") for place in named], list[str]()
    fits = _by_name(names, frames.names, f"{session}_" if session else "")
    if numbered:
        by_number, how = _by_number(labels.images, numbered, frames.names)
        fits |= {place: _Fit(frame, 0) for place, frame in by_number.items()}
        notes.append(how)
    if labels.images and not fits:
        first = labels.images[0].called
        raise BadFile(
            labels.source,
            f"none of its {len(labels.images)} images is a frame of the session: its first is {first}, the session's"
            f" first {frames.names[0]}; are these the labels of another recording?",
        )
    found = {place: fit.frame for place, fit in fits.items()}
    best: dict[int, int] = {}
    for fit in fits.values():
        best[fit.frame] = max(best.get(fit.frame, 0), fit.shared)
    alone = Counter(fit.frame for fit in fits.values() if fit.shared == best[fit.frame])
    certain = {p: fit.frame for p, fit in fits.items() if fit.shared == best[fit.frame] and alone[fit.frame] == 1}
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


@dataclass(frozen=True)
class _Fit:
    """A frame whose name fits an image's.

    Attributes:
        shared: parts from the end that the two names have in common; more than any of those where the names are one.
    """

    frame: int
    shared: int


_WHOLE, _SEVERAL = 1 << 30, -1


def _by_name(named: Sequence[tuple[int, str]], names: Sequence[str], prefix: str) -> dict[int, _Fit]:
    whole = {name: index for index, name in enumerate(names)}
    ends = _unique_ends(names)
    plain = _unique([_plain(PurePosixPath(name)) for name in names])
    found: dict[int, _Fit] = {}
    for place, name in named:
        path = PurePosixPath(name.replace("\\", "/"))
        if name in whole:
            found[place] = _Fit(whole[name], _WHOLE)
            continue
        end = next((end for end in _ends(path) if end in ends), None)
        exported = plain.get(_plain(PurePosixPath(path.name)).removeprefix(prefix))
        if end is not None:
            found[place] = _Fit(ends[end], len(end))
        elif exported is not None:
            found[place] = _Fit(exported, 0)
    return found


def _ends(path: PurePosixPath) -> Iterator[tuple[str, ...]]:
    """How a name ends, the longest first: so many folders and the file, as it stands and without its ending."""
    parts = path.parts or ("",)
    for first in range(len(parts)):
        yield parts[first:]
        yield (*parts[first:-1], path.stem)


def _unique_ends(names: Sequence[str]) -> dict[tuple[str, ...], int]:
    """The name that ends so, for each end that only one has."""
    found: dict[tuple[str, ...], int] = {}
    for index, name in enumerate(names):
        for end in _ends(PurePosixPath(name)):
            if found.setdefault(end, index) != index:
                found[end] = _SEVERAL
    return {end: index for end, index in found.items() if index != _SEVERAL}


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
