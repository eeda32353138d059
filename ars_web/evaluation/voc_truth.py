"""Pascal VOC as truth: Annotations/*.xml, ImageSets/Main/*.txt, JPEGImages; objects marked `difficult` are ignored.

What one file says is read by `annotations/voc.py`. A truth asks for more than labels of a session do: which split an
image is of, its size where the file lacks it, and the classes that only other splits have.
"""

from pathlib import Path

from ars_web.annotations import voc
from ars_web.annotations.voc import VocImage
from ars_web.errors import BadFile
from ars_web.evaluation.detections import Truth, TruthImage
from ars_web.evaluation.labels_read import LabelsRead
from ars_web.evaluation.truth_layout import (
    SPLITS,
    TruthLayout,
    TruthOptions,
    chosen_split,
    own_classes,
    size_of,
    text_lines,
)


def _is_one(path: Path) -> bool:
    return path.is_dir() and bool(voc.find(path))


def _read(path: Path, options: TruthOptions) -> Truth:
    # Label programs write the files into a folder of their own, without Annotations/ round them.
    everything = {file.stem: file for file in voc.find(path)} if path.is_dir() else {}
    if not everything:
        raise BadFile(path, "holds no Annotations/*.xml")
    lists = {split: file for split in SPLITS if (file := path / "ImageSets" / "Main" / f"{split}.txt").is_file()}
    split = chosen_split(path, list(lists), options.split)
    stems = list(everything) if split is None else _listed(lists[split], everything)
    read = {stem: voc.read_image(file) for stem, file in everything.items()}
    own = own_classes(path)
    # Classes that only other splits have are the set's, too: a detector may know them.
    classes = list(own or sorted({one.class_name for image in read.values() for one in image.objects}))
    class_of = {name: place for place, name in enumerate(classes)}
    labels = LabelsRead()
    for place, stem in enumerate(stems):
        labels.images.append(_image(path, everything[stem], read[stem], options))
        for one in read[stem].objects:
            if one.class_name not in class_of:
                raise BadFile(path / "dataset.json", f"names no class {one.class_name!r}, which {stem}.xml has")
            x0, y0, x1, y1 = one.bbox.tolist()
            labels.add(place, class_of[one.class_name], (x0, y0, x1, y1), ignored=one.is_difficult)
    sized = all(image.size is not None for image in labels.images)
    return labels.truth(
        path,
        "voc",
        classes=classes,
        split=split,
        numbers=None if own is None else tuple(range(len(classes))),
        warnings=() if sized else ("some images have no size: YOLO predictions of those cannot be read",),
    )


def _listed(listing: Path, everything: dict[str, Path]) -> list[str]:
    stems: list[str] = []
    for line, text in enumerate(text_lines(listing), start=1):
        words = text.split()
        # Lists of one class have `stem flag`; of the whole set `stem`, which may hold blanks.
        stem = text.strip() if text.strip() in everything or not words else words[0]
        if not stem:
            continue
        if stem not in everything:
            raise BadFile(listing, f"lists {stem!r}, of which there is no Annotations/{stem}.xml", line=line)
        stems.append(stem)
    if not stems:
        raise BadFile(listing, "is empty: the split has no image; choose another by --split")
    return stems


def _image(path: Path, file: Path, told: VocImage, options: TruthOptions) -> TruthImage:
    name = told.name or file.stem
    places = (path / "JPEGImages" / name, path / "JPEGImages" / f"{file.stem}.jpg", file.parent / name)
    found = next((place for place in places if place.is_file()), None)
    return TruthImage(name, told.size or size_of(found, options), found)


LAYOUT = TruthLayout("voc", "a folder with Annotations/*.xml, as Pascal VOC has it", _is_one, _read)
