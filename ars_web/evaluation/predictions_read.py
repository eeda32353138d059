"""Predictions while they are read: rows in, columns out; images and classes as the truth has them."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ars_web.errors import BadInput
from ars_web.evaluation.detections import Predictions, Truth
from ars_web.evaluation.image_names import ImageNames, stem_of

UNUSED = "-"
"""Among a detector's classes: a number that stands for none, such as 0 where they begin at 1."""

_SHOWN = 8


def _written_number(text: str) -> int | None:
    """The whole number that a text is, as a program writes it; None where it is none."""
    return int(text) if text.isascii() and text.isdecimal() and len(text) < 19 and str(int(text)) == text else None


@dataclass(eq=False)
class PredictionsRead:
    """What has been read so far.

    Attributes:
        truth: that images and classes are looked up in.
        class_names: what the detector's class numbers mean, from 0, UNUSED ones included; None: what the truth's do.
        warnings: what is odd so far.
    """

    truth: Truth
    class_names: Sequence[str] | None = None
    image: list[int] = field(default_factory=list[int])
    class_: list[int] = field(default_factory=list[int])
    rectangles: list[tuple[float, float, float, float]] = field(default_factory=list[tuple[float, float, float, float]])
    score: list[float] = field(default_factory=list[float])
    warnings: list[str] = field(default_factory=list[str])

    def __post_init__(self) -> None:
        self._names = ImageNames([image.name for image in self.truth.images])
        self._found: dict[str | int, int] = {}
        self._class_of = {name: place for place, name in enumerate(self.truth.classes)}
        self._coco_ids = {image.coco_id: i for i, image in enumerate(self.truth.images) if image.coco_id is not None}
        self._numbered: dict[int, int] = {}
        if class_names := self.class_names:
            said = [(number, name) for number, name in enumerate(class_names) if name != UNUSED]
            self._numbered = {number: self.class_named(name) for number, name in said}
        elif self.truth.numbers is not None:
            self._numbered = {number: place for place, number in enumerate(self.truth.numbers)}

    def image_named(self, name: str) -> int:
        """The place of the image of that name; BadInput where there is none, or several."""
        if name not in self._found:
            self._found[name] = self._names.place(name)
        return self._found[name]

    def image_of_id(self, image_id: int | str) -> int:
        """The place of the image of that id in COCO results: an id of the truth where that is COCO, else a name, or
        the number that a name consists of; BadInput where there is none."""
        if isinstance(image_id, str):
            # Some programs write all ids as texts; a name goes first.
            id_ = _written_number(image_id)
            return (
                self._coco_ids[id_]
                if id_ in self._coco_ids and not self._is_named(image_id)
                else self.image_named(image_id)
            )
        if self._coco_ids:
            if image_id not in self._coco_ids:
                meant = self._numbered_images(image_id)
                hint = ""
                if len(meant) == 1:
                    one = self.truth.images[meant[0]]
                    hint = f"; ids are those of its images, not the numbers in their names: {one.name} is {one.coco_id}"
                raise BadInput(
                    f"image_id {image_id} is not among the truth's {len(self._coco_ids)}; choose them by --split{hint}"
                )
            return self._coco_ids[image_id]
        if image_id not in self._found:
            same = self._numbered_images(image_id)
            if len(same) != 1:
                known = "no image's name is that number" if not same else "several images' names are that number"
                raise BadInput(f"image_id {image_id}: {known}; write the images' names as image_id")
            self._found[image_id] = same[0]
        return self._found[image_id]

    def _is_named(self, name: str) -> bool:
        try:
            self.image_named(name)
        except BadInput:
            return False
        return True

    def _numbered_images(self, number: int) -> list[int]:
        """The places of the images whose names are that number."""
        stems = [stem_of(image.name.rsplit("/", 1)[-1]) for image in self.truth.images]
        return [place for place, stem in enumerate(stems) if stem.isdecimal() and int(stem) == number]

    def class_named(self, name: str) -> int:
        """The place of the class of that name; BadInput where there is none."""
        if name not in self._class_of:
            known = ", ".join(self.truth.classes[:_SHOWN]) + (", …" if len(self.truth.classes) > _SHOWN else "")
            remedy = "; say by --classes what the numbers 0, 1, … mean" if name.isdecimal() else ""
            raise BadInput(f"class {name[:80]!r} is none of the truth's: {known}{remedy}")
        return self._class_of[name]

    def class_said(self, text: str) -> int:
        """The place of the class of that name, or of that number where it was said what numbers mean; BadInput where
        there is none."""
        number = _written_number(text) if self.class_names and text not in self._class_of else None
        return self.class_named(text) if number is None else self.class_numbered(number)

    def class_numbered(self, number: int) -> int:
        """The place of the class of that number; BadInput where there is none, or classes have no numbers."""
        if number in self._numbered:
            return self._numbered[number]
        if not self._numbered:
            raise BadInput(
                f"class {number}: the truth ({self.truth.format}) does not number its classes; say by --classes which"
                " classes 0, 1, … are"
            )
        raise BadInput(f"class {number} is none of {self.numbered_classes}")

    @property
    def numbered_classes(self) -> str:
        """Which class each number is, for messages."""
        pairs = list(self._numbered.items())[:_SHOWN]
        known = ", ".join(f"{number}: {self.truth.classes[place]}" for number, place in pairs)
        return known + (", …" if len(self._numbered) > _SHOWN else "")

    def class_of_category(self, category: int | str) -> int:
        """The place of a category of COCO results: the truth's ids where that is COCO, else numbers or names."""
        ids = self.truth.category_ids
        if isinstance(category, str):
            number = _written_number(category)
            if number is None or category in self._class_of or (ids is None and not self.class_names):
                return self.class_named(category)
            category = number
        if ids is None or self.class_names:
            return self.class_numbered(category)
        if category not in ids:
            known = ", ".join(f"{i}: {name}" for i, name in list(zip(ids, self.truth.classes, strict=True))[:_SHOWN])
            raise BadInput(
                f"category_id {category} is none of the truth's ({known}); where a detector has its own numbers, say by"
                " --classes what 0, 1, … mean"
            )
        return ids.index(category)

    def add(self, image: int, class_: int, rectangle: tuple[float, float, float, float], score: float) -> None:
        """One prediction; BadInput where its rectangle or score cannot be."""
        x0, y0, x1, y1 = rectangle
        if not all(abs(value) <= 1e9 for value in rectangle):
            raise BadInput(f"the rectangle {x0:g}, {y0:g}, {x1:g}, {y1:g} is not finite, or far beyond any image")
        if x1 < x0 or y1 < y0:
            raise BadInput(f"the rectangle {x0:g}, {y0:g} to {x1:g}, {y1:g} has a negative size")
        if not 0 <= score <= 1:
            raise BadInput(f"the score {score:g} is not between 0 and 1; a score is how sure the detector is")
        self.image.append(image)
        self.class_.append(class_)
        self.rectangles.append(rectangle)
        self.score.append(score)

    def refuse_without_pixels(self) -> None:
        """Refuse rectangles in pixels where the truth's are shares of images that are not there."""
        if not self.truth.in_pixels:
            raise BadInput(
                f"{self.truth.source} has no images, so its labels are shares of them, and pixels cannot be compared;"
                " say --image-size WxH, or export the truth with images"
            )

    def predictions(self, name: str, source: Path, format: str) -> Predictions:  # noqa: A002 - the contract's name
        """All of it as columns."""
        image, class_ = np.array(self.image, dtype=np.int64), np.array(self.class_, dtype=np.int64)
        bbox = np.array(self.rectangles, dtype=np.float64).reshape(-1, 4)
        score = np.array(self.score, dtype=np.float64)
        warnings = [*self.warnings]
        if not len(bbox):
            warnings.append(f"{source}: holds no prediction; every label counts as missed")
        sides = bbox[:, 2:] - bbox[:, :2]
        flat = int((sides <= 0).any(axis=1).sum())
        if flat:
            warnings.append(f"{source}: predictions without an area: {flat}; they find nothing and count as wrong")
        if format != "yolo" and len(bbox) and bbox.max() <= 1.0:
            warnings.append(
                f"{source}: no rectangle reaches beyond 1; if they are shares of images, write pixels instead"
            )
        rows = np.column_stack([image, class_, bbox, score]) if len(bbox) else np.zeros((0, 7))
        repeated = len(rows) - len(np.unique(rows, axis=0))
        if repeated:
            warnings.append(f"{source}: predictions that repeat another in everything: {repeated}; they count as wrong")
        labelled = set(self.truth.class_[~self.truth.ignored].tolist())
        for place in sorted(set(self.class_) - labelled):
            count = int((class_ == place).sum())
            warnings.append(
                f"{source}: predictions of {self.truth.classes[place]!r}, which is labelled nowhere: {count}; they"
                " count as wrong, and in no mean of AP"
            )
        return Predictions(name, image, class_, bbox, score, str(source), format, tuple(warnings))
