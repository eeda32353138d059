"""CVAT for images 1.1, as a project with a subset a split: `annotations.xml`, `images/{train,val}/`, `labels.json`.

Coordinates are image coordinates with two decimals, as CVAT's own are. A shape in CVAT is a box or a polygon, and two
shapes are two objects, so there are two formats: `cvat` writes boxes, `cvat-polygons` outlines. `occluded` is set
where more than 5 % of an object is hidden, as for VOC; `visible` and `truncated` are attributes, and `box_id`, which
is the same in every image of a session. An image's id is its place in the dataset.
"""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from numba import njit

from ars_web.datasets.samples import LabelTable, Outlines
from ars_web.datasets.writers.cvat_meta import labels_json, labels_xml
from ars_web.datasets.writers.digits import Buffer, put_bytes, put_decimal, scaled
from ars_web.datasets.writers.joining import join_files
from ars_web.datasets.writers.texts import packed, xml_text, xml_value
from ars_web.datasets.writers.voc import HIDDEN_BEYOND
from ars_web.datasets.writers.writer import Dataset, FileDigests, Shard, Writer

ANNOTATIONS = "annotations.xml"

_FRAGMENT = "images.xml"


def _text(text: str) -> UInt8[np.ndarray, "size"]:
    return np.frombuffer(text.encode(), dtype=np.uint8)


XTL, YTL, XBR, YBR = _text('" xtl="'), _text('" ytl="'), _text('" xbr="'), _text('" ybr="')
POINTS, Z_ORDER = _text('" points="'), _text('" z_order="0">\n')
VISIBLE, TRUNCATED = _text('      <attribute name="visible">'), _text('      <attribute name="truncated">')
END_ATTRIBUTE, END_BOX, END_POLYGON = _text("</attribute>\n"), _text("    </box>\n"), _text("    </polygon>\n")
_END_IMAGE = _text("  </image>\n")

FIXED_BYTES = 512
"""More than the longest shape without its label, its box's id and its ring."""

POINT_BYTES = 2 * 13
"""An image of 100 million pixels in one row: nine digits, a point, two decimals and a separator, twice."""


def images_xml(
    table: LabelTable,
    keep: Bool[np.ndarray, "n b"],
    outlines: Outlines,
    *,
    heads: Sequence[str],
    labels: Sequence[str],
    box_ids: Sequence[int],
    polygons: bool,
) -> UInt8[np.ndarray, "size"]:
    """`<image>` elements with the kept labels of each frame.

    `heads` are the elements' start tags, `labels` the class name of each box, escaped. A label without an outline has
    its box for one.
    """
    shape = "polygon" if polygons else "box"
    before = packed(f'    <{shape} label="{label}" source="file" occluded="' for label in labels)
    after = packed(f'      <attribute name="box_id">{i}</attribute>\n' for i in box_ids)
    starts = packed(heads)
    longest = int(np.diff(before[1]).max(initial=0) + np.diff(after[1]).max(initial=0))
    points = int(keep.sum()) * 4 + len(outlines.points)
    size = len(starts[0]) + len(heads) * 16 + int(keep.sum()) * (FIXED_BYTES + longest) + points * POINT_BYTES
    buffer = np.empty(size, dtype=np.uint8)
    end = _images(
        table.bbox,
        table.visible,
        table.truncated,
        keep,
        outlines.points,
        outlines.starts,
        *starts,
        *before,
        *after,
        polygons,
        buffer,
    )
    return buffer[:end]


@njit(cache=True)
def _images(
    bbox: Float[np.ndarray, "n b 4"],
    visible: Float[np.ndarray, "n b"],
    truncated: Float[np.ndarray, "n b"],
    keep: Bool[np.ndarray, "n b"],
    points: Float[np.ndarray, "m 2"],
    starts: Int[np.ndarray, "k"],
    heads: Buffer,
    head_starts: Int[np.ndarray, "n+1"],
    before: Buffer,
    before_starts: Int[np.ndarray, "b+1"],
    after: Buffer,
    after_starts: Int[np.ndarray, "b+1"],
    polygons: bool,
    buffer: Buffer,
) -> int:
    place = 0
    boxes = keep.shape[1]
    for frame in range(keep.shape[0]):
        place = put_bytes(buffer, place, heads[head_starts[frame] : head_starts[frame + 1]])
        for box in range(boxes):
            if not keep[frame, box]:
                continue
            place = put_bytes(buffer, place, before[before_starts[box] : before_starts[box + 1]])
            buffer[place] = 49 if visible[frame, box] < 1 - HIDDEN_BEYOND else 48
            place += 1
            if polygons:
                ring = points[starts[frame * boxes + box] : starts[frame * boxes + box + 1]]
                place = _put_points(buffer, place, ring, bbox[frame, box])
            else:
                place = put_sides(buffer, place, bbox[frame, box])
            place = put_bytes(buffer, place, Z_ORDER)
            place = put_bytes(buffer, place, after[after_starts[box] : after_starts[box + 1]])
            place = put_shares(buffer, place, visible[frame, box], truncated[frame, box])
            place = put_bytes(buffer, place, END_POLYGON if polygons else END_BOX)
        place = put_bytes(buffer, place, _END_IMAGE)
    return place


@njit(cache=True)
def put_sides(buffer: Buffer, place: int, bbox: Float[np.ndarray, "4"]) -> int:
    """The four sides of a box, as values of its start tag."""
    place = put_decimal(buffer, put_bytes(buffer, place, XTL), scaled(bbox[0], 100.0), 2)
    place = put_decimal(buffer, put_bytes(buffer, place, YTL), scaled(bbox[1], 100.0), 2)
    place = put_decimal(buffer, put_bytes(buffer, place, XBR), scaled(bbox[2], 100.0), 2)
    return put_decimal(buffer, put_bytes(buffer, place, YBR), scaled(bbox[3], 100.0), 2)


@njit(cache=True)
def put_shares(buffer: Buffer, place: int, visible: float, truncated: float) -> int:
    """The attributes `visible` and `truncated`."""
    place = put_decimal(buffer, put_bytes(buffer, place, VISIBLE), scaled(visible, 1e4), 4)
    place = put_bytes(buffer, place, END_ATTRIBUTE)
    place = put_decimal(buffer, put_bytes(buffer, place, TRUNCATED), scaled(truncated, 1e4), 4)
    return put_bytes(buffer, place, END_ATTRIBUTE)


@njit(cache=True)
def _put_points(buffer: Buffer, place: int, ring: Float[np.ndarray, "k 2"], bbox: Float[np.ndarray, "4"]) -> int:
    if len(ring) < 3:
        ring = np.empty((4, 2))
        ring[0, 0], ring[0, 1] = bbox[0], bbox[1]
        ring[1, 0], ring[1, 1] = bbox[0], bbox[3]
        ring[2, 0], ring[2, 1] = bbox[2], bbox[3]
        ring[3, 0], ring[3, 1] = bbox[2], bbox[1]
    place = put_bytes(buffer, place, POINTS)
    for i in range(len(ring)):
        if i > 0:
            buffer[place] = 59  # ";"
            place += 1
        place = put_decimal(buffer, place, scaled(ring[i, 0], 100.0), 2)
        buffer[place] = 44  # ","
        place = put_decimal(buffer, place + 1, scaled(ring[i, 1], 100.0), 2)
    return place


def _write(shard: Shard, files: Path, fragments: Path, *, polygons: bool) -> FileDigests:
    subsets = ("train", "val", "test")
    heads = [
        f'  <image id="{shard.first + i}" name="{name}" subset="{split}" task_id="{subsets.index(split)}"'
        f' width="{width}" height="{height}">\n'
        for i, (name, split, (width, height)) in enumerate(
            zip(shard.image_names, shard.splits, shard.sizes.tolist(), strict=True)
        )
    ]
    content = images_xml(
        shard.table,
        shard.keep,
        shard.outlines,
        heads=heads,
        labels=[xml_value(shard.class_names[place]) for place in shard.class_of_box.tolist()],
        box_ids=shard.session.box_ids,
        polygons=polygons,
    )
    (fragments / _FRAGMENT).write_bytes(content.data)
    return {}


def _join(dataset: Dataset, fragments: Sequence[Path], folder: Path, *, shape: str) -> FileDigests:
    for split in dataset.splits:
        (folder / "images" / split).mkdir(parents=True, exist_ok=True)
    tasks = "".join(
        f"        <task>\n          <id>{number}</id>\n          <name>{split}</name>\n"
        f"          <mode>annotation</mode>\n          <subset>{split}</subset>\n        </task>\n"
        for number, split in enumerate(dataset.splits)
    )
    head = (
        '<?xml version="1.0" encoding="utf-8"?>\n<annotations>\n  <version>1.1</version>\n  <meta>\n    <project>\n'
        f"      <name>{xml_text(dataset.description)}</name>\n      <tasks>\n{tasks}      </tasks>\n"
        f"{labels_xml(dataset.class_names, shape)}      <subsets>{chr(10).join(dataset.splits)}</subsets>\n"
        "    </project>\n  </meta>\n"
    )
    sources = [fragment / _FRAGMENT for fragment in fragments]
    (folder / "labels.json").write_text(labels_json(dataset.class_names, shape), encoding="utf-8")
    digest = join_files(sources, folder / ANNOTATIONS, head=head.encode(), tail=b"</annotations>\n")
    return {ANNOTATIONS: digest}


def _image_folder(split: str) -> str:
    return f"images/{split}"


def _writer(
    format: str,  # noqa: A002 - the contract's name
    title: str,
    description: str,
    *,
    shows: str,
    write: Callable[[Shard, Path, Path], FileDigests],
    shape: str,
) -> Writer:
    return Writer(
        format=format,
        title=title,
        description=description,
        label_folder=ANNOTATIONS,
        image_folder=_image_folder,
        write=write,
        join=partial(_join, shape=shape),
        shows=(shows,),
        with_visible=True,
        with_outlines=shape == "polygon",
    )


WRITER = _writer(
    "cvat",
    "CVAT boxes",
    "For looking at labels and mending them in CVAT: boxes, with the object's id and how much of it is seen.",
    shows="box",
    write=partial(_write, polygons=False),
    shape="rectangle",
)

POLYGONS = _writer(
    "cvat-polygons",
    "CVAT polygons",
    "For looking at outlines and mending them in CVAT: polygons, with the object's id and how much of it is seen.",
    shows="outline",
    write=partial(_write, polygons=True),
    shape="polygon",
)
