"""TUM trajectories: `timestamp tx ty tz qx qy qz qw` a line, the camera in the world.

    images   those of rgb.txt (`timestamp file` a line) where it lies beside the trajectory: each has the pose nearest
             in time, at most MAX_TIME_APART away; else image i of the image folder belongs to pose i
    folder   the one named, else images/ or rgb/ beside the trajectory, else images/ one level up
    camera   the file named, else camera_intrinsics.txt beside the trajectory or beside the image folder

Source: https://cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats
"""

from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from ars_web.errors import BadFile, BadInput
from ars_web.recordings.frames import ListedFrame, usable_frames
from ars_web.recordings.image_folder import list_images, uncounted
from ars_web.recordings.intrinsics import find_camera_file, read_camera_file
from ars_web.recordings.number_rows import NumberRows, count_numbers, file_bytes, read_rows
from ars_web.recordings.options import ReadOptions, real
from ars_web.recordings.pose_checks import CheckedPoses, poses_from_quaternions
from ars_web.recordings.recording import Recording

TITLE = "TUM trajectory"
NEEDS = "a trajectory (timestamp tx ty tz qx qy qz qw), its images and a camera file"

MAX_TIME_APART = 0.02
"""Seconds; the benchmark's own tools take as much."""

_COLUMNS = 8


def recognises(path: Path) -> bool:
    """Whether `path` is a file of eight numbers a line, or a folder with one."""
    return bool(_trajectories(path)) if path.is_dir() else count_numbers(path) == _COLUMNS


def read(path: Path, options: ReadOptions) -> Recording:
    """Read a trajectory, or the only one in a folder.

    Raises:
        BadFile: a line is damaged, images or camera are missing, or poses and images differ in number.
        BadInput: it cannot be known which trajectory, images or camera is meant.
        RefusedPath: something lies outside `options.within`.
    """
    file = options.allowed(_trajectory(path))
    rows = read_rows(file, columns={_COLUMNS: "timestamp tx ty tz qx qy qz qw"})
    poses = poses_from_quaternions(rows.values[:, 1:4], rows.values[:, [7, 4, 5, 6]])
    times_file = file.parent / "rgb.txt"
    if times_file.is_file():
        folder, listed, poses = _by_time(options.allowed(times_file), rows, poses, options)
    else:
        folder, listed = _by_order(rows, options)
    cameras = {0: read_camera_file(find_camera_file([file.parent, folder.parent], options))}
    frames, skipped = usable_frames(file, listed, poses, cameras, options)
    return Recording("tum", path.resolve(), cameras, frames, skipped)


def _trajectories(folder: Path) -> list[Path]:
    return [file for file in sorted(folder.glob("*.txt")) if count_numbers(file) == _COLUMNS]


def _trajectory(path: Path) -> Path:
    if not path.is_dir():
        return path
    found = _trajectories(path)
    if not found:
        raise BadFile(path, "holds no trajectory: no .txt file begins with a line of eight numbers")
    if len(found) > 1:
        raise BadInput(f"{path} holds the trajectories {', '.join(file.name for file in found)}; give one of them")
    return found[0]


def _by_order(rows: NumberRows, options: ReadOptions) -> tuple[Path, list[ListedFrame]]:
    folder = options.allowed(options.images or _image_folder(rows.path))
    images = list_images(folder)
    if len(images) != len(rows.values):
        raise BadFile(
            rows.path,
            f"has {len(rows.values)} poses for {len(images)} images in {folder}{uncounted(images)}; without an rgb.txt"
            " that gives the images' times, which pose is whose cannot be known",
        )
    return real(folder), [ListedFrame(None, image, 0, rows.where(i)) for i, image in enumerate(images)]


def _image_folder(file: Path) -> Path:
    here = real(file).parent
    beside = [folder for folder in (here / "images", here / "rgb") if folder.is_dir()]
    if len(beside) > 1:
        raise BadInput(f"the images of {file} could be in {beside[0]} or in {beside[1]}; say which")
    above = here.parent / "images"
    found = beside or ([above] if above.is_dir() else [])
    if not found:
        raise BadFile(
            file, f"there is no image folder at {here / 'images'}, {here / 'rgb'} or {above}; say where the images are"
        )
    return found[0]


def _by_time(
    times_file: Path, rows: NumberRows, poses: CheckedPoses, options: ReadOptions
) -> tuple[Path, list[ListedFrame], CheckedPoses]:
    """Every image that rgb.txt lists, with the pose nearest in time."""
    times: list[float] = []
    images: list[Path] = []
    lines: list[int] = []
    for line, words in enumerate((text.split(None, 1) for text in file_bytes(times_file).splitlines()), 1):
        if not words or words[0].startswith(b"#"):
            continue
        try:
            times.append(float(words[0]))
            name = words[1].decode().strip()
        except (ValueError, IndexError) as error:
            raise BadFile(times_file, "is not `timestamp file`", line=line) from error
        base = times_file.parent if options.images is None else options.images
        images.append(base / (name if options.images is None else Path(name).name))
        lines.append(line)
    if not images:
        raise BadFile(times_file, "lists no image")
    image_times = np.array(times)
    usable = np.array([row for row in range(len(rows.values)) if row not in poses.problems], dtype=np.int64)
    usable = usable[np.isfinite(rows.values[usable, 0])]
    if not usable.size:
        raise BadFile(rows.path, f"none of its {len(rows.values)} poses can be used; the first: {_first(rows, poses)}")
    nearest = usable[_nearest(image_times, rows.values[usable, 0])]
    # A time that is not finite is far from every pose, and must not take one from an image that is near.
    apart = np.nan_to_num(np.abs(rows.values[nearest, 0] - image_times), nan=np.inf)
    taken: Int[np.ndarray, " n"] = _closest_image(nearest, apart)
    listed: list[ListedFrame] = []
    for i, image in enumerate(images):
        problem = None
        if not apart[i] <= MAX_TIME_APART:
            problem = f"no pose within {MAX_TIME_APART:g} s of it; the nearest is {apart[i]:.3g} s away"
        elif taken[nearest[i]] != i:
            problem = f"its nearest pose, {apart[i]:.3g} s away, belongs to an image that is nearer to it in time"
        listed.append(ListedFrame(None, image, 0, f"{times_file}:{lines[i]}", problem))
    return real(images[0].parent), listed, CheckedPoses(poses.Ts[nearest], {})


def _first(rows: NumberRows, poses: CheckedPoses) -> str:
    row = min(poses.problems, default=0)
    return f"{poses.problems.get(row, 'its time is not finite')}, in {rows.where(row)}"


def _nearest(times: Float[np.ndarray, " n"], candidates: Float[np.ndarray, " m"]) -> Int[np.ndarray, " n"]:
    """The index of the candidate nearest to each time."""
    order = np.argsort(candidates, kind="stable")
    ordered = candidates[order]
    after = np.clip(np.searchsorted(ordered, times), 1, max(len(ordered) - 1, 1))
    before = after - 1
    after = np.minimum(after, len(ordered) - 1)
    return order[np.where(times - ordered[before] <= ordered[after] - times, before, after)]


def _closest_image(nearest: Int[np.ndarray, " n"], apart: Float[np.ndarray, " n"]) -> Int[np.ndarray, " m"]:
    """By pose, the image nearest to it in time: a pose serves one image, or two images would share one place."""
    taken = np.full(int(nearest.max()) + 1, -1)
    for i in np.argsort(-apart, kind="stable"):
        taken[nearest[i]] = i
    return taken
