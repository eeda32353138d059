"""The original tool's scene folder.

    images/                 JPEG, else PNG, sorted by name; image i belongs to pose i
    robot_poses.txt         `x y z qx qy qz qw` a line: the wrist in the world
    camera_extrinsics.txt   `x y z qx qy qz qw`: the camera in the wrist
    camera_intrinsics.txt   `w h fx fy cx cy k1 k2 p1 p2`, and k3 where the camera has one

Positions are in metres, camera axes OpenCV's, pixel centres at integers: only the quaternions' order changes here.
"""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from ars_web.errors import BadFile
from ars_web.geometry.rigid_transform import Transform
from ars_web.recordings.frames import ListedFrame, usable_frames
from ars_web.recordings.image_folder import list_images, uncounted
from ars_web.recordings.intrinsics import CAMERA_FILE, read_camera_file
from ars_web.recordings.number_rows import read_rows
from ars_web.recordings.options import ReadOptions
from ars_web.recordings.pose_checks import CheckedPoses, poses_from_quaternions
from ars_web.recordings.recording import Recording

TITLE = "ARS scene folder"
NEEDS = "images/, robot_poses.txt, camera_extrinsics.txt, camera_intrinsics.txt"

POSE_NAMES = "x y z qx qy qz qw"
EXTRINSICS_FILE = "camera_extrinsics.txt"
_POSES_FILE = "robot_poses.txt"


def recognises(path: Path) -> bool:
    """Whether `path` is a folder with robot poses."""
    return (path / _POSES_FILE).is_file()


def read(path: Path, options: ReadOptions) -> Recording:
    """Read a scene folder.

    Raises:
        BadFile: a file of it is missing or damaged, or poses and images differ in number.
        RefusedPath: something lies outside `options.within`.
    """
    if not path.is_dir():
        raise BadFile(path, "an ARS scene is a folder" if path.exists() else "the folder is missing")
    poses_file = options.allowed(path / _POSES_FILE)
    rows = read_rows(poses_file, columns={7: POSE_NAMES})
    images = list_images(options.allowed(options.images or path / "images"))
    if len(images) != len(rows.values):
        raise BadFile(
            poses_file,
            f"has {len(rows.values)} poses for {len(images)} images in {images[0].parent}{uncounted(images)};"
            " which pose is whose cannot be known",
        )
    T_wrist_camera = camera_in_wrist(options.allowed(path / EXTRINSICS_FILE))
    cameras = {0: read_camera_file(options.allowed(options.camera or path / CAMERA_FILE))}
    listed = [ListedFrame(None, image, 0, rows.where(i)) for i, image in enumerate(images)]
    poses = poses_from_wrist(rows.values, T_wrist_camera)
    frames, skipped = usable_frames(poses_file, listed, poses, cameras, options)
    return Recording("ars", path.resolve(), cameras, frames, skipped)


def poses_from_wrist(wrist_xyz_xyzw: Float[np.ndarray, "n 7"], T_wrist_camera: Transform) -> CheckedPoses:
    """`Ts_world_camera` from rows `x y z qx qy qz qw` of the wrist in the world."""
    wrist = poses_from_quaternions(wrist_xyz_xyzw[:, :3], wrist_xyz_xyzw[:, [6, 3, 4, 5]])
    return CheckedPoses(wrist.Ts @ T_wrist_camera, wrist.problems)


def camera_in_wrist(path: Path) -> Transform:
    """`T_wrist_camera` of a file of seven numbers, in one line or one a line.

    Raises:
        BadFile: it is missing or damaged.
    """
    # numpy.savetxt writes a vector one number a line, and the original tool reads that too.
    rows = read_rows(path, columns={7: POSE_NAMES, 1: "one a line"})
    if rows.values.size != 7:
        raise BadFile(path, f"has {rows.values.size} numbers; the camera in the wrist is 7: {POSE_NAMES}")
    row = rows.values.reshape(1, 7)
    pose = poses_from_quaternions(row[:, :3], row[:, [6, 3, 4, 5]])
    if pose.problems:
        raise BadFile(path, pose.problems[0], line=int(rows.lines[0]))
    return pose.Ts[0]
