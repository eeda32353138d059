"""What tells whether a source image is still the one that an export was planned with."""

import hashlib
import os
import stat
from collections.abc import Callable

from ars_web.errors import BadFile
from ars_web.recordings.stores import is_address, split_address


def source_stamp(source: str) -> tuple[int, int]:
    """The size in bytes and the time of change in ns of an image that is to be exported.

    Sessions keep paths without links, so a link is what someone put in the image's place. Besides, a hard link to it
    would be a link, out of the dataset.

    Raises:
        BadFile: it is missing, or has become a link.
    """
    try:
        status = os.lstat(source)
    except OSError as error:
        raise BadFile(source, f"the image cannot be exported: {error.strerror}") from error
    if stat.S_ISLNK(status.st_mode):
        raise BadFile(source, "the image has become a link since it was imported; import the recording again")
    return status.st_size, status.st_mtime_ns


def stored_stamp(source: str) -> tuple[int, int]:
    """The size in bytes of an image on a store, and a number that changes when the image does.

    Raises:
        BadFile: it is missing, or cannot be looked at.
    """
    folder, name = split_address(source)
    try:
        return _stamp(*folder.detail(name))
    except OSError as error:
        raise BadFile(source, f"the image cannot be exported: {error.strerror or error}") from error


def stamps_now() -> Callable[[str], tuple[int, int]]:
    """What stamps sources of either kind as they are now; a store's folder is listed once, not asked for each image."""
    listed: dict[str, dict[str, tuple[int, str]]] = {}

    def stamp(source: str) -> tuple[int, int]:
        if not is_address(source):
            return source_stamp(source)
        folder, name = split_address(source)
        try:
            if folder.address not in listed:
                listed[folder.address] = folder.details()
        except OSError as error:
            raise BadFile(source, f"the image cannot be exported: {error.strerror or error}") from error
        if name not in listed[folder.address]:
            raise BadFile(source, "the image cannot be exported: there is no such file")
        return _stamp(*listed[folder.address][name])

    return stamp


def _stamp(size: int, version: str) -> tuple[int, int]:
    return size, int.from_bytes(hashlib.sha256(version.encode()).digest()[:7], "big")
