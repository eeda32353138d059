"""What a sphere round an object shows: the views from every direction, folded ones where they are folded to."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Int

from ars_web.datasets.coverage import chosen_boxes, coverage_of
from ars_web.datasets.options import ExportOptions
from ars_web.geometry.sphere_bins import SphereBins
from ars_web.geometry.sphere_tiles import stand_ins
from ars_web.geometry.symmetry import Symmetry
from ars_web.sessions.model import SessionSnapshot
from ars_web.studies.kept_views import KeptViews


@dataclass(frozen=True, eq=False)
class SphereCounts:
    """Views by direction, all round.

    Attributes:
        counts: (k,) views from each cell of equal area; where a symmetry folds its middle elsewhere, those from there.
        symmetry: of the object's class.
    """

    counts: Int[np.ndarray, "k"]
    symmetry: Symmetry


def sphere_counts(
    snapshot: SessionSnapshot,
    kept: KeptViews,
    bins: SphereBins,
    *,
    box_id: int,
    whole_class: bool = False,
    min_visible: float = 0.0,
) -> SphereCounts:
    """The counts of a box, or of all boxes of its class.

    Raises:
        NotFound: there is no such box.
    """
    rows = chosen_boxes(snapshot, box_id=box_id)
    class_id = snapshot.state.boxes[box_id].class_id
    if whole_class:
        rows = chosen_boxes(snapshot, class_id=class_id)
    views = kept.find(snapshot, ExportOptions.model_validate({"min_visible": min_visible}))
    symmetry = snapshot.state.classes[class_id].symmetry
    return SphereCounts(coverage_of(views, bins, rows).cell_counts[stand_ins(bins, symmetry)[1]], symmetry)
