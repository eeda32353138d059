"""A BOP scene as a recording: its images, where scene_camera.json says where their cameras were.

scene_camera.json   cam_K for each image, and cam_R_w2c, cam_t_w2c; an image without them is a skipped frame
rgb/, else gray/    000000.png (or .jpg), after the image's number
scene_gt.json       where it is there, with models_info.json above the scene: boxes, of the objects that rest
"""

from pathlib import Path

import numpy as np

from ars_web.errors import BadFile, BadInput, TooLarge
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.resting_objects import resting_objects
from ars_web.recordings.bop_scene import (
    CAMERA_FILE,
    IMAGE_ENDINGS,
    IMAGE_FOLDERS,
    MODELS_FILE,
    TRUTH_FILE,
    SceneCamera,
    find_models,
    object_poses,
    read_cameras,
    read_models,
    read_truth,
    world_poses,
)
from ars_web.recordings.frames import ListedFrame, usable_frames
from ars_web.recordings.image_header import read_header
from ars_web.recordings.intrinsics import camera_from
from ars_web.recordings.json_file import holds_words
from ars_web.recordings.options import ReadOptions
from ars_web.recordings.pose_checks import CheckedPoses
from ars_web.recordings.recording import RecordedBox, Recording, SkippedFrame

TITLE = "BOP scene"
NEEDS = "scene_camera.json with cam_R_w2c and cam_t_w2c, and images in rgb/ or gray/"


def recognises(path: Path) -> bool:
    """Whether `path` is a scene_camera.json, or a folder with one."""
    if path.is_dir():
        return (path / CAMERA_FILE).is_file()
    return path.name == CAMERA_FILE and holds_words(path, (b'"cam_K"',))


def read(path: Path, options: ReadOptions) -> Recording:
    """Read a scene's folder, or its scene_camera.json.

    Raises:
        BadFile: a file is damaged, or no image can be used.
        RefusedPath: something lies outside `options.within`.
    """
    file = options.allowed(path / CAMERA_FILE if path.is_dir() else path)
    given = read_cameras(file)
    poses = world_poses(file, given)
    folder = _image_folder(file, options)
    cameras: dict[Camera, int] = {}
    listed: list[ListedFrame] = []
    for number, one in given.items():
        image = _image(folder, number)
        try:
            header = read_header(options.allowed(image))
        except (BadInput, TooLarge) as error:
            listed.append(ListedFrame(image.name, image, -1, str(file), problem=str(error)))
            continue
        camera = _camera(file, number, one, header.width, header.height)
        listed.append(ListedFrame(image.name, image, cameras.setdefault(camera, len(cameras)), str(file)))
    by_id = {id_: camera for camera, id_ in cameras.items()}
    frames, skipped = usable_frames(file, listed, poses, by_id, options)
    names, boxes, unplaced = _boxes(file.parent, tuple(given), poses, options)
    return Recording("bop", path.resolve(), by_id, frames, skipped + unplaced, names, boxes)


def _image_folder(file: Path, options: ReadOptions) -> Path:
    if options.images is not None:
        return options.allowed(options.images)
    for name in IMAGE_FOLDERS:
        if (file.parent / name).is_dir():
            return options.allowed(file.parent / name)
    raise BadFile(file, f"there is no {' and no '.join(IMAGE_FOLDERS)} folder beside it; say where the images are")


def _image(folder: Path, number: int) -> Path:
    """Where an image lies; the first ending where it is missing, which is told later."""
    places = [folder / f"{number:06d}{ending}" for ending in IMAGE_ENDINGS]
    return next((place for place in places if place.is_file()), places[0])


def _camera(file: Path, number: int, given: SceneCamera, width: int, height: int) -> Camera:
    fx, _, cx, _, fy, cy, *_ = given.cam_K
    try:
        return camera_from(width, height, focal=(fx, fy), centre_pixels=(cx, cy), model="pinhole", distortion=())
    except BadInput as error:
        raise BadFile(file, f"image {number}: {error}") from error


def _boxes(
    scene: Path, numbers: tuple[int, ...], poses: CheckedPoses, options: ReadOptions
) -> tuple[tuple[str, ...], tuple[RecordedBox, ...], tuple[SkippedFrame, ...]]:
    """Class names, the boxes of the objects that rest, and the objects that nobody can place."""
    truth_file = options.allowed(scene / TRUTH_FILE)
    if not truth_file.is_file():
        return (), (), ()
    truth = read_truth(truth_file)
    rows = {number: row for row, number in enumerate(numbers) if row not in poses.problems}
    objects = [(number, i, one) for number, them in truth.items() for i, one in enumerate(them)]
    Ts_camera_model = object_poses(truth_file, objects)
    models_file = find_models(scene, options)
    models = {} if models_file is None else read_models(models_file, options)
    boxes: list[RecordedBox] = []
    unplaced: list[SkippedFrame] = []
    names: list[str] = []
    for obj_id in sorted({one.obj_id for *_, one in objects}):
        own = [k for k, (number, _, one) in enumerate(objects) if one.obj_id == obj_id and number in rows]
        if obj_id not in models:
            reason = f"its size is not known: there is no model {obj_id} in a {MODELS_FILE} beside or above the scene"
            unplaced.append(SkippedFrame(f"obj_id {obj_id}", reason, str(truth_file)))
            continue
        model = models[obj_id]
        names.append(model.class_name)
        images = np.array([objects[k][0] for k in own], dtype=np.int64)
        Ts_world_camera = poses.Ts[[rows[number] for number in images.tolist()]]
        Ts_world_box = Ts_world_camera @ Ts_camera_model[own] @ model.T_model_box
        placed = resting_objects(images, Ts_world_box, size=model.size, symmetry=model.symmetry)
        for place in placed:
            if place.problem is None:
                boxes.append(RecordedBox(model.class_name, Box(place.T_world_box, model.size)))
            else:
                first = f"{model.class_name}, first in image {images[place.rows[0]]}"
                unplaced.append(SkippedFrame(first, place.problem, str(truth_file)))
    return tuple(dict.fromkeys(names)), tuple(boxes), tuple(unplaced)
