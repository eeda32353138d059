"""Files of a fixed number of samples each, one sample a frame, whatever the shards: tar files and TFRecords.

A shard writes those files whole that all samples of are its own; they become part of the dataset as they are. Of a
file that begins or ends in another shard it keeps its part, and joining puts the parts together: so most bytes are
written once, and what is joined is some files a shard.
"""

import hashlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import BaseModel, ConfigDict

from ars_web.datasets.writers.joining import Joined
from ars_web.datasets.writers.writer import FileDigests, Shard

SAMPLES = 1000
"""In a file, but for the last of a split: of photos some hundred MB, as readers of such files like them."""

_INDEX = "samples.json"

Member = tuple[str, int, int, str]
"""A file in a sample: what follows the first dot of its name, where its bytes begin, how many, and its name."""


@dataclass(frozen=True, eq=False)
class Sample:
    """One sample's bytes.

    Attributes:
        pieces: one after the other.
        members: what is in it, counted from its own beginning; empty where the format has none.
    """

    pieces: Sequence[bytes]
    members: Sequence[Member] = ()


@dataclass(frozen=True)
class Layout:
    """How a format lays its files out.

    Attributes:
        path: of a file in the dataset, given its split, its number, and how many the split has.
        tail: bytes after the last sample.
        index: the path and the content of a file beside it that says where its samples are, given its own path and
            the members of each sample, counted from the file's beginning; None: there is none.
    """

    path: Callable[[str, int, int], str]
    tail: bytes = b""
    index: Callable[[str, Sequence[Sequence[Member]]], tuple[str, bytes]] | None = None


class _Part(BaseModel):
    """Some samples of a file, or all."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    path: str
    split: str
    whole: bool
    members: list[list[Member]]


class Parts(BaseModel):
    """What a shard has of the dataset's files; of whole ones, members are not kept."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    split_sizes: dict[str, int]
    parts: list[_Part]


class _Open:
    """A file, or a part of one, that is being written."""

    def __init__(self, split: str, path: str, *, wanted: int, of_file: int, files: Path, fragments: Path) -> None:
        self.split, self.path, self.wanted = split, path, wanted
        self.whole = wanted == of_file
        target = files / path if self.whole else fragments / Path(path).name
        target.parent.mkdir(parents=True, exist_ok=True)
        self.joined = Joined(target)
        self.size = 0
        self.members: list[list[Member]] = []

    def add(self, sample: Sample) -> None:
        self.members.append([(kind, start + self.size, size, name) for kind, start, size, name in sample.members])
        for piece in sample.pieces:
            self.joined.add(piece)
            self.size += len(piece)


def file_count(samples: int) -> int:
    """How many files a split of so many frames has; one, which is empty, where it has no frame."""
    return max(1, -(-samples // SAMPLES))


def write_samples(shard: Shard, samples: Iterable[Sample], layout: Layout, files: Path, fragments: Path) -> FileDigests:
    """Write a shard's samples, one a frame; the digests of the files that are whole."""
    numbers: list[int] = (shard.places // SAMPLES).tolist()
    ours: dict[tuple[str, int], int] = {}
    for key in zip(shard.splits, numbers, strict=True):
        ours[key] = ours.get(key, 0) + 1
    digests: FileDigests = {}
    parts: list[_Part] = []
    opened: dict[tuple[str, int], _Open] = {}
    for split, number, sample in zip(shard.splits, numbers, samples, strict=True):
        key, total = (split, number), shard.split_sizes[split]
        if key not in opened:
            path = layout.path(split, number, file_count(total))
            of_file = min(SAMPLES, total - number * SAMPLES)
            opened[key] = _Open(split, path, wanted=ours[key], of_file=of_file, files=files, fragments=fragments)
        file = opened[key]
        file.add(sample)
        if len(file.members) == file.wanted:
            with file.joined as joined:
                if file.whole:
                    joined.add(layout.tail)
                    digests[file.path] = joined.sha256
                    digests.update(_write_index(layout, file.path, file.members, files))
            parts.append(
                _Part(path=file.path, split=split, whole=file.whole, members=[] if file.whole else file.members)
            )
            del opened[key]
    index = Parts(split_sizes=dict(shard.split_sizes), parts=parts)
    (fragments / _INDEX).write_text(index.model_dump_json(), encoding="utf-8")
    return digests


def join_samples(fragments: Sequence[Path], layout: Layout, folder: Path) -> FileDigests:
    """Put the parts of files together that several shards have; the digests of those files."""
    parts: dict[str, list[tuple[Path, _Part]]] = {}
    for fragment, index in zip(fragments, _indices(fragments), strict=True):
        for part in index.parts:
            if not part.whole:
                parts.setdefault(part.path, []).append((fragment, part))
    digests: FileDigests = {}
    for path, held in parts.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        members: list[list[Member]] = []
        start = 0
        with Joined(folder / path) as joined:
            for fragment, part in held:
                source = fragment / Path(path).name
                joined.add_files([source], between=b"")
                members += [[(kind, at + start, size, name) for kind, at, size, name in one] for one in part.members]
                start += source.stat().st_size
            joined.add(layout.tail)
        digests[path] = joined.sha256
        digests.update(_write_index(layout, path, members, folder))
    return digests


def split_sizes(fragments: Sequence[Path]) -> dict[str, int]:
    """How many frames each split has, as the shards were told."""
    return next(_indices(fragments)).split_sizes


def _indices(fragments: Sequence[Path]) -> Iterator[Parts]:
    return (Parts.model_validate_json((fragment / _INDEX).read_bytes()) for fragment in fragments)


def _write_index(layout: Layout, path: str, members: Sequence[Sequence[Member]], folder: Path) -> FileDigests:
    if layout.index is None:
        return {}
    beside, content = layout.index(path, members)
    (folder / beside).write_bytes(content)
    return {beside: hashlib.sha256(content).hexdigest()}
