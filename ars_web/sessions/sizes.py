"""The usual sizes of classes."""

from collections.abc import Iterable

from ars_web.geometry.box import checked_size


def checked_class_size(size: Iterable[float]) -> tuple[float, float, float]:
    """A class's usual size, metres.

    Raises:
        BadInput: it could not be the size of a box.
    """
    x, y, z = checked_size(list(size)).tolist()
    return x, y, z
