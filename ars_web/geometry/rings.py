"""Rings of many labels one after the other: what outlines, silhouettes and rectangles in images are kept as."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int


@dataclass(frozen=True, eq=False)
class Rings:
    """Any number of rings for each of n x b labels; image coordinates, none of them closed.

    Outer rings run counter-clockwise as seen in the image (y down), holes clockwise; a hole follows its outer ring.

    Attributes:
        points: (m, 2) of all rings.
        ring_starts: (r + 1,) places in `points`; a ring ends where the next begins.
        label_starts: (n * b + 1,) places among the rings: those of frame i and shape j begin at
            `label_starts[i * b + j]`, and there may be none.
    """

    points: Float[np.ndarray, "m 2"]
    ring_starts: Int[np.ndarray, "r"]
    label_starts: Int[np.ndarray, "k"]

    def of(self, label: int) -> list[Float[np.ndarray, "_ 2"]]:
        """The rings of the label with this number, frame * b + shape."""
        first, last = int(self.label_starts[label]), int(self.label_starts[label + 1])
        edges = self.ring_starts[first : last + 1].tolist()
        return [self.points[start:end] for start, end in pairwise(edges)]


def rings_of(labels: Sequence[Sequence[Float[np.ndarray, "_ 2"]]]) -> Rings:
    """The rings of each label, put one after the other."""
    every = [ring for rings in labels for ring in rings]
    return Rings(
        np.concatenate([np.zeros((0, 2)), *every]),
        np.cumsum([0, *(len(ring) for ring in every)], dtype=np.int64),
        np.cumsum([0, *(len(rings) for rings in labels)], dtype=np.int64),
    )


def one_ring_each(points: Float[np.ndarray, "m 2"], offsets: Int[np.ndarray, "k"]) -> Rings:
    """Labels of one ring at most: `points[offsets[i] : offsets[i + 1]]` of label i, none where that is empty."""
    there = np.diff(offsets) > 0
    ring_starts = np.concatenate([offsets[:-1][there], offsets[-1:]]).astype(np.int64)
    return Rings(points, ring_starts, np.concatenate([[0], np.cumsum(there)]).astype(np.int64))
