"""An object's outlines joined with the cameras and poses of their frames, and the object that they give."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from ars_web.errors import BadInput, NotFound
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.hull_box import box_of_hull
from ars_web.geometry.polygon import Polygon
from ars_web.geometry.visual_hull import View, VisualHull, visual_hull
from ars_web.sessions.hull_mesh import HullMesh
from ars_web.sessions.model import FrameTable, HullOptions, VirtualBox
from ars_web.sessions.outlines import checked_polygons
from ars_web.sessions.store import SessionStore

Outlines = Sequence[tuple[int, Sequence[Polygon]]]
"""An object's outline by frame."""


class Photographed(Protocol):
    """What of a session never changes; a `SessionSnapshot` has it."""

    @property
    def cameras(self) -> Mapping[int, Camera]:
        """By id."""
        ...

    @property
    def frames(self) -> FrameTable:
        """All of them."""
        ...


@dataclass(frozen=True, eq=False)
class Photographs:
    """The same by itself."""

    cameras: Mapping[int, Camera]
    frames: FrameTable


def photographs(store: SessionStore, sid: str) -> Photographs:
    """Those of a session; they are read once."""
    return Photographs(store.cameras(sid), store.frames(sid))


def camera_of(taken: Photographed, frame: int) -> Camera:
    """The camera of a frame that a request names.

    Raises:
        BadInput: there is no such frame.
    """
    if not 0 <= frame < len(taken.frames):
        raise BadInput(f"there is no frame {frame}; the session's frames are 0 to {len(taken.frames) - 1}")
    return taken.cameras[int(taken.frames.camera_ids[frame])]


def views_of(taken: Photographed, outlines: Outlines) -> tuple[View, ...]:
    """Outlines with their frames' cameras and poses, each as a session would keep it.

    Raises:
        BadInput: a frame is not there or comes twice, or an outline cannot be kept; the message names the frame.
    """
    views: dict[int, View] = {}
    for frame, polygons in outlines:
        camera = camera_of(taken, frame)
        if frame in views:
            raise BadInput(f"frame {frame} is given twice; an object has one outline in a frame, of several polygons")
        try:
            kept = checked_polygons(polygons, width=camera.width, height=camera.height)
        except BadInput as error:
            raise BadInput(f"frame {frame}: {error}") from error
        views[frame] = View(frame, camera, taken.frames.Ts_world_camera[frame], kept)
    return tuple(views.values())


def object_of(views: Sequence[View], options: HullOptions, *, before: Box | None = None) -> tuple[Box, HullMesh]:
    """The box and the hull that outlines give; the box as it was `before` where it was fitted.

    Raises:
        ViewsDisagree: they are of no one object, or too few or too much alike to tell.
    """
    hull = visual_hull(views, widen=options.widen, ground=options.ground)
    kept = before if options.fitted else None
    box = kept or box_of_hull(hull, orientation=options.orientation, position=options.position)
    return box, HullMesh.of(hull.vertices, hull.faces, box)


def hull_of(store: SessionStore, sid: str, box: VirtualBox) -> VisualHull:
    """The hull that is stored with a box, where that is.

    Raises:
        NotFound: it has none.
    """
    if box.hull is None:
        raise NotFound(f"box {box.id} ({box.name!r}) has no hull: it was not made from masks")
    return VisualHull(*store.hull(sid, box.hull).in_world(box.box))
