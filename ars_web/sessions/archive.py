"""Unpacking zip archives of strangers: nothing outside the target, nothing beyond the limits, whole or not at all."""

import secrets
import shutil
import stat
import unicodedata
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from ars_web.errors import ArsError, BadFile, BadInput, RefusedPath, StoreError, TooLarge

CHUNK = 1 << 20

HARMLESS = 1 << 20
"""Bytes that may come of an archive however small it is: a short file of equal lines is no bomb."""


@dataclass(frozen=True)
class ArchiveLimits:
    """How much an archive may hold.

    Attributes:
        bytes: unpacked, in all.
        members: files and folders.
        ratio: unpacked bytes to the bytes of the archive itself. Images hardly shrink and text shrinks tenfold; a
            bomb is a thousandfold.
        name_bytes: of one member's path, in UTF-8.
        part_bytes: of each folder's and file's name in that path; file systems take no more.
    """

    bytes: int = 64 << 30
    members: int = 200_000
    ratio: float = 100.0
    name_bytes: int = 512
    part_bytes: int = 255


DEFAULT_LIMITS = ArchiveLimits()


def extract_zip(source: Path, target: Path, *, limits: ArchiveLimits = DEFAULT_LIMITS) -> None:
    """Unpack the zip at `source` into the folder `target`, which is made and must not be there yet, or be empty.

    Raises:
        BadFile: it is no zip, is damaged, encrypted or packed in a way other than stored or deflated.
        RefusedPath: a member's name is absolute, leaves the target, occurs twice, or is a link or a device.
        TooLarge: it is beyond a limit.
        BadInput: there is something at `target`.
        StoreError: `target` cannot be written.
    """
    if target.is_symlink() or (target.exists() and not (target.is_dir() and not any(target.iterdir()))):
        raise BadInput(f"{target}: there is something here already; choose a new or empty folder")
    partial = target.with_name(f".{target.name}.{secrets.token_hex(4)}.partial")
    try:
        with zipfile.ZipFile(source) as archive:
            members = _checked_members(source, archive, limits)
            partial.mkdir(parents=True)
            _unpack(source, archive, members, partial, limits)
        partial.replace(target)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, UnicodeDecodeError) as error:
        raise BadFile(source, f"is no zip archive or a damaged one: {error}") from error
    except OSError as error:
        raise _blame(error, source, target) from error
    finally:
        shutil.rmtree(partial, ignore_errors=True)


def _checked_members(source: Path, archive: zipfile.ZipFile, limits: ArchiveLimits) -> list[zipfile.ZipInfo]:
    """The members, all of which may be unpacked. What they say of their sizes is checked again while unpacking."""
    members = archive.infolist()
    if len(members) > limits.members:
        raise TooLarge(f"{source}: holds {len(members)} members; at most {limits.members} are taken")
    length = source.stat().st_size
    if not all(0 <= member.header_offset < length for member in members):
        raise BadFile(source, "is a damaged zip archive: a member is said to lie outside it")
    kinds: dict[str, bool] = {}
    for member in members:
        name = _checked_name(source, member, limits)
        # One name must not stand for two files where upper and lower case are one, or accents are composed.
        folded = unicodedata.normalize("NFC", name).casefold()
        if folded in kinds:
            raise RefusedPath(f"{source}: {name!r} occurs twice")
        kinds[folded] = member.is_dir()
        if member.flag_bits & 0x1:
            raise BadFile(source, f"{name!r} is encrypted; pack it without a password")
        if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise BadFile(source, f"{name!r} is packed by method {member.compress_type}; store or deflate it")
    for folded in kinds:
        for parent in PurePosixPath(folded).parents:
            if kinds.get(str(parent)) is False:
                raise RefusedPath(f"{source}: {str(parent)!r} is a file and a folder at once")
    total = sum(member.file_size for member in members)
    # Against the archive as it lies there, not against what its members say: overlapping ones share their bytes.
    _refuse_too_large(source, total, _most_bytes(source, limits), limits)
    return members


def _checked_name(source: Path, member: zipfile.ZipInfo, limits: ArchiveLimits) -> str:
    # The name as it is in the archive: `filename` is already cut at a NUL and has its separators changed.
    name = member.orig_filename
    stem = name.removesuffix("/")
    parts = stem.split("/")
    if "\0" in name or "\\" in name or ":" in parts[0] or any(part in ("", ".", "..") for part in parts):
        raise RefusedPath(f"{source}: a member is called {name!r}, which would leave the folder or cannot be a path")
    if any(unicodedata.category(character) in ("Cc", "Cs") for character in name):
        raise RefusedPath(f"{source}: a member's name holds a control character: {name!r}")
    if len(name.encode()) > limits.name_bytes:
        raise TooLarge(f"{source}: a member's name is longer than {limits.name_bytes} bytes: {name[:60]!r}…")
    if any(len(part.encode()) > limits.part_bytes for part in parts):
        raise TooLarge(f"{source}: a file or folder has a name over {limits.part_bytes} bytes: {name[:60]!r}…")
    kind = stat.S_IFMT(member.external_attr >> 16)
    if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
        raise RefusedPath(f"{source}: {name!r} is a link or a device, not a file")
    return stem


def _unpack(
    source: Path, archive: zipfile.ZipFile, members: list[zipfile.ZipInfo], folder: Path, limits: ArchiveLimits
) -> None:
    most, total = _most_bytes(source, limits), 0
    for member in members:
        path = folder.joinpath(*member.orig_filename.removesuffix("/").split("/"))
        if member.is_dir():
            path.mkdir(parents=True, exist_ok=True)
            continue
        path.parent.mkdir(parents=True, exist_ok=True)
        with archive.open(member) as packed, path.open("xb") as file:
            while chunk := packed.read(CHUNK):
                total += len(chunk)
                _refuse_too_large(source, total, most, limits)
                file.write(chunk)


def _most_bytes(source: Path, limits: ArchiveLimits) -> float:
    return min(limits.bytes, max(limits.ratio * source.stat().st_size, HARMLESS))


def _refuse_too_large(source: Path, total: int, most: float, limits: ArchiveLimits) -> None:
    if total > most:
        raise TooLarge(
            f"{source}: unpacks to more than {most:.0f} bytes; the limit is {limits.bytes} bytes and"
            f" {limits.ratio:g} times the archive's own size"
        )


def _blame(error: OSError, source: Path, target: Path) -> ArsError:
    if error.filename is not None and Path(error.filename) == source:
        return BadFile(source, f"cannot be read: {error.strerror}")
    return StoreError(f"{target}: cannot be unpacked here: {error.strerror}")
