"""COCO: `images/`, `annotations/instances_{train,val}.json`.

Image ids and category ids start at 1, as COCO's own tools expect; an annotation's id follows from its image and its
box, so that shards can write final bytes. `bbox` is top left x, y, width, height of the part in the image,
`segmentation` its outline and `area` the outline's. `keypoints` are pixel indices, as COCO's own are: 0.5 less than the
coordinates of `bbox` and `segmentation`, which are edges. Beyond COCO: `amodal_bbox` of the whole object, unclipped,
`visible` and `truncated`.
"""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from numba import njit

from ars_web.datasets.label_functions import Marks
from ars_web.datasets.planned import PlannedClass
from ars_web.datasets.samples import LabelTable, Outlines
from ars_web.datasets.writers.digits import Buffer, put_bytes, put_decimal, put_integer, scaled
from ars_web.datasets.writers.joining import Joined
from ars_web.datasets.writers.writer import Dataset, FileDigests, Shard, Writer
from ars_web.geometry.box import EDGES
from ars_web.geometry.keypoints import DEFAULT_KEYPOINTS


def _text(text: str) -> UInt8[np.ndarray, "size"]:
    return np.frombuffer(text.encode(), dtype=np.uint8)


_ID = _text('{"id":')
_IMAGE = _text(',"image_id":')
_CATEGORY = _text(',"category_id":')
_BBOX = _text(',"bbox":[')
_AREA = _text('],"area":')
_SEGMENTATION = _text(',"iscrowd":0,"segmentation":[[')
_KEYPOINTS = _text(']],"keypoints":[')
_COUNT = _text('],"num_keypoints":')
_AMODAL = _text(',"amodal_bbox":[')
_VISIBLE = _text('],"visible":')
_TRUNCATED = _text(',"truncated":')

_FIXED_BYTES = 512
"""More than the longest annotation without its ring and its keypoints."""

_POINT_BYTES = 2 * 13
"""An image of 100 million pixels in one row: nine digits, a point, two decimals and a comma, twice."""

_KEYPOINT_BYTES = _POINT_BYTES + 2
"""Then a digit and a comma."""


def annotations(
    table: LabelTable,
    keep: Bool[np.ndarray, "n b"],
    outlines: Outlines,
    class_of_box: Int[np.ndarray, "b"],
    marks: Marks,
    keypoints_of_box: Int[np.ndarray, "b"],
    *,
    first: int,
    most_boxes: int,
) -> UInt8[np.ndarray, "size"]:
    """The kept annotations as JSON objects with commas between them.

    `first` is the place of the first frame in the dataset: image ids are places + 1, annotation ids are
    place * most_boxes + box + 1. Coordinates and areas have two decimals, shares four, rounded halves up;
    `x + width` is exactly the rounded right edge. A label without an outline has its box for one. Of a box's points
    in `marks` the first `keypoints_of_box` are written.
    """
    kept = int(keep.sum())
    points = kept * 4 + len(outlines.points)
    keypoints = int((keep * keypoints_of_box).sum())
    size = kept * _FIXED_BYTES + points * _POINT_BYTES + keypoints * _KEYPOINT_BYTES
    buffer = np.empty(size, dtype=np.uint8)
    end = _annotations(
        table.bbox,
        table.bbox_amodal,
        table.truncated,
        table.visible,
        keep,
        outlines.points,
        outlines.starts,
        class_of_box.astype(np.int64),
        marks.points,
        marks.states.astype(np.int64),
        keypoints_of_box.astype(np.int64),
        first,
        most_boxes,
        buffer,
    )
    return buffer[:end]


@njit(cache=True)
def _annotations(
    bbox: Float[np.ndarray, "n b 4"],
    amodal: Float[np.ndarray, "n b 4"],
    truncated: Float[np.ndarray, "n b"],
    visible: Float[np.ndarray, "n b"],
    keep: Bool[np.ndarray, "n b"],
    points: Float[np.ndarray, "m 2"],
    starts: Int[np.ndarray, "k"],
    class_of_box: Int[np.ndarray, "b"],
    keypoints: Float[np.ndarray, "n b k 2"],
    states: Int[np.ndarray, "n b k"],
    keypoints_of_box: Int[np.ndarray, "b"],
    first: int,
    most_boxes: int,
    buffer: Buffer,
) -> int:
    place = 0
    boxes = keep.shape[1]
    for frame in range(keep.shape[0]):
        for box in range(boxes):
            if not keep[frame, box]:
                continue
            if place > 0:
                buffer[place] = 44  # ","
                place += 1
            place = put_bytes(buffer, place, _ID)
            place = put_integer(buffer, place, (first + frame) * most_boxes + box + 1)
            place = put_bytes(buffer, place, _IMAGE)
            place = put_integer(buffer, place, first + frame + 1)
            place = put_bytes(buffer, place, _CATEGORY)
            place = put_integer(buffer, place, class_of_box[box] + 1)
            place = put_bytes(buffer, place, _BBOX)
            place = _put_bbox(buffer, place, bbox[frame, box])
            ring = points[starts[frame * boxes + box] : starts[frame * boxes + box + 1]]
            if len(ring) < 3:
                ring = _rectangle(bbox[frame, box])
            place = put_bytes(buffer, place, _AREA)
            place = put_decimal(buffer, place, scaled(_area(ring), 100.0), 2)
            place = put_bytes(buffer, place, _SEGMENTATION)
            for i in range(len(ring)):
                if i > 0:
                    buffer[place] = 44
                    place += 1
                place = put_decimal(buffer, place, scaled(ring[i, 0], 100.0), 2)
                buffer[place] = 44
                place = put_decimal(buffer, place + 1, scaled(ring[i, 1], 100.0), 2)
            place = put_bytes(buffer, place, _KEYPOINTS)
            count = keypoints_of_box[box]
            place, labelled = _put_keypoints(buffer, place, keypoints[frame, box, :count], states[frame, box, :count])
            place = put_bytes(buffer, place, _COUNT)
            place = put_integer(buffer, place, labelled)
            place = put_bytes(buffer, place, _AMODAL)
            place = _put_bbox(buffer, place, amodal[frame, box])
            place = put_bytes(buffer, place, _VISIBLE)
            place = put_decimal(buffer, place, scaled(visible[frame, box], 1e4), 4)
            place = put_bytes(buffer, place, _TRUNCATED)
            place = put_decimal(buffer, place, scaled(truncated[frame, box], 1e4), 4)
            buffer[place] = 125  # "}"
            place += 1
    return place


@njit(cache=True)
def _put_bbox(buffer: Buffer, place: int, bbox: Float[np.ndarray, "4"]) -> int:
    x0, y0 = scaled(bbox[0], 100.0), scaled(bbox[1], 100.0)
    x1, y1 = scaled(bbox[2], 100.0), scaled(bbox[3], 100.0)
    place = put_decimal(buffer, place, x0, 2)
    for value in (y0, x1 - x0, y1 - y0):
        buffer[place] = 44
        place = put_decimal(buffer, place + 1, value, 2)
    return place


@njit(cache=True)
def _put_keypoints(
    buffer: Buffer, place: int, points: Float[np.ndarray, "k 2"], states: Int[np.ndarray, "k"]
) -> tuple[int, int]:
    """`x,y,v` of each point, as pixel indices, zeros where it is not labelled; with the count of those that are."""
    labelled = 0
    for i in range(len(states)):
        x, y = 0, 0
        if states[i] > 0:
            labelled += 1
            # A pixel's index is its centre's coordinate less a half.
            x, y = scaled(points[i, 0] - 0.5, 100.0), scaled(points[i, 1] - 0.5, 100.0)
        if i > 0:
            buffer[place] = 44
            place += 1
        place = put_decimal(buffer, place, x, 2)
        buffer[place] = 44
        place = put_decimal(buffer, place + 1, y, 2)
        buffer[place] = 44
        place = put_integer(buffer, place + 1, states[i])
    return place, labelled


@njit(cache=True)
def _rectangle(bbox: Float[np.ndarray, "4"]) -> Float[np.ndarray, "4 2"]:
    ring = np.empty((4, 2))
    ring[0, 0], ring[0, 1] = bbox[0], bbox[1]
    ring[1, 0], ring[1, 1] = bbox[0], bbox[3]
    ring[2, 0], ring[2, 1] = bbox[2], bbox[3]
    ring[3, 0], ring[3, 1] = bbox[2], bbox[1]
    return ring


@njit(cache=True)
def _area(ring: Float[np.ndarray, "k 2"]) -> float:
    """The shoelace formula, from the first point so that large coordinates do not cost digits."""
    twice = 0.0
    for i in range(1, len(ring) - 1):
        ax, ay = ring[i, 0] - ring[0, 0], ring[i, 1] - ring[0, 1]
        bx, by = ring[i + 1, 0] - ring[0, 0], ring[i + 1, 1] - ring[0, 1]
        twice += ax * by - ay * bx
    return abs(twice) / 2


def _write(shard: Shard, files: Path, fragments: Path) -> FileDigests:
    of_frame = np.array(shard.splits)
    counts = [len(shard.classes[place].keypoints) for place in shard.class_of_box.tolist()]
    for split in sorted(set(shard.splits)):
        in_split = of_frame == split
        images = [
            json.dumps(
                {"id": shard.first + i + 1, "file_name": shard.image_names[i], "width": width, "height": height},
                separators=(",", ":"),
            )
            for i, (width, height) in enumerate(shard.sizes.tolist())
            if in_split[i]
        ]
        (fragments / f"{split}.images").write_text(",".join(images), encoding="utf-8")
        content = annotations(
            shard.table,
            shard.keep & in_split[:, None],
            shard.outlines,
            shard.class_of_box,
            shard.marks["keypoints"],
            np.array(counts, dtype=np.int64),
            first=shard.first,
            most_boxes=shard.most_boxes,
        )
        (fragments / f"{split}.annotations").write_bytes(content.data)
    return {}


def _join(dataset: Dataset, fragments: Sequence[Path], folder: Path) -> FileDigests:
    (folder / "images").mkdir(parents=True, exist_ok=True)
    (folder / "annotations").mkdir(parents=True, exist_ok=True)
    categories = [
        {
            "id": i,
            "name": a_class.name,
            "supercategory": "",
            "keypoints": [point.name for point in a_class.keypoints],
            "skeleton": _skeleton(a_class),
        }
        for i, a_class in enumerate(dataset.classes, start=1)
    ]
    digests: FileDigests = {}
    for split in dataset.splits:
        path = f"annotations/instances_{split}.json"
        with Joined(folder / path) as joined:
            joined.add(b'{"info":' + json.dumps({"description": dataset.description}).encode())
            joined.add(b',"licenses":[],"categories":' + json.dumps(categories).encode())
            joined.add(b',"images":[')
            joined.add_files([f / f"{split}.images" for f in fragments], between=b",")
            joined.add(b'],"annotations":[')
            joined.add_files([f / f"{split}.annotations" for f in fragments], between=b",")
            joined.add(b"]}\n")
        digests[path] = joined.sha256
    return digests


def _skeleton(a_class: PlannedClass) -> list[list[int]]:
    """Which keypoints, counted from 1, are joined by a line: the box's edges, where they are its corners."""
    if a_class.keypoints != DEFAULT_KEYPOINTS:
        return []
    # The first keypoint is the centre.
    return (EDGES + 2).tolist()


WRITER = Writer(
    format="coco",
    title="COCO instances and keypoints",
    description=(
        "For Detectron2, MMDetection and most others: one JSON file a split, with boxes, outlines as polygons,"
        " keypoints, the whole object's box, and how much of it is seen and cut off."
    ),
    label_folder="annotations",
    image_folder=lambda split: "images",
    write=_write,
    join=_join,
    shows=("outline", "box", "keypoints"),
    label_functions=("keypoints",),
    with_visible=True,
    with_outlines=True,
)
