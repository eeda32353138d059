"""What the formats with poses have in common: where boxes are before the camera, and what a lens costs them."""

import numpy as np
from jaxtyping import Float

from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.shapes import PosedShapes
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import stack
from ars_web.geometry.camera import Camera, normalised_from_pixels

_GRID = 33
"""Pixels along each side of an image in which the lens is looked at."""


def Ts_camera_box(shapes: PosedShapes) -> Float[np.ndarray, "n b 4 4"]:
    """(n, b, 4, 4) place and axes of each box before the camera of each frame, metres."""
    Ts_world_box, _ = stack(list(shapes.boxes))
    return rigid_transform.invert(shapes.Ts_world_camera)[:, None] @ Ts_world_box[None]


def lens_error(camera: Camera) -> float:
    """The largest distance in pixels, within the image, between where the lens shows a point and where the camera
    matrix alone would; pixels that no ray leads to are left out."""
    if camera.model == "pinhole":
        return 0.0
    columns, rows = np.meshgrid(np.linspace(0, camera.width - 1, _GRID), np.linspace(0, camera.height - 1, _GRID))
    pixels = np.stack([columns, rows], axis=-1)
    straight = normalised_from_pixels(camera, pixels) * [camera.fx, camera.fy] + [camera.cx, camera.cy]
    distances = np.linalg.norm(straight - pixels, axis=-1)
    return float(np.max(distances, where=np.isfinite(distances), initial=0.0))


def lens_losses(plan: ExportPlan, *, exact: str) -> list[str]:
    """One line for formats whose camera is a matrix alone, where the images are not rectified; `exact` says what of
    a label is right nevertheless."""
    if plan.options.images == "rectify":
        return []
    errors = [
        (lens_error(camera), camera_id, session.id)
        for session in plan.sessions
        for camera_id, camera in session.cameras.items()
        if camera.model != "pinhole"
    ]
    if not errors:
        return []
    error, camera_id, session_id = max(errors, key=lambda found: found[0])
    return [
        f"the lens's distortion: poses projected by the camera matrix alone are up to {error:.1f} px off (camera"
        f" {camera_id} of session {session_id}); {exact}. Export with images: rectify to be rid of it"
    ]


def classes_without_boxes(plan: ExportPlan) -> list[str]:
    """The names of the classes that no box has."""
    used = {place for session in plan.sessions for place in session.class_of_box}
    return [name for place, name in enumerate(plan.class_names) if place not in used]
