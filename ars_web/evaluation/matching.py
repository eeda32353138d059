"""Labels and predictions in groups of one image and class, and which of them are each other's."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from ars_web.evaluation import matching_kernels
from ars_web.evaluation.detections import Predictions, Truth

MOST = 100
"""Predictions of an image and a class that COCO looks at: those of the highest scores."""


@dataclass(frozen=True, eq=False)
class Groups:
    """Both sides sorted by class and image; of a group the predictions by falling score, the labels that count first.

    Attributes:
        label, box: (n,), (d,) each row's place in the truth's and in the predictions' columns.
        label_starts, box_starts: (g + 1,) where each group begins.
        labels, boxes: x, y, w, h.
        rank: (d,) a prediction's place in its group, from 0.
    """

    label: Int[np.ndarray, " n"]
    box: Int[np.ndarray, " d"]
    label_starts: Int[np.ndarray, " g1"]
    box_starts: Int[np.ndarray, " g1"]
    labels: Float[np.ndarray, "n 4"]
    boxes: Float[np.ndarray, "d 4"]
    rank: Int[np.ndarray, " d"]


@dataclass(frozen=True, eq=False)
class Matches:
    """Which label each prediction finds at one threshold; columns are the predictions', unsorted.

    Attributes:
        label: (d,) place in the truth's columns; -1: none.
        overlap: (d,) intersection over union with it; over the prediction alone where it is a crowd.
        right: (d,) finds a label that counts.
        wrong: (d,) finds none; what finds an ignored label, or is beyond the hundredth, is neither.
    """

    label: Int[np.ndarray, " d"]
    overlap: Float[np.ndarray, " d"]
    right: Bool[np.ndarray, " d"]
    wrong: Bool[np.ndarray, " d"]


def grouped(truth: Truth, found: Predictions) -> Groups:
    """Both sides by class and image."""
    images = len(truth.images)
    label_key = truth.class_ * images + truth.image
    box_key = found.class_ * images + found.image
    label = np.lexsort((truth.ignored, label_key))
    # Sorting is stable: predictions of one score stay in the order in which they came, as pycocotools has it.
    box = np.lexsort((-found.score, box_key))
    keys = np.unique(np.concatenate([label_key, box_key]))
    label_starts = np.append(np.searchsorted(label_key[label], keys), len(label))
    box_starts = np.append(np.searchsorted(box_key[box], keys), len(box))
    rank = np.arange(len(box)) - np.repeat(box_starts[:-1], np.diff(box_starts))
    return Groups(
        label, box, label_starts, box_starts, _with_sides(truth.bbox[label]), _with_sides(found.bbox[box]), rank
    )


def coco_matches(truth: Truth, groups: Groups, *, thresholds: Float[np.ndarray, " t"]) -> list[Matches]:
    """Matches by COCO's rule, for each threshold."""
    ignored = truth.ignored[groups.label]
    found, shared = matching_kernels.coco_matches(
        groups.boxes,
        groups.box_starts,
        groups.labels,
        groups.label_starts,
        ignored,
        truth.crowd[groups.label],
        thresholds,
        MOST,
    )
    counted = groups.rank < MOST
    return [
        _unsorted(groups, row, overlap, right=hit & ~_at(ignored, row, hit), wrong=~hit & counted)
        for row, overlap in zip(found, shared, strict=True)
        for hit in (row != matching_kernels.NONE,)
    ]


def voc_matches(truth: Truth, groups: Groups, *, thresholds: Float[np.ndarray, " t"]) -> list[Matches]:
    """Matches by VOC's rule, for each threshold: overlaps of the threshold and more count."""
    found, shared = matching_kernels.voc_matches(groups.boxes, groups.box_starts, groups.labels, groups.label_starts)
    ignored = truth.ignored[groups.label]
    matches: list[Matches] = []
    for threshold in thresholds:
        row = np.where(shared >= threshold, found, matching_kernels.NONE)
        hit = row != matching_kernels.NONE
        skipped = _at(ignored, row, hit)
        first = matching_kernels.first_of_each(row, len(groups.label)) & ~skipped
        matches.append(_unsorted(groups, row, shared, right=first, wrong=~first & ~skipped))
    return matches


def _at(flags: np.ndarray, places: np.ndarray, there: np.ndarray) -> np.ndarray:
    """Flags at places, False where there is none."""
    return np.concatenate([flags, [False]])[np.where(there, places, -1)]


def _unsorted(groups: Groups, row: np.ndarray, overlap: np.ndarray, *, right: np.ndarray, wrong: np.ndarray) -> Matches:
    label, shared = np.full(len(row), matching_kernels.NONE, dtype=np.int64), np.zeros(len(row))
    is_right, is_wrong = np.zeros(len(row), dtype=np.bool_), np.zeros(len(row), dtype=np.bool_)
    hit = row != matching_kernels.NONE
    label[groups.box[hit]] = groups.label[row[hit]]
    shared[groups.box] = overlap
    is_right[groups.box] = right
    is_wrong[groups.box] = wrong
    return Matches(label, shared, is_right, is_wrong)


def _with_sides(bbox: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(np.concatenate([bbox[:, :2], bbox[:, 2:] - bbox[:, :2]], axis=1))
