"""The recording's cameras in the scene: a point for each, a thinned-out path of frusta, and the current frame's own.

Points and lines are one buffer each, whatever the number of frames: a browser draws 36,000 nodes never, and one
buffer of 36,000 points at once. Their coordinates are relative to the recording's focus, since browsers compute in
single precision.
"""

from collections.abc import Mapping
from pathlib import Path

import cv2
import numpy as np
import viser
from jaxtyping import Float, Int, UInt8

from ars_web.datasets.images import rectify
from ars_web.errors import BadInput
from ars_web.geometry import rigid_transform
from ars_web.geometry.camera import Camera, image_from_pixels, rectified
from ars_web.recordings.images import read_reduced
from ars_web.recordings.recording import StoredImage
from ars_web.recordings.stored_images import local
from ars_web.scene.extent import Extent
from ars_web.sessions.model import FrameTable

MOST_FRUSTA = 300

NEIGHBOURS = 3
"""Frames before and after the current one whose frusta are drawn, wherever the path has been thinned out."""

PHOTO_WIDTH = 320
"""Pixels, of the photo in the current frame's frustum."""

PATH_COLOR = (112, 128, 148)
NEIGHBOUR_COLOR = (120, 190, 255)
CURRENT_COLOR = (74, 168, 255)

CAMERAS = "/cameras"
"""The node that holds all that is shared of cameras."""

FRUSTUM_EDGES = np.array([(0, 1), (0, 2), (0, 3), (0, 4), (1, 2), (2, 3), (3, 4), (4, 1)])


def frustum_corners(camera: Camera, *, depth: float) -> Float[np.ndarray, "5 3"]:
    """The camera's centre, and the image's corners at `depth`, clockwise from the top left, in camera coordinates.

    A distorted image's frustum is that of its rectified one.
    """
    flat = rectified_or_plain(camera)
    x0, y0 = (-image_from_pixels(np.array([flat.cx, flat.cy]))) / [flat.fx, flat.fy]
    x1, y1 = x0 + flat.width / flat.fx, y0 + flat.height / flat.fy
    plane = np.array([[x0, y0, 1.0], [x1, y0, 1.0], [x1, y1, 1.0], [x0, y1, 1.0]])
    return np.concatenate([np.zeros((1, 3)), depth * plane])


def rectified_or_plain(camera: Camera) -> Camera:
    """The camera without its distortion: the rectified one, or where there is none, its own intrinsics."""
    try:
        return rectified(camera)
    except BadInput:
        return Camera(camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy)


def frustum_lines(
    frames: FrameTable, cameras: Mapping[int, Camera], indices: Int[np.ndarray, "k"], *, depth: float
) -> Float[np.ndarray, "m 2 3"]:
    """The eight edges of each frame's frustum, m = 8 k, in the world."""
    corners = {key: frustum_corners(camera, depth=depth) for key, camera in _used(frames, cameras, indices).items()}
    own = np.array([corners[int(frames.camera_ids[i])] for i in indices]).reshape(-1, 5, 3)
    world = rigid_transform.transform_points(frames.Ts_world_camera[indices], own)
    return world[:, FRUSTUM_EDGES].reshape(-1, 2, 3)


def _used(frames: FrameTable, cameras: Mapping[int, Camera], indices: Int[np.ndarray, "k"]) -> dict[int, Camera]:
    return {int(key): cameras[int(key)] for key in np.unique(frames.camera_ids[indices])}


def thinned(centres: Float[np.ndarray, "n 3"], *, apart: float, most: int) -> Int[np.ndarray, "k"]:
    """Indices along a path, its first and its last included, at least `apart` metres of way from one to the next.

    At most `most`; where the path is too long for that, they are further apart, evenly.
    """
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(centres, axis=0), axis=1))])
    stations = np.linspace(0.0, way[-1], max(2, min(most, 1 + int(way[-1] / apart))))
    return np.unique(np.clip(np.searchsorted(way, stations - 1e-12), 0, len(centres) - 1))


def frustum_photo(image: Path | StoredImage, camera: Camera) -> UInt8[np.ndarray, "h w 3"]:
    """A small RGB picture of a frame, rectified where the frustum is.

    Raises:
        BadFile, TooLarge: the image cannot be used (see `recordings.images`).
    """
    small = read_reduced(local(image), width=PHOTO_WIDTH)
    height, width = small.shape[:2]
    if camera.model != "pinhole":
        reduced = reduced_camera(camera, width=width, height=height)
        try:
            small = rectify(small, reduced)
        except BadInput:
            pass  # it cannot be rectified, and its frustum is not
    return cv2.cvtColor(small, cv2.COLOR_BGR2RGB)


def reduced_camera(camera: Camera, *, width: int, height: int) -> Camera:
    """The camera of an image that was made smaller."""
    sx, sy = width / camera.width, height / camera.height
    cx, cy = image_from_pixels(np.array([camera.cx, camera.cy])) * [sx, sy] - 0.5
    return Camera(width, height, camera.fx * sx, camera.fy * sy, float(cx), float(cy), camera.model, camera.distortion)


def add_cameras(scene: viser.SceneApi, frames: FrameTable, cameras: Mapping[int, Camera], extent: Extent) -> None:
    """Add what all views share: every camera's point and the path's frusta."""
    centres = frames.Ts_world_camera[:, :3, 3]
    scene.add_frame(CAMERAS, show_axes=False, position=extent.focus)
    scene.add_point_cloud(
        f"{CAMERAS}/points",
        (centres - extent.focus).astype(np.float32),
        colors=PATH_COLOR,
        point_size=0.06 * extent.frustum_depth,
        point_shape="square",
        point_shading="flat",
        precision="float32",
    )
    path = thinned(centres, apart=0.5 * extent.frustum_depth, most=MOST_FRUSTA)
    lines = frustum_lines(frames, cameras, path, depth=extent.frustum_depth) - extent.focus
    scene.add_line_segments(
        f"{CAMERAS}/path", lines.astype(np.float32), colors=PATH_COLOR, thickness=1.0, thickness_units="screen"
    )


class CurrentCamera:
    """The current frame in one view's scene: its frustum with its photo, and those of its neighbours."""

    def __init__(
        self, client: viser.ClientHandle, frames: FrameTable, cameras: Mapping[int, Camera], extent: Extent
    ) -> None:
        self._client = client
        self._frames = frames
        self._cameras = cameras
        self._depth = 1.6 * extent.frustum_depth
        self._neighbour_depth = extent.frustum_depth
        self._nodes: tuple[viser.FrameHandle, viser.LineSegmentsHandle, viser.LineSegmentsHandle] | None = None
        self._photo: viser.ImageHandle | None = None

    def show(self, frame: int, photo: UInt8[np.ndarray, "h w 3"] | None) -> None:
        """Make it this frame; None: its photo cannot be read, and only its frustum is drawn."""
        T_world_camera = self._frames.Ts_world_camera[frame]
        camera = self._cameras[int(self._frames.camera_ids[frame])]
        corners = frustum_corners(camera, depth=self._depth)
        own = corners[FRUSTUM_EDGES].astype(np.float32)
        around = np.arange(max(0, frame - NEIGHBOURS), min(len(self._frames), frame + NEIGHBOURS + 1))
        lines = frustum_lines(self._frames, self._cameras, around[around != frame], depth=self._neighbour_depth)
        near = rigid_transform.transform_points(rigid_transform.invert(T_world_camera), lines).astype(np.float32)
        scene = self._client.scene
        if self._nodes is None:
            self._nodes = (
                scene.add_frame("/current", show_axes=False),
                scene.add_line_segments(
                    "/current/frustum", own, CURRENT_COLOR, thickness=2.5, thickness_units="screen"
                ),
                scene.add_line_segments(
                    "/current/near", near, NEIGHBOUR_COLOR, thickness=1.0, thickness_units="screen"
                ),
            )
        at, frustum, neighbours = self._nodes
        at.position, at.wxyz = T_world_camera[:3, 3], rigid_transform.wxyz_from_rotation(T_world_camera[:3, :3])
        frustum.points, neighbours.points = own, near
        at.visible = True
        self._show_photo(photo, corners)

    def _show_photo(self, photo: UInt8[np.ndarray, "h w 3"] | None, corners: Float[np.ndarray, "5 3"]) -> None:
        if photo is None:
            if self._photo is not None:
                self._photo.visible = False
            return
        width, height = (float(side) for side in corners[3, :2] - corners[1, :2])
        if self._photo is None:
            self._photo = self._client.scene.add_image(
                "/current/photo", photo, width, height, cast_shadow=False, receive_shadow=False
            )
        else:
            self._photo.image = photo
            self._photo.render_width, self._photo.render_height = width, height
        self._photo.position = corners[1:].mean(axis=0)
        self._photo.visible = True

    def hide(self) -> None:
        """Show it no more, until it is shown again."""
        if self._nodes is not None:
            self._nodes[0].visible = False
