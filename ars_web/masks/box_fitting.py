"""Boxes refined: moved, turned and resized until their labels agree with the object's masks, or with boxes given."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ars_web.errors import BadInput
from ars_web.geometry.box_fit import BoxFit, fit_box
from ars_web.geometry.box_parameters import Orientation
from ars_web.geometry.box_sighting import Sighting, sighting_of_region
from ars_web.geometry.mask_regions import region
from ars_web.masks.views import hull_of, photographs, views_of
from ars_web.sessions.drafting import box_at, existing_box
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.edits import BoxChange
from ars_web.sessions.hull_mesh import HullMesh
from ars_web.sessions.model import SessionState, VirtualBox
from ars_web.sessions.store import SessionStore

UPRIGHT = np.cos(np.radians(1.0))
"""A box with an axis nearer to the vertical than this stands upright."""

UNCERTAIN = 0.05
"""Of a box's diagonal, that its worst corner may be off if every side was seen to a pixel: more is warned of."""

NO_BOX = 0.025
"""Of the object's size in the images, that labels are off in the root mean square: the object does not fill a box."""


@dataclass(frozen=True, eq=False)
class FittedBox:
    """A box after it was fitted.

    Attributes:
        box: as it is now, or would be.
        frames: those it was fitted to, as `fit` has them in its rows.
        moved: metres, the most that a corner moved.
        warnings: what is doubtful and what to do about it, in words.
    """

    box: VirtualBox
    fit: BoxFit
    frames: tuple[int, ...]
    moved: float
    warnings: tuple[str, ...]


class BoxFitting:
    """Fits boxes, for any number of threads. Methods raise what those of `SessionEditor` do."""

    def __init__(self, store: SessionStore, editor: SessionEditor) -> None:
        self._store = store
        self._editor = editor

    def try_fit(
        self, sid: str, box_id: int, sightings: Sequence[Sighting] | None, *, orientation: Orientation | None
    ) -> FittedBox:
        """What a box would be if it was fitted; nothing is changed.

        Args:
            sightings: where the object is seen; None: in its accepted masks.
            orientation: None: upright where the box stands upright, else free.

        Raises:
            BadInput: they do not determine the box, or no box agrees with them.
        """
        state = self._store.state(sid)
        return self._fitted(sid, state, existing_box(state, box_id), sightings, orientation)

    def fit(
        self,
        sid: str,
        box_id: int,
        sightings: Sequence[Sighting] | None,
        *,
        orientation: Orientation | None,
        expected_revision: int,
        author: str,
        key: str | None = None,
        request: object = None,
    ) -> FittedBox:
        """Fit a box, in one edit. Its hull stays where it is in the world, and the box where it was fitted to when the
        masks change.

        A repeat with the same idempotency `key` and the same `request` (strings, numbers, lists and dicts of them) is
        worked out again from what the box was, and changes nothing.
        """
        asked = ["fit", box_id, expected_revision, request]
        state = self._store.state(sid)
        answered = None if key is None else self._editor.object_made(sid, request=asked, author=author, key=key)
        if answered is not None:
            before = self._before(sid, answered)
            return replace(self._fitted(sid, state, before, sightings, orientation), box=answered)
        before = box_at(state, box_id, expected_revision)
        fitted = self._fitted(sid, state, before, sightings, orientation)
        hull = None
        if before.hull is not None:
            in_place = hull_of(self._store, sid, before)
            hull = HullMesh.of(in_place.vertices, in_place.faces, fitted.box.box)
        stored = self._editor.put_object(
            sid,
            box_id=box_id,
            class_id=before.class_id,
            box=fitted.box.box,
            hull=hull,
            hull_options=None if before.hull_options is None else replace(before.hull_options, fitted=True),
            expected_revision=expected_revision,
            summary=f"Fit {before.name} to {len(fitted.frames)} frames",
            author=author,
            key=key,
            request=asked,
        )
        return replace(fitted, box=stored)

    def _fitted(
        self,
        sid: str,
        state: SessionState,
        box: VirtualBox,
        sightings: Sequence[Sighting] | None,
        orientation: Orientation | None,
    ) -> FittedBox:
        if sightings is None:
            sightings = self._of_masks(sid, state, box)
        if orientation is None:
            steepest = float(np.abs(box.box.T_world_box[2, :3]).max())
            orientation = "upright" if steepest >= UPRIGHT else "free"
        fit = fit_box(box.box, sightings, orientation=orientation)
        return FittedBox(
            replace(box, box=fit.box),
            fit,
            tuple(sighting.frame for sighting in sightings),
            float(np.linalg.norm(fit.box.corners_world - box.box.corners_world, axis=1).max()),
            tuple(_warnings(fit, sightings)),
        )

    def _of_masks(self, sid: str, state: SessionState, box: VirtualBox) -> list[Sighting]:
        masks = [(mask.frame, mask.polygons) for mask in state.masks_of(box.id) if mask.accepted]
        if not masks:
            raise BadInput(
                f"box {box.id} ({box.name!r}) has no masks to be fitted to; outline its object in two frames at least,"
                " or give the boxes round it"
            )
        return [
            sighting_of_region(view.frame, view.camera, view.T_world_camera, region(view.polygons))
            for view in views_of(photographs(self._store, sid), masks)
        ]

    def _before(self, sid: str, box: VirtualBox) -> VirtualBox:
        """What a box was before the edit that made it what it is."""
        (edit,) = self._store.edits(sid, after=box.revision - 1, limit=1)
        change = next(change for change in edit.changes if isinstance(change, BoxChange))
        assert change.before is not None, "it was fitted, not added"
        return change.before


def _warnings(fit: BoxFit, sightings: Sequence[Sighting]) -> list[str]:
    warnings: list[str] = []
    worst = np.abs(fit.residuals_px).max(axis=1)
    for row in np.flatnonzero(fit.outliers).tolist():
        others = float(np.median(np.delete(worst, row)))
        warnings.append(
            f"Frame {sightings[row].frame} is up to {worst[row]:.0f} px off where the others are {others:.1f} px off;"
            " look whether its mask is right, or leave it out."
        )
    diagonal = float(np.linalg.norm(fit.box.size))
    if fit.corner_error > UNCERTAIN * diagonal:
        warnings.append(
            f"The frames tell the corners only to {fit.corner_error * 1e3:.1f} mm for each pixel that an outline is"
            " off. Add a frame from another side."
        )
    size = float(np.median([np.sqrt(np.prod(sighting.size)) for sighting in sightings]))
    if fit.rms_px > NO_BOX * size and not fit.outliers.any():
        warnings.append(
            f"The object does not fill a box: the labels of the best one are {fit.rms_px:.0f} px off on the average. A"
            " box made from masks, exported by its hull, fits closer."
        )
    return warnings
