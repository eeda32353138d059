"""TFRecords by protobuf's own parser, with TensorFlow's messages described here, and checksums by the definition."""

import hashlib
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

from ars_web.datasets.jobs import partial_folder, plan_export, run_export
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.readback.comparison import compare
from ars_web.datasets.readback.tfrecord import features_of, records_of
from ars_web.datasets.writers import sample_files
from ars_web.datasets.writers.tf_example import bytes_feature, example, float_feature, int64_feature, record
from ars_web.datasets.writers.tfrecord import label_map
from ars_web.errors import BadFile, BadInput
from ars_web.sessions.model import SessionSnapshot

Make = Callable[..., SessionSnapshot]
Tree = Callable[[Path], dict[str, str]]


def example_class() -> type:
    """`tf.train.Example`, as tensorflow/core/example/{example,feature}.proto say."""
    file = descriptor_pb2.FileDescriptorProto(name="example.proto", package="tensorflow", syntax="proto3")
    kinds = descriptor_pb2.FieldDescriptorProto

    def message(name: str, *fields: tuple[str, int, int, str], repeated: bool = False, parent: object = file) -> object:
        made = parent.message_type.add(name=name) if parent is file else parent.nested_type.add(name=name)
        for field, number, kind, of in fields:
            label = kinds.LABEL_REPEATED if repeated else kinds.LABEL_OPTIONAL
            made.field.add(name=field, number=number, type=kind, label=label, type_name=of or None)
        return made

    message("BytesList", ("value", 1, kinds.TYPE_BYTES, ""), repeated=True)
    message("FloatList", ("value", 1, kinds.TYPE_FLOAT, ""), repeated=True)
    message("Int64List", ("value", 1, kinds.TYPE_INT64, ""), repeated=True)
    feature = message(
        "Feature",
        ("bytes_list", 1, kinds.TYPE_MESSAGE, ".tensorflow.BytesList"),
        ("float_list", 2, kinds.TYPE_MESSAGE, ".tensorflow.FloatList"),
        ("int64_list", 3, kinds.TYPE_MESSAGE, ".tensorflow.Int64List"),
    )
    feature.oneof_decl.add(name="kind")
    for field in feature.field:
        field.oneof_index = 0
    features = message(
        "Features", ("feature", 1, kinds.TYPE_MESSAGE, ".tensorflow.Features.FeatureEntry"), repeated=True
    )
    entry = message(
        "FeatureEntry",
        ("key", 1, kinds.TYPE_STRING, ""),
        ("value", 2, kinds.TYPE_MESSAGE, ".tensorflow.Feature"),
        parent=features,
    )
    entry.options.map_entry = True
    message("Example", ("features", 1, kinds.TYPE_MESSAGE, ".tensorflow.Features"))
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName("tensorflow.Example"))


EXAMPLE = example_class()


def parsed(content: bytes) -> dict[str, list]:
    """Every feature's values by its name, and nothing that the messages do not have."""
    found = EXAMPLE.FromString(content)
    assert found.ByteSize() == len(content)
    return {
        name: list(getattr(feature, feature.WhichOneof("kind")).value)
        for name, feature in found.features.feature.items()
    }


def crc32c(content: bytes) -> int:
    """By the definition: Castagnoli's polynomial, reflected, bit by bit."""
    crc = 0xFFFFFFFF
    for byte in content:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ (0x82F63B78 if crc & 1 else 0)
    return crc ^ 0xFFFFFFFF


def masked(content: bytes) -> int:
    crc = crc32c(content)
    return (((crc >> 15) | (crc << 17)) + 0xA282EAD8) % 2**32


def slow_records(content: bytes) -> Iterator[bytes]:
    """The records of a file's bytes, their checksums checked."""
    while content:
        length = int.from_bytes(content[:8], "little")
        assert int.from_bytes(content[8:12], "little") == masked(content[:8])
        one, crc = content[12 : 12 + length], content[12 + length : 16 + length]
        assert int.from_bytes(crc, "little") == masked(one)
        yield one
        content = content[16 + length :]


def test_the_checksum_is_castagnolis() -> None:
    assert crc32c(b"123456789") == 0xE3069283
    head, content, tail = record(b"123456789")
    assert content == b"123456789"
    assert list(slow_records(head + content + tail)) == [b"123456789"]


def test_an_example_is_what_protobuf_makes_of_it() -> None:
    features = {
        "z": int64_feature([0, 1, 127, 128, 300, 2**40]),
        "a/text": bytes_feature([b"", b"\x00\xff", "é".encode() * 100]),
        "numbers": float_feature(np.array([0.1, 1.0, -2.5])),
        "none/int": int64_feature([]),
        "none/bytes": bytes_feature([]),
        "none/float": float_feature(np.zeros(0)),
    }
    content = example(features)
    expected = {
        "z": [0, 1, 127, 128, 300, 2**40],
        "a/text": [b"", b"\x00\xff", "é".encode() * 100],
        "numbers": [np.float32(0.1), 1.0, -2.5],
        "none/int": [],
        "none/bytes": [],
        "none/float": [],
    }
    assert parsed(content) == expected
    assert {name: list(values) for name, values in features_of(content).items()} == expected
    assert EXAMPLE.FromString(content).SerializeToString(deterministic=True) == content
    assert example(dict(reversed(features.items()))) == content


def test_by_protobuf(export: Callable[..., object]) -> None:
    expected = export("tfrecord")
    for split in ("train", "val"):
        stems: set[str] = set()
        for path in sorted((expected.folder / "records").glob(f"{split}-*.record")):
            for content in slow_records(path.read_bytes()):
                features = parsed(content)
                (name,), (encoded,) = features["image/filename"], features["image/encoded"]
                stem = name.decode().removesuffix(".jpg")
                stems.add(stem)
                image = cv2.imdecode(np.frombuffer(encoded, dtype=np.uint8), cv2.IMREAD_COLOR)
                (height,), (width,) = features["image/height"], features["image/width"]
                assert image.shape[:2] == (height, width)
                assert features["image/format"] == [b"jpeg"]
                assert features["image/key/sha256"] == [hashlib.sha256(encoded).hexdigest().encode()]
                # A frame's place, from 1: all frames are exported.
                assert features["image/source_id"] == [str(int(stem) + 1).encode()]
                boxes, classes = expected.boxes[stem], expected.classes[stem]
                for side, column, length in (("xmin", 0, 64), ("ymin", 1, 48), ("xmax", 2, 64), ("ymax", 3, 48)):
                    shares = np.array(features[f"image/object/bbox/{side}"])
                    assert len(shares) == len(boxes)
                    assert ((shares >= 0) & (shares <= 1)).all()
                    assert np.abs(shares * length - boxes[:, column]).max(initial=0) < 1e-4
                assert features["image/object/class/label"] == [i + 1 for i in classes]
                assert features["image/object/class/text"] == [(b"cube", b"tall one")[i] for i in classes]
                areas = (boxes[:, 2] - boxes[:, 0]) * (boxes[:, 3] - boxes[:, 1])
                assert np.allclose(features["image/object/area"], areas, rtol=1e-6)
                assert features["image/object/difficult"] == features["image/object/is_crowd"] == [0] * len(boxes)
                assert set(features["image/object/truncated"]) <= {0, 1}
        assert stems == {stem for stem, of in expected.splits.items() if of == split}


@pytest.mark.parametrize("by", ["block", "frame"])
def test_files_have_a_fixed_number_of_records_whatever_the_shards(
    make_snapshot: Make, tree: Tree, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, by: str
) -> None:
    monkeypatch.setattr(sample_files, "SAMPLES", 4)
    options = ExportOptions.model_validate({"split": {"by": by}, "images": "none"})
    trees: list[dict[str, str]] = []
    for shard in (1, 3, 12):
        out = tmp_path / str(shard)
        run_export(
            plan_export([make_snapshot(12)], format="tfrecord", options=options, out=out, frames_per_shard=shard)
        )
        trees.append(tree(out))
    assert trees[0] == trees[1] == trees[2]
    counts = {path.name: len(list(records_of(path))) for path in sorted((tmp_path / "1").rglob("*.record"))}
    assert counts == {
        "train-00000-of-00003.record": 4,
        "train-00001-of-00003.record": 4,
        "train-00002-of-00003.record": 2,
        "val-00000-of-00001.record": 2,
    }


def test_a_label_map_counts_from_1_and_quotes_what_it_must() -> None:
    assert label_map(["cube", 'a "b" \\ é\n']) == (
        'item {\n  id: 1\n  name: "cube"\n}\nitem {\n  id: 2\n  name: "a \\042b\\042 \\134 \\303\\251\\012"\n}\n'
    )


def test_without_images_and_without_frames(make_snapshot: Make, tmp_path: Path) -> None:
    options = ExportOptions.model_validate({"images": "none"})
    report = run_export(plan_export([make_snapshot(1)], format="tfrecord", options=options, out=tmp_path / "d"))
    assert len(report.losses) == 1
    # A pattern that matches no file is an error to TensorFlow.
    assert (tmp_path / "d" / "records" / "val-00000-of-00001.record").read_bytes() == b""
    (content,) = records_of(tmp_path / "d" / "records" / "train-00000-of-00001.record")
    assert "image/encoded" not in parsed(content)


def test_damage_is_found(make_snapshot: Make, tmp_path: Path) -> None:
    options = ExportOptions.model_validate({"images": "none"})
    plan = plan_export([make_snapshot(4)], format="tfrecord", options=options, out=tmp_path / "d")
    run_export(plan)
    path = tmp_path / "d" / "records" / "train-00000-of-00001.record"
    whole = path.read_bytes()
    for place, message in ((3, "no sound length"), (100, "checksum"), (len(whole) - 2, "checksum")):
        path.write_bytes(whole[:place] + bytes((whole[place] ^ 1,)) + whole[place + 1 :])
        with pytest.raises(BadFile, match=message):
            compare(plan, plan.out)
    path.write_bytes(whole[:-1])
    with pytest.raises(BadFile, match="checksum"):
        compare(plan, plan.out)
    path.write_bytes(b"".join(record(b"\x08\x01")))
    with pytest.raises(BadFile, match=r"record 0 is no tf\.train\.Example"):
        compare(plan, plan.out)


def test_without_its_checksums_nothing_is_begun(
    make_snapshot: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "google_crc32c", None)
    with pytest.raises(BadInput, match=r"pip install 'ars-web\[tfrecord\]'"):
        plan_export([make_snapshot(2)], format="tfrecord", options=ExportOptions.model_validate({}), out=tmp_path / "d")
    assert not (tmp_path / "d").exists()
    assert not partial_folder(tmp_path / "d").exists()
