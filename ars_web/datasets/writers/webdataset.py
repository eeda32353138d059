"""WebDataset: `shards/train-000000.tar` and so on, a sample a frame: `KEY.jpg` or `KEY.png`, and `KEY.json`.

Beside each tar file lies `train-000000.idx`, the index that NVIDIA DALI reads (v1.2), and for each split `train.json`,
the index of the wids library. `classes.json` names the classes and their keypoints. A key is the frame's file name; its
dots are written as `=`, because readers take what follows the first dot for the kind of file.
"""

import hashlib
import json
import tarfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.writers.frame_documents import frame_documents
from ars_web.datasets.writers.sample_files import (
    SAMPLES,
    Layout,
    Member,
    Sample,
    file_count,
    join_samples,
    split_sizes,
    write_samples,
)
from ars_web.datasets.writers.writer import Dataset, FileDigests, Shard, Writer

FOLDER = "shards"

_BLOCK = tarfile.BLOCKSIZE
_LONGEST_NAME = tarfile.LENGTH_NAME


def key_of(stem: str) -> str:
    """The sample's key; a file name has no `=`, so no two frames have one key."""
    return stem.replace(".", "=")


def stem_of(key: str) -> str:
    """The name of the frame's file of a sample's key."""
    return key.replace("=", ".")


def tar_member(name: str, content: bytes) -> tuple[bytes, bytes, bytes]:
    """Header, content and padding of a file in a tar file, without a date or an owner.

    The header is plain ustar; a name that is too long for it gets a pax header before.
    """
    info = tarfile.TarInfo(name)
    info.size = len(content)
    kind = tarfile.USTAR_FORMAT if len(name) <= _LONGEST_NAME else tarfile.PAX_FORMAT
    return info.tobuf(format=kind), content, bytes(-len(content) % _BLOCK)


def _samples(shard: Shard) -> Iterator[Sample]:
    for i, document in enumerate(frame_documents(shard)):
        key = key_of(shard.stems[i])
        contents = [("json", document)]
        if shard.image_files:
            # `.jpeg` is `.jpg` to those who ask for it by its kind.
            kind = "png" if shard.image_files[i].suffix == ".png" else "jpg"
            contents.insert(0, (kind, shard.image_files[i].read_bytes()))
        pieces: list[bytes] = []
        members: list[Member] = []
        size = 0
        for kind, content in contents:
            name = f"{key}.{kind}"
            header, content, padding = tar_member(name, content)
            members.append((kind, size + len(header), len(content), name))
            pieces += [header, content, padding]
            size += len(header) + len(content) + len(padding)
        yield Sample(pieces, members)


def _path(split: str, number: int, count: int) -> str:
    return f"{FOLDER}/{split}-{number:06d}.tar"


def _index(path: str, members: Sequence[Sequence[Member]]) -> tuple[str, bytes]:
    """DALI's index: a line with its version and the number of samples, then a line a sample."""
    lines = (" ".join(f"{kind} {start} {size} {name}" for kind, start, size, name in sample) for sample in members)
    content = f"v1.2 {len(members)}\n" + "".join(f"{line}\n" for line in lines)
    return f"{path.removesuffix('.tar')}.idx", content.encode()


# Two empty blocks say that a tar file is over.
_LAYOUT = Layout(path=_path, tail=bytes(2 * _BLOCK), index=_index)


def _write(shard: Shard, files: Path, fragments: Path) -> FileDigests:
    return write_samples(shard, _samples(shard), _LAYOUT, files, fragments)


def _join(dataset: Dataset, fragments: Sequence[Path], folder: Path) -> FileDigests:
    (folder / FOLDER).mkdir(exist_ok=True)
    digests = join_samples(fragments, _LAYOUT, folder)
    sizes = split_sizes(fragments)
    documents: dict[str, object] = {}
    for split in dataset.splits:
        samples = sizes.get(split, 0)
        paths = [_path(split, number, 0) for number in range(file_count(samples) if samples else 0)]
        documents[f"{split}.json"] = {
            "__kind__": "wids-shard-index-v1",
            "wids_version": 1,
            "name": split,
            "shardlist": [
                {
                    "url": Path(path).name,
                    "nsamples": min(SAMPLES, samples - number * SAMPLES),
                    "filesize": (folder / path).stat().st_size,
                }
                for number, path in enumerate(paths)
            ],
        }
    documents["classes.json"] = [
        {"id": place, "name": a_class.name, "keypoints": [keypoint.name for keypoint in a_class.keypoints]}
        for place, a_class in enumerate(dataset.classes)
    ]
    for name, document in documents.items():
        content = (json.dumps(document, indent=2) + "\n").encode()
        (folder / FOLDER / name).write_bytes(content)
        digests[f"{FOLDER}/{name}"] = hashlib.sha256(content).hexdigest()
    return digests


def _losses(plan: ExportPlan) -> Sequence[str]:
    return ("the tar files hold labels alone, because no images are exported",) if plan.options.images == "none" else ()


WRITER = Writer(
    format="webdataset",
    title="WebDataset",
    description=(
        "For training from large storage in sequence: tar files of a thousand images with their labels as JSON, with"
        " indices for wids and DALI."
    ),
    label_folder=FOLDER,
    image_folder=None,
    write=_write,
    join=_join,
    shows=("box", "silhouette", "keypoints"),
    label_functions=("silhouette", "keypoints"),
    losses=_losses,
    with_visible=True,
)
