"""nerfstudio's `transforms.json`, and those of instant-ngp and of Blender-style sets, which are its ancestors.

    poses       camera-to-world in OpenGL axes (x right, y up, z backward), after `applied_transform` and then
                `applied_scale`; both are undone
    cameras     one for all frames, or one for each; `camera_angle_x` where there is no focal length
    cx, cy      in image coordinates: half a pixel more than ours
    file_path   relative to the file, or absolute; Blender-style sets leave out its ending

Source: https://docs.nerf.studio/quickstart/data_conventions.html
"""

from collections.abc import Sequence
from pathlib import Path, PurePosixPath

import numpy as np
from jaxtyping import Float
from pydantic import ConfigDict

from ars_web.errors import ArsError, BadFile, BadInput
from ars_web.geometry import rigid_transform
from ars_web.geometry.camera import Camera
from ars_web.recordings.frames import ListedFrame, usable_frames
from ars_web.recordings.image_header import read_header
from ars_web.recordings.json_file import holds_words, line_of, parse_json
from ars_web.recordings.nerfstudio_camera import Intrinsics, camera_of
from ars_web.recordings.number_rows import file_bytes
from ars_web.recordings.options import ReadOptions
from ars_web.recordings.pose_checks import CheckedPoses, poses_from_matrices
from ars_web.recordings.recording import Recording

TITLE = "nerfstudio"
NEEDS = "transforms.json, and the images it lists"

_ENDINGS = (".png", ".jpg", ".jpeg", ".PNG", ".JPG", ".JPEG")
_OPENGL_FROM_OPENCV = np.diag([1.0, -1.0, -1.0, 1.0])
_LAST_ROW = [0.0, 0.0, 0.0, 1.0]

Rows = list[list[float]]


class _Frame(Intrinsics):
    file_path: str
    transform_matrix: Rows


class _Transforms(Intrinsics):
    model_config = ConfigDict(extra="ignore", frozen=True)

    frames: list[_Frame]
    applied_transform: Rows | None = None
    applied_scale: float | None = None


def recognises(path: Path) -> bool:
    """Whether `path` is a JSON file of frames with transforms, or a folder with transforms*.json."""
    return bool(_files_below(path)) if path.is_dir() else holds_words(path, (b'"frames"', b'"transform_matrix"'))


def read(path: Path, options: ReadOptions) -> Recording:
    """Read a `transforms.json`, or the only one in a folder.

    Raises:
        BadFile: it is damaged, gives no camera, or one that cannot be expressed.
        BadInput: the folder holds several.
        RefusedPath: something lies outside `options.within`.
    """
    file = options.allowed(_file(path))
    data = file_bytes(file)
    transforms = parse_json(file, data, _Transforms)
    # A frame names its file once, so the n-th name stands in the n-th frame.
    lines = line_of(data, b'"file_path"', count=len(transforms.frames)) or [None] * len(transforms.frames)
    poses = _poses(file, transforms, lines)
    cameras: dict[Camera, int] = {}
    listed: list[ListedFrame] = []
    known: dict[object, Camera] = {}
    for frame, line in zip(transforms.frames, lines, strict=True):
        where = f"{file}:{line}" if line else str(file)
        image = _image(file.parent, frame.file_path, options)
        own = transforms.overridden(frame)
        try:
            size = own.size() or _stored_size(image, options)
        except ArsError as error:
            listed.append(ListedFrame(None, image, -1, where, problem=str(error)))
            continue
        key = (None if own is transforms else own.key(), size)
        if key not in known:
            try:
                known[key] = camera_of(own, size)
            except BadInput as error:
                raise BadFile(file, f"the camera of {frame.file_path}: {error}", line=line) from error
        number = cameras.setdefault(known[key], len(cameras))
        listed.append(ListedFrame(None, image, number, where))
    by_number = {number: camera for camera, number in cameras.items()}
    frames, skipped = usable_frames(file, listed, poses, by_number, options)
    return Recording("nerfstudio", path.resolve(), by_number, frames, skipped)


def _files_below(folder: Path) -> list[Path]:
    return [file for file in sorted(folder.glob("transforms*.json")) if file.is_file()]


def _file(path: Path) -> Path:
    if not path.is_dir():
        return path
    found = _files_below(path)
    if not found:
        raise BadFile(path, "holds no transforms.json")
    if len(found) > 1:
        raise BadInput(f"{path} holds {', '.join(file.name for file in found)}; give the one that is meant")
    return found[0]


def _image(folder: Path, file_path: str, options: ReadOptions) -> Path:
    """Where a frame's image lies; what is not there stays as it is written, and is missed later."""
    if options.images is None:
        return _with_ending(folder / file_path)
    # A folder that replaces the file's own holds the images under the end of their old path.
    parts = PurePosixPath(file_path).parts
    ends = [_with_ending(options.images.joinpath(*parts[start:])) for start in range(len(parts)) if parts[start] != "/"]
    return next((end for end in ends if end.is_file()), options.images / PurePosixPath(file_path).name)


def _with_ending(path: Path) -> Path:
    if path.suffix in _ENDINGS:
        return path
    found = [path.with_name(path.name + ending) for ending in _ENDINGS] if path.name else []
    return next((one for one in found if one.is_file()), path)


def _stored_size(image: Path, options: ReadOptions) -> tuple[float, float]:
    """The size of an image that the file gives none for, as Blender-style sets do not."""
    header = read_header(options.allowed(image))
    return header.width, header.height


def _poses(file: Path, transforms: _Transforms, lines: Sequence[int | None]) -> CheckedPoses:
    """`Ts_world_camera` of all frames."""
    matrices = [frame.transform_matrix for frame in transforms.frames]
    for frame, line in zip(transforms.frames, lines, strict=True):
        if not _is_transform(frame.transform_matrix):
            raise BadFile(file, f"the transform_matrix of {frame.file_path} is not 4 x 4 numbers", line=line)
    stacked = np.array([rows if len(rows) == 4 else [*rows, _LAST_ROW] for rows in matrices], dtype=np.float64)
    saved = poses_from_matrices(stacked.reshape(-1, 4, 4))
    Ts_world_opengl = _undone(file, transforms, saved.Ts)
    return CheckedPoses(Ts_world_opengl @ _OPENGL_FROM_OPENCV, saved.problems)


def _undone(file: Path, transforms: _Transforms, Ts_saved: Float[np.ndarray, "n 4 4"]) -> Float[np.ndarray, "n 4 4"]:
    """The poses in the original world: nerfstudio saves `applied_scale * (applied_transform @ T_world_camera)`."""
    Ts = Ts_saved.copy()
    scale = transforms.applied_scale
    if scale is not None:
        if not (np.isfinite(scale) and scale > 0):
            raise BadFile(file, f"applied_scale must be a positive number, not {scale:g}")
        Ts[:, :3, 3] /= scale
    applied = transforms.applied_transform
    if applied is not None:
        if not _is_transform(applied):
            raise BadFile(file, "applied_transform is not 3 x 4 or 4 x 4 numbers")
        matrix = np.array(applied if len(applied) == 4 else [*applied, _LAST_ROW], dtype=np.float64)
        try:
            Ts = rigid_transform.invert(rigid_transform.checked(matrix)) @ Ts
        except BadInput as error:
            raise BadFile(file, f"applied_transform: {error}") from error
    return Ts


def _is_transform(rows: Rows) -> bool:
    return len(rows) in (3, 4) and all(len(row) == 4 for row in rows)
