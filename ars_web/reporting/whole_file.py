"""Files that are written whole or not at all."""

import os
import tempfile
from pathlib import Path

from ars_web.errors import BadInput


def write_whole(file: Path, content: bytes) -> None:
    """Write `content` to `file`, or leave what was there; its folder is made where it is missing.

    Raises:
        BadInput: it cannot be written. It names `file`, whichever step failed.
    """
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        descriptor, partial = tempfile.mkstemp(dir=file.parent, prefix=f".{file.name}.")
        try:
            with os.fdopen(descriptor, "wb") as stream:
                stream.write(content)
            Path(partial).chmod(0o666 & ~_umask())
            Path(partial).replace(file)
        except BaseException:
            Path(partial).unlink(missing_ok=True)
            raise
    except OSError as error:
        # Nobody knows the file beside it that is written first, or which folder above it could not be made.
        raise BadInput(
            f"{file} cannot be written: {error.strerror}; name a file in a folder that you may write to"
        ) from error


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
