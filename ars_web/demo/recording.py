"""Writing the generated recording, once: an ARS scene folder with its truth beside the images."""

import fcntl
import os
import shutil
from collections.abc import Callable, Generator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from ars_web.demo.truth import TRUTH_FILE, DemoObject, DemoTruth, load_demo, load_versioned, truth_json
from ars_web.errors import BadFile, BadInput, NotFound
from ars_web.geometry import rigid_transform
from ars_web.geometry.camera import Camera

if TYPE_CHECKING:
    from ars_web.demo.world import World

__all__ = ["DEMO_FRAMES", "DEMO_SIZE", "DemoObject", "DemoTruth", "load_demo", "make_demo"]

DEMO_FRAMES = 60
DEMO_SIZE = (960, 720)
JPEG_QUALITY = 92

VERSION = 2
"""Goes up whenever other images or another truth would be written: what was made before is then made again."""


def make_demo(
    folder: Path,
    *,
    frames: int = DEMO_FRAMES,
    size: tuple[int, int] = DEMO_SIZE,
    progress: Callable[[int, int], None] | None = None,
    world: "World | None" = None,
) -> DemoTruth:
    """The generated recording in `folder`, made there unless it is there already, whole and of this version.

    It is made in a folder beside and renamed when whole, so that a run that is killed leaves no half recording;
    the next one clears away what it left. Of several processes that want it at once, one makes it and the others
    wait. The same arguments give the same bytes on the same machine.

    Args:
        frames: how many images the camera's way is cut into.
        size: the images' width and height; the lens is scaled with the width.
        progress: called with (images done, images in all) as they are written.
        world: the scene as `lit_world` gives it, for who makes several; made where it is not given.

    Raises:
        BadInput: an argument that cannot be, or the folder holds something else.
        BadFile: it cannot be written.
    """
    width, height = size
    if frames < 1:
        raise BadInput(f"the recording needs at least 1 frame, not {frames}")
    if width < 64 or height < 48 or abs(width / height - 4 / 3) > 0.1:
        raise BadInput(f"the images are about 4 : 3 and at least 64 x 48 pixels, not {width} x {height}")
    folder = folder.absolute()
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with _only_one_at_a_time(folder):
            found = _found(folder, frames=frames, size=size)
            if found is None:
                _make(folder, frames=frames, size=size, progress=progress, world=world)
                found = load_demo(folder)
    except OSError as error:
        raise BadFile(folder, f"the generated recording cannot be written: {error.strerror or error}") from error
    return found


@contextmanager
def _only_one_at_a_time(folder: Path) -> Generator[None]:
    """Hold the lock of a recording; a killed process lets go of it."""
    with (folder.parent / f".{folder.name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def _found(folder: Path, *, frames: int, size: tuple[int, int]) -> DemoTruth | None:
    """The recording in `folder`, None where it has to be made; raises BadInput where something else is there."""
    if not folder.exists() or (folder.is_dir() and not any(folder.iterdir())):
        return None
    try:
        truth, version = load_versioned(folder)
    except (NotFound, BadFile) as error:
        if (folder / TRUTH_FILE).exists() and (folder / "robot_poses.txt").exists():
            return None
        raise BadInput(f"{folder}: holds something else than a generated recording; name another folder") from error
    asked = (version, len(truth.image_names), truth.camera.width, truth.camera.height) == (VERSION, frames, *size)
    return truth if asked and _is_whole(truth) else None


def _is_whole(truth: DemoTruth) -> bool:
    """Whether every file is there, the images with all their bytes."""
    texts = ("robot_poses.txt", "camera_extrinsics.txt", "camera_intrinsics.txt")
    images = [truth.folder / "images" / name for name in truth.image_names]
    return all((truth.folder / name).is_file() for name in texts) and all(
        image.is_file() and image.stat().st_size == size for image, size in zip(images, truth.image_bytes, strict=True)
    )


def _make(
    folder: Path,
    *,
    frames: int,
    size: tuple[int, int],
    progress: Callable[[int, int], None] | None,
    world: "World | None",
) -> None:
    partial = folder.with_name(f".{folder.name}.partial")
    outdated = folder.with_name(f".{folder.name}.outdated")
    for leftover in (partial, outdated):
        if leftover.exists():
            shutil.rmtree(leftover)
    try:
        (partial / "images").mkdir(parents=True)
        _write(partial, frames=frames, size=size, progress=progress, world=world)
        if folder.exists():
            folder.rename(outdated)
        partial.rename(folder)
    finally:
        for leftover in (partial, outdated):
            shutil.rmtree(leftover, ignore_errors=True)


def _write(
    folder: Path,
    *,
    frames: int,
    size: tuple[int, int],
    progress: Callable[[int, int], None] | None,
    world: "World | None",
) -> None:
    # numba and OpenCV take a second to load and are of no use where the recording is there already.
    import cv2

    from ars_web.demo import building, measuring, rendering, scene

    camera, things = scene.camera(*size), scene.things()
    Ts_world_camera = scene.camera_path(frames)
    names = tuple(f"{i:05d}.jpg" for i in range(frames))
    executor = ThreadPoolExecutor(os.cpu_count())
    try:
        ray_table = executor.submit(rendering.ray_table, camera)
        lit = world or building.lit_world(
            things, desk=scene.desk(), executor=executor, meanwhile=rendering.compile_kernels
        )
        rays = ray_table.result()
        surfaces = [measuring.surface_points_world(thing) for thing in things]

        def photograph(i: int) -> tuple[int, measuring.Counts]:
            sight = rendering.look(lit.parts, rays, Ts_world_camera[i])
            image = rendering.paint(lit, rays, Ts_world_camera[i], sight, seed=i)
            _, jpeg = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
            return (folder / "images" / names[i]).write_bytes(jpeg.tobytes()), measuring.pixel_counts(sight)

        image_bytes: list[int] = []
        counts: list[measuring.Counts] = []
        for written, counted in executor.map(photograph, range(frames)):
            image_bytes.append(written)
            counts.append(counted)
            if progress is not None:
                progress(len(counts), frames)
    finally:
        executor.shutdown(cancel_futures=True)
    truth = DemoTruth(
        folder=folder,
        class_names=scene.CLASS_NAMES,
        objects=tuple(DemoObject(thing.class_name, thing.name, thing.box) for thing in things),
        camera=camera,
        image_names=names,
        image_bytes=tuple(image_bytes),
        Ts_world_camera=Ts_world_camera,
        bbox_amodal=np.array(
            [[measuring.amodal_box(camera, T, points) for points in surfaces] for T in Ts_world_camera]
        ),
        bbox_visible=np.array([count.bbox_visible for count in counts]),
        px_in_image=np.array([count.in_image for count in counts]),
        px_visible=np.array([count.visible for count in counts]),
    )
    T_wrist_camera = scene.T_WRIST_CAMERA
    _write_poses(folder / "robot_poses.txt", Ts_world_camera @ rigid_transform.invert(T_wrist_camera))
    _write_poses(folder / "camera_extrinsics.txt", T_wrist_camera[None])
    _write_camera(folder / "camera_intrinsics.txt", camera)
    (folder / TRUTH_FILE).write_bytes(truth_json(truth, version=VERSION))


def _write_poses(path: Path, Ts: Float[np.ndarray, "n 4 4"]) -> None:
    """One `x y z qx qy qz qw` a line, digits enough for every bit but the last few."""
    wxyz = rigid_transform.wxyz_from_rotation(Ts[:, :3, :3])
    rows = np.column_stack([Ts[:, :3, 3], wxyz[:, 1:], wxyz[:, :1]])
    path.write_text("".join(" ".join(f"{value:.15g}" for value in row) + "\n" for row in rows))


def _write_camera(path: Path, camera: Camera) -> None:
    """`w h fx fy cx cy k1 k2 p1 p2`."""
    k1, k2, p1, p2, _ = camera.distortion
    values = (camera.fx, camera.fy, camera.cx, camera.cy, k1, k2, p1, p2)
    path.write_text(" ".join([str(camera.width), str(camera.height), *(f"{value:.15g}" for value in values)]) + "\n")
