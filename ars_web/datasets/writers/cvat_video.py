"""CVAT for video 1.1: `annotations.xml` with a track an object, `images/00000.jpg`, `labels.json`.

Frames are numbered by their place in the dataset, and every box is a keyframe: what CVAT would put between two is not
what the session says. Where an object goes out of sight its track says so with `outside="1"` in the next frame, else
CVAT would keep its last box; an object that is in no frame has no track. Numbers are as in `cvat`. The layout has no
place for splits, so they are lists of images beside it, as for `ars`.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from numba import njit
from pydantic import BaseModel, ConfigDict

from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.samples import LabelTable
from ars_web.datasets.writers.cvat import ANNOTATIONS, END_BOX, FIXED_BYTES, Z_ORDER, put_shares, put_sides
from ars_web.datasets.writers.cvat_meta import labels_json, labels_xml
from ars_web.datasets.writers.digits import Buffer, put_bytes, put_integer, scaled
from ars_web.datasets.writers.joining import Joined, join_files
from ars_web.datasets.writers.texts import packed, xml_text, xml_value
from ars_web.datasets.writers.voc import HIDDEN_BEYOND
from ars_web.datasets.writers.writer import Dataset, FileDigests, Shard, Writer

_SORTED_BY_NAME = 100_000
"""Images whose names of five digits sort as their numbers do."""

_CONTENT, _INDEX = "tracks.xml", "tracks.json"


def _text(text: str) -> UInt8[np.ndarray, "size"]:
    return np.frombuffer(text.encode(), dtype=np.uint8)


_FRAME, _KEYFRAME, _OCCLUDED = _text('    <box frame="'), _text('" keyframe="1" outside="'), _text('" occluded="')


class _Piece(BaseModel):
    """A part of one track.

    Attributes:
        start, end: of its bytes in the shard's file.
        seen_first, seen_last: whether the object is labelled in the shard's first and last frame.
        last: the sides of its last box in hundredths of a pixel.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    start: int
    end: int
    seen_first: bool
    seen_last: bool
    last: tuple[int, int, int, int]


class _Pieces(BaseModel):
    """What a shard has of the tracks of its session: a piece a box. `size` is that of its first image."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    session: int
    first: int
    frames: int
    size: tuple[int, int]
    pieces: list[_Piece]


def track_boxes(
    table: LabelTable, keep: Bool[np.ndarray, "n b"], box_ids: Sequence[int], *, first: int
) -> tuple[UInt8[np.ndarray, "size"], Int[np.ndarray, "b+1"]]:
    """`<box>` elements of each object's track, object after object, and where each object's begin and the last end.

    `first` is the number of the first frame.
    """
    after = packed(f'      <attribute name="box_id">{i}</attribute>\n' for i in box_ids)
    # Every box can be followed by one that says that it is over.
    size = 2 * int(keep.sum()) * (FIXED_BYTES + int(np.diff(after[1]).max(initial=0)))
    buffer = np.empty(size, dtype=np.uint8)
    starts = np.zeros(len(box_ids) + 1, dtype=np.int64)
    end = _track_boxes(table.bbox, table.visible, table.truncated, keep, *after, first, buffer, starts)
    return buffer[:end], starts


@njit(cache=True)
def _track_boxes(
    bbox: Float[np.ndarray, "n b 4"],
    visible: Float[np.ndarray, "n b"],
    truncated: Float[np.ndarray, "n b"],
    keep: Bool[np.ndarray, "n b"],
    after: Buffer,
    after_starts: Int[np.ndarray, "b+1"],
    first: int,
    buffer: Buffer,
    starts: Int[np.ndarray, "b+1"],
) -> int:
    place = 0
    for box in range(keep.shape[1]):
        suffix = after[after_starts[box] : after_starts[box + 1]]
        for frame in range(keep.shape[0]):
            seen = keep[frame, box]
            if not seen and (frame == 0 or not keep[frame - 1, box]):
                continue
            place = put_integer(buffer, put_bytes(buffer, place, _FRAME), first + frame)
            place = put_bytes(buffer, place, _KEYFRAME)
            buffer[place] = 48 if seen else 49
            place = put_bytes(buffer, place + 1, _OCCLUDED)
            buffer[place] = 49 if seen and visible[frame, box] < 1 - HIDDEN_BEYOND else 48
            place = put_sides(buffer, place + 1, bbox[frame if seen else frame - 1, box])
            place = put_bytes(buffer, place, Z_ORDER)
            place = put_bytes(buffer, place, suffix)
            shares = (visible[frame, box], truncated[frame, box]) if seen else (0.0, 1.0)
            place = put_shares(buffer, place, shares[0], shares[1])
            place = put_bytes(buffer, place, END_BOX)
        starts[box + 1] = place
    return place


def _outside(frame: int, sides: Sequence[int], box_id: int) -> bytes:
    """What `track_boxes` writes where a track is over, of one that went on to the end of its shard."""
    xtl, ytl, xbr, ybr = (f"{side // 100}.{side % 100:02d}" for side in sides)
    return (
        f'    <box frame="{frame}" keyframe="1" outside="1" occluded="0" xtl="{xtl}" ytl="{ytl}" xbr="{xbr}"'
        f' ybr="{ybr}" z_order="0">\n      <attribute name="box_id">{box_id}</attribute>\n'
        '      <attribute name="visible">0.0000</attribute>\n      <attribute name="truncated">1.0000</attribute>\n'
        "    </box>\n"
    ).encode()


def _write(shard: Shard, files: Path, fragments: Path) -> FileDigests:
    content, starts = track_boxes(shard.table, shard.keep, shard.session.box_ids, first=shard.first)
    (fragments / _CONTENT).write_bytes(content.data)
    pieces: list[_Piece] = []
    for box in range(shard.keep.shape[1]):
        seen = shard.keep[:, box]
        x0, y0, x1, y1 = (scaled(v, 100.0) if seen[-1] else 0 for v in shard.table.bbox[-1, box].tolist())
        pieces.append(
            _Piece(
                start=int(starts[box]),
                end=int(starts[box + 1]),
                seen_first=bool(seen[0]),
                seen_last=bool(seen[-1]),
                last=(x0, y0, x1, y1),
            )
        )
    width, height = shard.sizes[0].tolist()
    index = _Pieces(
        session=shard.session_number,
        first=shard.first,
        frames=len(shard.stems),
        size=(width, height),
        pieces=pieces,
    )
    (fragments / _INDEX).write_text(index.model_dump_json(), encoding="utf-8")
    for split in sorted(set(shard.splits)):
        lines = (f"images/{n}\n" for n, s in zip(shard.image_names, shard.splits, strict=True) if s == split)
        (fragments / f"{split}.txt").write_text("".join(lines), encoding="utf-8")
    return {}


def _join(dataset: Dataset, fragments: Sequence[Path], folder: Path) -> FileDigests:
    (folder / "images").mkdir(parents=True, exist_ok=True)
    for split in dataset.splits:
        join_files([f / f"{split}.txt" for f in fragments], folder / f"{split}.txt")
    (folder / "labels.json").write_text(labels_json(dataset.class_names, "rectangle"), encoding="utf-8")
    indices = [_Pieces.model_validate_json((fragment / _INDEX).read_bytes()) for fragment in fragments]
    number = 0
    with Joined(folder / ANNOTATIONS) as joined:
        joined.add(_head(dataset, indices).encode())
        for session_number, session in enumerate(dataset.sessions):
            of_session = [(f, i) for f, i in zip(fragments, indices, strict=True) if i.session == session_number]
            for box, box_id in enumerate(session.box_ids):
                if all(index.pieces[box].start == index.pieces[box].end for _, index in of_session):
                    continue
                label = xml_value(dataset.class_names[session.class_of_box[box]])
                joined.add(f'  <track id="{number}" label="{label}" source="file">\n'.encode())
                for part in _track(of_session, box, box_id, frames=sum(index.frames for index in indices)):
                    joined.add(part)
                joined.add(b"  </track>\n")
                number += 1
        joined.add(b"</annotations>\n")
    return {ANNOTATIONS: joined.sha256}


def _track(shards: Sequence[tuple[Path, _Pieces]], box: int, box_id: int, *, frames: int) -> Iterator[bytes]:
    """The bytes of one object's track; `frames` are those of the dataset."""
    for number, (fragment, index) in enumerate(shards):
        piece = index.pieces[box]
        if piece.start < piece.end:
            with (fragment / _CONTENT).open("rb") as file:
                file.seek(piece.start)
                yield file.read(piece.end - piece.start)
        after = index.first + index.frames
        goes_on = number + 1 < len(shards) and shards[number + 1][1].pieces[box].seen_first
        if piece.seen_last and not goes_on and after < frames:
            yield _outside(after, piece.last, box_id)


def _head(dataset: Dataset, indices: Sequence[_Pieces]) -> str:
    frames = sum(index.frames for index in indices)
    # A video has one size, and datumaro asks for it. Of images CVAT knows each one's own.
    width, height = indices[0].size
    size = (
        f"      <original_size>\n        <width>{width}</width>\n        <height>{height}</height>\n"
        "      </original_size>\n"
    )
    return (
        '<?xml version="1.0" encoding="utf-8"?>\n<annotations>\n  <version>1.1</version>\n  <meta>\n    <task>\n'
        f"      <id>0</id>\n      <name>{xml_text(dataset.description)}</name>\n      <size>{frames}</size>\n"
        f"      <mode>interpolation</mode>\n      <start_frame>0</start_frame>\n"
        f"      <stop_frame>{frames - 1}</stop_frame>\n{labels_xml(dataset.class_names, 'rectangle')}{size}"
        "    </task>\n  </meta>\n"
    )


def _losses(plan: ExportPlan) -> Sequence[str]:
    lines: list[str] = []
    used = len(np.unique(plan.frames.split))
    if used > 1:
        lines.append(f"tracks run through all {used} splits; which image is in which is in lists beside them")
    if len(plan.frames) > _SORTED_BY_NAME:
        lines.append(
            f"of {len(plan.frames)} images those from {_SORTED_BY_NAME} on have names of six digits: let CVAT sort them"
            " naturally, not by name"
        )
    return lines


WRITER = Writer(
    format="cvat-video",
    title="CVAT tracks",
    description=(
        "For looking at labels and mending them in CVAT, frame after frame: a track of boxes an object, for one task."
    ),
    label_folder=ANNOTATIONS,
    image_folder=lambda split: "images",
    write=_write,
    join=_join,
    losses=_losses,
    with_visible=True,
    numbered=True,
)
