"""Predictions to labels, by COCO's rule and by VOC's, compiled: both are loops whose every step depends on the last."""

import numpy as np
from jaxtyping import Bool, Float, Int

from ars_web.geometry.compiled import entry, part

NONE = -1
"""No label."""


@part
def _overlap(a: Float[np.ndarray, "4"], b: Float[np.ndarray, "4"], within: bool) -> float:
    """Intersection over union of two x, y, w, h, or over `a` alone: operation by operation as pycocotools has it, since
    a last digit decides where an overlap is a threshold."""
    w = min(a[2] + a[0], b[2] + b[0]) - max(a[0], b[0])
    if w <= 0:
        return 0.0
    h = min(a[3] + a[1], b[3] + b[1]) - max(a[1], b[1])
    if h <= 0:
        return 0.0
    common = w * h
    area = a[2] * a[3]
    return common / (area if within else area + b[2] * b[3] - common)


@entry
def coco_matches(
    boxes: Float[np.ndarray, "d 4"],
    box_starts: Int[np.ndarray, "g1"],
    labels: Float[np.ndarray, "n 4"],
    label_starts: Int[np.ndarray, "g1"],
    ignored: Bool[np.ndarray, "n"],
    crowd: Bool[np.ndarray, "n"],
    thresholds: Float[np.ndarray, "t"],
    most: int,
) -> tuple[Int[np.ndarray, "t d"], Float[np.ndarray, "t d"]]:
    """For each threshold the label that each prediction finds, NONE where it finds none, and how far they overlap.

    Source: COCOeval.evaluateImg of pycocotools 2.0.11.

    Args:
        boxes, labels: x, y, w, h, in groups of one image and class each; predictions by falling score, the labels that
            count before those that are ignored.
        box_starts, label_starts: (g + 1,) where each group begins.
        most: predictions of a group beyond which none finds anything.
    """
    found = np.full((len(thresholds), len(boxes)), NONE, dtype=np.int64)
    shared = np.zeros((len(thresholds), len(boxes)))
    for group in range(len(box_starts) - 1):
        first_box, first = box_starts[group], label_starts[group]
        count = min(box_starts[group + 1] - first_box, most)
        labelled = label_starts[group + 1] - first
        if count == 0 or labelled == 0:
            continue
        overlaps = np.empty((count, labelled))
        for i in range(count):
            for j in range(labelled):
                overlaps[i, j] = _overlap(boxes[first_box + i], labels[first + j], bool(crowd[first + j]))
        for t in range(len(thresholds)):
            taken = np.zeros(labelled, dtype=np.bool_)
            for i in range(count):
                least = min(thresholds[t], 1 - 1e-10)
                best = NONE
                for j in range(labelled):
                    if taken[j] and not crowd[first + j]:
                        continue
                    if best != NONE and not ignored[first + best] and ignored[first + j]:
                        break
                    if overlaps[i, j] >= least:
                        least = overlaps[i, j]
                        best = j
                if best != NONE:
                    taken[best] = True
                    found[t, first_box + i] = first + best
                    shared[t, first_box + i] = least
    return found, shared


@entry
def voc_matches(
    boxes: Float[np.ndarray, "d 4"],
    box_starts: Int[np.ndarray, "g1"],
    labels: Float[np.ndarray, "n 4"],
    label_starts: Int[np.ndarray, "g1"],
) -> tuple[Int[np.ndarray, "d"], Float[np.ndarray, "d"]]:
    """The label that each prediction overlaps most, whoever else does, NONE where it overlaps none, and how far.

    Source: VOCevaldet.m of the VOC2012 development kit. Groups are as in `coco_matches`.
    """
    found = np.full(len(boxes), NONE, dtype=np.int64)
    shared = np.zeros(len(boxes))
    for group in range(len(box_starts) - 1):
        for i in range(box_starts[group], box_starts[group + 1]):
            for j in range(label_starts[group], label_starts[group + 1]):
                overlap = _overlap(boxes[i], labels[j], False)
                if overlap > shared[i]:
                    shared[i] = overlap
                    found[i] = j
    return found, shared


@entry
def first_of_each(found: Int[np.ndarray, "d"], labels: int) -> Bool[np.ndarray, "d"]:
    """Whether a prediction is the first in order that finds its label; never where it finds none."""
    taken = np.zeros(labels, dtype=np.bool_)
    first = np.zeros(len(found), dtype=np.bool_)
    for i in range(len(found)):
        if found[i] != NONE and not taken[found[i]]:
            taken[found[i]] = True
            first[i] = True
    return first
