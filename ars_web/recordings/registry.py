"""The readers by format, and finding a recording's format by looking at what is there."""

from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from ars_web.errors import BadFile, BadInput
from ars_web.recordings import ars, bop, colmap, nerfstudio, poses, roars, tum
from ars_web.recordings.options import NOTHING_SAID, ReadOptions
from ars_web.recordings.recording import Recording

__all__ = ["READERS", "ReadOptions", "Reader", "detect_formats", "read_recording"]


@dataclass(frozen=True)
class Reader:
    """One format.

    Attributes:
        format: its key.
        title: what it is called.
        needs: which files it needs.
        recognises: whether a path that exists looks like it; damage is for `read` to find.
        read: reads it, whole and sound, or raises.
    """

    format: str
    title: str
    needs: str
    recognises: Callable[[Path], bool]
    read: Callable[[Path, ReadOptions], Recording]


READERS: dict[str, Reader] = {
    "ars": Reader("ars", ars.TITLE, ars.NEEDS, ars.recognises, ars.read),
    "roars": Reader("roars", roars.TITLE, roars.NEEDS, roars.recognises, roars.read),
    "tum": Reader("tum", tum.TITLE, tum.NEEDS, tum.recognises, tum.read),
    "colmap": Reader("colmap", colmap.TITLE, colmap.NEEDS, colmap.recognises, colmap.read),
    "nerfstudio": Reader("nerfstudio", nerfstudio.TITLE, nerfstudio.NEEDS, nerfstudio.recognises, nerfstudio.read),
    "bop": Reader("bop", bop.TITLE, bop.NEEDS, bop.recognises, bop.read),
    "poses": Reader("poses", poses.TITLE, poses.NEEDS, poses.recognises, poses.read),
}


def detect_formats(path: Path) -> list[str]:
    """The formats that the file or folder at `path` looks like; none, one or several.

    Raises:
        BadFile: the file system does not let it be looked at.
    """
    with _file_system_errors(path):
        return [key for key, reader in READERS.items() if reader.recognises(path)]


def read_recording(path: Path, *, format: str = "auto", options: ReadOptions = NOTHING_SAID) -> Recording:  # noqa: A002 - the contract's name
    """Read the recording at `path` (a file or a folder).

    Raises:
        BadInput: no reader knows it, or several do (the message names the candidates and what to do).
        BadFile: it is damaged; the message names file and line.
        RefusedPath: something of it lies outside `options.within`.
    """
    if format != "auto" and format not in READERS:
        raise BadInput(f"format {format!r} is unknown; known are auto, {', '.join(READERS)}")
    options.allowed(path)
    with _file_system_errors(path):
        if not path.exists():
            raise BadFile(path, "is missing")
        return READERS[_only_format(path) if format == "auto" else format].read(path, options)


@contextmanager
def _file_system_errors(path: Path) -> Generator[None]:
    """Whatever the file system refuses (permission, a name too long, a disk that fails) as the BadFile it is."""
    try:
        yield
    except OSError as error:
        raise BadFile(error.filename or path, f"cannot be read: {error.strerror}") from error


def _only_format(path: Path) -> str:
    found = detect_formats(path)
    if not found:
        known = "; ".join(f"{key}: {reader.title}, {reader.needs}" for key, reader in READERS.items())
        raise BadInput(f"{path} is no recording that is known. Known are: {known}")
    if len(found) > 1:
        raise BadInput(
            f"{path} could be {' or '.join(found)}; say which with the format ({', '.join(found)}), or give the"
            " recording's own file or folder instead"
        )
    return found[0]
