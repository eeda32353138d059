"""What an annotation session holds. Everything here is immutable; `edits.py` says how one state becomes the next."""

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera


@dataclass(frozen=True)
class ObjectClass:
    """A kind of object. Its id never shifts and is never used again after the class is deleted.

    Attributes:
        id: from 0, in the order of creation.
        name: unique in its session, not empty.
        color: `#rrggbb`, lower case.
        revision: the session's revision that last changed it; its ETag.
        default_size: metres, of a new box of this class along its own axes; None: nobody has said.
    """

    id: int
    name: str
    color: str
    revision: int
    default_size: tuple[float, float, float] | None = None


@dataclass(frozen=True, eq=False)
class VirtualBox:
    """A box round one object.

    Attributes:
        id: from 1, in the order of creation, never used again.
        class_id: an existing class of the session.
        name: shown to people; not empty, need not be unique.
        box: its place and size.
        has_hull: whether a visual hull is stored with it.
        revision: the session's revision that last changed it; its ETag.
        locked: its class, place and size are not changed, nor is it deleted, until it is unlocked.
    """

    id: int
    class_id: int
    name: str
    box: Box
    has_hull: bool
    revision: int
    locked: bool = False


@dataclass(frozen=True, eq=False)
class FrameTable:
    """The session's frames, one column each; row i is frame index i.

    Attributes:
        names: relative image names with `/`, unique.
        images: absolute paths.
        camera_ids: (n,) keys into the session's cameras.
        Ts_world_camera: (n, 4, 4).
    """

    names: tuple[str, ...]
    images: tuple[Path, ...]
    camera_ids: np.ndarray
    Ts_world_camera: Float[np.ndarray, "n 4 4"]

    def __len__(self) -> int:
        return len(self.names)


@dataclass(frozen=True)
class SessionSummary:
    """What a list of sessions shows.

    Attributes:
        revision: 0 after import, one more with every edit.
        format: of the recording it was made from.
        source: where that recording was.
        created, changed: UTC.
    """

    id: str
    name: str
    revision: int
    format: str
    source: str
    frames: int
    classes: int
    boxes: int
    skipped: int
    created: datetime
    changed: datetime


@dataclass(frozen=True, eq=False)
class SessionState:
    """All of a session that edits can change, at one revision.

    Attributes:
        classes: by id, ascending.
        boxes: by id, ascending.
        next_class_id, next_box_id: what the next of each is called; never decreases, also not by undo.
    """

    revision: int
    name: str
    classes: dict[int, ObjectClass]
    boxes: dict[int, VirtualBox]
    next_class_id: int
    next_box_id: int


@dataclass(frozen=True, eq=False)
class SessionSnapshot:
    """One session, whole, at one revision: what exports and previews are computed from."""

    id: str
    state: SessionState
    cameras: dict[int, Camera]
    frames: FrameTable
