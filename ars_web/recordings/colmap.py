"""COLMAP models, text and binary, old (cameras, images, points3D) and new (with rigs and frames).

    cameras, images (and rigs, frames) as .bin, or as .txt where there is no .bin, as COLMAP itself chooses
    sparse/0/ below the given folder is looked into where the folder itself holds no model

Poses are camera-from-world and inverted here; the first pixel's centre is at (0.5, 0.5). The scale is the model's
own. Frames are in the natural order of their names: the files' order is that of ids, which means nothing.
"""

from pathlib import Path, PurePosixPath

from ars_web.errors import BadFile, BadInput
from ars_web.geometry.camera import Camera
from ars_web.recordings import colmap_binary, colmap_text
from ars_web.recordings.colmap_model import ColmapModel, camera_of, poses_of, refuse_repeated_ids
from ars_web.recordings.frames import ListedFrame, usable_frames
from ars_web.recordings.image_folder import files_in, natural_key
from ars_web.recordings.options import ReadOptions
from ars_web.recordings.pose_checks import CheckedPoses
from ars_web.recordings.recording import Frame, Recording, SkippedFrame

TITLE = "COLMAP model"
NEEDS = "cameras and images (.bin or .txt), in the folder or in its sparse/0/, and the images"

_IMAGE_ENDINGS = (".jpg", ".jpeg", ".png")


def recognises(path: Path) -> bool:
    """Whether `path` is a folder with a model, or with models under sparse/."""
    return path.is_dir() and (_ending(path) is not None or bool(_models_below(path)))


def read(path: Path, options: ReadOptions) -> Recording:
    """Read the model at `path`, or the only one under its sparse/.

    Raises:
        BadFile: a file of it is missing or damaged, or a camera's model cannot be expressed.
        BadInput: there are several models.
        RefusedPath: something lies outside `options.within`.
    """
    folder = _model_folder(path)
    model = _read_model(folder, options)
    if not model.images:
        raise BadFile(model.images_file, "lists no image")
    poses = poses_of(model)
    order = sorted(range(len(model.images)), key=lambda row: natural_key(model.images[row].name))
    images = [model.images[row] for row in order]
    images_folder = _images_folder(folder, [image.name for image in images], options)
    ids = {camera.id: number for number, camera in enumerate(model.cameras)}
    for image in images:
        if image.camera_id not in ids:
            raise BadInput(f"{image.where}: {image.name} is of camera {image.camera_id}, which the model does not have")
    used = {image.camera_id for image in images}
    cameras: dict[int, Camera] = {ids[camera.id]: camera_of(camera) for camera in model.cameras if camera.id in used}
    listed = [
        ListedFrame(_inner(image.name), images_folder / image.name, ids[image.camera_id], image.where)
        for image in images
    ]
    rows = {row: place for place, row in enumerate(order)}
    ordered = CheckedPoses(poses.Ts[order], {rows[row]: problem for row, problem in poses.problems.items()})
    frames, skipped = usable_frames(model.images_file, listed, ordered, cameras, options)
    unposed = _unposed(model.images_file, images_folder, listed, frames)
    return Recording("colmap", path.resolve(), cameras, frames, skipped + unposed)


def _ending(folder: Path) -> str | None:
    for ending in (".bin", ".txt"):
        if (folder / f"cameras{ending}").is_file() and (folder / f"images{ending}").is_file():
            return ending
    return None


def _models_below(folder: Path) -> list[Path]:
    sparse = folder / "sparse"
    if not sparse.is_dir():
        return []
    return [one for one in (sparse, *files_in(sparse)) if one.is_dir() and _ending(one) is not None]


def _model_folder(path: Path) -> Path:
    if not path.is_dir():
        raise BadFile(path, "a COLMAP model is a folder" if path.exists() else "the folder is missing")
    if _ending(path) is not None:
        return path
    models = _models_below(path)
    if not models:
        raise BadFile(path, "holds no cameras and images (.bin or .txt), and neither does a folder in its sparse/")
    if len(models) > 1:
        names = ", ".join(str(model) for model in models)
        raise BadInput(f"{path} holds several models, each with a world of its own; give one of {names}")
    return models[0]


def _read_model(folder: Path, options: ReadOptions) -> ColmapModel:
    ending = _ending(folder)
    files = colmap_binary if ending == ".bin" else colmap_text
    path = {name: options.allowed(folder / f"{name}{ending}") for name in ("cameras", "images", "rigs", "frames")}
    cameras, images = files.read_cameras(path["cameras"]), files.read_images(path["images"])
    refuse_repeated_ids(path["cameras"], [camera.id for camera in cameras], kind="camera")
    refuse_repeated_ids(path["images"], [image.id for image in images], kind="image")
    if not path["rigs"].exists() and not path["frames"].exists():
        return ColmapModel(path["images"], cameras, images)
    rigs, frames = files.read_rigs(path["rigs"]), files.read_frames(path["frames"])
    refuse_repeated_ids(path["rigs"], [rig.id for rig in rigs], kind="rig")
    refuse_repeated_ids(path["frames"], [frame.id for frame in frames], kind="frame")
    return ColmapModel(path["images"], cameras, images, rigs, frames)


def _images_folder(folder: Path, names: list[str], options: ReadOptions) -> Path:
    """The image folder that was named, or the nearest images/ beside or above the model that holds one of them."""
    if options.images is not None:
        files_in(options.allowed(options.images))  # says what is wrong with it
        return options.images
    here = folder.resolve()
    beside = [parent / "images" for parent in (here, here.parent, here.parent.parent)]
    present = [one for one in beside if one.is_dir() and any((one / name).is_file() for name in names)]
    if not present:
        looked = ", ".join(str(one) for one in beside)
        raise BadFile(folder, f"none of the model's images is in {looked}; say where the images are")
    return present[0]


def _inner(name: str) -> str | None:
    """The name where it stays within the image folder; None where it leads elsewhere."""
    path = PurePosixPath(name)
    return None if path.is_absolute() or ".." in path.parts else path.as_posix()


def _unposed(
    images_file: Path, images_folder: Path, listed: list[ListedFrame], frames: tuple[Frame, ...]
) -> tuple[SkippedFrame, ...]:
    """Images that lie beside the model's own but that COLMAP found no pose for."""
    known = {frame.image for frame in listed}
    folders = sorted({(images_folder / frame.name).parent for frame in frames if not Path(frame.name).is_absolute()})
    return tuple(
        SkippedFrame(path.relative_to(images_folder).as_posix(), "the model has no pose for it", str(images_file))
        for folder in folders
        if folder.is_dir()
        for path in files_in(folder)
        if path.suffix.lower() in _IMAGE_ENDINGS and path not in known
    )
