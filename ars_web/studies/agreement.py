"""How far manual and automatic labels agree: counts, shares and overlaps of what was matched.

Precision is the share of the automatic labels that match a manual one, recall the share of the manual labels that an
automatic one matches, and mean IoU is over the matches: the terms of De Gregorio et al., whose study they follow.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from ars_web.studies.rectangle_matching import Pairs, Rectangles, matched_pairs, pairs_of_any_class

BINS = 20
"""Of IoU from 0 to 1."""


@dataclass(frozen=True)
class Agreement:
    """Of the labels of one class, or of all.

    Attributes:
        manual, automatic: how many labels there are.
        matched: pairs of one of each.
        precision: matched of automatic; None where there is no automatic label.
        recall: matched of manual; None where there is no manual label.
        mean_iou, median_iou: of the pairs; None where there is none.
    """

    manual: int
    automatic: int
    matched: int
    precision: float | None
    recall: float | None
    mean_iou: float | None
    median_iou: float | None


@dataclass(frozen=True)
class ClassAgreement:
    """Of one class."""

    class_name: str
    agreement: Agreement


@dataclass(frozen=True)
class Confusion:
    """How often a manual label of one class lies where an automatic one of another does, or of the same.

    Attributes:
        manual, automatic: names of classes; None: there is no label that overlaps enough, and is free.
    """

    manual: str | None
    automatic: str | None
    count: int


@dataclass(frozen=True)
class Offsets:
    """Median of automatic minus manual of each side, pixels; to the right and down are positive."""

    left: float
    top: float
    right: float
    bottom: float


@dataclass(frozen=True)
class RectangleAgreement:
    """All numbers of one kind of automatic rectangles.

    Attributes:
        total: of all compared classes.
        classes: each compared class.
        confusion: every combination that occurs, by the manual class and then the automatic one; none comes last.
        histogram: how many pairs have an IoU in each of BINS equal parts of 0 to 1, the last with its end.
        offsets: None where there is no pair.
    """

    total: Agreement
    classes: tuple[ClassAgreement, ...]
    confusion: tuple[Confusion, ...]
    histogram: tuple[int, ...]
    offsets: Offsets | None


@dataclass(frozen=True, eq=False)
class Matches:
    """What was matched with what.

    Attributes:
        pairs: of one class; first manual, second automatic.
        confused: of two classes, among what is left.
    """

    pairs: Pairs
    confused: Pairs


def matches(manual: Rectangles, automatic: Rectangles, *, iou: float) -> Matches:
    """Pairs of one class, then pairs of any classes among the labels that have no partner."""
    pairs = matched_pairs(manual, automatic, iou=iou)
    free = np.ones(len(manual), dtype=bool), np.ones(len(automatic), dtype=bool)
    free[0][pairs.first] = free[1][pairs.second] = False
    confused = pairs_of_any_class(manual, automatic, iou=iou, among_first=free[0], among_second=free[1])
    return Matches(pairs, confused)


def rectangle_agreement(
    manual: Rectangles, automatic: Rectangles, found: Matches, *, names: tuple[str, ...], compared: frozenset[int]
) -> RectangleAgreement:
    """The numbers of matches.

    Args:
        names: of the classes, by `kind`.
        compared: kinds whose labels count; the others are looked at for confusion alone.
    """
    pairs = found.pairs
    of_class = [_agreement(manual.kind == kind, automatic.kind == kind, pairs) for kind in sorted(compared)]
    wanted = np.array(sorted(compared), dtype=np.int64)
    total = _agreement(np.isin(manual.kind, wanted), np.isin(automatic.kind, wanted), pairs)
    counts, _ = np.histogram(pairs.iou, bins=BINS, range=(0.0, 1.0))
    return RectangleAgreement(
        total,
        tuple(ClassAgreement(names[kind], one) for kind, one in zip(sorted(compared), of_class, strict=True)),
        tuple(_confusion(manual, automatic, found, names, compared)),
        tuple(counts.tolist()),
        _offsets(manual.bbox[pairs.first], automatic.bbox[pairs.second]),
    )


def _agreement(manual: Bool[np.ndarray, "n"], automatic: Bool[np.ndarray, "m"], pairs: Pairs) -> Agreement:
    """Of the labels that are marked True."""
    ious = pairs.iou[manual[pairs.first] & automatic[pairs.second]]
    by_hand, by_program, matched = int(manual.sum()), int(automatic.sum()), len(ious)
    return Agreement(
        manual=by_hand,
        automatic=by_program,
        matched=matched,
        precision=matched / by_program if by_program else None,
        recall=matched / by_hand if by_hand else None,
        mean_iou=float(ious.mean()) if matched else None,
        median_iou=float(np.median(ious)) if matched else None,
    )


def _confusion(
    manual: Rectangles, automatic: Rectangles, found: Matches, names: tuple[str, ...], compared: frozenset[int]
) -> Iterable[Confusion]:
    none = len(names)
    counts = np.zeros((none + 1, none + 1), dtype=np.int64)
    free = np.ones(len(manual), dtype=bool), np.ones(len(automatic), dtype=bool)
    for pairs in (found.pairs, found.confused):
        np.add.at(counts, (manual.kind[pairs.first], automatic.kind[pairs.second]), 1)
        free[0][pairs.first] = free[1][pairs.second] = False
    wanted = np.array(sorted(compared), dtype=np.int64)
    missed = manual.kind[free[0] & np.isin(manual.kind, wanted)]
    extra = automatic.kind[free[1] & np.isin(automatic.kind, wanted)]
    counts[:none, none] = np.bincount(missed, minlength=none)
    counts[none, :none] = np.bincount(extra, minlength=none)
    called = (*names, None)
    for i, j in np.argwhere(counts).tolist():
        yield Confusion(called[i], called[j], int(counts[i, j]))


def _offsets(manual: Float[np.ndarray, "m 4"], automatic: Float[np.ndarray, "m 4"]) -> Offsets | None:
    if not len(manual):
        return None
    return Offsets(*np.median(automatic - manual, axis=0).tolist())
