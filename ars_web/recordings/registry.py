"""The readers by format, and finding a recording's format by looking at what is there."""

from dataclasses import dataclass
from pathlib import Path

from ars_web.recordings.recording import Recording


@dataclass(frozen=True)
class ReadOptions:
    """What a caller may say about a recording that its files do not.

    Attributes:
        images: the image folder, where it is not the one the format implies.
        camera: a camera file (`w h fx fy cx cy k1 k2 p1 p2`), for formats without one of their own.
        within: images outside this folder are refused (None: anywhere). Doors that serve strangers set it.
    """

    images: Path | None = None
    camera: Path | None = None
    within: Path | None = None


def read_recording(path: Path, *, format: str = "auto", options: ReadOptions = ReadOptions()) -> Recording:  # noqa: A002
    """Read the recording at `path` (a file or a folder).

    Raises:
        BadInput: no reader knows it, or several do (the message names the candidates and what to do).
        BadFile: it is damaged; the message names file and line.
    """
    raise NotImplementedError
