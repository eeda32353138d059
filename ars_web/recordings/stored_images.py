"""Images that lie on a store: a recording's poses and camera are here, its images are not.

A session keeps their addresses, and exports fetch them. Nothing else does: whoever may use the server's API must not
have it fetch things, so the page shows no photos of such a session unless they were copied in (`import --copy`).
"""

import shutil
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from ars_web.errors import ArsError, BadFile, BadInput
from ars_web.recordings.image_header import read_header
from ars_web.recordings.options import ReadOptions, real
from ars_web.recordings.recording import Frame, Recording, StoredImage
from ars_web.recordings.registry import read_recording
from ars_web.recordings.stores import AT_ONCE, StoreFolder, split_address

_SUFFIXES = (".jpg", ".jpeg", ".png")

_HEAD = 16384
_TAIL = 4096
"""Of an image, what is fetched to look at its header and its end; more where that does not do."""


def local(image: Path | StoredImage) -> Path:
    """The image's path.

    Raises:
        BadFile: it lies on a store.
    """
    if isinstance(image, StoredImage):
        raise BadFile(
            image.address,
            "the image lies on a store, from which only the command line's export reads; import the recording with"
            " --copy to have it here",
        )
    return image


def copy_image(image: Path | StoredImage, target: Path) -> None:
    """Copy the image, wherever it lies, to `target`, which must not be there.

    Raises:
        BadInput: the image cannot be read.
        OSError: the copy cannot be written.
    """
    if isinstance(image, StoredImage):
        try:
            folder, name = split_address(image.address)
            content = folder.read(name)
        except OSError as error:
            raise BadInput(f"{image}: the image cannot be read: {error.strerror}") from error
        with target.open("xb") as file:
            file.write(content)
        return
    try:
        source = image.open("rb")
    except OSError as error:
        raise BadInput(f"{image}: the image cannot be read: {error.strerror}") from error
    with source, target.open("xb") as copy:
        shutil.copyfileobj(source, copy, length=1 << 20)


def read_with_stored_images(path: Path, folder: StoreFolder, *, format: str, options: ReadOptions) -> Recording:  # noqa: A002 - the contract's name
    """Read the recording at `path`, whose images lie in the store's `folder`; raises as `read_recording` does.

    The readers look at a folder of stand-ins: files of the images' names and sizes, with their beginnings and ends.
    """
    try:
        details = {n: size for n, (size, _) in folder.details().items() if n.lower().endswith(_SUFFIXES)}
        if not details:
            raise BadFile(folder.address, "holds no JPEG and no PNG image")
        with TemporaryDirectory(prefix="ars-web-images-") as temporary:
            stand_ins = real(Path(temporary))
            _make(stand_ins, folder, details)
            try:
                read = read_recording(path, format=format, options=replace(options, images=stand_ins))
            except ArsError as error:
                if str(stand_ins) not in str(error):
                    raise
                raise BadInput(str(error).replace(str(stand_ins), folder.address)) from error
    except OSError as error:
        raise BadFile(error.filename or folder.address, f"cannot be read: {error.strerror or error}") from error
    return replace(
        read,
        frames=tuple(_stored(frame, stand_ins, folder) for frame in read.frames),
        skipped=tuple(replace(s, reason=s.reason.replace(str(stand_ins), folder.address)) for s in read.skipped),
    )


def _stored(frame: Frame, stand_ins: Path, folder: StoreFolder) -> Frame:
    image = local(frame.image)
    if not image.is_relative_to(stand_ins):
        return frame
    return replace(frame, image=StoredImage(f"{folder.address}/{image.relative_to(stand_ins).as_posix()}"))


def _make(stand_ins: Path, folder: StoreFolder, sizes: dict[str, int]) -> None:
    names = sorted(sizes)
    for start in range(0, len(names), AT_ONCE):
        some = names[start : start + AT_ONCE]
        heads = folder.ranges([(name, 0, min(_HEAD, sizes[name])) for name in some])
        tails = folder.ranges([(name, max(0, sizes[name] - _TAIL), sizes[name]) for name in some])
        for name, head, tail in zip(some, heads, tails, strict=True):
            path = stand_ins / name
            path.parent.mkdir(parents=True, exist_ok=True)
            with path.open("wb") as file:
                file.write(head)
                file.truncate(sizes[name])
                file.seek(max(0, sizes[name] - _TAIL))
                file.write(tail)
        folder.download(_unclear(stand_ins, some), stand_ins)


def _unclear(stand_ins: Path, names: Sequence[str]) -> list[str]:
    """The images whose beginning and end do not tell that they are sound."""
    unclear: list[str] = []
    for name in names:
        whole = False
        with suppress(ArsError):
            whole = read_header(stand_ins / name).whole
        if not whole:
            unclear.append(name)
    return unclear
