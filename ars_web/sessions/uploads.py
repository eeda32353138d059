"""Recordings that were sent as a zip and wait, unpacked, until a session is made of them or a day is over.

SESSIONS/.uploads/ID/upload.json     what it was called and how large it was
SESSIONS/.uploads/ID/recording/      what was in the zip
"""

import contextlib
import shutil
import time
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from pydantic import BaseModel, ValidationError

from ars_web.errors import NotFound, StoreError
from ars_web.recordings.options import ReadOptions
from ars_web.recordings.recording import Recording
from ars_web.sessions.archive import DEFAULT_LIMITS, ArchiveLimits, extract_zip
from ars_web.sessions.names import checked_key
from ars_web.sessions.session_folders import is_id, new_id, unseen_folder

UPLOADS = ".uploads"
KEPT_SECONDS = 24 * 60 * 60
"""How long an upload waits after it was last asked for."""

_ABOUT = "upload.json"
_RECORDING = "recording"


@dataclass(frozen=True)
class Upload:
    """An unpacked zip.

    Attributes:
        folder: what was in it, absolute and without links.
        file_name: what its sender called it.
        bytes: of the zip.
        files: in the zip.
    """

    id: str
    folder: Path
    file_name: str
    bytes: int
    files: int

    @property
    def recording(self) -> Path:
        """The recording's own folder, where the zip holds it in one folder, or in several nested ones."""
        return only_folder(self.folder)


class _About(BaseModel):
    file_name: str
    bytes: int
    files: int


class Uploads:
    """All uploads of a sessions folder. Any number of threads and processes may use the same folder at once."""

    def __init__(self, sessions: Path) -> None:
        self._sessions = sessions
        self._folder = sessions.absolute() / UPLOADS

    @contextmanager
    def receiving(self) -> Generator[Path]:
        """An empty folder for a zip while it comes, gone when the block ends; a killed server leaves nothing of it."""
        with unseen_folder(self._sessions) as folder:
            yield folder

    def keep(
        self, archive: Path, *, file_name: str, key: str | None = None, limits: ArchiveLimits = DEFAULT_LIMITS
    ) -> Upload:
        """Unpack a zip that lies in a folder of `receiving`, and keep what was in it. The zip goes.

        A repeat with the same idempotency `key` answers the upload that the first made.

        Raises:
            BadFile, RefusedPath, TooLarge: it is no zip that is taken (see `archive.extract_zip`).
            StoreError: it cannot be kept.
        """
        self.sweep()
        id_ = new_id(key=None if key is None else checked_key(key))
        with contextlib.suppress(NotFound):
            return self.get(id_)
        made = archive.with_name("upload")
        size = archive.stat().st_size
        extract_zip(archive, made / _RECORDING, limits=limits)
        files = sum(1 for path in (made / _RECORDING).rglob("*") if path.is_file())
        try:
            archive.unlink()
            about = _About(file_name=file_name, bytes=size, files=files)
            (made / _ABOUT).write_text(about.model_dump_json())
            self._folder.mkdir(exist_ok=True)
            with contextlib.suppress(FileExistsError):  # another request with the same key was quicker
                made.rename(self._folder / id_)
        except OSError as error:
            raise StoreError(f"{self._folder}: the upload cannot be kept: {error.strerror}") from error
        return self.get(id_)

    def get(self, id_: str) -> Upload:
        """An upload, which from now on waits another day.

        Raises:
            NotFound: there is none; used ones go, others after a day.
        """
        folder = self._folder / id_
        try:
            if not is_id(id_):
                raise FileNotFoundError
            about = _About.model_validate_json((folder / _ABOUT).read_bytes())
            folder.touch()
        except (OSError, ValidationError) as error:
            raise NotFound(
                f"there is no upload {id_[:40]!r}: it was imported already, or waited for a day; send it again"
            ) from error
        return Upload(id_, (folder / _RECORDING).resolve(), about.file_name, about.bytes, about.files)

    def discard(self, id_: str) -> None:
        """Take an upload away; one that is not there is no matter."""
        if is_id(id_):
            shutil.rmtree(self._folder / id_, ignore_errors=True)

    def sweep(self) -> None:
        """Take away what has waited for longer than KEPT_SECONDS."""
        with contextlib.suppress(OSError):
            for folder in self._folder.iterdir():
                if folder.stat().st_mtime < time.time() - KEPT_SECONDS:
                    shutil.rmtree(folder, ignore_errors=True)


def as_uploaded(recording: Recording, *, unpacked: Path, file_name: str) -> Recording:
    """`recording`, which was read from an upload, without a word of where that lay: it will be gone."""
    options = ReadOptions(within=unpacked)
    skipped = tuple(
        replace(frame, **{name: options.told(text) for name, text in asdict(frame).items()})
        for frame in recording.skipped
    )
    return replace(recording, source=Path(file_name), skipped=skipped)


def only_folder(folder: Path) -> Path:
    """The innermost folder that holds all there is in `folder`, which may be `folder` itself."""
    while True:
        entries = [entry for entry in folder.iterdir() if entry.name != "__MACOSX"]
        if len(entries) != 1 or not entries[0].is_dir():
            return folder
        folder = entries[0]
