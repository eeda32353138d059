"""Relative paths that clients name, joined to roots that the server declared; where those lie is told to nobody."""

from collections.abc import Generator, Mapping
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

from ars_web.errors import BadFile, BadInput, NotFound, RefusedPath, TooLarge
from ars_web.recordings.options import ReadOptions


def declared_root(roots: Mapping[str, Path], name: str) -> Path:
    """The folder that was declared as `name` when the server started.

    Raises:
        BadInput: none was.
    """
    if name not in roots:
        known = ", ".join(roots) or "none; start the server with --root NAME=PATH"
        raise BadInput(f"root {name!r} was not declared; declared are: {known}")
    return roots[name]


@contextmanager
def told_within(options: ReadOptions) -> Generator[None]:
    """Errors raised in the block name their files as seen from `options.within`."""
    try:
        yield
    except BadFile as error:
        path = Path(options.told(str(error.path)))
        # Its message begins with where it is, and so does the new one's.
        where = f"{error.path}:{error.line}: " if error.line is not None else f"{error.path}: "
        raise BadFile(path, options.told(str(error).removeprefix(where)), line=error.line) from error
    except (BadInput, NotFound, RefusedPath, TooLarge) as error:
        raise type(error)(options.told(str(error))) from error


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
