"""The annotation study: a session's labels beside those that people made, after De Gregorio et al.

An automatic label covers the whole object, what nearer ones hide of it included; people draw what they see. So manual
labels are compared with three rectangles of the same automatic labels, those of `automatic_labels.RECTANGLES`. The
paper compared with the first, and its mean IoU of 0.70 comes from that difference.
"""

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Int

from ars_web.annotations.foreign import ForeignLabels
from ars_web.datasets.options import ExportOptions
from ars_web.errors import BadInput
from ars_web.masks.label_import import Reason, reasons
from ars_web.sessions.model import SessionSnapshot
from ars_web.studies.agreement import RectangleAgreement, matches, rectangle_agreement
from ars_web.studies.automatic_labels import RECTANGLES, AutomaticLabels, RectangleKind, automatic_labels
from ars_web.studies.compared_frames import ComparedFrame, Sides, WorstFrame, compared_frames, worst_frames
from ars_web.studies.comparison_warnings import UncomparedClass, comparison_warnings
from ars_web.studies.hidden_bands import HiddenBand, hidden_bands
from ars_web.studies.manual_labels import manual_labels
from ars_web.studies.rectangle_matching import Rectangles

IOU = 0.3
"""The paper's: from here on two rectangles may be of one object."""

WORST = 12
"""Frames that are shown."""


@dataclass(frozen=True)
class Comparison:
    """What a study found.

    Attributes:
        session, revision: whose automatic labels.
        format, source: of the manual labels.
        iou: from which on two rectangles may be a pair.
        rectangles: the numbers by what automatic labels are drawn round.
        hidden: automatic labels of which nothing is seen; they count for `in_image` and `amodal`, not for `visible`.
        bands: the pairs by how much is hidden.
        frames: all that are labelled by hand, by index.
        worst: those of them that agree least, the worst first.
        never_by_hand: the session's classes with automatic labels and no manual one: in no number but the confusion.
        unknown: manual classes that the session has not: in no number but the confusion.
        left_out: manual labels that are not compared, by reason.
        notes: how images were understood, in words.
        warnings: what looks wrong with the labels or the numbers, and what to do about it, in words.
    """

    session: str
    revision: int
    format: str
    source: Path
    iou: float
    rectangles: Mapping[RectangleKind, RectangleAgreement]
    hidden: int
    bands: tuple[HiddenBand, ...]
    frames: tuple[ComparedFrame, ...]
    worst: tuple[WorstFrame, ...]
    never_by_hand: tuple[UncomparedClass, ...]
    unknown: tuple[UncomparedClass, ...]
    left_out: tuple[Reason, ...]
    notes: tuple[str, ...]
    warnings: tuple[str, ...]


def compare(
    snapshot: SessionSnapshot,
    labels: ForeignLabels,
    *,
    options: ExportOptions,
    iou: float = IOU,
    classes: Mapping[str, str] | None = None,
    worst: int = WORST,
    progress: Callable[[int, int], None] | None = None,
) -> Comparison:
    """Compare a session's labels with manual ones, in the frames that somebody labelled.

    Args:
        options: what automatic labels are drawn round, and which of them exports would drop.
        iou: above 0, at most 1.
        classes: what the session calls a class of the manual labels, for those that have two names.
        worst: how many of the worst frames are kept with their labels.
        progress: told (frames done, frames in all).

    Raises:
        BadFile: the manual labels are not of the session's images.
        BadInput: `iou`, `classes` or a shape cannot be, or the two have no class in common.
    """
    if not 0 < iou <= 1:
        raise BadInput(f"the least IoU of a pair must be above 0 and at most 1, not {iou:g}")
    by_hand = manual_labels(labels, snapshot, classes=classes or {})
    ours = [snapshot.state.classes[id_].name for id_ in sorted(snapshot.state.classes)]
    names = (*ours, *(name for name in dict.fromkeys(by_hand.class_names) if name not in ours))
    kinds = {name: kind for kind, name in enumerate(names)}
    compared = frozenset(kinds[name] for name in set(by_hand.class_names) if name in ours)
    if by_hand.class_names and not compared:
        raise BadInput(
            f"no class of the manual labels ({', '.join(sorted(set(by_hand.class_names)))}) is one of the session's"
            f" ({', '.join(ours) or 'none'}); say which is which, as --classes manual=session,…"
        )
    by_program = automatic_labels(snapshot, by_hand.frames, options, progress=progress)
    manual = Rectangles(by_hand.frame, _kinds(by_hand.class_names, kinds), by_hand.bbox)
    automatic = {of: _rectangles(by_program, of, kinds) for of in RECTANGLES}
    found = {of: matches(manual, automatic[of], iou=iou) for of in RECTANGLES}
    sides = Sides(
        manual,
        automatic["in_image"],
        by_program.bbox["visible"],
        found["in_image"],
        np.isin(manual.kind, sorted(compared)),
        np.isin(automatic["in_image"].kind, sorted(compared)),
        names,
    )
    frames = compared_frames(sides, by_hand.frames, snapshot.frames.names)
    never_by_hand, unknown = _uncompared(sides)
    bands = hidden_bands(sides, by_program.visible)
    agreements: dict[RectangleKind, RectangleAgreement] = {
        of: rectangle_agreement(manual, automatic[of], found[of], names=names, compared=compared) for of in RECTANGLES
    }
    return Comparison(
        session=snapshot.id,
        revision=snapshot.state.revision,
        format=labels.format,
        source=labels.source,
        iou=iou,
        rectangles=agreements,
        hidden=int((np.isnan(by_program.bbox["visible"][:, 0]) & sides.automatic_counts).sum()),
        bands=bands,
        frames=tuple(frames),
        worst=worst_frames(sides, frames, count=worst),
        never_by_hand=never_by_hand,
        unknown=unknown,
        left_out=reasons(by_hand.left_out),
        notes=by_hand.notes,
        warnings=tuple(comparison_warnings(agreements["in_image"], bands, never_by_hand, unknown)),
    )


def _kinds(class_names: tuple[str, ...], kinds: Mapping[str, int]) -> Int[np.ndarray, "n"]:
    return np.array([kinds[name] for name in class_names], dtype=np.int64)


def _rectangles(labels: AutomaticLabels, of: RectangleKind, kinds: Mapping[str, int]) -> Rectangles:
    """All labels that have such a rectangle."""
    has = ~np.isnan(labels.bbox[of][:, 0])
    return Rectangles(labels.frame[has], _kinds(labels.class_names, kinds)[has], labels.bbox[of][has])


def _uncompared(sides: Sides) -> tuple[tuple[UncomparedClass, ...], tuple[UncomparedClass, ...]]:
    """The session's classes that nobody labelled, and people's that the session has not."""
    confused, manual, automatic = sides.found.confused, sides.manual.kind, sides.automatic.kind
    of_hand, of_program = manual[confused.first], automatic[confused.second]
    return (
        _only_there(automatic[~sides.automatic_counts], of_program, of_hand, sides.names),
        _only_there(manual[~sides.manual_counts], of_hand, of_program, sides.names),
    )


def _only_there(
    kinds: Int[np.ndarray, "n"], own: Int[np.ndarray, "m"], other: Int[np.ndarray, "m"], names: tuple[str, ...]
) -> tuple[UncomparedClass, ...]:
    found: list[UncomparedClass] = []
    for kind, count in sorted(Counter(kinds.tolist()).items()):
        often = Counter(other[own == kind].tolist()).most_common(1)
        name, times = (names[often[0][0]], often[0][1]) if often else (None, 0)
        found.append(UncomparedClass(names[kind], count, name, times))
    return tuple(found)
