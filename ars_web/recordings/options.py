"""What a caller may say about a recording that its files do not."""

import os
import re
from collections.abc import Callable
from dataclasses import dataclass, field
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
        progress: told (frames looked at, frames listed) while the images' headers are read; what it raises stops the
            reading.
    """

    images: Path | None = None
    camera: Path | None = None
    within: Path | None = None
    progress: Callable[[int, int], None] | None = field(default=None, compare=False)

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

    def told(self, text: str) -> str:
        """`text` for who knows only what lies within `within`: paths below it are told from there."""
        if self.within is None:
            return text
        # Only where the path begins and its last part ends: not /x/data in /mnt/x/data, nor in /x/data.old.
        within = rf"(?<![^\s('\"\[]){re.escape(str(self.within))}(?:{os.sep}|(?=$|[\s:,;)'\"\]]|\.(?:\s|$)))"
        return re.sub(within, lambda found: "" if found[0].endswith(os.sep) else "the folder", text)


def real(path: Path) -> Path:
    """`path` made absolute, links followed; links that run in a ring raise nothing, unlike in `Path.resolve`."""
    return Path(os.path.realpath(path))


NOTHING_SAID = ReadOptions()
"""The options of a caller who leaves all to the files."""
