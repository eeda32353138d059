"""Pascal VOC as truth: Annotations/*.xml, ImageSets/Main/*.txt, JPEGImages; objects marked `difficult` are ignored.

Corners are counted from 1 and inclusive: xmin, ymin, xmax, ymax become xmin - 1, ymin - 1, xmax, ymax.
"""

from pathlib import Path

from ars_web.annotations.xml_elements import XmlElement, elements_of
from ars_web.errors import BadFile, BadInput
from ars_web.evaluation.detections import Truth, TruthImage
from ars_web.evaluation.labels_read import LabelsRead, number
from ars_web.evaluation.truth_layout import (
    SPLITS,
    TruthLayout,
    TruthOptions,
    chosen_split,
    own_classes,
    size_of,
    text_lines,
)

_CORNERS = ("xmin", "ymin", "xmax", "ymax")


def _is_one(path: Path) -> bool:
    return any((path / "Annotations").glob("*.xml"))


def _read(path: Path, options: TruthOptions) -> Truth:
    everything = {file.stem: file for file in sorted((path / "Annotations").glob("*.xml"))}
    if not everything:
        raise BadFile(path, "holds no Annotations/*.xml")
    lists = {split: file for split in SPLITS if (file := path / "ImageSets" / "Main" / f"{split}.txt").is_file()}
    split = chosen_split(path, list(lists), options.split)
    stems = list(everything) if split is None else _listed(lists[split], everything)
    labels = LabelsRead()
    named: list[tuple[int, str, tuple[float, float, float, float], bool]] = []
    for place, stem in enumerate(stems):
        labels.images.append(_take_image(path, everything[stem], place, named, options))
    own = own_classes(path)
    # Classes that only other splits have are the set's, too: a detector may know them.
    others = {name for stem in everything.keys() - set(stems) for name in _names_in(everything[stem])}
    classes = list(own or sorted({name for _, name, _, _ in named} | others))
    class_of = {name: place for place, name in enumerate(classes)}
    for place, name, rectangle, difficult in named:
        if name not in class_of:
            raise BadFile(path / "dataset.json", f"names no class {name!r}, which {stems[place]}.xml has")
        labels.add(place, class_of[name], rectangle, ignored=difficult)
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


def _take_image(
    path: Path,
    file: Path,
    place: int,
    named: list[tuple[int, str, tuple[float, float, float, float], bool]],
    options: TruthOptions,
) -> TruthImage:
    size: tuple[int, int] | None = None
    name = file.stem
    for element in elements_of(file, root="annotation"):
        if element.tag == "filename" and element.text.strip():
            name = element.text.strip()
        elif element.tag == "size":
            size = int(_value(file, element, "width")), int(_value(file, element, "height"))
        elif element.tag == "object":
            bndbox = element.child("bndbox")
            if bndbox is None:
                raise BadFile(file, "<object> has no bndbox", line=element.line)
            x0, y0, x1, y1 = (_value(file, bndbox, corner) for corner in _CORNERS)
            if x1 < x0 or y1 < y0:
                raise BadFile(
                    file, f"<bndbox>: {x0:g}, {y0:g} to {x1:g}, {y1:g} ends before it begins", line=bndbox.line
                )
            difficult = element.child("difficult")
            named.append(
                (
                    place,
                    _name(file, element),
                    (x0 - 1, y0 - 1, x1, y1),
                    difficult is not None and difficult.text.strip() not in ("", "0"),
                )
            )
    image = next(
        (found for found in (path / "JPEGImages" / name, path / "JPEGImages" / f"{file.stem}.jpg") if found.is_file()),
        None,
    )
    if size is None or min(size) < 1:
        size = size_of(image, options)
    return TruthImage(name, size, image)


def _names_in(file: Path) -> list[str]:
    return [_name(file, element) for element in elements_of(file, root="annotation") if element.tag == "object"]


def _name(file: Path, element: XmlElement) -> str:
    child = element.child("name")
    name = "" if child is None else child.text.strip()
    if not name:
        raise BadFile(file, "<object> has no name", line=element.line)
    return name


def _value(file: Path, element: XmlElement, tag: str) -> float:
    child = element.child(tag)
    if child is None:
        raise BadFile(file, f"<{element.tag}> has no {tag}", line=element.line)
    try:
        return number(child.text.strip())
    except BadInput as error:
        raise BadFile(file, f"<{tag}>: {error}", line=child.line) from error


LAYOUT = TruthLayout("voc", "a folder with Annotations/*.xml, as Pascal VOC has it", _is_one, _read)
