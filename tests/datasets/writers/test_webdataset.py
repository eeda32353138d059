"""WebDataset's tar files: by the webdataset library, by their indices, and the same bytes whatever the shards."""

import gc
import io
import json
import tarfile
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
import webdataset

from ars_web.datasets.file_names import LONGEST, stems
from ars_web.datasets.jobs import plan_export, run_export
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.readback import webdataset as readback
from ars_web.datasets.readback.comparison import compare
from ars_web.datasets.writers import sample_files
from ars_web.datasets.writers.webdataset import key_of, stem_of, tar_member
from ars_web.errors import BadFile
from ars_web.sessions.model import SessionSnapshot

Make = Callable[..., SessionSnapshot]
Tree = Callable[[Path], dict[str, str]]


@pytest.fixture
def small_files(monkeypatch: pytest.MonkeyPatch) -> None:
    """Files of four samples."""
    monkeypatch.setattr(sample_files, "SAMPLES", 4)
    monkeypatch.setattr("ars_web.datasets.writers.webdataset.SAMPLES", 4)


def samples(paths: list[Path]) -> list[dict]:
    """What the library reads. It leaves files open, which is a warning once they are forgotten."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)
        found = list(webdataset.WebDataset([str(path) for path in sorted(paths)], shardshuffle=False))
        gc.collect()
    return found


def test_by_the_library(export: Callable[..., object]) -> None:
    expected = export("webdataset")
    for split in ("train", "val"):
        found = samples(list((expected.folder / "shards").glob(f"{split}-*.tar")))
        assert {sample["__key__"] for sample in found} == {s for s, of in expected.splits.items() if of == split}
        for sample in found:
            image = cv2.imdecode(np.frombuffer(sample["jpg"], dtype=np.uint8), cv2.IMREAD_COLOR)
            document = json.loads(sample["json"])
            assert image.shape[:2] == (document["height"], document["width"])
            stem = sample["__key__"]
            boxes = np.array([label["bbox"] for label in document["labels"]]).reshape(-1, 4)
            assert np.abs(boxes - expected.boxes[stem]).max(initial=0) <= 0.006
            assert [label["class_id"] for label in document["labels"]] == expected.classes[stem]
            assert all(len(label["keypoints"]) == 9 for label in document["labels"])


@pytest.mark.usefixtures("small_files")
@pytest.mark.parametrize("by", ["block", "frame"])
def test_files_have_a_fixed_number_of_samples_whatever_the_shards(
    make_snapshot: Make, tree: Tree, tmp_path: Path, by: str
) -> None:
    snapshots = [make_snapshot(12), make_snapshot(5, sid="s2")]
    options = ExportOptions.model_validate({"split": {"by": by}})
    trees: list[dict[str, str]] = []
    for shard in (1, 3, 12):
        out = tmp_path / str(shard)
        run_export(plan_export(snapshots, format="webdataset", options=options, out=out, frames_per_shard=shard))
        trees.append(tree(out))
    assert trees[0] == trees[1] == trees[2]
    train = json.loads((tmp_path / "1" / "shards" / "train.json").read_bytes())["shardlist"]
    assert [shard["nsamples"] for shard in train] == [4] * (len(train) - 1) + [train[-1]["nsamples"]]
    assert len(train) > 2
    for shard in train:
        assert (tmp_path / "1" / "shards" / shard["url"]).stat().st_size == shard["filesize"]


@pytest.mark.usefixtures("small_files")
def test_indices_say_where_each_file_is(make_snapshot: Make, tmp_path: Path) -> None:
    options = ExportOptions.model_validate({})
    plan = plan_export(
        [make_snapshot(12)], format="webdataset", options=options, out=tmp_path / "d", frames_per_shard=5
    )
    run_export(plan)
    for path in sorted((tmp_path / "d" / "shards").glob("*.tar")):
        content, lines = path.read_bytes(), path.with_suffix(".idx").read_text().splitlines()
        with tarfile.open(path) as tar:
            members = tar.getmembers()
            assert lines[0] == f"v1.2 {len(members) // 2}"
            words = [word for line in lines[1:] for word in line.split(" ")]
            assert words == [str(w) for m in members for w in (m.name.partition(".")[2], m.offset_data, m.size, m.name)]
            for member in members:
                file = tar.extractfile(member)
                assert file is not None
                assert content[member.offset_data : member.offset_data + member.size] == file.read()
            assert [m.name.split(".")[1] for m in members] == ["jpg", "json"] * (len(members) // 2)
            assert {(m.mtime, m.uid, m.gid, m.uname, m.gname, m.mode) for m in members} == {(0, 0, 0, "", "", 0o644)}


def test_a_key_ends_at_its_first_dot_and_no_two_are_alike(make_snapshot: Make, tmp_path: Path) -> None:
    names = ["a.b.jpg", "a_b.jpg", "a=b.jpg", f"{'n' * 200}.jpg"]
    snapshot = make_snapshot(4)
    images = [path.with_name(name) for path, name in zip(snapshot.frames.images, names, strict=True)]
    for old, new in zip(snapshot.frames.images, images, strict=True):
        old.rename(new)
    snapshot = replace(snapshot, frames=replace(snapshot.frames, names=tuple(names), images=tuple(images)))
    plan = plan_export([snapshot], format="webdataset", options=ExportOptions.model_validate({}), out=tmp_path / "d")
    run_export(plan)
    keys = [sample["__key__"] for sample in samples(list((tmp_path / "d" / "shards").glob("*.tar")))]
    assert sorted(keys) == sorted(["a=b", "a_b", "a_b-2", "n" * LONGEST])
    assert {stem_of(key) for key in keys} == set(stems(names)) == set(plan.frames.stems)
    assert compare(plan, plan.out).agrees
    assert key_of("a.b") == "a=b"


def test_a_name_too_long_for_ustar_is_read_all_the_same() -> None:
    name = "k" * 120 + ".json"
    tar = b"".join(tar_member(name, b"content")) + bytes(1024)
    assert len(tar) % 512 == 0
    with tarfile.open(fileobj=io.BytesIO(tar)) as file:
        (member,) = file.getmembers()
        assert (member.name, file.extractfile(member).read()) == (name, b"content")


def test_png_stays_png_and_without_images_labels_are_alone(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(3, suffix=".png")
    kinds: list[set[str]] = []
    for images in ("link", "none"):
        options = ExportOptions.model_validate({"images": images})
        report = run_export(plan_export([snapshot], format="webdataset", options=options, out=tmp_path / images))
        with tarfile.open(tmp_path / images / "shards" / "train-000000.tar") as tar:
            kinds.append({name.partition(".")[2] for name in tar.getnames()})
        assert len(report.losses) == (images == "none")
        assert not list((tmp_path / images).rglob("*.png"))
    assert kinds == [{"png", "json"}, {"json"}]


def test_a_split_without_frames_has_an_index_without_files(make_snapshot: Make, tmp_path: Path) -> None:
    options = ExportOptions.model_validate({"images": "none"})
    run_export(plan_export([make_snapshot(1)], format="webdataset", options=options, out=tmp_path / "d"))
    assert json.loads((tmp_path / "d" / "shards" / "val.json").read_bytes())["shardlist"] == []
    assert not list((tmp_path / "d" / "shards").glob("val-*"))


def test_without_the_library_the_same_is_read(
    make_snapshot: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    options = ExportOptions.model_validate({})
    plan = plan_export([make_snapshot(4)], format="webdataset", options=options, out=tmp_path / "d")
    run_export(plan)
    assert compare(plan, plan.out).library == "webdataset"
    monkeypatch.setattr(readback, "_has_webdataset", lambda: False)
    found = compare(plan, plan.out)
    assert found.agrees
    assert "not installed" in found.library
    path = tmp_path / "d" / "shards" / "train-000000.tar"
    path.write_bytes(path.read_bytes()[:700])
    with pytest.raises(BadFile, match=r"train-000000\.tar"):
        compare(plan, plan.out)
