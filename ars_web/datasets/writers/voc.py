"""Pascal VOC: `Annotations/`, `ImageSets/Main/`, `JPEGImages/` (the original images, PNG ones included).

Boxes are 1-based and inclusive: pixel columns and rows whose larger part lies in the label. `truncated` and
`occluded` follow VOC's own annotation guide: more than 15 % of the object outside, more than 5 % of it hidden.
`labelmap.txt`, which datumaro and CVAT ask for, lists the classes in their order; VOC itself has no place for it.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int

from ars_web.datasets.writers.joining import join_files
from ars_web.datasets.writers.small_files import write_files
from ars_web.datasets.writers.texts import xml_text
from ars_web.datasets.writers.writer import Dataset, FileDigests, Shard, Writer

TRUNCATED_BEYOND = 0.15
HIDDEN_BEYOND = 0.05

_FOLDER = "JPEGImages"


def inclusive(bbox: Float[np.ndarray, "n b 4"], sizes: Int[np.ndarray, "n 2"]) -> Int[np.ndarray, "n b 4"]:
    """`xmin ymin xmax ymax` counted from 1, the last pixel included, at least one pixel, within the image.

    Where bbox is NaN the result means nothing.
    """
    edges = np.floor(np.nan_to_num(bbox) + 0.5).astype(np.int64)
    last = sizes[:, None, :]
    low = np.clip(edges[..., :2] + 1, 1, last)
    high = np.clip(edges[..., 2:], low, last)
    return np.concatenate([low, high], axis=-1)


def _annotation(
    image: str,
    size: Sequence[int],
    names: Sequence[str],
    boxes: Sequence[Sequence[int]],
    flags: Sequence[Sequence[int]],
) -> bytes:
    objects = "".join(
        f"  <object>\n    <name>{name}</name>\n    <pose>Unspecified</pose>\n"
        f"    <truncated>{truncated}</truncated>\n    <occluded>{occluded}</occluded>\n    <difficult>0</difficult>\n"
        f"    <bndbox>\n      <xmin>{x0}</xmin>\n      <ymin>{y0}</ymin>\n      <xmax>{x1}</xmax>\n"
        f"      <ymax>{y1}</ymax>\n    </bndbox>\n  </object>\n"
        for name, (x0, y0, x1, y1), (truncated, occluded) in zip(names, boxes, flags, strict=True)
    )
    return (
        f"<annotation>\n  <folder>{_FOLDER}</folder>\n  <filename>{image}</filename>\n"
        f"  <size>\n    <width>{size[0]}</width>\n    <height>{size[1]}</height>\n    <depth>3</depth>\n  </size>\n"
        f"  <segmented>0</segmented>\n{objects}</annotation>\n"
    ).encode()


def _write(shard: Shard, files: Path, fragments: Path) -> FileDigests:
    boxes = inclusive(shard.table.bbox, shard.sizes)
    flags = _flags(shard.table.truncated, shard.table.visible)
    class_names = [xml_text(shard.class_names[int(i)]) for i in shard.class_of_box.tolist()]
    contents = [
        _annotation(
            image,
            shard.sizes[i].tolist(),
            [class_names[box] for box in np.flatnonzero(shard.keep[i]).tolist()],
            boxes[i, shard.keep[i]].tolist(),
            flags[i, shard.keep[i]].tolist(),
        )
        for i, image in enumerate(shard.image_names)
    ]
    digests = write_files(
        files,
        ["Annotations"] * len(contents),
        [f"{stem}.xml" for stem in shard.stems],
        memoryview(b"".join(contents)),
        np.cumsum([0, *map(len, contents)]),
    )
    for split in sorted(set(shard.splits)):
        lines = (f"{stem}\n" for stem, s in zip(shard.stems, shard.splits, strict=True) if s == split)
        (fragments / f"{split}.txt").write_text("".join(lines), encoding="utf-8")
    return digests


def _flags(truncated: Float[np.ndarray, "n b"], visible: Float[np.ndarray, "n b"]) -> Int[np.ndarray, "n b 2"]:
    outside: Bool[np.ndarray, "n b"] = truncated > TRUNCATED_BEYOND
    hidden: Bool[np.ndarray, "n b"] = visible < 1 - HIDDEN_BEYOND
    return np.stack([outside, hidden], axis=-1).astype(np.int64)


def _join(dataset: Dataset, fragments: Sequence[Path], folder: Path) -> FileDigests:
    for name in ("Annotations", _FOLDER):
        (folder / name).mkdir(parents=True, exist_ok=True)
    lists = {split: [split] for split in dataset.splits} | {"trainval": ["train", "val"]}
    for name, members in lists.items():
        sources = [f / f"{split}.txt" for split in members for f in fragments]
        join_files(sources, folder / "ImageSets" / "Main" / f"{name}.txt")
    labels = "".join(f"{name.replace(':', '_')}:::\n" for name in dataset.class_names)
    (folder / "labelmap.txt").write_text(f"# label:color_rgb:parts:actions\n{labels}", encoding="utf-8")
    return {}


WRITER = Writer(
    format="voc",
    title="Pascal VOC",
    description=(
        "One XML file an image, with marks for truncated and occluded objects, and a list of the images in each split."
    ),
    label_folder="Annotations",
    image_folder=lambda split: _FOLDER,
    write=_write,
    join=_join,
    with_visible=True,
)
