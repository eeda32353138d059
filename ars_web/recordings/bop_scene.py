"""The files of a BOP scene: scene_camera.json, scene_gt.json and the models' models_info.json.

    scene_camera.json   by image number: cam_K (3 x 3 row by row, OpenCV's pixels), and where they are known
                        cam_R_w2c (3 x 3 row by row) and cam_t_w2c (millimetres): the camera from the world
    scene_gt.json       by image number: objects, each with obj_id, cam_R_m2c and cam_t_m2c: the camera from the model
    objects.json        in a dataset of this program: by obj_id, the class and the box's size, which a model of another
                        shape does not fill
    models_info.json    by obj_id: min_x ... size_z of the model's box, millimetres, in the model's own frame, whose
                        origin need not be the box's centre; symmetries_discrete and symmetries_continuous

Lengths are millimetres there and metres from here on.

Source: https://github.com/thodan/bop_toolkit/blob/master/docs/bop_datasets_format.md
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float
from pydantic import BaseModel, ConfigDict, Field, RootModel, ValidationError

from ars_web.errors import BadFile, BadInput
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import checked_size
from ars_web.geometry.rigid_transform import Transform
from ars_web.geometry.symmetry import Symmetry
from ars_web.geometry.symmetry_of_turns import symmetry_of_turns
from ars_web.recordings.json_file import parse_json
from ars_web.recordings.number_rows import file_bytes
from ars_web.recordings.options import ReadOptions
from ars_web.recordings.pose_checks import CheckedPoses, poses_from_matrices

CAMERA_FILE = "scene_camera.json"
TRUTH_FILE = "scene_gt.json"
MODELS_FILE = "models_info.json"
OWN_OBJECTS_FILE = "objects.json"

IMAGE_FOLDERS = ("rgb", "gray")
IMAGE_ENDINGS = (".png", ".jpg", ".jpeg")

MILLIMETRE = 1e-3

OFF_CENTRE = 0.05
"""Of a model's diagonal, that a symmetry may move its box's centre and be one of the box."""


class _Part(BaseModel):
    model_config = ConfigDict(extra="ignore", frozen=True)


class SceneCamera(_Part):
    """What scene_camera.json has of an image."""

    cam_K: list[float]
    cam_R_w2c: list[float] | None = None
    cam_t_w2c: list[float] | None = None


class SceneObject(_Part):
    """What scene_gt.json has of an object in an image."""

    obj_id: int
    cam_R_m2c: list[float]
    cam_t_m2c: list[float]


class _Turning(_Part):
    axis: list[float]
    offset: list[float]


class _ModelInfo(_Part):
    min_x: float
    min_y: float
    min_z: float
    size_x: float
    size_y: float
    size_z: float
    name: str | None = None
    symmetries_discrete: list[list[float]] = []
    symmetries_continuous: list[_Turning] = []


class _OwnObject(_Part):
    """What this program's objects.json has of an object; class is a word of Python's."""

    class_name: str = Field(alias="class")
    size_mm: tuple[float, float, float]


class _OwnObjects(RootModel[dict[int, _OwnObject]]):
    pass


class _Cameras(RootModel[dict[int, SceneCamera]]):
    pass


class _Truth(RootModel[dict[int, list[SceneObject]]]):
    pass


class _Models(RootModel[dict[int, _ModelInfo]]):
    pass


@dataclass(frozen=True, eq=False)
class BopModel:
    """A kind of object.

    Attributes:
        class_name: what objects.json or models_info.json calls it, else `obj_000001` after its files.
        size: (3,) metres, of its box along its own axes.
        T_model_box: the box's centre in the model's frame, metres; the axes are the same.
        symmetry: in the box's frame.
    """

    class_name: str
    size: Float[np.ndarray, "3"]
    T_model_box: Transform
    symmetry: Symmetry


def read_cameras(file: Path) -> dict[int, SceneCamera]:
    """scene_camera.json by image number, ascending.

    Raises:
        BadFile: it is damaged, or a cam_K is not that of a camera without skew.
    """
    cameras = parse_json(file, file_bytes(file), _Cameras).root
    for number, camera in cameras.items():
        _refuse_other_lengths(file, f"image {number}: cam_K", camera.cam_K, 9)
        K = np.array(camera.cam_K).reshape(3, 3)
        if not np.isfinite(K).all() or np.abs(K[[0, 1, 2, 2], [1, 0, 0, 1]]).max() > 1e-6 or K[2, 2] != 1.0:
            raise BadFile(file, f"image {number}: cam_K must be fx 0 cx 0 fy cy 0 0 1, not {camera.cam_K}")
    return dict(sorted(cameras.items()))


def read_truth(file: Path) -> dict[int, list[SceneObject]]:
    """scene_gt.json by image number, ascending.

    Raises:
        BadFile: it is damaged.
    """
    return dict(sorted(parse_json(file, file_bytes(file), _Truth).root.items()))


def world_poses(file: Path, cameras: Mapping[int, SceneCamera]) -> CheckedPoses:
    """`Ts_world_camera` of the images in order; one without is a problem.

    Raises:
        BadFile: a rotation or a translation has too many or too few numbers.
    """
    known = [
        (row, number, one.cam_R_w2c, one.cam_t_w2c)
        for row, (number, one) in enumerate(cameras.items())
        if one.cam_R_w2c is not None and one.cam_t_w2c is not None
    ]
    Ts_camera_world = _transforms(file, [(f"image {number}", "w2c", R, t) for _, number, R, t in known])
    rows = [row for row, *_ in known]
    Ts = np.tile(np.eye(4), (len(cameras), 1, 1))
    Ts[rows] = rigid_transform.invert(Ts_camera_world.Ts)
    problems = dict.fromkeys(range(len(Ts)), "has no cam_R_w2c and cam_t_w2c, so nobody knows where its camera was")
    for place, row in enumerate(rows):
        del problems[row]
        if place in Ts_camera_world.problems:
            problems[row] = f"cam_R_w2c, cam_t_w2c: {Ts_camera_world.problems[place]}"
    return CheckedPoses(Ts, problems)


def object_poses(file: Path, objects: Sequence[tuple[int, int, SceneObject]]) -> Float[np.ndarray, "n 4 4"]:
    """`Ts_camera_model` of objects, each with its image's number and its place there.

    Raises:
        BadFile: one is no pose; the message names image and place.
    """
    named = [(f"image {n}, object {i} (obj_id {o.obj_id})", "m2c", o.cam_R_m2c, o.cam_t_m2c) for n, i, o in objects]
    poses = _transforms(file, named)
    if poses.problems:
        row, problem = min(poses.problems.items())
        raise BadFile(file, f"{named[row][0]}: {problem}")
    return poses.Ts


def find_models(scene: Path, options: ReadOptions) -> Path | None:
    """The models_info.json of a scene: in models/, else models_eval/, else another models*/ folder, beside the scene
    or one or two folders up. None: there is none."""
    root = scene.resolve()
    for folder in (root, root.parent, root.parent.parent):
        if options.within is not None and not folder.is_relative_to(options.within.resolve()):
            return None
        names = {"models": 0, "models_eval": 1}
        places = sorted(folder.glob(f"models*/{MODELS_FILE}"), key=lambda file: (names.get(file.parent.name, 2), file))
        if places:
            return options.allowed(places[0])
    return None


def read_models(file: Path, options: ReadOptions) -> dict[int, BopModel]:
    """The kinds of objects by obj_id.

    Raises:
        BadFile: it is damaged, a model's box is none, or a symmetry is no rigid transform.
        RefusedPath: the objects.json beside it lies outside `options.within`.
    """
    models = {
        obj_id: _model(file, obj_id, info) for obj_id, info in parse_json(file, file_bytes(file), _Models).root.items()
    }
    own = _own_objects(file.parent.parent, options)
    return {obj_id: _as_own(model, own.get(obj_id)) for obj_id, model in models.items()}


def _own_objects(dataset: Path, options: ReadOptions) -> dict[int, _OwnObject]:
    """What this program's dataset says of its objects; nothing where it is another program's."""
    file = dataset / OWN_OBJECTS_FILE
    if options.within is not None and not dataset.resolve().is_relative_to(options.within.resolve()):
        return {}
    if not file.is_file():
        return {}
    try:
        return _OwnObjects.model_validate_json(file_bytes(options.allowed(file))).root
    except ValidationError:
        return {}


def _as_own(model: BopModel, own: _OwnObject | None) -> BopModel:
    """A model as this program wrote it: in the frame of its box, whose centre is the origin."""
    if own is None:
        return model
    try:
        size = checked_size(np.array(own.size_mm) * MILLIMETRE)
    except BadInput:
        return model
    return replace(model, class_name=own.class_name.strip() or model.class_name, size=size, T_model_box=np.eye(4))


def _model(file: Path, obj_id: int, info: _ModelInfo) -> BopModel:
    lowest = np.array([info.min_x, info.min_y, info.min_z])
    sides = np.array([info.size_x, info.size_y, info.size_z])
    if not np.isfinite(lowest).all():
        raise BadFile(file, f"model {obj_id}: min_x, min_y, min_z must be finite numbers, not {lowest.tolist()}")
    try:
        size = checked_size(sides * MILLIMETRE)
    except BadInput as error:
        raise BadFile(file, f"model {obj_id}: {error}") from error
    centre = lowest + sides / 2
    rotations, axis = [np.eye(3)], None
    for place, numbers in enumerate(info.symmetries_discrete):
        what = f"model {obj_id}: symmetries_discrete[{place}]"
        _refuse_other_lengths(file, what, numbers, 16)
        try:
            T = rigid_transform.checked(np.array(numbers).reshape(4, 4))
        except BadInput as error:
            raise BadFile(file, f"{what}: {error}") from error
        moved = np.linalg.norm(T[:3, :3] @ centre + T[:3, 3] - centre)
        if moved <= OFF_CENTRE * np.linalg.norm(sides):
            rotations.append(T[:3, :3])
    for place, turning in enumerate(info.symmetries_continuous):
        what = f"model {obj_id}: symmetries_continuous[{place}].axis"
        _refuse_other_lengths(file, what, turning.axis, 3)
        length = float(np.linalg.norm(turning.axis))
        if not 1e-9 < length < 1e9:
            raise BadFile(file, f"{what} must have a direction, not {turning.axis}")
        # A second axis makes a ball of it, of which no turn means anything; one is enough to place it.
        axis = np.array(turning.axis) / length if axis is None else axis
    try:
        symmetry = symmetry_of_turns(np.array(rotations), axis=axis)
    except BadInput as error:
        raise BadFile(file, f"model {obj_id}: symmetries_discrete: {error}") from error
    T_model_box = rigid_transform.from_rotation(np.eye(3), centre * MILLIMETRE)
    return BopModel((info.name or "").strip() or f"obj_{obj_id:06d}", size, T_model_box, symmetry)


def _transforms(file: Path, named: Sequence[tuple[str, str, Sequence[float], Sequence[float]]]) -> CheckedPoses:
    for where, which, R, t in named:
        _refuse_other_lengths(file, f"{where}: cam_R_{which}", R, 9)
        _refuse_other_lengths(file, f"{where}: cam_t_{which}", t, 3)
    Ts = np.tile(np.eye(4), (len(named), 1, 1))
    if named:
        Ts[:, :3, :3] = np.array([R for _, _, R, _ in named], dtype=np.float64).reshape(-1, 3, 3)
        Ts[:, :3, 3] = np.array([t for *_, t in named], dtype=np.float64) * MILLIMETRE
    return poses_from_matrices(Ts)


def _refuse_other_lengths(file: Path, what: str, numbers: Sequence[float], length: int) -> None:
    if len(numbers) != length:
        raise BadFile(file, f"{what} has {len(numbers)} numbers, not {length}")
