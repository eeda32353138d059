"""The frames in which an error of a box would show most, with where to look in each; what was found is kept."""

import threading
from dataclasses import dataclass

from cachetools import LRUCache, cached

from ars_web.api.crops import Crop, crop_round
from ars_web.datasets.samples import labels_in_frames
from ars_web.geometry.box import Box
from ars_web.geometry.box_sensitivity import telling_frames
from ars_web.sessions.store import SessionStore

KEPT = 1000
"""Boxes whose frames are kept. A drag leaves one, and undoing it needs that before."""


@dataclass(frozen=True)
class TellingView:
    """A frame that shows errors of a box.

    Attributes:
        px_per_mm: how far a corner that is off is drawn from where it should be, at most.
        crop: the part of the image with the box in it.
    """

    frame: int
    px_per_mm: float
    crop: Crop


class TellingViews:
    """Finds the frames that tell most of a box. A recording's frames never change, so the answer to one box is kept."""

    def __init__(self, store: SessionStore) -> None:
        self._store = store
        kept: LRUCache[tuple[str, bytes, bytes, int], list[TellingView]] = LRUCache(KEPT)
        self._kept = cached(kept, key=_key, condition=threading.Condition())(self._found)

    def find(self, sid: str, box: Box, *, count: int) -> list[TellingView]:
        """At most `count` frames, in the recording's order; fewer where fewer show the box.

        Raises:
            NotFound: there is no such session.
        """
        return self._kept(sid, box, count)

    def _found(self, sid: str, box: Box, count: int) -> list[TellingView]:
        cameras, frames = self._store.cameras(sid), self._store.frames(sid)
        chosen = telling_frames(cameras, frames.camera_ids, frames.Ts_world_camera, box, count=count)
        chosen.sort(key=lambda one: one.frame)
        rows = [one.frame for one in chosen]
        camera_ids = frames.camera_ids[rows]
        labels = labels_in_frames(cameras, camera_ids, frames.Ts_world_camera[rows], [box], with_visible=False)
        views: list[TellingView] = []
        for one, camera_id, bbox in zip(chosen, camera_ids.tolist(), labels.bbox[:, 0].tolist(), strict=True):
            camera = cameras[camera_id]
            crop = crop_round(tuple(bbox), width=camera.width, height=camera.height)
            views.append(TellingView(one.frame, one.px_per_metre / 1000, crop))
        return views


def _key(sid: str, box: Box, count: int) -> tuple[str, bytes, bytes, int]:
    return sid, box.T_world_box.tobytes(), box.size.tobytes(), count
