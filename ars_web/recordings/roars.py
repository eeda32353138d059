"""The original tool's manifest, `.roars`: JSON with the scene, its frames, its classes and the boxes put into it.

    scene_path              the scene folder; relative to the manifest, or absolute
    images_path             the image folder in it (`images` where there is none)
    image_filenames_lists   the images, one for each of robot_poses
    robot_poses             [x, y, z, qx, qy, qz, qw]: the wrist in the world
    robot_to_camera_pose    the same of the camera in the wrist
    camera_params           width, height, fx, fy, cx, cy, k1, k2, p1, p2
    classes                 by label: name and instances, each with frame [x, y, z, qx, qy, qz, qw], size and label

The frame of a box sits at its bottom face's centre and is moved to the box's centre here. The label -1 is no class.
`_type` tags name the tool's Python classes; nothing here looks at them.
"""

from pathlib import Path

import numpy as np
from pydantic import BaseModel, ConfigDict

from ars_web.errors import BadFile, BadInput
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.rigid_transform import Transform
from ars_web.recordings.ars import POSE_NAMES, poses_from_wrist
from ars_web.recordings.frames import ListedFrame, usable_frames
from ars_web.recordings.intrinsics import camera_from
from ars_web.recordings.json_file import holds_words, parse_json
from ars_web.recordings.number_rows import file_bytes
from ars_web.recordings.options import ReadOptions
from ars_web.recordings.pose_checks import poses_from_quaternions
from ars_web.recordings.recording import RecordedBox, Recording, SkippedFrame

TITLE = "ARS manifest"
NEEDS = "a .roars file, and the scene folder that it names"

_NO_CLASS = -1


class _Part(BaseModel):
    model_config = ConfigDict(extra="ignore", frozen=True)


class _Camera(_Part):
    width: float
    height: float
    fx: float
    fy: float
    cx: float
    cy: float
    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0


class _Instance(_Part):
    frame: list[float]
    size: list[float]
    label: int | None = None


class _Class(_Part):
    name: str = ""
    instances: list[_Instance] = []


class _Manifest(_Part):
    scene_path: str
    images_path: str = "images"
    image_filenames_lists: list[str]
    robot_poses: list[list[float]]
    robot_to_camera_pose: list[float]
    camera_params: _Camera
    classes: dict[int, _Class] = {}


def recognises(path: Path) -> bool:
    """Whether `path` is a manifest, or a folder with one."""
    if path.is_dir():
        return bool(_manifests(path))
    return holds_words(path, (b'"image_filenames_lists"', b'"robot_poses"'))


def read(path: Path, options: ReadOptions) -> Recording:
    """Read a manifest, or the only one in a folder.

    Raises:
        BadFile: it is damaged, its scene is not there, or poses and images differ in number.
        BadInput: the folder holds several.
        RefusedPath: something lies outside `options.within`.
    """
    file = options.allowed(_file(path))
    manifest = parse_json(file, file_bytes(file), _Manifest)
    names = manifest.image_filenames_lists
    if len(names) != len(manifest.robot_poses):
        raise BadFile(
            file,
            f"has {len(manifest.robot_poses)} robot_poses for {len(names)} images; which pose is whose cannot be known",
        )
    wrist = _rows_of_seven(file, manifest.robot_poses, "robot_poses")
    T_wrist_camera = _camera_in_wrist(file, manifest)
    cameras = {0: _camera(file, manifest.camera_params)}
    folder = _image_folder(file, manifest, options)
    listed = [ListedFrame(None, folder / name, 0, str(file)) for name in names]
    poses = poses_from_wrist(wrist, T_wrist_camera)
    frames, skipped = usable_frames(file, listed, poses, cameras, options)
    class_names, boxes, unclassed = _boxes(file, manifest.classes)
    return Recording("roars", path.resolve(), cameras, frames, skipped + unclassed, class_names, boxes)


def camera_in_wrist(path: Path, options: ReadOptions) -> Transform:
    """`T_wrist_camera` of a manifest, or of the only one in a folder; raises as `read`."""
    file = options.allowed(_file(path))
    return _camera_in_wrist(file, parse_json(file, file_bytes(file), _Manifest))


def _camera_in_wrist(file: Path, manifest: _Manifest) -> Transform:
    mounted = poses_from_wrist(_rows_of_seven(file, [manifest.robot_to_camera_pose], "robot_to_camera_pose"), np.eye(4))
    if mounted.problems:
        raise BadFile(file, f"robot_to_camera_pose: {mounted.problems[0]}")
    return mounted.Ts[0]


def _manifests(folder: Path) -> list[Path]:
    return [file for file in sorted(folder.glob("*.roars")) if file.is_file()]


def _file(path: Path) -> Path:
    if not path.is_dir():
        return path
    found = _manifests(path)
    if not found:
        raise BadFile(path, "holds no .roars manifest")
    if len(found) > 1:
        raise BadInput(f"{path} holds {', '.join(file.name for file in found)}; give the one that is meant")
    return found[0]


def _rows_of_seven(file: Path, rows: list[list[float]], name: str) -> np.ndarray:
    for place, row in enumerate(rows):
        if len(row) != 7:
            raise BadFile(file, f"{name}: pose {place} has {len(row)} numbers, a pose has 7: {POSE_NAMES}")
    return np.array(rows, dtype=np.float64).reshape(-1, 7)


def _camera(file: Path, camera: _Camera) -> Camera:
    try:
        return camera_from(
            camera.width,
            camera.height,
            focal=(camera.fx, camera.fy),
            centre_pixels=(camera.cx, camera.cy),
            model="brown",
            distortion=(camera.k1, camera.k2, camera.p1, camera.p2, camera.k3),
        )
    except BadInput as error:
        raise BadFile(file, f"camera_params: {error}") from error


def _image_folder(file: Path, manifest: _Manifest, options: ReadOptions) -> Path:
    """The folder that the images' names are relative to: the scene's image folder, or the scene itself."""
    if options.images is not None:
        return options.allowed(options.images)
    scene = options.allowed(file.parent / manifest.scene_path)
    if not scene.is_dir():
        raise BadFile(file, f"its scene_path {manifest.scene_path} is no folder at {scene}; say where the images are")
    places = [scene / manifest.images_path, scene]
    return next(
        (place for place in places if any((place / name).is_file() for name in manifest.image_filenames_lists)),
        places[0],
    )


def _boxes(
    file: Path, classes: dict[int, _Class]
) -> tuple[tuple[str, ...], tuple[RecordedBox, ...], tuple[SkippedFrame, ...]]:
    """Class names in the order of their labels, the boxes of those classes, and the boxes of none."""
    names = {
        label: one.name.strip() or f"class {label}" for label, one in sorted(classes.items()) if label != _NO_CLASS
    }
    if len(set(names.values())) != len(names):
        raise BadFile(file, f"two of its classes have one name: {', '.join(names.values())}")
    boxes: list[RecordedBox] = []
    unclassed: list[SkippedFrame] = []
    for label, one in sorted(classes.items()):
        for place, instance in enumerate(one.instances):
            what = f"classes.{label}.instances[{place}]"
            box = _box(file, what, instance)
            # The tool itself sorts instances by their own label, and into -1 where no class has it.
            name = names.get(label if instance.label is None else instance.label)
            if name is None:
                reason = "the box has no class in the manifest; give it one there, or draw it again"
                unclassed.append(SkippedFrame(what, reason, str(file)))
            else:
                boxes.append(RecordedBox(name, box))
    return tuple(names.values()), tuple(boxes), tuple(unclassed)


def _box(file: Path, what: str, instance: _Instance) -> Box:
    row = _rows_of_seven(file, [instance.frame], what)
    bottom = poses_from_quaternions(row[:, :3], row[:, [6, 3, 4, 5]])
    if bottom.problems:
        raise BadFile(file, f"{what}: {bottom.problems[0]}")
    if len(instance.size) != 3:
        raise BadFile(file, f"{what}: a size has 3 lengths, not {len(instance.size)}")
    T_bottom_box = rigid_transform.from_rotation(np.eye(3), np.array([0.0, 0.0, instance.size[2] / 2]))
    try:
        return Box(bottom.Ts[0] @ T_bottom_box, np.array(instance.size, dtype=np.float64))
    except BadInput as error:
        raise BadFile(file, f"{what}: {error}") from error
