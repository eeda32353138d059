"""Which frames of many to take: those that together show objects from most sides, without near twins.

An element is an object seen from one direction: a cell of equal area on the sphere round it. A choice is better than
another where it covers more elements; of two that cover as many, where the views of each element, 1/1 + 1/2 + ... of
them, add up to more, so that elements are seen about equally often. Both grow with every frame and by less the more
there are, so the greedy choice is the lazy one's too (Minoux, "Accelerated greedy algorithms for maximizing submodular
set functions", 1978), and covers at least 1 - 1/e of what the best choice could (Nemhauser, Wolsey and Fisher, 1978).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from ars_web.geometry import selection_kernels
from ars_web.geometry.even_spacing import evenly

NOTHING = -1
"""The element of an object that has no label in a frame."""

NEAR_SHARE = 0.1
"""Of the larger of two distances to an object, by which the other may be less for the views to be near twins."""

_ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class FrameViews:
    """What n frames show of at most b objects each, in the recordings' order.

    Attributes:
        elements: (n, b) the element that each object is seen as, NOTHING where it has no label. An element belongs to
            one object, so a frame has it once at most.
        directions: (n, b, 3) from the object to the camera, in the object's frame, of unit length.
        distances: (n, b) from the camera to the object.
        recording: (n,) frames of two recordings are never twins.
        index: (n,) place in the recording.
    """

    elements: Int[np.ndarray, "n b"]
    directions: Float[np.ndarray, "n b 3"]
    distances: Float[np.ndarray, "n b"]
    recording: Int[np.ndarray, "n"]
    index: Int[np.ndarray, "n"]

    def __len__(self) -> int:
        return len(self.elements)

    def of(self, rows: Int[np.ndarray, "k"]) -> "FrameViews":
        """Some of the frames, in the order of `rows`."""
        return FrameViews(
            self.elements[rows], self.directions[rows], self.distances[rows], self.recording[rows], self.index[rows]
        )


@dataclass(frozen=True)
class Nearness:
    """When a frame is a near twin of one that was chosen before it.

    By time: both are of one recording and at most `frames` apart. By view: every object with a label in it, and there
    is one, has a label in the chosen frame too, seen from directions at most `degrees` apart and from distances that
    differ by at most NEAR_SHARE of the larger. A frame without a label has no twin by view. 0: no twins by that.
    """

    degrees: float = 0.0
    frames: int = 0

    @property
    def drops_any(self) -> bool:
        """Whether there are near twins at all."""
        return self.degrees > 0.0 or self.frames > 0


NO_TWINS = Nearness()


def apart(views: FrameViews, near: Nearness) -> Int[np.ndarray, "k"]:
    """The frames, in order, that are no near twin of one before them that is kept."""
    if not near.drops_any:
        return np.arange(len(views))
    state = np.zeros(len(views), dtype=np.int8)
    columns = _columns(views)
    selection_kernels.walk(columns, _twins(columns, near), state)
    return np.flatnonzero(state == selection_kernels.CHOSEN)


def twins_of(views: FrameViews, rows: Int[np.ndarray, "k"], near: Nearness) -> Bool[np.ndarray, "n"]:
    """Which frames are near twins of those at `rows`, which themselves are none."""
    state = np.zeros(len(views), dtype=np.int8)
    state[rows] = selection_kernels.CHOSEN
    columns = _columns(views)
    selection_kernels.mark_all(np.ascontiguousarray(rows, dtype=np.int64), columns, _twins(columns, near), state)
    return state == selection_kernels.TWIN


def greedily(views: FrameViews, count: int, *, near: Nearness = NO_TWINS) -> Int[np.ndarray, "k"]:
    """At most `count` frames, in the order in which they are chosen: each adds most to those before it.

    Fewer where the others are near twins of these. Of frames that add as much the one goes first that comes first
    in `tie_order`.
    """
    order = tie_order(views.elements)
    chosen = np.zeros(min(count, len(views)), dtype=np.int64)
    columns = _columns(views.of(order))
    counts = np.zeros(int(columns.elements.max(initial=NOTHING)) + 1, dtype=np.int64)
    found = selection_kernels.choose_lazily(columns, _twins(columns, near), counts, chosen)
    return order[chosen[:found]]


def covering(views: FrameViews, count: int, *, near: Nearness = NO_TWINS) -> Int[np.ndarray, "k"]:
    """At most `count` frames that cover most, ascending: the greedy choice, never worse than even spacing.

    Even spacing takes every k-th of the frames that are `apart`. Where that is better, which can be in few frames
    alone, it is what is returned.
    """
    kept = apart(views, near)
    even = kept[evenly(len(kept), count)]
    greedy = np.sort(greedily(views, count, near=near))
    return greedy if worth(views.elements, greedy) >= worth(views.elements, even) else even


def covered(elements: Int[np.ndarray, "n b"]) -> int:
    """How many elements frames cover."""
    return worth(elements, np.arange(len(elements)))[0]


def worth(elements: Int[np.ndarray, "n b"], rows: Int[np.ndarray, "k"]) -> tuple[int, int]:
    """How good the choice of `rows` is: elements covered, and what their views are worth. Larger is better."""
    seen = elements[rows]
    counts = np.bincount(seen[seen != NOTHING], minlength=1)
    views = selection_kernels.WHOLE // np.arange(1, int(counts.max()) + 1)
    return int((counts > 0).sum()), int(np.concatenate([[0], np.cumsum(views)])[counts].sum())


def tie_order(elements: Int[np.ndarray, "n b"]) -> Int[np.ndarray, "n"]:
    """All n frames, those first that show the element that fewest frames show, so that no twin takes its place; of
    those that are as rare in `spread_order`: neighbours show nearly the same."""
    labelled = elements != NOTHING
    frames_of = np.bincount(elements[labelled], minlength=1)
    rarest = np.where(labelled, frames_of[np.where(labelled, elements, 0)], len(elements) + 1)
    order = spread_order(len(elements))
    return order[np.argsort(rarest.min(axis=1, initial=len(elements) + 1)[order], kind="stable")]


def spread_order(n: int) -> Int[np.ndarray, "n"]:
    """All n places in an order in which the first few always lie far apart: by their bits, read backwards."""
    bits = max(1, int(n - 1).bit_length()) if n else 1
    places = np.arange(1 << bits)
    backwards = np.zeros_like(places)
    for bit in range(bits):
        backwards |= ((places >> bit) & 1) << (bits - 1 - bit)
    return backwards[backwards < n]


def _columns(views: FrameViews) -> selection_kernels.Views:
    return selection_kernels.Views(
        np.ascontiguousarray(views.elements, dtype=np.int64),
        np.ascontiguousarray(views.directions, dtype=np.float64),
        np.ascontiguousarray(views.distances, dtype=np.float64),
        np.ascontiguousarray(views.recording, dtype=np.int64),
        np.ascontiguousarray(views.index, dtype=np.int64),
    )


def _twins(views: selection_kernels.Views, near: Nearness) -> selection_kernels.Twins:
    angle = np.radians(near.degrees)
    by_time = np.lexsort((views.frame, views.recording))
    place = np.empty_like(by_time)
    place[by_time] = np.arange(len(by_time))
    labelled = views.elements != NOTHING
    rows = np.flatnonzero(labelled.any(axis=1)) if near.degrees > 0.0 else np.zeros(0, dtype=np.int64)
    first = labelled[rows].argmax(axis=1) if len(rows) else rows
    directions = views.directions[rows, first]
    # Of a camera that goes round at one height z tells nothing apart, and every frame would be held against every one.
    axis = np.zeros(labelled.shape[1], dtype=np.int64)
    for k in np.unique(first).tolist():
        axis[k] = directions[first == k].var(axis=0).argmax()
    along = directions[np.arange(len(rows)), axis[first]]
    order = np.lexsort((along, first))
    return selection_kernels.Twins(
        frames=near.frames,
        by_time=by_time,
        place=place,
        cosine=float(np.cos(angle)) - _ROUNDING,
        share=NEAR_SHARE,
        reach=float(2.0 * np.sin(angle / 2.0)) + 1e-6,
        axis=axis,
        rows=rows[order],
        along=along[order],
        starts=np.searchsorted(first[order], np.arange(labelled.shape[1] + 1)),
    )
