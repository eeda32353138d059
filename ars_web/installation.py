"""What is wrong with an install or a sessions folder, and how to mend it."""

import importlib
import shutil
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from packaging.requirements import Requirement

import ars_web
from ars_web.errors import StoreError

OLDEST_PYTHON = (3, 11)

LEAST_FREE_BYTES = 2**30
"""Below this an import with copies or an export is likely to fill the disk."""

LOADED = ("cv2", "numba", "orjson", "scipy", "shapely", "sqlalchemy", "uvicorn")
"""Modules whose binary parts can be missing or broken although the package is there."""


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at.

    Attributes:
        found: what it is, in words.
        remedy: what to do where it is not ok.
    """

    subject: str
    ok: bool
    found: str
    remedy: str = ""


def findings(sessions: Path) -> list[Finding]:
    """All that is looked at, in an order in which a person would mend it."""
    return [*_program(), *_dependencies(), *_page(), *_sessions_folder(sessions)]


def _program() -> Iterator[Finding]:
    version = ".".join(map(str, sys.version_info[:3]))
    wanted = ".".join(map(str, OLDEST_PYTHON))
    yield Finding("ars-web", True, f"{ars_web.__version__} in {Path(ars_web.__file__).parent}")
    yield Finding(
        "python",
        sys.version_info >= OLDEST_PYTHON,
        f"{version} in {sys.prefix}",
        f"ARS Web needs Python {wanted} or later: install it with that one",
    )


def _dependencies() -> Iterator[Finding]:
    try:
        lines = metadata.requires("ars-web") or []
    except metadata.PackageNotFoundError:
        yield Finding("dependencies", True, "not looked at: ars-web is run from its checkout without being installed")
        return
    wanted = [r for r in map(Requirement, lines) if r.marker is None or r.marker.evaluate({"extra": ""})]
    wrong = [line for line in map(_unmet, wanted) if line]
    yield Finding(
        "dependencies",
        not wrong,
        "; ".join(wrong) or f"all {len(wanted)} as asked for",
        "install ars-web again: `pip install --upgrade ars-web`, or `make demo` in a checkout",
    )
    broken: list[str] = []
    for name in LOADED:
        try:
            importlib.import_module(name)
        except (ImportError, OSError) as error:
            broken.append(f"{name}: {error}")
    yield Finding(
        "binary modules",
        not broken,
        "; ".join(broken) or f"{', '.join(LOADED)} load",
        "install the library that is named, or the package again with `pip install --force-reinstall`",
    )


def _unmet(wanted: Requirement) -> str | None:
    """What is wrong with a dependency; None where nothing is."""
    try:
        version = metadata.version(wanted.name)
    except metadata.PackageNotFoundError:
        return f"{wanted.name} is missing"
    if not wanted.specifier.contains(version, prereleases=True):
        return f"{wanted.name} is {version}, needed is {wanted.specifier}"
    return None


def _page() -> Iterator[Finding]:
    from ars_web.app import static_folder

    try:
        yield Finding("page", True, str(static_folder()))
    except StoreError as error:
        yield Finding("page", False, str(error), "install ars-web again")


def _sessions_folder(sessions: Path) -> Iterator[Finding]:
    from ars_web.sessions.store import SessionStore

    folder = sessions.resolve()
    at = next(parent for parent in (folder, *folder.parents) if parent.exists())
    try:
        with tempfile.TemporaryFile(dir=at):
            pass
    except OSError as error:
        remedy = "make it writable for you, or name another folder with --sessions or ARS_WEB_SESSIONS"
        yield Finding("sessions folder", False, f"{at} cannot be written: {error.strerror}", remedy)
        return
    yield Finding("sessions folder", True, f"{folder}" + ("" if at == folder else ", to be made"))
    free = shutil.disk_usage(at).free
    yield Finding(
        "disk space",
        free >= LEAST_FREE_BYTES,
        f"{free / 2**30:.1f} GiB free",
        "make room, or name a folder on a larger disk with --sessions",
    )
    if not folder.is_dir():
        return
    try:
        with SessionStore(folder) as store:
            count, problems = len(store.list()), store.check()
    except StoreError as error:
        yield Finding("sessions", False, str(error), "see the message")
        return
    if not problems:
        yield Finding("sessions", True, f"{count}, all sound")
    for problem in problems:
        yield Finding("sessions", False, problem, "see the message")
