"""Many small files fast: their bytes lie in one buffer, and their folder is opened once."""

import hashlib
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Int

from ars_web.datasets.writers.writer import FileDigests


def write_files(
    root: Path,
    folders: Sequence[str],
    names: Sequence[str],
    content: memoryview,
    starts: Int[np.ndarray, "k"],
) -> FileDigests:
    """Write file i as `root/folders[i]/names[i]` with the bytes `starts[i]` to `starts[i + 1]` of the content."""
    descriptors: dict[str, int] = {}
    digests: FileDigests = {}
    edges = starts.tolist()
    try:
        for i, (folder, name) in enumerate(zip(folders, names, strict=True)):
            if folder not in descriptors:
                (root / folder).mkdir(parents=True, exist_ok=True)
                descriptors[folder] = os.open(root / folder, os.O_RDONLY | os.O_DIRECTORY)
            part = content[edges[i] : edges[i + 1]]
            _write(name, part, folder=descriptors[folder])
            digests[f"{folder}/{name}"] = hashlib.sha256(part).hexdigest()
    finally:
        for descriptor in descriptors.values():
            os.close(descriptor)
    return digests


def _write(name: str, content: memoryview, *, folder: int) -> None:
    file = os.open(name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644, dir_fd=folder)
    try:
        while len(content):
            # A full disk can take a part and fail on the rest only.
            content = content[os.write(file, content) :]
    finally:
        os.close(file)
