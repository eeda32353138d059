"""The JSON of imports: folders to choose from, what a recording holds, uploads and jobs."""

from datetime import datetime
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import BaseModel, Field, StringConstraints, model_validator

from ars_web.api.models import CameraJson, Name, SkippedFrameJson, Strict
from ars_web.recordings.browsing import Browsed
from ars_web.recordings.options import ReadOptions
from ars_web.recordings.overview import CameraUse
from ars_web.recordings.registry import READERS
from ars_web.sessions.import_jobs import ImportJob
from ars_web.sessions.import_looks import Look
from ars_web.sessions.uploads import Upload

SKIPPED_TOLD = 20
"""Frames left out that a look names one by one; the rest are counted."""

RelativePath = Annotated[str, StringConstraints(max_length=4096)]


class BrowsedFolderJson(BaseModel):
    """A folder below the one that is listed."""

    name: str
    formats: list[str] = Field(description="of the recording that it may be")
    images: int = Field(description="in it; where it holds none, those in its images/ or rgb/")
    problem: str | None = Field(description="why it cannot be looked into; null: it can")


class BrowsedFileJson(BaseModel):
    """A file that can be imported by itself."""

    name: str
    formats: list[str]


class FoldersJson(BaseModel):
    """A folder as one chooses from it. Hidden folders, and links that lead out of the root, are left out."""

    path: str = Field(description="relative to the root, with /; empty: the root itself")
    formats: list[str] = Field(description="of the recording that the folder itself may be")
    images: int = Field(description="image files in it")
    folders: list[BrowsedFolderJson]
    files: list[BrowsedFileJson]
    more: bool = Field(description="whether there are more folders than are listed")

    @classmethod
    def of(cls, found: Browsed, *, path: str) -> Self:
        """The JSON of a listing."""
        return cls(
            path=path,
            formats=list(found.formats),
            images=found.images,
            folders=[
                BrowsedFolderJson(name=f.name, formats=list(f.formats), images=f.images, problem=f.problem)
                for f in found.folders
            ],
            files=[BrowsedFileJson(name=f.name, formats=list(f.formats)) for f in found.files],
            more=found.more,
        )


class UploadJson(BaseModel):
    """A recording that was sent, unpacked, and that waits a day to be imported."""

    id: str
    file_name: str = Field(description="what its sender called it")
    bytes: int = Field(description="of the zip")
    files: int = Field(description="in the zip")

    @classmethod
    def of(cls, upload: Upload) -> Self:
        """The JSON of an upload."""
        return cls(id=upload.id, file_name=upload.file_name, bytes=upload.bytes, files=upload.files)


class LookDraft(Strict):
    """A recording to look at: below a declared root, or in an upload."""

    root: str | None = Field(None, description="a name from GET /api/roots")
    upload: str | None = Field(None, description="the id of an upload")
    path: RelativePath = Field("", description="relative to the root or the upload, with /; empty: all of it")
    format: str = Field("auto", description="auto: found by looking", json_schema_extra={"enum": ["auto", *READERS]})
    images: RelativePath | None = Field(None, description="the image folder, where the format implies none; as path")
    camera: RelativePath | None = Field(None, description="a camera file, for formats without one; as path")

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        if (self.root is None) == (self.upload is None):
            raise ValueError("say either root, with path, or upload")
        return self


class ImportDraft(LookDraft):
    """A recording to make a session of."""

    name: Name
    classes: list[Name] = Field(default_factory=list[Name], max_length=10_000)


class LookedCameraJson(CameraJson):
    """A camera of the recording."""

    frames: int = Field(description="that it took")

    @classmethod
    def used(cls, use: CameraUse) -> Self:
        """The JSON of a camera and its use."""
        return cls(**CameraJson.of(use.id, use.camera).model_dump(), frames=use.frames)


class LookedSkippedJson(BaseModel):
    """What the recording lists and cannot be used."""

    count: int
    first: list[SkippedFrameJson] = Field(description=f"at most {SKIPPED_TOLD}")


class LookJson(BaseModel):
    """What an import would make."""

    id: str = Field(description="for GET /api/imports/look/image; forgotten after a while")
    format: str = Field(description="that it was read as")
    formats_possible: list[str] = Field(description="that it looks like")
    frames: int
    cameras: list[LookedCameraJson]
    images_size: list[tuple[int, int]] = Field(description="the different widths and heights, pixels")
    classes: list[str] = Field(description="that come with the recording")
    boxes: int = Field(description="that come with the recording")
    skipped: LookedSkippedJson
    path_length_m: float = Field(description="how far the camera went, metres; of several the one that went farthest")
    warnings: list[str]
    sample_frames: list[int] = Field(description="frames whose images can be shown")

    @classmethod
    def of(cls, look: Look, options: ReadOptions, *, warnings: list[str]) -> Self:
        """The JSON of a look; `warnings`: more of them."""
        recording, seen = look.recording, look.overview
        cameras = recording.cameras.values()
        return cls(
            id=look.id,
            format=recording.format,
            formats_possible=list(look.formats_possible),
            frames=len(recording.frames),
            cameras=[LookedCameraJson.used(use) for use in seen.cameras],
            images_size=list(dict.fromkeys((camera.width, camera.height) for camera in cameras)),
            classes=list(recording.class_names),
            boxes=len(recording.boxes),
            skipped=LookedSkippedJson(
                count=len(recording.skipped),
                first=[
                    SkippedFrameJson(name=s.name, reason=options.told(s.reason), where=options.told(s.where))
                    for s in recording.skipped[:SKIPPED_TOLD]
                ],
            ),
            path_length_m=seen.path_length,
            warnings=[*look.warnings, *warnings],
            sample_frames=list(seen.sample_frames),
        )


class ImportJson(BaseModel):
    """An import and how far it is."""

    id: str
    name: str = Field(description="the session's")
    state: Literal["queued", "running", "done", "failed", "cancelled"]
    phase: Literal["reading", "checking images", "storing"]
    done: int = Field(description="images in this phase")
    total: int = Field(description="images in this phase; 0 until that is known")
    error: str | None
    session_id: str | None = Field(description="once done")
    skipped: int = Field(description="frames left out, once done")
    created: datetime

    @classmethod
    def of(cls, job: ImportJob) -> Self:
        """The JSON of an import job."""
        return cls.model_validate(job, from_attributes=True)


def relative_path(path: Path, within: Path) -> str:
    """`path` from `within`, with `/`; empty where they are one."""
    relative = path.relative_to(within).as_posix()
    return "" if relative == "." else relative
