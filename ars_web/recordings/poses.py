"""A plain image folder and `poses.txt`: the camera in the world as 4 x 4 matrices, OpenCV axes, metres.

poses.txt   16 numbers a line, row by row; or 12, the last row left out; or each matrix on four lines
images      the folder named, else images/ beside it, else the images beside it; image i belongs to pose i
camera      the file named, else camera_intrinsics.txt beside poses.txt or beside the image folder
"""

from pathlib import Path

import numpy as np

from ars_web.errors import BadFile, BadInput
from ars_web.recordings.frames import ListedFrame, usable_frames
from ars_web.recordings.image_folder import files_in, list_images, uncounted
from ars_web.recordings.intrinsics import find_camera_file, read_camera_file
from ars_web.recordings.number_rows import count_numbers, read_rows
from ars_web.recordings.options import ReadOptions, real
from ars_web.recordings.pose_checks import poses_from_matrices
from ars_web.recordings.recording import Recording

TITLE = "images with poses"
NEEDS = "images, poses.txt (4 x 4 matrices) and a camera file"

_POSES_FILE = "poses.txt"
_WIDTHS = {16: "a 4 x 4 matrix row by row", 12: "its first three rows", 4: "one of its four rows"}
_TUM_COLUMNS = 8
_IMAGE_ENDINGS = (".jpg", ".jpeg", ".png")


def recognises(path: Path) -> bool:
    """Whether `path` is a file of matrices, or a folder with a poses.txt that is no TUM trajectory."""
    if path.is_dir():
        file = path / _POSES_FILE
        return file.is_file() and count_numbers(file) != _TUM_COLUMNS
    return count_numbers(path) in _WIDTHS


def read(path: Path, options: ReadOptions) -> Recording:
    """Read a folder with poses.txt, or such a file.

    Raises:
        BadFile: a line is damaged, images or camera are missing, or poses and images differ in number.
        BadInput: it cannot be known which images or camera is meant.
        RefusedPath: something lies outside `options.within`.
    """
    file = options.allowed(path / _POSES_FILE if path.is_dir() else path)
    rows = read_rows(file, columns=_WIDTHS)
    values, lines = rows.values, rows.lines
    if values.shape[1] == 4:
        if len(values) % 4:
            raise BadFile(file, f"has {len(values)} lines of 4 numbers; a matrix has four", line=int(lines[-1]))
        values, lines = values.reshape(-1, 16), lines[::4]
    if values.shape[1] == 12:
        values = np.column_stack([values, np.tile([0.0, 0.0, 0.0, 1.0], (len(values), 1))])
    poses = poses_from_matrices(values.reshape(-1, 4, 4))
    folder = options.allowed(options.images or _image_folder(file))
    images = list_images(folder)
    if len(images) != len(poses.Ts):
        raise BadFile(
            file,
            f"has {len(poses.Ts)} poses for {len(images)} images in {folder}{uncounted(images)}; which pose is whose"
            " cannot be known",
        )
    cameras = {0: read_camera_file(find_camera_file([file.parent, real(folder).parent], options))}
    listed = [ListedFrame(None, image, 0, f"{file}:{line}") for image, line in zip(images, lines, strict=True)]
    frames, skipped = usable_frames(file, listed, poses, cameras, options)
    return Recording("poses", path.resolve(), cameras, frames, skipped)


def _image_folder(file: Path) -> Path:
    inner = file.parent / "images"
    loose = any(path.suffix.lower() in _IMAGE_ENDINGS for path in files_in(file.parent))
    if inner.is_dir() and loose:
        raise BadInput(f"the images of {file} could be in {inner} or beside it; say which")
    if not inner.is_dir() and not loose:
        raise BadFile(file, f"there are no images in {inner} and none beside it; say where the images are")
    return inner if inner.is_dir() else file.parent
