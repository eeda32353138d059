"""Recordings as they were looked at before an import: a few of their frames can be shown meanwhile."""

import secrets
import threading
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from ars_web.errors import NotFound
from ars_web.geometry.camera import Camera

REMEMBERED = 32
"""Looks whose frames can be shown; beyond that the oldest is forgotten."""


@dataclass(frozen=True)
class LookedImage:
    """An image of a recording that was looked at.

    Attributes:
        within: the folder that it must not lead out of.
    """

    path: Path
    camera: Camera
    within: Path


class ImportLooks:
    """The sample frames of the recordings that were looked at last."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._looks: OrderedDict[str, Mapping[int, LookedImage]] = OrderedDict()

    def keep(self, images: Mapping[int, LookedImage]) -> str:
        """Remember a recording's sample images by frame; the look's id."""
        id_ = f"l{secrets.token_hex(8)}"
        with self._lock:
            self._looks[id_] = dict(images)
            while len(self._looks) > REMEMBERED:
                self._looks.popitem(last=False)
        return id_

    def image(self, id_: str, frame: int) -> LookedImage:
        """A sample image.

        Raises:
            NotFound: the look is forgotten, or the frame is none of its samples.
        """
        with self._lock:
            images = self._looks.get(id_)
        if images is None:
            raise NotFound(f"the look {id_[:40]!r} is forgotten; look at the recording again")
        if frame not in images:
            raise NotFound(f"frame {frame} is no sample of this look; samples are {', '.join(map(str, images))}")
        return images[frame]
