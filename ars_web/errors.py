"""The errors that ARS Web raises on purpose. There is no HTTP in here: `api/problems.py` maps them in one table.

ArsError                  the root; its message names the value, what is wrong with it and what to do
├── BadInput              a value, a file or a request that cannot be used as it is
│   ├── BadFile           the same, in a file: the message begins with `FILE:LINE:` or `FILE:`
│   ├── BadOption         an export option that cannot be as it is; `option` names it
│   └── ViewsDisagree     outlines in several views that no one object can have
├── NotFound              a session, a frame, a box, a class or an export that is not there
├── Conflict              the thing was changed meanwhile; `current` holds what it is now
├── Locked                the thing is kept as it is until someone unlocks it
├── RefusedPath           a path that leaves its root, or cannot be one
├── TooLarge              an upload, an archive or an image beyond its limit
├── Cancelled             work stopped because someone asked for it
└── StoreError            the sessions folder or a database cannot be used
"""

from pathlib import Path


class ArsError(Exception):
    """Root of the errors that are shown to a user as one clear line."""


class BadInput(ArsError):
    """A value that cannot be used; the message says which, why, and what would do."""


class BadFile(BadInput):
    """Something in a file cannot be used.

    Attributes:
        path: the file.
        line: its line, counted from 1; None where lines mean nothing (a binary file, a whole file).
    """

    def __init__(self, path: Path | str, message: str, *, line: int | None = None) -> None:
        where = f"{path}:{line}" if line is not None else f"{path}"
        super().__init__(f"{where}: {message}")
        self.path = Path(path)
        self.line = line
        self._message = message

    def __reduce__(self) -> tuple[object, ...]:
        # Exceptions are pickled with their args, which are not this one's: a pool's worker could not raise it.
        return _bad_file, (self.path, self._message, self.line)


def _bad_file(path: Path, message: str, line: int | None) -> BadFile:
    return BadFile(path, message, line=line)


class BadOption(BadInput):
    """An export option that cannot be as it is.

    Attributes:
        option: its name, such as `shape` or `split.train`.
    """

    def __init__(self, message: str, option: str) -> None:
        super().__init__(message)
        self.option = option

    def __reduce__(self) -> tuple[object, ...]:
        return BadOption, (str(self), self.option)


class ViewsDisagree(BadInput):
    """Outlines in several views that no one object can have, or that are too much alike to tell where it is.

    Attributes:
        misfits: (frame, pixels) of the views concerned, the worst first: by how much each outline would have to grow
            to meet the others; NaN where no growing helps, such as for an object behind a camera.
    """

    def __init__(self, message: str, misfits: tuple[tuple[int, float], ...]) -> None:
        super().__init__(message)
        self.misfits = misfits

    def __reduce__(self) -> tuple[object, ...]:
        return ViewsDisagree, (str(self), self.misfits)


class NotFound(ArsError):
    """A thing was named that is not there."""


class Conflict(ArsError):
    """The thing changed since the caller read it.

    Attributes:
        current: the thing as it is now, None where it is gone. What it is, the raiser's docstring says.
    """

    def __init__(self, message: str, *, current: object = None) -> None:
        super().__init__(message)
        self.current = current


class Locked(ArsError):
    """A thing that someone locked, so that it stays as it is; the message says what to unlock."""


class RefusedPath(ArsError):
    """A path that would leave its declared root."""


class TooLarge(ArsError):
    """Something beyond a stated limit; the message names the limit."""


class Cancelled(ArsError):
    """Work that stopped because it was asked to."""


class StoreError(ArsError):
    """The sessions folder or a session's database cannot be used; the message says how to mend it."""
