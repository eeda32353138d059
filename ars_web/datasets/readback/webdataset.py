"""WebDataset's tar files, read by the webdataset library where it is installed."""

import importlib
import importlib.util
import tarfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import orjson
from jaxtyping import Float

from ars_web.datasets.readback.reader import Reader, ReadFrame, ReadLabel, Sizes
from ars_web.datasets.writers.webdataset import FOLDER, stem_of
from ars_web.errors import BadFile
from ars_web.geometry import rigid_transform
from ars_web.geometry.rigid_transform import Transform


def _library() -> str:
    return "webdataset" if _has_webdataset() else "this program's own reading; webdataset is not installed"


def _has_webdataset() -> bool:
    return importlib.util.find_spec("webdataset") is not None


def _read(folder: Path, sizes: Sizes) -> Iterator[ReadFrame]:
    for index in sorted((folder / FOLDER).glob("*.json")):
        if index.name == "classes.json":
            continue
        for shard in orjson.loads(index.read_bytes())["shardlist"]:
            path = index.parent / shard["url"]
            count = 0
            for sample in _samples(path):
                count += 1
                yield _frame(path, index.stem, sample)
            if count != shard["nsamples"]:
                raise BadFile(path, f"has {count} samples, not {shard['nsamples']} as {index.name} says")


def _samples(path: Path) -> Iterator[Mapping[str, Any]]:
    """The samples of a tar file as the library gives them: bytes by kind, and `__key__`."""
    try:
        if _has_webdataset():
            library: Any = importlib.import_module("webdataset.tariterators")
            # `WebDataset` itself would leave the file open.
            with path.open("rb") as file:
                yield from library.group_by_keys(library.tar_file_expander([{"url": str(path), "stream": file}]))
            return
        sample: dict[str, Any] = {}
        with tarfile.open(path) as tar:
            for member in tar:
                key, _, kind = member.name.partition(".")
                if sample and sample["__key__"] != key:
                    yield sample
                    sample = {}
                file = tar.extractfile(member)
                sample |= {"__key__": key, kind: file.read() if file else b""}
        if sample:
            yield sample
    except (tarfile.TarError, OSError) as error:
        raise BadFile(path, f"is no whole tar file: {error}") from error


def _frame(path: Path, split: str, sample: Mapping[str, Any]) -> ReadFrame:
    key = sample["__key__"]
    if "json" not in sample:
        raise BadFile(path, f"sample {key!r} has no labels")
    document = orjson.loads(sample["json"])
    if (document["stem"], document["split"]) != (stem_of(key), split):
        raise BadFile(path, f"sample {key!r} holds the labels of {document['stem']!r} in {document['split']}")
    labels = tuple(_label(label) for label in document["labels"])
    return ReadFrame(
        document["stem"], split, f"{path}, sample {key}", labels, image_size=(document["width"], document["height"])
    )


def _label(label: dict[str, Any]) -> ReadLabel:
    points = [(np.nan, np.nan) if x is None else (x, y) for x, y, _ in label["keypoints"]]
    keypoints: Float[np.ndarray, "k 2"] = np.array(points).reshape(-1, 2)
    return ReadLabel(
        label["class"],
        bbox=np.array(label["bbox"]),
        bbox_amodal=np.array(label["bbox_amodal"]),
        rings=tuple(np.array(ring).reshape(-1, 2) for ring in label["outline"]),
        points=keypoints,
        T_camera_box=_transform(label["T_camera_box"]),
        size=np.array(label["size"]),
        visible=label["visible"],
        truncated=label["truncated"],
    )


def _transform(held: dict[str, Any]) -> Transform:
    return rigid_transform.from_position_wxyz(np.array(held["position"]), np.array(held["wxyz"]))


def _rounding(longer: int) -> float:
    # Two decimals, of which a corner of a ring has two.
    return 0.0071


READER = Reader(format="webdataset", library=_library, read=_read, rounding=_rounding, ring_function="silhouette")
