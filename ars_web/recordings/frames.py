"""From the frames that a file lists to the frames that can be used: poses, paths and image headers are checked here."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ars_web.errors import ArsError, BadFile, RefusedPath
from ars_web.geometry.camera import Camera
from ars_web.recordings.image_header import read_header
from ars_web.recordings.options import ReadOptions, real
from ars_web.recordings.pose_checks import CheckedPoses
from ars_web.recordings.recording import Frame, SkippedFrame


@dataclass(frozen=True)
class ListedFrame:
    """A frame as its file lists it.

    Attributes:
        name: the image's name in the recording; None: its path relative to the images' common folder.
        image: the image, absolute or relative to the working directory.
        camera_id: key into the recording's cameras.
        where: `FILE:LINE` or `FILE`.
        problem: why it cannot be used, where that is known already.
    """

    name: str | None
    image: Path
    camera_id: int
    where: str
    problem: str | None = None


def usable_frames(
    source: Path,
    listed: Sequence[ListedFrame],
    poses: CheckedPoses,
    cameras: dict[int, Camera],
    options: ReadOptions,
) -> tuple[tuple[Frame, ...], tuple[SkippedFrame, ...]]:
    """Divide listed frames into those that can be used and those that cannot, both in the listed order.

    Args:
        source: the file that lists them, for messages.
        poses: `Ts_world_camera`, row i that of `listed[i]`.

    Raises:
        RefusedPath: an image lies outside `options.within`.
        BadFile: no frame is listed or none can be used; a name occurs twice.
    """
    if not listed:
        raise BadFile(source, "lists no frame")
    images = _absolute([frame.image for frame in listed], options.within)
    names = _names(listed, images)
    _refuse_repeated(source, listed, names)
    Ts = np.array(poses.Ts, dtype=np.float64)
    Ts.flags.writeable = False
    frames: list[Frame] = []
    skipped: list[SkippedFrame] = []
    for row, (frame, image, name) in enumerate(zip(listed, images, names, strict=True)):
        reason = (
            frame.problem
            or poses.problems.get(row)
            or _name_problem(name)
            or _image_problem(image, cameras[frame.camera_id])
        )
        if reason is None:
            frames.append(Frame(name, image, frame.camera_id, Ts[row]))
        else:
            skipped.append(SkippedFrame(name, reason, frame.where))
        if options.progress is not None:
            options.progress(row + 1, len(listed))
    if not frames:
        first = skipped[0]
        raise BadFile(
            source,
            f"none of its {len(skipped)} frames can be used; the first: {first.name}: {first.reason}, in {first.where}",
        )
    return tuple(frames), tuple(skipped)


def _absolute(images: list[Path], within: Path | None) -> list[Path]:
    """The paths made absolute, links to folders followed; a link in the last place is kept, but must not lead out."""
    root = None if within is None else real(within)
    folders: dict[Path, Path] = {}
    absolute: list[Path] = []
    for image in images:
        parent = image.parent
        folder = folders.get(parent)
        if folder is None:
            folder = folders[parent] = parent if "\0" in str(parent) else real(parent)
        path = folder / image.name
        if root is not None:
            outside = not folder.is_relative_to(root)
            # Folders are resolved already, so only the last place can be a link.
            if outside or (path.is_symlink() and not real(path).is_relative_to(root)):
                raise RefusedPath(f"the image {image} leads outside {within}, and nothing outside it is read")
        absolute.append(path)
    return absolute


def _names(listed: Sequence[ListedFrame], images: list[Path]) -> list[str]:
    unnamed = {image.parent for frame, image in zip(listed, images, strict=True) if frame.name is None}
    common = Path(os.path.commonpath(unnamed)) if unnamed else Path()
    if len(unnamed) == 1:
        return [image.name if frame.name is None else frame.name for frame, image in zip(listed, images, strict=True)]
    return [
        image.relative_to(common).as_posix() if frame.name is None else frame.name
        for frame, image in zip(listed, images, strict=True)
    ]


def _refuse_repeated(source: Path, listed: Sequence[ListedFrame], names: list[str]) -> None:
    seen: dict[str, str] = {}
    for frame, name in zip(listed, names, strict=True):
        if name in seen:
            raise BadFile(source, f"lists {name} twice, in {seen[name]} and in {frame.where}; a frame has one pose")
        seen[name] = frame.where


def _name_problem(name: str) -> str | None:
    # Names end up in label files and archives, where a line break or an undecodable byte would be damage.
    return None if name.isprintable() else "its name has characters that cannot be printed"


def _image_problem(image: Path, camera: Camera) -> str | None:
    try:
        header = read_header(image)
    except ArsError as error:
        return str(error)
    if not header.whole:
        return f"{image}: the image ends before its data does (truncated)"
    if (header.width, header.height) != (camera.width, camera.height):
        return (
            f"{image}: the image has {header.width} x {header.height} pixels,"
            f" its camera {camera.width} x {camera.height}"
        )
    if header.orientation != 1:
        return (
            f"{image}: the image asks to be turned when shown (Exif orientation {header.orientation}), so programs"
            " disagree about where a pixel is; remove that tag if the calibration is for the pixels as stored"
        )
    return None
