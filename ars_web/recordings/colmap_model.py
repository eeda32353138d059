"""A COLMAP model as its files hold it, and what it means: cameras and poses in our conventions.

Sources: https://colmap.github.io/format.html and https://colmap.github.io/cameras.html; the parameters' order is
that of COLMAP's `src/colmap/sensor/models.h`.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ars_web.errors import BadFile, BadInput
from ars_web.geometry.camera import Camera, Model, pixels_from_image
from ars_web.geometry.rigid_transform import invert
from ars_web.recordings.intrinsics import camera_from
from ars_web.recordings.pose_checks import CheckedPoses, poses_from_quaternions

MODEL_PARAMS: dict[str, tuple[str, ...]] = {
    "SIMPLE_PINHOLE": ("f", "cx", "cy"),
    "PINHOLE": ("fx", "fy", "cx", "cy"),
    "SIMPLE_RADIAL": ("f", "cx", "cy", "k1"),
    "RADIAL": ("f", "cx", "cy", "k1", "k2"),
    "OPENCV": ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"),
    "OPENCV_FISHEYE": ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"),
    "FULL_OPENCV": ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
    "FOV": ("fx", "fy", "cx", "cy", "omega"),
    "SIMPLE_RADIAL_FISHEYE": ("f", "cx", "cy", "k1"),
    "RADIAL_FISHEYE": ("f", "cx", "cy", "k1", "k2"),
    "THIN_PRISM_FISHEYE": ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "sx1", "sy1"),
    "RAD_TAN_THIN_PRISM_FISHEYE": (
        *("fx", "fy", "cx", "cy", "k0", "k1", "k2", "k3", "k4", "k5"),
        *("p0", "p1", "s0", "s1", "s2", "s3"),
    ),
    "SIMPLE_DIVISION": ("f", "cx", "cy", "k"),
    "DIVISION": ("fx", "fy", "cx", "cy", "k"),
    "SIMPLE_FISHEYE": ("f", "cx", "cy"),
    "FISHEYE": ("fx", "fy", "cx", "cy"),
    "EUCM": ("fx", "fy", "cx", "cy", "alpha", "beta"),
    "EQUIRECTANGULAR": ("w", "h"),
}
"""COLMAP's camera models by their number in binary files, which is their place here."""

_BROWN = ("k1", "k2", "p1", "p2", "k3")
_FISHEYE = ("k1", "k2", "k3", "k4")
# What our model of a COLMAP model can express; other parameters of it must be zero.
_EXPRESSED: dict[str, tuple[Model, tuple[str, ...]]] = {
    "SIMPLE_PINHOLE": ("pinhole", ()),
    "PINHOLE": ("pinhole", ()),
    "SIMPLE_RADIAL": ("brown", _BROWN),
    "RADIAL": ("brown", _BROWN),
    "OPENCV": ("brown", _BROWN),
    "FULL_OPENCV": ("brown", _BROWN),
    "OPENCV_FISHEYE": ("fisheye", _FISHEYE),
    "SIMPLE_RADIAL_FISHEYE": ("fisheye", _FISHEYE),
    "RADIAL_FISHEYE": ("fisheye", _FISHEYE),
    "SIMPLE_FISHEYE": ("fisheye", _FISHEYE),
    "FISHEYE": ("fisheye", _FISHEYE),
}

CAMERA_SENSOR = 0
"""The sensor type of cameras; others (an IMU is 1) have no images."""

Sensor = tuple[int, int]
"""A sensor's type and id."""


@dataclass(frozen=True)
class ColmapCamera:
    """A camera as the file has it: first pixel centre at (0.5, 0.5). `where` is `FILE:LINE` or `FILE`."""

    id: int
    model: str
    width: int
    height: int
    params: tuple[float, ...]
    where: str


@dataclass(frozen=True)
class ColmapImage:
    """An image; `camera_from_world` is qw qx qy qz tx ty tz."""

    id: int
    name: str
    camera_id: int
    camera_from_world: tuple[float, ...]
    where: str


@dataclass(frozen=True)
class ColmapRig:
    """Sensors mounted together; `sensor_from_rig` is qw qx qy qz tx ty tz, None where the model has no pose for it.

    The reference sensor is the rig's own frame and has the identity.
    """

    id: int
    sensor_from_rig: dict[Sensor, tuple[float, ...] | None]
    where: str


@dataclass(frozen=True)
class ColmapFrame:
    """One instant of a rig; `rig_from_world` is qw qx qy qz tx ty tz, `images` the image of each camera in it."""

    id: int
    rig_id: int
    rig_from_world: tuple[float, ...]
    images: tuple[tuple[Sensor, int], ...]
    where: str


@dataclass(frozen=True)
class ColmapModel:
    """A model, its images in the file's order. `frames` is None in models without rigs."""

    images_file: Path
    cameras: tuple[ColmapCamera, ...]
    images: tuple[ColmapImage, ...]
    rigs: tuple[ColmapRig, ...] = ()
    frames: tuple[ColmapFrame, ...] | None = None


def camera_of(camera: ColmapCamera) -> Camera:
    """Our camera for COLMAP's, where ours expresses it exactly.

    Raises:
        BadInput: it is of a model that ours does not express, or its numbers are no camera's.
    """
    if camera.model not in _EXPRESSED:
        raise BadInput(
            f"{camera.where}: camera {camera.id} is a {camera.model}, which cannot be expressed exactly; undistort the"
            f" images or use one of {', '.join(_EXPRESSED)}"
        )
    model, coefficients = _EXPRESSED[camera.model]
    values = dict(zip(MODEL_PARAMS[camera.model], camera.params, strict=True))
    fx = values.pop("fx") if "fx" in values else values["f"]
    fy = values.pop("fy") if "fy" in values else values.pop("f")
    # COLMAP's first pixel has its centre at (0.5, 0.5): image coordinates, half a pixel more than ours.
    cx, cy = pixels_from_image(np.array([values.pop("cx"), values.pop("cy")])).tolist()
    distortion = tuple(values.pop(name, 0.0) for name in coefficients)
    left = [f"{name} {value:g}" for name, value in values.items() if value != 0.0]
    if left:
        raise BadInput(
            f"{camera.where}: camera {camera.id} is a {camera.model} with {', '.join(left)}, which cannot be expressed"
            " exactly; undistort the images or calibrate as OPENCV"
        )
    try:
        return camera_from(
            camera.width, camera.height, focal=(fx, fy), centre_pixels=(cx, cy), model=model, distortion=distortion
        )
    except BadInput as error:
        raise BadInput(f"{camera.where}: camera {camera.id}: {error}") from error


def poses_of(model: ColmapModel) -> CheckedPoses:
    """`Ts_world_camera` of the model's images, in their order.

    A model with rigs has them from its frames, as COLMAP itself does: camera from rig, after rig from world.

    Raises:
        BadFile: a frame names a rig, a sensor or an image that is not in the model, or an image is in two frames.
    """
    if model.frames is None:
        return _inverted(_checked(image.camera_from_world for image in model.images))
    rigs = {rig.id: rig for rig in model.rigs}
    rows = {image.id: row for row, image in enumerate(model.images)}
    n = len(model.images)
    camera_from_rig = [_UNKNOWN] * n
    rig_from_world = [_UNKNOWN] * n
    problems = dict.fromkeys(range(n), "the model has no pose for it (it is in no frame)")
    seen: dict[int, str] = {}
    for frame in model.frames:
        rig = rigs.get(frame.rig_id)
        if rig is None:
            raise BadInput(f"{frame.where}: frame {frame.id} is of rig {frame.rig_id}, which the model does not have")
        for sensor, image_id in frame.images:
            if sensor[0] != CAMERA_SENSOR:
                continue
            row = rows.get(image_id)
            if row is None:
                continue  # COLMAP lists a frame's images here even where images.* leaves out the unregistered
            if sensor not in rig.sensor_from_rig:
                raise BadInput(f"{frame.where}: frame {frame.id} has camera {sensor[1]}, which rig {rig.id} does not")
            if sensor[1] != model.images[row].camera_id:
                raise BadInput(
                    f"{frame.where}: frame {frame.id} says that image {image_id} is of camera {sensor[1]},"
                    f" {model.images[row].where} that it is of {model.images[row].camera_id}"
                )
            if image_id in seen:
                raise BadInput(f"{frame.where}: image {image_id} is in two frames, here and in {seen[image_id]}")
            seen[image_id] = frame.where
            mounted = rig.sensor_from_rig[sensor]
            if mounted is None:
                problems[row] = f"rig {rig.id} has no pose for camera {sensor[1]} ({rig.where})"
                continue
            camera_from_rig[row], rig_from_world[row] = mounted, frame.rig_from_world
            del problems[row]
    mounted_poses, rig_poses = _checked(camera_from_rig), _checked(rig_from_world)
    # A pose that is missing comes first: what is wrong with its stand-in means nothing.
    merged = mounted_poses.problems | rig_poses.problems | problems
    return _inverted(CheckedPoses(mounted_poses.Ts @ rig_poses.Ts, merged))


_UNKNOWN: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def _checked(poses: Iterable[tuple[float, ...]]) -> CheckedPoses:
    rows: Float[np.ndarray, "n 7"] = np.array(list(poses), dtype=np.float64).reshape(-1, 7)
    return poses_from_quaternions(rows[:, 4:], rows[:, :4])


def _inverted(poses: CheckedPoses) -> CheckedPoses:
    return CheckedPoses(invert(poses.Ts), poses.problems)


def refuse_repeated_ids(path: Path, ids: list[int], *, kind: str) -> None:
    """Raises BadFile where an id occurs twice."""
    if len(set(ids)) != len(ids):
        seen: set[int] = set()
        for one in ids:
            if one in seen:
                raise BadFile(path, f"has {kind} {one} twice")
            seen.add(one)
