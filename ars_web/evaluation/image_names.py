"""Which image a name means: a path, a file name or a stem, with or without the folders that the truth has."""

from collections.abc import Sequence

from ars_web.errors import BadInput

ENDINGS = (".jpg", ".jpeg", ".png", ".bmp", ".tif", ".tiff", ".webp")
"""Of image files; another ending is a part of a stem."""

_SEVERAL = -1
_SHOWN = 3


class ImageNames:
    """The truth's images by whatever names them.

    A name means an image where one of the two is the end of the other, part by part: `val/0009.jpg`, `0009.jpg` and
    `0009` mean `images/val/0009.jpg`, and so does `/data/images/val/0009.jpg`; `train/0009.jpg` does not.
    """

    def __init__(self, names: Sequence[str]) -> None:
        self._names = names
        self._whole: dict[tuple[str, ...], int] = {}
        self._ends: dict[tuple[str, ...], int] = {}
        for place, name in enumerate(names):
            parts = _parts(name)
            bare = (*parts[:-1], stem_of(parts[-1]))
            for spelled in {parts, bare}:
                _put(self._whole, spelled, place)
                for first in range(len(spelled)):
                    _put(self._ends, spelled[first:], place)

    def place(self, name: str) -> int:
        """The image's place.

        Raises:
            BadInput: no image has that name, or several have.
        """
        parts = _parts(name)
        bare = (*parts[:-1], stem_of(parts[-1]))
        several = False
        for spelled in (parts, bare):
            found = self._ends.get(spelled)
            for first in range(1, len(spelled)):
                if found is not None:
                    break
                found = self._whole.get(spelled[first:])
            if found is not None and found != _SEVERAL:
                return found
            several = several or found == _SEVERAL
        if several:
            raise BadInput(f"image {name[:200]!r} may be any of several of the truth; name it with its folder")
        shown = ", ".join(self._names[:_SHOWN]) + (", …" if len(self._names) > _SHOWN else "")
        raise BadInput(
            f"image {name[:200]!r} is not among the truth's {len(self._names)} ({shown}); is it of another split? Give"
            " predictions of the images that are scored, or choose the images by --split"
        )


def stem_of(name: str) -> str:
    """A file name without an image's ending."""
    for ending in ENDINGS:
        if name.lower().endswith(ending) and len(name) > len(ending):
            return name[: -len(ending)]
    return name


def _parts(name: str) -> tuple[str, ...]:
    parts = tuple(part for part in name.replace("\\", "/").split("/") if part not in ("", "."))
    return parts or ("",)


def _put(where: dict[tuple[str, ...], int], key: tuple[str, ...], place: int) -> None:
    if where.setdefault(key, place) != place:
        where[key] = _SEVERAL
