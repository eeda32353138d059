"""What an annotation session holds. Everything here is immutable; `edits.py` says how one state becomes the next."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float

from ars_web.errors import BadInput
from ars_web.geometry.box import FARTHEST, Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.keypoints import DEFAULT_KEYPOINTS, Keypoint
from ars_web.geometry.polygon import Polygon
from ars_web.geometry.symmetry import NO_SYMMETRY, Symmetry
from ars_web.recordings.recording import StoredImage
from ars_web.sessions.hull_mesh import HullMesh
from ars_web.sessions.object_mesh import ObjectMesh

Orientation = Literal["world", "upright", "free"]
Position = Literal["box", "mass"]
Origin = Literal["drawn", "smart", "proposed"]

ORIENTATIONS: tuple[Orientation, ...] = ("world", "upright", "free")
POSITIONS: tuple[Position, ...] = ("box", "mass")
ORIGINS: tuple[Origin, ...] = ("drawn", "smart", "proposed")

WIDEST = 100.0
"""Pixels that masks may be widened by."""


def checked_origin(origin: str) -> Origin:
    """Who made an outline.

    Raises:
        BadInput: it is none of ORIGINS.
    """
    for known in ORIGINS:
        if origin == known:
            return known
    raise BadInput(f"a mask's origin must be one of {', '.join(ORIGINS)}, not {origin!r}")


@dataclass(frozen=True)
class ObjectClass:
    """A kind of object. Its id never shifts and is never used again after the class is deleted.

    Attributes:
        id: from 0, in the order of creation.
        name: unique in its session, not empty.
        color: `#rrggbb`, lower case.
        revision: the session's revision that last changed it; its ETag.
        default_size: metres, of a new box of this class along its own axes; None: nobody has said.
        mesh: the digest of the stored mesh of its objects; None: it has none.
        symmetry: of its objects, in their boxes' frames.
        keypoints: the named points of its objects; none: the box's centre and corners (`DEFAULT_KEYPOINTS`).
    """

    id: int
    name: str
    color: str
    revision: int
    default_size: tuple[float, float, float] | None = None
    mesh: str | None = None
    symmetry: Symmetry = NO_SYMMETRY
    keypoints: tuple[Keypoint, ...] = ()


@dataclass(frozen=True)
class HullOptions:
    """How a box was made from its object's masks, so that it can be made again when they change.

    Attributes:
        orientation: of the box's axes: the world's, upright (turned about the world's z), or free.
        position: what the box's centre is: its own, or the hull's centre of mass.
        widen: pixels that every mask is widened by, for poses that are a little off.
        ground: z in the world, metres, of a support plane under the object; None: there is none.
        fitted: whether the box was fitted to what is seen of the object since: it then stays as it is, and the hull
            alone follows the masks.
    """

    orientation: Orientation = "world"
    position: Position = "box"
    widen: float = 0.0
    ground: float | None = None
    fitted: bool = False

    def __post_init__(self) -> None:
        """Raises BadInput for what none of them can be."""
        if self.orientation not in ORIENTATIONS:
            raise BadInput(f"a box's orientation must be one of {', '.join(ORIENTATIONS)}, not {self.orientation!r}")
        if self.position not in POSITIONS:
            raise BadInput(f"a box's position must be one of {', '.join(POSITIONS)}, not {self.position!r}")
        if not 0.0 <= self.widen <= WIDEST:
            raise BadInput(f"masks can be widened by 0 to {WIDEST:g} pixels, not {self.widen}")
        if self.ground is not None and not abs(self.ground) <= FARTHEST:
            raise BadInput(f"a support plane must be within {FARTHEST:g} m of z = 0, not at {self.ground}")


@dataclass(frozen=True, eq=False)
class Mask:
    """The outline of one object in one frame; an object has at most one in each.

    Attributes:
        id: from 1, in the order of creation, never used again.
        box_id: the object's box, or the id that is kept for it while there is none yet.
        frame: index.
        class_id: an existing class of the session; the box's, where there is one.
        polygons: at least one; what is inside is told by the even-odd rule over all their rings together. Image
            coordinates of the original image, in whole thousandths of a pixel.
        origin: drawn by hand, by the smart tool, or proposed by the program.
        accepted: whether it counts for the hull; one that does not waits for a yes or a no.
        revision: the session's revision that last changed it; its ETag.
    """

    id: int
    box_id: int
    frame: int
    class_id: int
    polygons: tuple[Polygon, ...]
    origin: Origin
    accepted: bool
    revision: int


@dataclass(frozen=True, eq=False)
class VirtualBox:
    """A box round one object.

    Attributes:
        id: from 1, in the order of creation, never used again.
        class_id: an existing class of the session.
        name: shown to people; not empty, need not be unique.
        box: its place and size.
        revision: the session's revision that last changed it; its ETag.
        locked: its class, place, size, hull, mesh and masks are not changed, nor is it deleted, until it is unlocked.
        hull: the digest of the hull that is stored with it, in units of its sizes; None: it has none.
        hull_options: how box and hull were made from the masks; None: they were not.
        mesh: the digest of the object's own stored mesh, which counts before that of its class; None: it has none.
    """

    id: int
    class_id: int
    name: str
    box: Box
    revision: int
    locked: bool = False
    hull: str | None = None
    hull_options: HullOptions | None = None
    mesh: str | None = None

    @property
    def has_hull(self) -> bool:
        """Whether a visual hull is stored with it."""
        return self.hull is not None

    @property
    def has_mesh(self) -> bool:
        """Whether a mesh of its own, not its class's, is stored with it."""
        return self.mesh is not None


@dataclass(frozen=True, eq=False)
class FrameTable:
    """The session's frames, one column each; row i is frame index i.

    Attributes:
        names: relative image names with `/`, unique.
        images: absolute paths, or addresses on a store.
        camera_ids: (n,) keys into the session's cameras.
        Ts_world_camera: (n, 4, 4).
    """

    names: tuple[str, ...]
    images: tuple[Path | StoredImage, ...]
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
        next_class_id, next_box_id, next_mask_id: what the next of each is called; never decreases, also not by undo.
        masks: by id, ascending.
    """

    revision: int
    name: str
    classes: dict[int, ObjectClass]
    boxes: dict[int, VirtualBox]
    next_class_id: int
    next_box_id: int
    masks: dict[int, Mask] = field(default_factory=dict[int, Mask])
    next_mask_id: int = 1

    def masks_of(self, box_id: int) -> tuple[Mask, ...]:
        """The masks of one object, by frame."""
        found = (mask for mask in self.masks.values() if mask.box_id == box_id)
        return tuple(sorted(found, key=lambda mask: mask.frame))

    def mesh_of(self, box: VirtualBox) -> str | None:
        """The digest of the mesh that a box's object has: the box's own, else its class's; None: neither has one."""
        return box.mesh or self.classes[box.class_id].mesh

    def keypoints_of(self, class_id: int) -> tuple[Keypoint, ...]:
        """The named points of a class's objects: its own, else the centre and the corners of their boxes."""
        return self.classes[class_id].keypoints or DEFAULT_KEYPOINTS

    @property
    def meshes_named(self) -> frozenset[str]:
        """The digests of the meshes that classes and boxes have."""
        named = {thing.mesh for thing in (*self.classes.values(), *self.boxes.values())}
        return frozenset(digest for digest in named if digest is not None)


@dataclass(frozen=True, eq=False)
class SessionSnapshot:
    """One session, whole, at one revision: what exports and previews are computed from.

    Attributes:
        hulls: those of its boxes, by digest.
        meshes: those of its classes and boxes, by digest.
    """

    id: str
    state: SessionState
    cameras: dict[int, Camera]
    frames: FrameTable
    hulls: Mapping[str, HullMesh] = field(default_factory=dict[str, HullMesh])
    meshes: Mapping[str, ObjectMesh] = field(default_factory=dict[str, ObjectMesh])
