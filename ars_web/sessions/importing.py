"""Filling a new session's folder from a recording: its first state, its database, and its images if copied."""

import os
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path

from ars_web.errors import BadInput, StoreError
from ars_web.recordings.recording import Recording
from ars_web.recordings.stored_images import copy_image
from ars_web.sessions import migration, rows
from ars_web.sessions.database import Database
from ars_web.sessions.model import ObjectClass, SessionState, VirtualBox
from ars_web.sessions.names import FreshNames, checked_image_name, checked_name
from ars_web.sessions.palette import next_color
from ars_web.sessions.session_folders import DATABASE

Progress = Callable[[int, int], None]


def starting_state(recording: Recording, *, name: str, class_names: Sequence[str]) -> SessionState:
    """The session at revision 0: the recording's classes, then those of `class_names` that are new, and its boxes.

    Raises:
        BadInput: a name cannot be used, or a box is of a class that the recording does not list.
    """
    classes: dict[int, ObjectClass] = {}
    by_name: dict[str, int] = {}
    for class_name in (*recording.class_names, *class_names):
        class_name = checked_name(class_name, what="a class")
        if class_name not in by_name:
            id_ = by_name[class_name] = len(classes)
            classes[id_] = ObjectClass(id_, class_name, next_color(c.color for c in classes.values()), revision=0)
    boxes: dict[int, VirtualBox] = {}
    names = FreshNames(())
    for recorded in recording.boxes:
        class_name = checked_name(recorded.class_name, what="a class")
        if class_name not in by_name:
            raise BadInput(f"a box of the recording is of class {class_name!r}, which it does not list")
        id_ = len(boxes) + 1
        boxes[id_] = VirtualBox(
            id=id_,
            class_id=by_name[class_name],
            name=names.give(class_name),
            box=recorded.box,
            revision=0,
        )
    return SessionState(
        revision=0,
        name=checked_name(name, what="a session"),
        classes=classes,
        boxes=boxes,
        next_class_id=len(classes),
        next_box_id=len(boxes) + 1,
    )


def fill(
    folder: Path, recording: Recording, *, state: SessionState, copy_images: bool, progress: Progress | None
) -> None:
    """Write a session's database, and its images if `copy_images`, into the empty `folder`.

    Raises:
        BadInput: the recording has no frame, a frame's name is no relative path or not unique, its camera is not
            listed, its image cannot be copied, or a path is not UTF-8.
        StoreError: the folder cannot be written.
    """
    _refuse_unsound(recording)
    if copy_images:
        _copy_images(recording, folder / rows.IMAGES, progress)
    path = folder / DATABASE
    migration.bring_up_to_date(path)
    database = Database(path)
    try:
        with database.writing() as connection:
            rows.insert_recording(
                connection,
                recording,
                state=state,
                at=datetime.now(UTC),
                copied=copy_images,
                progress=None if copy_images else progress,
            )
    except UnicodeEncodeError as error:
        raise BadInput(
            f"{error.object!r} is not text in UTF-8 and cannot be kept: rename the file or folder"
        ) from error
    finally:
        database.close()


def _refuse_unsound(recording: Recording) -> None:
    if not recording.frames:
        raise BadInput(f"{recording.source}: the recording has no frame that can be used")
    names: set[str] = set()
    for frame in recording.frames:
        if checked_image_name(frame.name) in names:
            raise BadInput(f"{recording.source}: two frames are called {frame.name!r}")
        names.add(frame.name)
        if frame.camera_id not in recording.cameras:
            raise BadInput(
                f"{recording.source}: frame {frame.name!r} is of camera {frame.camera_id}, which is not listed"
            )


def _copy_images(recording: Recording, images: Path, progress: Progress | None) -> None:
    """Copy every frame's image to its name under `images`; what is there already is never overwritten."""
    for done, frame in enumerate(recording.frames, start=1):
        target = images / frame.name
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            copy_image(frame.image, target)
        except OSError as error:
            raise StoreError(f"{target}: the image cannot be copied here: {error.strerror}") from error
        if progress is not None:
            progress(done, len(recording.frames))
    # Once for all of them: an image that was copied is on the disk before its session is seen.
    os.sync()
