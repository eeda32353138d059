"""The objects of a BOP scene: scene_gt.json, with models_info.json for their boxes.

A pose is of the model's frame, in millimetres; the box's centre in it is the middle of models_info.json's bounds. The
world that scene_camera.json may have plays no part: where the cameras were is the session's to say.
"""

from collections.abc import Sequence
from pathlib import Path

from ars_web.annotations.foreign import ForeignImage, ForeignLabels, ForeignModel, ForeignPose, LeftOut
from ars_web.errors import BadFile
from ars_web.recordings.bop_scene import (
    CAMERA_FILE,
    MODELS_FILE,
    TRUTH_FILE,
    find_models,
    object_poses,
    read_cameras,
    read_models,
    read_truth,
)
from ars_web.recordings.json_file import holds_words
from ars_web.recordings.number_rows import file_bytes
from ars_web.recordings.options import ReadOptions

TITLE = "BOP scene"
NEEDS = "scene_gt.json, scene_camera.json beside it, and a models_info.json in models/ beside or above the scene"

FRAMES_FILE = "frames.txt"
"""In a dataset of this program: `000012 folder!image.jpg`, what each image was called where it came from."""

_DEPTHS = ("", "*/", "*/*/")

_NO_MODEL = f"its size is not known: its obj_id is not in a {MODELS_FILE} in models/ beside or above the scene"


def find(path: Path) -> list[Path]:
    """The scene's scene_gt.json; in a dataset's folder those of its scenes."""
    if path.is_dir():
        return next((files for depth in _DEPTHS if (files := sorted(path.glob(f"{depth}{TRUTH_FILE}")))), [])
    return [path] if path.name == TRUTH_FILE or holds_words(path, (b'"cam_R_m2c"', b'"obj_id"')) else []


def are_parts(files: Sequence[Path]) -> bool:
    """Whether scenes are the splits of one dataset of this program, which says what image is whose."""
    return len({file.parents[2] for file in files}) == 1 and (files[0].parents[2] / FRAMES_FILE).is_file()


def read(file: Path, options: ReadOptions) -> ForeignLabels:
    """Read a scene_gt.json.

    Raises:
        BadFile: a file is damaged, or scene_camera.json has no entry for an image with objects.
        RefusedPath: something lies outside `options.within`.
    """
    truth = read_truth(file)
    camera_file = options.allowed(file.parent / CAMERA_FILE)
    cameras = read_cameras(camera_file) if camera_file.is_file() else {}
    objects = [(number, i, one) for number, them in truth.items() for i, one in enumerate(them)]
    Ts_camera_model = object_poses(file, objects)
    models_file = find_models(file.parent, options)
    models = {} if models_file is None else read_models(models_file, options)
    names = _own_names(file, options)
    images: list[ForeignImage] = []
    places: dict[int, int] = {}
    for number in truth:
        K = None
        if camera_file.is_file():
            if number not in cameras:
                raise BadFile(camera_file, f"has no image {number}, of which {file.name} has objects")
            fx, _, cx, _, fy, cy, *_ = cameras[number].cam_K
            K = (fx, fy, cx, cy)
        places[number] = len(images)
        images.append(ForeignImage(name=names.get(number), number=number, K=K))
    poses: list[ForeignPose] = []
    left_out: list[LeftOut] = []
    for (number, i, one), T in zip(objects, Ts_camera_model, strict=True):
        where = f"image {number}, object {i} (obj_id {one.obj_id})"
        if one.obj_id in models:
            poses.append(ForeignPose(places[number], str(one.obj_id), T, where))
        else:
            left_out.append(LeftOut(_NO_MODEL, where))
    kinds = {str(obj_id): ForeignModel(m.class_name, m.size, m.T_model_box, m.symmetry) for obj_id, m in models.items()}
    return ForeignLabels("bop", file, tuple(images), kinds, tuple(poses), left_out=tuple(left_out))


def _own_names(file: Path, options: ReadOptions) -> dict[int, str]:
    """By an image's number its name in the recording, where this program's dataset says so."""
    dataset = file.resolve().parent.parent.parent
    if options.within is not None and not dataset.is_relative_to(options.within.resolve()):
        return {}
    listed = dataset / FRAMES_FILE
    if not listed.is_file():
        return {}
    names: dict[int, str] = {}
    for line in file_bytes(options.allowed(listed)).decode(errors="replace").splitlines():
        number, _, identity = line.partition(" ")
        _, told, name = identity.partition("!")
        if not (number.isdecimal() and told and name):
            return {}  # It is another program's.
        names[int(number)] = name
    return names
