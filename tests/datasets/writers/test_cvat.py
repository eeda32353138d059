"""CVAT's XML: by datumaro's importer, which CVAT's own is made from, and beside a readable twin."""

import math
import warnings
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from ars_web.datasets.jobs import plan_export, run_export
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.samples import LabelTable, Outlines
from ars_web.datasets.writers.cvat import images_xml
from ars_web.datasets.writers.cvat_video import track_boxes
from ars_web.datasets.writers.texts import xml_text, xml_value
from ars_web.sessions.model import SessionSnapshot

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    import datumaro as dm

Make = Callable[..., SessionSnapshot]


def exported(snapshots: list[SessionSnapshot], kind: str, out: Path, *, shard: int = 5, **changes: object) -> Path:
    options = ExportOptions.model_validate(changes)
    run_export(plan_export(snapshots, format=kind, options=options, out=out, frames_per_shard=shard))
    return out


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # its own
@pytest.mark.parametrize("kind", ["cvat", "cvat-polygons"])
def test_images_by_datumaro(export: Callable[..., object], kind: str) -> None:
    expected = export(kind)
    dataset = dm.Dataset.import_from(str(expected.folder), "cvat")
    assert sorted(dataset.subsets()) == ["train", "val"]
    labels = dataset.categories()[dm.AnnotationType.label]
    assert [label.name for label in labels.items] == ["cube", "tall one"]
    assert {item.id: item.subset for item in dataset} == expected.splits
    for item in dataset:
        boxes = expected.boxes[item.id]
        assert [a.label for a in item.annotations] == expected.classes[item.id]
        assert item.media.data.shape[:2] == (48, 64)
        for annotation, (x0, y0, x1, y1) in zip(item.annotations, boxes.tolist(), strict=True):
            x, y, w, h = annotation.get_bbox()
            assert np.abs(np.array([x, y, x + w, y + h]) - [x0, y0, x1, y1]).max() < (0.2 if "poly" in kind else 0.011)
            assert annotation.attributes["box_id"] in ("1", "2", "3")
            assert 0 <= annotation.attributes["visible"] <= 1
            assert 0 <= annotation.attributes["truncated"] <= 1
            assert annotation.attributes["occluded"] == (annotation.attributes["visible"] < 0.95)
        assert len({annotation.attributes["box_id"] for annotation in item.annotations}) == len(boxes)


def test_odd_names_are_what_they_were_and_each_label_is_told(make_snapshot: Make, tmp_path: Path) -> None:
    names = ("a \"b\" & 'c' <d>", "läßt\u00a0e\u4e2d\U0001f642", "never used")
    snapshot = make_snapshot(3, classes=names, objects=None)
    for kind in ("cvat", "cvat-polygons", "cvat-video"):
        root = ElementTree.parse(exported([snapshot], kind, tmp_path / kind) / "annotations.xml").getroot()
        told = [e.findtext("name") for e in root.iter("label")]
        assert told == [name.replace("\u00a0", "_") for name in names]
        used = {e.get("label") for e in root.iter() if e.get("label")}
        assert used <= set(told)
        assert len(used) == 3


def test_what_xml_cannot_hold_is_a_line() -> None:
    assert xml_text('\x00a\n"<&>') == '_a_"&lt;&amp;&gt;'
    assert xml_value('\x00a\n"<&>') == "_a_&quot;&lt;&amp;&gt;"


def test_a_merged_session_keeps_its_images_and_ids(make_snapshot: Make, tmp_path: Path) -> None:
    snapshots = [make_snapshot(4), make_snapshot(3, sid="s2")]
    root = ElementTree.parse(exported(snapshots, "cvat", tmp_path / "d") / "annotations.xml").getroot()
    images = list(root.iter("image"))
    assert [image.get("id") for image in images] == [str(i) for i in range(7)]
    assert [image.get("name") for image in images][3:5] == ["s1_0003.jpg", "s2_0000.jpg"]
    for image in images:
        assert (tmp_path / "d" / "images" / image.get("subset", "") / image.get("name", "")).is_file()


# Tracks.


def tracks(folder: Path) -> dict[tuple[str, str], dict[int, ElementTree.Element]]:
    """The boxes of each track by frame, by its id and label."""
    root = ElementTree.parse(folder / "annotations.xml").getroot()
    return {
        (track.get("id", ""), track.get("label", "")): {int(box.get("frame", "")): box for box in track.iter("box")}
        for track in root.iter("track")
    }


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_tracks_by_datumaro(make_snapshot: Make, tmp_path: Path) -> None:
    folder = exported([make_snapshot(12)], "cvat-video", tmp_path / "d")
    dataset = dm.Dataset.import_from(str(folder), "cvat")
    seen = [a for item in dataset for a in item.annotations if not a.attributes["outside"]]
    written = [b for boxes in tracks(folder).values() for b in boxes.values() if b.get("outside") == "0"]
    assert len(seen) == len(written) > 20
    assert {a.attributes["track_id"] for a in seen} == {0, 1, 2}
    assert all(a.attributes["keyframe"] for a in seen)


def test_a_track_says_where_it_is_over_and_is_the_same_whatever_the_shards(make_snapshot: Make, tmp_path: Path) -> None:
    snapshots = [make_snapshot(12), make_snapshot(4, sid="s2")]
    folders = [exported(snapshots, "cvat-video", tmp_path / str(n), shard=n) for n in (1, 2, 3, 12)]
    contents = {(folder / "annotations.xml").read_bytes() for folder in folders}
    assert len(contents) == 1
    found = tracks(folders[0])
    assert [i for i, _ in found] == [str(i) for i in range(6)]
    over = 0
    for number, boxes in enumerate(found.values()):
        first, last = (0, 11) if number < 3 else (12, 15)
        frames = sorted(boxes)
        assert boxes[frames[0]].get("outside") == "0"
        assert all(box.get("keyframe") == "1" for box in boxes.values())
        for frame, box in boxes.items():
            if box.get("outside") == "0":
                assert first <= frame <= last
                # The next frame has a box, or says that there is none; after the dataset's last there is no frame.
                assert frame + 1 in boxes or frame == 15
            else:
                over += 1
                before = boxes[frame - 1]
                assert before.get("outside") == "0"
                assert [before.get(s) for s in ("xtl", "ytl", "xbr", "ybr")] == [
                    box.get(s) for s in ("xtl", "ytl", "xbr", "ybr")
                ]
    assert over == 3


def test_an_object_that_is_never_seen_has_no_track(make_snapshot: Make, tmp_path: Path) -> None:
    folder = exported([make_snapshot(4)], "cvat-video", tmp_path / "d", max_truncated=0.0, min_area_px=100.0)
    kept = [len(boxes) for boxes in tracks(folder).values()]
    assert 0 < len(kept) < 3
    assert min(kept) > 0
    empty = exported([make_snapshot(2, objects=[])], "cvat-video", tmp_path / "e")
    assert tracks(empty) == {}


# The compiled writers beside readable ones.


def decimal(value: float, decimals: int) -> str:
    whole, fraction = divmod(math.floor(value * 10**decimals + 0.5), 10**decimals)
    return f"{whole}.{fraction:0{decimals}d}"


def sides(bbox: list[float]) -> str:
    return "".join(f' {n}="{decimal(v, 2)}"' for n, v in zip(("xtl", "ytl", "xbr", "ybr"), bbox, strict=True))


def attributes(box_id: int, visible: float, truncated: float) -> str:
    values = (("box_id", str(box_id)), ("visible", decimal(visible, 4)), ("truncated", decimal(truncated, 4)))
    return "".join(f'      <attribute name="{name}">{value}</attribute>\n' for name, value in values)


def random_labels(seed: int, n: int, b: int) -> tuple[LabelTable, np.ndarray, Outlines]:
    random = np.random.default_rng(seed)
    bbox = (np.sort(random.random((n, b, 2, 2)), axis=2) * random.choice([3, 700, 99_999], (n, b, 1, 1))).reshape(
        n, b, 4
    )
    keep = random.random((n, b)) < 0.6
    lengths = np.where(keep, random.integers(0, 6, (n, b)), 0).ravel()
    starts = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)
    table = LabelTable(bbox, bbox - 1, random.random((n, b)), random.random((n, b)))
    return table, keep, Outlines(random.random((int(starts[-1]), 2)) * 1000, starts)


@pytest.mark.parametrize("polygons", [False, True])
@pytest.mark.parametrize(("seed", "n", "b"), [(0, 5, 4), (1, 3, 0), (2, 0, 3), (3, 9, 7)])
def test_fast_and_readable_images_agree(seed: int, n: int, b: int, polygons: bool) -> None:
    table, keep, outlines = random_labels(seed, n, b)
    labels, ids, heads = [f"class {i % 3} é" for i in range(b)], [10**i for i in range(b)], [f"<{i}>" for i in range(n)]
    fast = images_xml(table, keep, outlines, heads=heads, labels=labels, box_ids=ids, polygons=polygons)
    slow = ""
    for frame in range(n):
        slow += heads[frame]
        for box in np.flatnonzero(keep[frame]).tolist():
            x0, y0, x1, y1 = table.bbox[frame, box].tolist()
            ring = outlines.points[outlines.starts[frame * b + box] : outlines.starts[frame * b + box + 1]].tolist()
            ring = ring if len(ring) > 2 else [[x0, y0], [x0, y1], [x1, y1], [x1, y0]]
            points = ";".join(f"{decimal(x, 2)},{decimal(y, 2)}" for x, y in ring)
            tag = "polygon" if polygons else "box"
            where = f' points="{points}"' if polygons else sides([x0, y0, x1, y1])
            visible = table.visible[frame, box]
            slow += (
                f'    <{tag} label="{labels[box]}" source="file" occluded="{int(visible < 0.95)}"{where} z_order="0">'
            )
            slow += f"\n{attributes(ids[box], visible, table.truncated[frame, box])}    </{tag}>\n"
        slow += "  </image>\n"
    assert fast.tobytes().decode() == slow


@pytest.mark.parametrize(("seed", "n", "b"), [(0, 9, 4), (1, 3, 0), (3, 12, 7)])
def test_fast_and_readable_tracks_agree(seed: int, n: int, b: int) -> None:
    table, keep, _ = random_labels(seed, n, b)
    fast, starts = track_boxes(table, keep, range(b), first=95)
    for box in range(b):
        slow = ""
        for frame in range(n):
            seen, before = keep[frame, box], frame > 0 and keep[frame - 1, box]
            if not seen and not before:
                continue
            visible, truncated = (table.visible[frame, box], table.truncated[frame, box]) if seen else (0.0, 1.0)
            slow += f'    <box frame="{95 + frame}" keyframe="1" outside="{int(not seen)}"'
            slow += f' occluded="{int(seen and visible < 0.95)}"'
            slow += f'{sides(table.bbox[frame if seen else frame - 1, box].tolist())} z_order="0">\n'
            slow += f"{attributes(box, visible, truncated)}    </box>\n"
        assert fast[starts[box] : starts[box + 1]].tobytes().decode() == slow
