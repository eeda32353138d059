"""The labels of a truth while they are read: rows in, columns out, what is odd counted."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ars_web.errors import BadInput
from ars_web.evaluation.detections import Truth, TruthImage


@dataclass(eq=False)
class LabelsRead:
    """What has been read so far; `images` and `classes` may grow meanwhile.

    Attributes:
        rectangles: (x0, y0, x1, y1), in pixels, or in shares where no image has a size.
        areas: as the file has them; None: of the rectangles.
    """

    images: list[TruthImage] = field(default_factory=list[TruthImage])
    image: list[int] = field(default_factory=list[int])
    class_: list[int] = field(default_factory=list[int])
    rectangles: list[tuple[float, float, float, float]] = field(default_factory=list[tuple[float, float, float, float]])
    ignored: list[bool] = field(default_factory=list[bool])
    crowd: list[bool] = field(default_factory=list[bool])
    areas: list[float | None] = field(default_factory=list[float | None])

    def add(
        self,
        image: int,
        class_: int,
        rectangle: tuple[float, float, float, float],
        *,
        ignored: bool = False,
        crowd: bool = False,
        area: float | None = None,
    ) -> None:
        self.image.append(image)
        self.class_.append(class_)
        self.rectangles.append(rectangle)
        self.ignored.append(ignored)
        self.crowd.append(crowd)
        self.areas.append(area)

    def truth(
        self,
        source: Path,
        format: str,  # noqa: A002 - the contract's name
        *,
        classes: Sequence[str],
        split: str | None,
        numbers: tuple[int, ...] | None,
        category_ids: tuple[int, ...] | None = None,
        in_pixels: bool = True,
        warnings: Sequence[str] = (),
    ) -> Truth:
        """All of it as columns.

        Raises:
            BadInput: two images have one name.
        """
        part = str(source) if split is None else f"{source} (split {split})"
        names = [image.name for image in self.images]
        if len(set(names)) != len(names):
            twice = next(name for place, name in enumerate(names) if name in names[:place])
            raise BadInput(f"{part}: two images are called {twice!r}; name them apart")
        bbox = np.array(self.rectangles, dtype=np.float64).reshape(-1, 4)
        sides = bbox[:, 2:] - bbox[:, :2]
        area = sides.prod(axis=1)
        for row, given in enumerate(self.areas):
            if given is not None:
                area[row] = given
        image, class_ = np.array(self.image, dtype=np.int64), np.array(self.class_, dtype=np.int64)
        said = [*warnings]
        flat = int((sides <= 0).any(axis=1).sum())
        if flat:
            said.append(f"{part}: labels without an area: {flat}; nothing can find them, so they count as missed")
        rows = np.column_stack([image, class_, bbox]) if len(bbox) else np.zeros((0, 6))
        repeated = len(rows) - len(np.unique(rows, axis=0))
        if repeated:
            said.append(
                f"{part}: labels that repeat another of the same class and rectangle in their image: {repeated}; of"
                " such a pair one stays missed"
            )
        return Truth(
            part,
            tuple(classes),
            tuple(self.images),
            image,
            class_,
            bbox,
            np.array(self.ignored, dtype=np.bool_),
            np.array(self.crowd, dtype=np.bool_),
            area,
            in_pixels=in_pixels,
            numbers=numbers,
            category_ids=category_ids,
            format=format,
            split=split,
            warnings=tuple(said),
        )


def number(text: str) -> float:
    """A finite number.

    Raises:
        BadInput: it is none.
    """
    try:
        found = float(text)
    except ValueError:
        found = np.nan
    # Python reads 1_000, and no label file means it.
    if not np.isfinite(found) or "_" in text:
        raise BadInput(f"{text[:40]!r} is not a finite number")
    return found
