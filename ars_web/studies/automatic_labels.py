"""A session's labels in some of its frames, drawn round three things.

in_image  round the whole object, cut to the image: what exports write
amodal    round the whole object, beyond the image's border
visible   round what is seen of it
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float, Int

from ars_web.datasets.options import ExportOptions
from ars_web.datasets.samples import kept, labels_of_shapes
from ars_web.datasets.shapes import check_shape, posed_shapes
from ars_web.sessions.model import SessionSnapshot
from ars_web.studies.visible_rectangles import visible_rectangles

RectangleKind = Literal["in_image", "amodal", "visible"]

RECTANGLES: tuple[RectangleKind, ...] = ("in_image", "amodal", "visible")


@dataclass(frozen=True, eq=False)
class AutomaticLabels:
    """m labels.

    Attributes:
        frame: (m,) index of the frame of each, ascending.
        class_names: m of them.
        bbox: (m, 4) x0, y0, x1, y1, image coordinates, by what they are drawn round; NaN where nothing is seen.
        visible: (m,) share that no nearer object hides.
    """

    frame: Int[np.ndarray, "m"]
    class_names: tuple[str, ...]
    bbox: Mapping[RectangleKind, Float[np.ndarray, "m 4"]]
    visible: Float[np.ndarray, "m"]


def automatic_labels(
    snapshot: SessionSnapshot,
    indices: Sequence[int],
    options: ExportOptions,
    *,
    progress: Callable[[int, int], None] | None = None,
) -> AutomaticLabels:
    """The labels that an export of the frames at `indices` (ascending) with these options would write.

    `progress` is told (frames done, frames in all).

    Raises:
        BadInput: no object has the shape that is asked for, or there is no such shape.
    """
    check_shape(options.shape, [snapshot])
    shapes = posed_shapes(snapshot, indices, shape=options.shape)
    table = labels_of_shapes(shapes)
    keep, _ = kept(table, options)
    rows, columns = np.nonzero(keep)
    state = snapshot.state
    names = [state.classes[box.class_id].name for _, box in sorted(state.boxes.items())]
    visible = visible_rectangles(shapes, table, progress=progress)
    return AutomaticLabels(
        np.asarray(indices, dtype=np.int64)[rows],
        tuple(names[column] for column in columns.tolist()),
        {"in_image": table.bbox[keep], "amodal": table.bbox_amodal[keep], "visible": visible[keep]},
        table.visible[keep],
    )
