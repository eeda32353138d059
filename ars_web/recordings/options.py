"""What a caller may say about a recording that its files do not."""

import os
from dataclasses import dataclass
from pathlib import Path

from ars_web.errors import RefusedPath


@dataclass(frozen=True)
class ReadOptions:
    """What a caller may say about a recording that its files do not.

    Attributes:
        images: the image folder, where it is not the one the format implies.
        camera: a camera file (`w h fx fy cx cy k1 k2 p1 p2`), for formats without one of their own.
        within: files and images outside this folder are refused, links followed (None: anywhere). Doors that serve
            strangers set it. `images` and `camera` are held to it too.
    """

    images: Path | None = None
    camera: Path | None = None
    within: Path | None = None

    def allowed(self, path: Path) -> Path:
        """`path` itself, where it may be read.

        Raises:
            RefusedPath: it lies outside `within` once its links are followed, or has a NUL in it.
        """
        if "\0" in str(path):
            raise RefusedPath(f"{str(path)!r} has a NUL in it and can be no path")
        if self.within is not None and not real(path).is_relative_to(real(self.within)):
            raise RefusedPath(f"{path} leads outside {self.within}, and nothing outside it is read")
        return path


def real(path: Path) -> Path:
    """`path` made absolute, links followed; links that run in a ring raise nothing, unlike in `Path.resolve`."""
    return Path(os.path.realpath(path))


NOTHING_SAID = ReadOptions()
"""The options of a caller who leaves all to the files."""
