"""The six handles on the faces of one view's selected box, by which it is resized.

    handles = FaceHandles(client, dragged)         `dragged(Pull)`, on viser's event loop
    handles.show(box); handles.hide()              hiding ends a drag

They are balls of BALL metres here. The bridge in the page makes them as large on the screen as a finger needs, and
draws a dot for each over everything.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import viser
from jaxtyping import Float

from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.scene.gizmo import Phase
from ars_web.scene.poses import place

NODE = "/edit/handle"
"""Before each handle's name, such as `/edit/handle/x+`; the bridge knows them by it."""

BALL = 0.01
"""Radius in metres; the bridge's scale starts from it."""

FACES: tuple[tuple[int, int, str], ...] = tuple(
    (axis, side, f"{'xyz'[axis]}{'-+'[side > 0]}") for axis in range(3) for side in (1, -1)
)
"""Axis, side and name of each."""


@dataclass(frozen=True, eq=False)
class Pull:
    """A handle is being dragged.

    Attributes:
        axis, side: its face.
        eye, pointer: (3,) in the world; the pointer is on the ray from the one to the other.
    """

    phase: Phase
    axis: int
    side: int
    eye: Float[np.ndarray, "3"]
    pointer: Float[np.ndarray, "3"]


class FaceHandles:
    """One view's handles, made when they are first shown. Its methods need the lock of the boxes."""

    def __init__(self, client: viser.ClientHandle, dragged: Callable[[Pull], None]) -> None:
        self._client = client
        self._dragged = dragged
        self._balls: dict[tuple[int, int], viser.IcosphereHandle] = {}

    def show(self, box: Box) -> None:
        """Put one on each face of the box."""
        with self._client.atomic():
            for axis, side, name in FACES:
                ball = self._balls.get((axis, side))
                if ball is None:
                    ball = self._balls[axis, side] = self._make(axis, side, name)
                face = box.T_world_box[:3, 3] + box.T_world_box[:3, axis] * (side * box.size[axis] / 2)
                place(ball, rigid_transform.from_rotation(np.eye(3), face))
                ball.visible = True

    def hide(self) -> None:
        """Take them away."""
        for ball in self._balls.values():
            ball.visible = False

    def _make(self, axis: int, side: int, name: str) -> viser.IcosphereHandle:
        ball = self._client.scene.add_icosphere(
            f"{NODE}/{name}", radius=BALL, color=(13, 17, 23), cast_shadow=False, receive_shadow=False, visible=False
        )

        async def pulled(event: viser.SceneNodeDragEvent[viser.IcosphereHandle]) -> None:
            eye = np.array(event.client.camera.position, dtype=np.float64)
            self._dragged(Pull(event.phase, axis, side, eye, np.array(event.end_position)))

        ball.on_drag("left")(pulled)
        return ball
