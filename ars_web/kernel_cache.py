"""Where numba keeps what it compiled. It refuses to load code that it can keep nowhere, so a place is found first."""

import atexit
import os
import shutil
import tempfile
from collections.abc import MutableMapping
from pathlib import Path

VARIABLE = "NUMBA_CACHE_DIR"


def find_place(environment: MutableMapping[str, str], *, package: Path) -> None:
    """Leave `NUMBA_CACHE_DIR` as it is where it, or numba's own choice for `package`, can be written; else set it.

    numba's own choice is beside the code, else in the user's cache folder. An install that belongs to someone else,
    used by someone without a home (a container run with `--user`), has neither. Then it is a folder for this process
    and its workers alone, not a shared one: what lies there is unpickled, so nobody else may put anything there. It
    begins with what `NUMBA_CACHE_DIR` holds already.
    """
    home = Path(environment.get("XDG_CACHE_HOME") or Path(environment.get("HOME", "/")) / ".cache")
    given = environment.get(VARIABLE)
    if any(_can_hold_files(place) for place in (*([Path(given)] if given else []), package, home)):
        return
    place = tempfile.mkdtemp(prefix="ars-web-")
    atexit.register(shutil.rmtree, place, ignore_errors=True)
    if given and Path(given).is_dir():
        shutil.copytree(given, place, dirs_exist_ok=True)
    environment[VARIABLE] = place


def _can_hold_files(folder: Path) -> bool:
    """Whether files can be written in a folder, which may have to be made first."""
    at = folder
    while not at.exists() and at != at.parent:
        at = at.parent
    return at.is_dir() and os.access(at, os.W_OK | os.X_OK)
