"""Looking at a recording before it is imported; a few of its frames can be shown meanwhile. Nothing is stored."""

import secrets
import threading
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from ars_web.errors import BadInput, NotFound
from ars_web.geometry.camera import Camera
from ars_web.recordings.options import ReadOptions, real
from ars_web.recordings.overview import Overview, overview
from ars_web.recordings.recording import Recording
from ars_web.recordings.registry import detect_formats, read_recording
from ars_web.recordings.stored_images import local

REMEMBERED = 32
"""Looks whose frames can be shown; beyond that the oldest is forgotten."""


@dataclass(frozen=True, eq=False)
class Look:
    """A recording that was looked at.

    Attributes:
        id: its sample frames can be shown by it, for a while.
        formats_possible: that the path looks like.
        warnings: what a person should know before the import, in words.
    """

    id: str
    recording: Recording
    formats_possible: tuple[str, ...]
    overview: Overview
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class LookedImage:
    """A sample frame's image.

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
        self._images: OrderedDict[str, Mapping[int, LookedImage]] = OrderedDict()

    def look(self, path: Path, *, format: str = "auto", options: ReadOptions) -> Look:  # noqa: A002 - the contract's name
        """Look at the recording at `path`. Where several formats are possible and none is said, the first that can
        be read is taken, and a warning says so.

        Raises:
            BadInput, BadFile, RefusedPath: it cannot be imported (see `read_recording`).
        """
        options.allowed(path)
        possible = tuple(detect_formats(path))
        warnings: tuple[str, ...] = ()
        if format == "auto" and len(possible) > 1:
            recording = _first_readable(path, possible, options)
            others = " or ".join(one for one in possible if one != recording.format)
            warnings = (f"it was read as {recording.format}, and could also be {others}: say which it is",)
        else:
            recording = read_recording(path, format=format, options=options)
        seen = overview(recording)
        id_ = self._keep(recording, seen.sample_frames, within=options.within or path)
        return Look(id_, recording, possible, seen, warnings + seen.warnings)

    def image(self, id_: str, frame: int) -> LookedImage:
        """A sample frame's image.

        Raises:
            NotFound: the look is forgotten, or the frame is none of its samples.
        """
        with self._lock:
            images = self._images.get(id_)
        if images is None:
            raise NotFound(f"the look {id_[:40]!r} is forgotten; look at the recording again")
        if frame not in images:
            raise NotFound(f"frame {frame} is no sample of this look; samples are {', '.join(map(str, images))}")
        return images[frame]

    def _keep(self, recording: Recording, samples: tuple[int, ...], *, within: Path) -> str:
        id_ = f"l{secrets.token_hex(8)}"
        frames = {index: recording.frames[index] for index in samples}
        # The images as they are now: one that becomes a link later is not what was looked at.
        images = {
            index: LookedImage(real(local(frame.image)), recording.cameras[frame.camera_id], within)
            for index, frame in frames.items()
        }
        with self._lock:
            self._images[id_] = images
            while len(self._images) > REMEMBERED:
                self._images.popitem(last=False)
        return id_


def _first_readable(path: Path, formats: tuple[str, ...], options: ReadOptions) -> Recording:
    """The recording by the first of `formats` that can be read; raises what the first of them raises if none can."""
    first: BadInput | None = None
    for one in formats:
        try:
            return read_recording(path, format=one, options=options)
        except BadInput as error:
            first = first or error
    assert first is not None
    raise first
