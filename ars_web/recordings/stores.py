"""Object stores and what else fsspec reaches: a folder of one, by its address `s3://BUCKET/PREFIX`.

Credentials are never part of an address: they come from where each store's own library looks for them. Whatever goes
wrong in a store comes out as an OSError with the address for its file name, as on a disk.
"""

import errno
import importlib
import re
import sys
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

from ars_web.errors import BadInput

AT_ONCE = 128
"""Files that are on their way at a time."""

_SCHEME = re.compile(r"([A-Za-z][A-Za-z0-9+.-]*)://")

_REFUSED = {
    "http": "has no folders that can be listed or written to",
    "https": "has no folders that can be listed or written to",
}

_VERSIONS = ("ETag", "etag", "md5Hash", "content_md5", "mtime", "LastModified", "last_modified", "created")
"""What file systems call that which changes with a file, the surest first."""

# What these libraries raise is no OSError. Only those that are loaded can have raised something.
_FOREIGN = (
    ("botocore.exceptions", "BotoCoreError"),
    ("botocore.exceptions", "ClientError"),
    ("aiohttp", "ClientError"),
    ("gcsfs.retry", "HttpError"),
    ("azure.core.exceptions", "AzureError"),
)


def is_address(text: str) -> bool:
    """Whether `text` is an address, not a path."""
    return _SCHEME.match(text) is not None


def is_this_process_only(address: str) -> bool:
    """Whether what lies there is seen by this process alone (`memory://`)."""
    return address.startswith("memory://")


def place(text: str) -> "Path | StoreFolder":
    """What a user names: a folder of this machine, as a path or as `file://`, or one of a store.

    Raises:
        BadInput: an address that cannot be used.
    """
    scheme = _SCHEME.match(text)
    if scheme is None:
        return Path(text)
    if scheme[1].lower() == "file":
        parts = urlsplit(text)
        if parts.netloc not in ("", "localhost") or not parts.path:
            raise BadInput(f"{text} is no folder of this machine; a file address is file:///FOLDER")
        return Path(unquote(parts.path))
    return store_folder(text)


def store_folder(address: str) -> "StoreFolder":
    """The folder of a store at an address.

    Raises:
        BadInput: it cannot be used, holds a secret, or the package for it is not installed.
    """
    scheme = _SCHEME.match(address)
    if scheme is None:
        raise BadInput(f"{address!r} is no address of a store, such as s3://bucket/folder")
    name, rest = scheme[1].lower(), address[scheme.end() :].rstrip("/")
    user, at, _ = rest.partition("/")[0].rpartition("@")
    if (at and ":" in user) or "?" in rest:
        # Not shown: it would be in logs.
        raise BadInput(
            f"an address {name}://... holds a password or a query; leave them out, and give credentials where the"
            " store's own library looks for them (for s3: AWS's environment variables or ~/.aws)"
        )
    if "::" in rest or name in _REFUSED or not rest.isprintable():
        why = _REFUSED.get(name, "is an address within an address, or has characters that cannot be printed")
        raise BadInput(f"{address!r} cannot be used: it {why}; give s3://bucket/folder, or a folder of this machine")
    if not rest:
        raise BadInput(f"{address} names no bucket and no folder")
    try:
        fsspec = importlib.import_module("fsspec")
        fsspec.get_filesystem_class(name)
    except ImportError as error:
        raise BadInput(
            f"{address} needs a package that is not installed ({error}): install the extra `cluster`"
            " (pip install 'ars-web[cluster]'), and for stores other than s3 what fsspec names"
        ) from error
    except ValueError as error:
        raise BadInput(f"{address} cannot be used: {error}") from error
    return StoreFolder(f"{name}://{rest}")


@dataclass(frozen=True)
class StoreFolder:
    """A folder of a store. Names in it are relative, with `/`; folders come and go with what is in them.

    Attributes:
        address: without a slash at the end.
    """

    address: str

    def __str__(self) -> str:
        return self.address

    def below(self, name: str) -> "StoreFolder":
        """A folder in it."""
        return StoreFolder(f"{self.address}/{name}")

    def read(self, name: str) -> bytes:
        """A file's bytes; FileNotFoundError."""
        with _as_os_errors(f"{self.address}/{name}"):
            return self._system.cat_file(self._key(name))

    def write(self, name: str, content: bytes) -> None:
        """Make a file of these bytes, whole or not at all."""
        with _as_os_errors(f"{self.address}/{name}"):
            self._system.pipe_file(self._key(name), content)

    def has(self, name: str) -> bool:
        """Whether there is such a file."""
        with _as_os_errors(f"{self.address}/{name}"):
            self._system.invalidate_cache()
            return self._system.isfile(self._key(name))

    def detail(self, name: str) -> tuple[int, str]:
        """A file's size in bytes, and what changes when it does; FileNotFoundError."""
        with _as_os_errors(f"{self.address}/{name}"):
            self._system.invalidate_cache()
            return _told(self._system.info(self._key(name)))

    def names(self) -> list[str]:
        """All files in it, at any depth, in order."""
        return sorted(self.details())

    def details(self) -> dict[str, tuple[int, str]]:
        """By name: size in bytes, and what changes when the file does (its ETag, else its time)."""
        try:
            with _as_os_errors(self.address):
                self._system.invalidate_cache()
                found: dict[str, Any] = self._system.find(self._root, detail=True)
        except FileNotFoundError:
            return {}
        return {key[len(self._root) + 1 :]: _told(info) for key, info in found.items() if key != self._root}

    def upload(self, files: Sequence[tuple[Path, str]]) -> None:
        """Copy files of this machine to these names."""
        for start in range(0, len(files), AT_ONCE):
            some = files[start : start + AT_ONCE]
            with _as_os_errors(self.address):
                self._system.put([str(path) for path, _ in some], [self._key(name) for _, name in some])

    def download(self, names: Sequence[str], folder: Path) -> None:
        """Copy files to their names below a folder of this machine."""
        for start in range(0, len(names), AT_ONCE):
            some = names[start : start + AT_ONCE]
            for parent in {(folder / name).parent for name in some}:
                parent.mkdir(parents=True, exist_ok=True)
            with _as_os_errors(self.address):
                self._system.get([self._key(name) for name in some], [str(folder / name) for name in some])

    def ranges(self, places: Sequence[tuple[str, int, int]]) -> list[bytes]:
        """Bytes `start` to `stop` of files, each given as (name, start, stop)."""
        found: list[bytes] = []
        for begin in range(0, len(places), AT_ONCE):
            some = places[begin : begin + AT_ONCE]
            with _as_os_errors(self.address):
                found += self._system.cat_ranges(
                    [self._key(name) for name, _, _ in some],
                    [start for _, start, _ in some],
                    [stop for _, _, stop in some],
                    on_error="raise",
                )
        return found

    def remove(self, names: Sequence[str]) -> None:
        """Remove those of these files that are there."""
        there = set(self.names()) if names else set[str]()
        keys = [self._key(name) for name in names if name in there]
        if keys:
            with _as_os_errors(self.address):
                self._system.rm(keys)

    @cached_property
    def _system(self) -> Any:
        with _as_os_errors(self.address):
            return importlib.import_module("fsspec").url_to_fs(self.address)[0]

    @cached_property
    def _root(self) -> str:
        return self._system._strip_protocol(self.address)

    def _key(self, name: str) -> str:
        return f"{self._root}/{name}"


def split_address(address: str) -> tuple[StoreFolder, str]:
    """The folder and the name of a file's address; BadInput where it cannot be used here."""
    folder, _, name = address.rpartition("/")
    return store_folder(folder), name


def _told(info: dict[str, Any]) -> tuple[int, str]:
    """Size and version out of what a file system says of a file."""
    version = next((info[key] for key in _VERSIONS if info.get(key)), "")
    # Some file systems say the time as a number where they list, and as a time where they are asked for one file.
    if isinstance(version, datetime):
        version = version.timestamp()
    return int(info["size"]), str(version).strip('"')


@contextmanager
def _as_os_errors(address: str) -> Generator[None]:
    try:
        yield
    except _foreign() as error:
        raise OSError(errno.EIO, f"{type(error).__name__}: {error}", address) from error
    except FileNotFoundError as error:
        raise FileNotFoundError(errno.ENOENT, "there is no such file or folder", address) from error
    except PermissionError as error:
        raise PermissionError(errno.EACCES, f"the store does not allow it ({error})", address) from error


def _foreign() -> tuple[type[Exception], ...]:
    loaded = ((sys.modules.get(module), name) for module, name in _FOREIGN)
    return tuple(getattr(module, name) for module, name in loaded if module is not None)
