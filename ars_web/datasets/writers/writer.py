"""What a dataset format is: where its files go, how a shard is written, and what joins the shards."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Int

from ars_web.datasets.label_functions import Marks
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.planned import ExportPlan, PlannedClass, PlannedSession
from ars_web.datasets.samples import LabelTable, Outlines
from ars_web.datasets.shapes import PosedShapes


@dataclass(frozen=True, eq=False)
class Shard:
    """All that a writer knows of a run of n frames of one session with b boxes.

    Attributes:
        first: place of its first frame in the dataset, from 0.
        session_number: place of its session in the dataset, from 0.
        session: what the plan knows of it, box names and ids included.
        sessions: all of the dataset's, for ids that span them.
        options: of the export.
        splits: of each frame, `train`, `val` or `test`.
        places: (n,) of each frame among those of its split, in all of the dataset, from 0.
        split_sizes: how many frames of all of the dataset are in each split; those without any are left out.
        stems: of each frame's files.
        image_names: of each frame's image file, in the folder that the writer's `image_folder` says.
        image_files: where those lie while the shard is written, for writers that put their bytes into other files;
            empty where the export has no images.
        identities: `sceneFolder!imageFile` of each frame, where it came from.
        frame_names: of each frame, in the session.
        frame_indices: (n,) in the session.
        sizes: (n, 2) width and height in pixels.
        classes: of the whole dataset; a class's id is its place, from 0.
        class_of_box: (b,) places in `classes`.
        most_boxes: the largest b of all shards: frame number x most_boxes + box number is unique in the dataset.
        shapes: what the labels are drawn round, and the cameras of the images as they are written.
        table: labels of all boxes, those dropped included.
        keep: (n, b) which of them are written.
        outlines: of the kept labels, one joined ring each; empty unless the writer asks for them.
        marks: of the kept labels, by each of the label functions that the writer asks for.
    """

    first: int
    session_number: int
    session: PlannedSession
    sessions: Sequence[PlannedSession]
    options: ExportOptions
    splits: Sequence[str]
    places: Int[np.ndarray, "n"]
    split_sizes: Mapping[str, int]
    stems: Sequence[str]
    image_names: Sequence[str]
    image_files: Sequence[Path]
    identities: Sequence[str]
    frame_names: Sequence[str]
    frame_indices: Int[np.ndarray, "n"]
    sizes: Int[np.ndarray, "n 2"]
    classes: Sequence[PlannedClass]
    class_of_box: Int[np.ndarray, "b"]
    most_boxes: int
    shapes: PosedShapes
    table: LabelTable
    keep: Bool[np.ndarray, "n b"]
    outlines: Outlines
    marks: Mapping[str, Marks]

    @property
    def class_names(self) -> tuple[str, ...]:
        """The names of the dataset's classes."""
        return tuple(a_class.name for a_class in self.classes)


@dataclass(frozen=True)
class Dataset:
    """What a writer needs to join shards.

    Attributes:
        splits: those that the export asks for, in order; each has a list or a folder, an empty one too.
        classes: a class's id is its place.
        sessions: those that are exported.
        options: of the export.
        description: one line without a date, a path or anything else that differs between equal exports.
    """

    splits: Sequence[str]
    classes: Sequence[PlannedClass]
    sessions: Sequence[PlannedSession]
    options: ExportOptions
    description: str

    @property
    def class_names(self) -> tuple[str, ...]:
        """The names of its classes."""
        return tuple(a_class.name for a_class in self.classes)


FileDigests = dict[str, str]
"""SHA-256 in hex by the file's path in the dataset, with `/`."""


def no_losses(plan: ExportPlan) -> Sequence[str]:
    """Of a format that can hold all that a plan has."""
    return ()


def no_seconds(options: ExportOptions) -> float:
    """Of a format that is written nearly as soon as its labels are known."""
    return 0.0


@dataclass(frozen=True)
class Writer:
    """A dataset format.

    Attributes:
        format: its key in the registry and on the command line.
        title: its name for people.
        description: what it is for, and what it holds, in one line.
        label_folder: every file below it is a label file, and `dataset.json`'s sha256 is over those; or the one
            label file; or a shell's pattern of those files where others lie beside them.
        image_folder: from a split to the folder of its images, `{session:06d}` in it standing for the place of their
            session; None: their bytes are in the files that it writes.
        write: writes a shard's label files below the folder `files`, which becomes part of the dataset, and what
            is to be joined below `fragments`; returns the digests of the label files in `files`.
        join: from the shards' `fragments` folders, in order, writes the files that span shards into the dataset;
            returns the digests of those that are label files. Done twice, it does the same again.
        shows: the label functions that what it holds of a label is drawn by, for pictures of it.
        label_functions: those whose marks it writes.
        losses: what of a plan it cannot hold, one line each, told before and after an export; it raises BadInput
            where nothing useful would be left.
        seconds_per_frame: rough work of its own on one core, beyond labels and images; shards are cut by it.
        own_options: the export options that mean something to it alone, or to it and few others.
        with_visible: whether it writes visible fractions.
        with_outlines: whether it writes outlines, each as one ring.
        numbered: files are called by the frame's place in the dataset, not by the image's name.
        digits: of those numbers.
        only_jpeg, only_png: other images are encoded as JPEG, or as PNG.
    """

    format: str
    title: str
    description: str
    label_folder: str
    image_folder: Callable[[str], str] | None
    write: Callable[[Shard, Path, Path], FileDigests]
    join: Callable[[Dataset, Sequence[Path], Path], FileDigests]
    shows: tuple[str, ...] = ("box",)
    label_functions: tuple[str, ...] = ()
    losses: Callable[[ExportPlan], Sequence[str]] = no_losses
    seconds_per_frame: Callable[[ExportOptions], float] = no_seconds
    own_options: tuple[str, ...] = ()
    with_visible: bool = False
    with_outlines: bool = False
    numbered: bool = False
    digits: int = 5
    only_jpeg: bool = False
    only_png: bool = False
