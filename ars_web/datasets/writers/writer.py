"""What a dataset format is: where its files go, how a shard is written, and what joins the shards."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Int

from ars_web.datasets.samples import LabelTable, Outlines


@dataclass(frozen=True, eq=False)
class Shard:
    """All that a writer knows of a run of n frames of one session with b boxes.

    Attributes:
        first: place of its first frame in the dataset, from 0.
        splits: of each frame, `train`, `val` or `test`.
        stems: of each frame's files.
        image_names: of each frame's image file, in the folder that the writer's `image_folder` says.
        identities: `sceneFolder!imageFile` of each frame, where it came from.
        sizes: (n, 2) width and height in pixels.
        class_names: of the whole dataset; a class's id is its place, from 0.
        class_of_box: (b,) places in `class_names`.
        most_boxes: the largest b of all shards: frame number x most_boxes + box number is unique in the dataset.
        table: labels of all boxes, those dropped included.
        keep: (n, b) which of them are written.
        outlines: of the kept labels; empty unless the writer asks for them.
    """

    first: int
    splits: Sequence[str]
    stems: Sequence[str]
    image_names: Sequence[str]
    identities: Sequence[str]
    sizes: Int[np.ndarray, "n 2"]
    class_names: Sequence[str]
    class_of_box: Int[np.ndarray, "b"]
    most_boxes: int
    table: LabelTable
    keep: Bool[np.ndarray, "n b"]
    outlines: Outlines


@dataclass(frozen=True)
class Dataset:
    """What a writer needs to join shards.

    Attributes:
        splits: those that the export asks for, in order; each has a list or a folder, an empty one too.
        class_names: a class's id is its place.
        description: one line without a date, a path or anything else that differs between equal exports.
    """

    splits: Sequence[str]
    class_names: Sequence[str]
    description: str


FileDigests = dict[str, str]
"""SHA-256 in hex by the file's path in the dataset, with `/`."""


@dataclass(frozen=True)
class Writer:
    """A dataset format.

    Attributes:
        format: its key in the registry and on the command line.
        title: its name for people.
        description: what it is for, and what it holds, in one line.
        label_folder: every file below it is a label file, and `dataset.json`'s sha256 is over those.
        image_folder: from a split to the folder of its images.
        write: writes a shard's label files below the folder `files`, which becomes part of the dataset, and what
            is to be joined below `fragments`; returns the digests of the label files in `files`.
        join: from the shards' `fragments` folders, in order, writes the files that span shards into the dataset;
            returns the digests of those that are label files. Done twice, it does the same again.
        with_visible: whether it writes visible fractions.
        with_outlines: whether it writes outlines.
        numbered: files are called by the frame's place in the dataset, five digits, not by the image's name.
        only_jpeg: other images are encoded as JPEG.
    """

    format: str
    title: str
    description: str
    label_folder: str
    image_folder: Callable[[str], str]
    write: Callable[[Shard, Path, Path], FileDigests]
    join: Callable[[Dataset, Sequence[Path], Path], FileDigests]
    with_visible: bool = False
    with_outlines: bool = False
    numbered: bool = False
    only_jpeg: bool = False
