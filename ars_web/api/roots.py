"""Relative paths that clients name, joined to roots that the server declared."""

from pathlib import Path, PurePosixPath

from ars_web.errors import NotFound, RefusedPath


def safe_join(root: Path, relative: str) -> Path:
    """The existing file or folder at `relative` (with `/`) below `root`, links resolved.

    Raises:
        RefusedPath: `relative` is absolute, climbs with `..`, holds a NUL or a backslash, or follows a link
            that leaves `root`.
        NotFound: nothing is there.
    """
    shown = relative[:200]
    if "\0" in relative:
        raise RefusedPath("the path holds a NUL character")
    if "\\" in relative:
        raise RefusedPath(f"the path {shown!r} holds a backslash; separate folders with /")
    parts = PurePosixPath(relative)
    if parts.is_absolute():
        raise RefusedPath(f"the path {shown!r} is absolute; give it relative to its root")
    if ".." in parts.parts:
        raise RefusedPath(f"the path {shown!r} climbs with ..; give it relative to its root")
    try:
        base = root.resolve(strict=True)
        target = (base / parts).resolve(strict=True)
    except (OSError, RuntimeError) as error:  # missing, unreadable, too long, or a loop of links
        raise NotFound(f"there is nothing at {shown!r} below its root") from error
    if not target.is_relative_to(base):
        raise RefusedPath(f"the path {shown!r} follows a link that leaves its root")
    return target
