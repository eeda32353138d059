"""The cameras that are proposed next, in one view's scene: a frustum each, and the way from one to the next.

The nodes are `/tour/cameras` and `/tour/way`. Their numbers are written by the bridge in the page, over the scene.
"""

from collections.abc import Sequence

import numpy as np
import viser
from jaxtyping import Float

from ars_web.geometry import rigid_transform
from ars_web.geometry.camera import Camera
from ars_web.scene.cameras import FRUSTUM_EDGES, frustum_corners
from ars_web.scene.extent import Extent
from ars_web.workspace import ProposedCamera

TOUR = "/tour"

COLOR = {True: (255, 138, 207), False: (176, 24, 112)}
"""By whether the page is dark; no class, no path and no heat has it. As --proposed in the page's tokens."""


class TourPath:
    """The proposed cameras of one view."""

    def __init__(self, client: viser.ClientHandle, camera: Camera, extent: Extent) -> None:
        """
        Args:
            camera: whose frustum is drawn at each place.
        """
        self._client = client
        self._corners = frustum_corners(camera, depth=1.4 * extent.frustum_depth)
        self._focus = extent.focus
        self._nodes: tuple[viser.FrameHandle, viser.LineSegmentsHandle, viser.LineSegmentsHandle] | None = None
        self._shown: tuple[tuple[ProposedCamera, ...], bool] = ((), True)

    def show(self, cameras: tuple[ProposedCamera, ...], *, dark: bool) -> None:
        """Draw these; none: nothing. Call it within `atomic()`."""
        if (cameras, dark) == self._shown:
            return
        self._shown = (cameras, dark)
        if not cameras:
            if self._nodes is not None:
                self._nodes[0].visible = False
            return
        frusta = (self._frusta(cameras) - self._focus).astype(np.float32)
        centres = np.array([camera.position for camera in cameras]) - self._focus
        # A way has at least one piece, be it of no length.
        ends = centres[1:] if len(centres) > 1 else centres
        way = np.stack([centres[: len(ends)], ends], axis=1).astype(np.float32)
        color = COLOR[dark]
        if self._nodes is None:
            scene = self._client.scene
            self._nodes = (
                scene.add_frame(TOUR, show_axes=False, position=self._focus),
                scene.add_line_segments(f"{TOUR}/cameras", frusta, color, thickness=2.0, thickness_units="screen"),
                scene.add_line_segments(f"{TOUR}/way", way, color, thickness=1.5, thickness_units="screen"),
            )
        at, drawn, path = self._nodes
        at.visible = True
        drawn.points, path.points = frusta, way
        drawn.colors = path.colors = np.array(color, dtype=np.uint8)

    def _frusta(self, cameras: Sequence[ProposedCamera]) -> Float[np.ndarray, "m 2 3"]:
        places = [
            rigid_transform.from_position_wxyz(np.array(camera.position), np.array(camera.wxyz)) for camera in cameras
        ]
        corners = np.repeat(self._corners[None], len(places), axis=0)
        return rigid_transform.transform_points(np.stack(places), corners)[:, FRUSTUM_EDGES].reshape(-1, 2, 3)
