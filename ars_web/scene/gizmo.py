"""The arrows and rings at the selected box of one view, by which it is moved and turned.

    gizmo = Gizmo(client, dragged)                 `dragged(phase, T_world_gizmo)`, on viser's event loop
    gizmo.show(T_world_gizmo, rings=…, only_z=…)
    gizmo.hide()                                   ends a drag

It only says where it was dragged to: it goes back to where it is put, and does not carry the box itself.
"""

from collections.abc import Callable
from typing import Literal

import viser

from ars_web.geometry import rigid_transform
from ars_web.geometry.rigid_transform import Transform
from ars_web.scene.poses import place

NODE = "/edit/gizmo"

PIXELS = 95.0
"""Of an arrow on the screen, however far away."""

Phase = Literal["start", "update", "end"]

Dragged = Callable[[Phase, Transform], None]


class Gizmo:
    """One view's gizmo, made when it is first shown. Its methods need the lock of the boxes."""

    def __init__(self, client: viser.ClientHandle, dragged: Dragged) -> None:
        self._client = client
        self._dragged = dragged
        self._controls: viser.TransformControlsHandle | None = None

    def show(self, T_world_gizmo: Transform, *, rings: bool, only_z: bool) -> None:
        """Put it there: rings to turn, else arrows and squares to move; `only_z`: the ring about its z axis alone."""
        with self._client.atomic():
            if self._controls is None:
                self._controls = self._make()
            controls = self._controls
            controls.disable_axes = controls.disable_sliders = rings
            controls.disable_rotations = not rings
            # A ring lies between two active axes, so these are the ones that leave the ring about z.
            controls.active_axes = (True, True, not (rings and only_z))
            place(controls, T_world_gizmo)
            controls.visible = True

    def hide(self) -> None:
        """Take it away."""
        if self._controls is not None:
            self._controls.visible = False

    def _make(self) -> viser.TransformControlsHandle:
        controls = self._client.scene.add_transform_controls(
            NODE, scale=PIXELS, fixed=True, line_width=3.0, depth_test=False, visible=False
        )

        async def updated(event: viser.TransformControlsEvent) -> None:
            # The browser's quaternion is of unit length but for rounding.
            T = rigid_transform.from_position_wxyz(event.target.position, event.target.wxyz)
            self._dragged(event.phase, T)

        controls.on_update(updated)
        return controls
