"""The compiled loops that choose frames; `frame_selection.py` says what they do."""

from typing import NamedTuple

import numpy as np

from ars_web.geometry.compiled import entry, part

Array = np.ndarray

WHOLE = 1 << 32
"""What the first view of an element counts, in whole numbers: sums of these are the same on every machine."""

FREE = 0
CHOSEN = 1
TWIN = 2
"""What becomes of a frame."""


class Views(NamedTuple):
    """What n frames show, as `frame_selection.FrameViews` has it; `frame` is their index."""

    elements: Array
    directions: Array
    distances: Array
    recording: Array
    frame: Array


class Twins(NamedTuple):
    """Which frames are near twins.

    Attributes:
        frames: apart in time at most; 0: none are twins by time.
        by_time: (n,) all frames by their recording and the place in it.
        place: (n,) where each frame is in `by_time`.
        cosine, share: of the largest angle between two views, and by how much distances differ.
        reach: by how much a coordinate of two directions can differ within that angle.
        axis: (b,) by which coordinate of their directions each object's rows are sorted.
        rows: (m,) frames with a label, by the first object that they have one of, and then by that coordinate; none
            where there are no twins by view.
        along: (m,) those coordinates.
        starts: (b + 1,) where each object's rows begin, and after the last their number.
    """

    frames: int
    by_time: Array
    place: Array
    cosine: float
    share: float
    reach: float
    axis: Array
    rows: Array
    along: Array
    starts: Array


@part
def gain_of(elements: Array, row: int, counts: Array) -> int:
    """What a frame adds: first how many elements that have no view yet, and after that the views' worth."""
    boxes = elements.shape[1]
    gain = 0
    for j in range(boxes):
        element = elements[row, j]
        if element >= 0:
            count = counts[element]
            gain += WHOLE // (count + 1)
            if count == 0:
                # More than all labels of a frame can be worth together.
                gain += WHOLE * (boxes + 1)
    return int(gain)


@part
def shows_no_more(i: int, j: int, views: Views, twins: Twins) -> bool:
    """Whether frame i has every label of frame j, seen from nearly the same place."""
    for k in range(views.elements.shape[1]):
        if views.elements[j, k] < 0:
            continue
        if views.elements[i, k] < 0:
            return False
        along = 0.0
        for axis in range(3):
            along += views.directions[i, k, axis] * views.directions[j, k, axis]
        one, other = views.distances[i, k], views.distances[j, k]
        if along < twins.cosine or abs(one - other) > twins.share * max(one, other):
            return False
    return True


@part
def mark_twins(i: int, views: Views, twins: Twins, state: Array) -> None:
    """Mark the free frames that are near twins of frame i."""
    recording = views.recording[i]
    for step in (-1, 1):
        at = twins.place[i] + step
        while 0 <= at < len(twins.by_time):
            j = twins.by_time[at]
            if views.recording[j] != recording or abs(views.frame[j] - views.frame[i]) > twins.frames:
                break
            if state[j] == FREE:
                state[j] = TWIN
            at += step
    if len(twins.rows) == 0:
        return
    for k in range(views.elements.shape[1]):
        if views.elements[i, k] < 0:
            continue
        along = views.directions[i, k, twins.axis[k]]
        start, stop = twins.starts[k], twins.starts[k + 1]
        first = start + np.searchsorted(twins.along[start:stop], along - twins.reach)
        for place in range(first, stop):
            if twins.along[place] > along + twins.reach:
                break
            j = twins.rows[place]
            if state[j] == FREE and views.recording[j] == recording and shows_no_more(i, j, views, twins):
                state[j] = TWIN


@part
def set_key(keys: Array, row: int, key: int) -> None:
    """Change a frame's key in the tree, in which each node is the larger of its two children."""
    place = len(keys) // 2 + row
    keys[place] = key
    place //= 2
    while place:
        largest = max(keys[2 * place], keys[2 * place + 1])
        if keys[place] == largest:
            return
        keys[place] = largest
        place //= 2


@part
def row_of_largest(keys: Array) -> int:
    """The frame with the largest key; of several the first."""
    place, leaves = 1, len(keys) // 2
    while place < leaves:
        place = 2 * place if keys[2 * place] >= keys[2 * place + 1] else 2 * place + 1
    return place - leaves


@entry
def choose_lazily(views: Views, twins: Twins, counts: Array, chosen: Array) -> int:
    """Choose frames into `chosen` (k,) until it is full or no frame is left; how many were chosen.

    A frame's key is what it added when that was last looked at. It can only have become less, so the frame with the
    largest key is the best if its key is still right. `counts` are the views of each element so far.
    """
    n = len(views.elements)
    state = np.full(n, FREE, dtype=np.int8)
    leaves = 1
    while leaves < n:
        leaves *= 2
    keys = np.full(2 * leaves, -1, dtype=np.int64)
    for i in range(n):
        keys[leaves + i] = gain_of(views.elements, i, counts)
    for place in range(leaves - 1, 0, -1):
        keys[place] = max(keys[2 * place], keys[2 * place + 1])
    found = 0
    while found < len(chosen) and keys[1] >= 0:
        i = row_of_largest(keys)
        # A twin leaves the tree when it comes to the top.
        gain = gain_of(views.elements, i, counts) if state[i] == FREE else -1
        if gain < keys[leaves + i]:
            set_key(keys, i, gain)
            continue
        chosen[found] = i
        found += 1
        state[i] = CHOSEN
        set_key(keys, i, -1)
        for j in range(views.elements.shape[1]):
            if views.elements[i, j] >= 0:
                counts[views.elements[i, j]] += 1
        mark_twins(i, views, twins, state)
    return found


@entry
def walk(views: Views, twins: Twins, state: Array) -> None:
    """Take frames in their order, and mark in `state` (n,) later ones that are twins of one that was taken."""
    for i in range(len(state)):
        if state[i] == FREE:
            state[i] = CHOSEN
            mark_twins(i, views, twins, state)


@entry
def mark_all(rows: Array, views: Views, twins: Twins, state: Array) -> None:
    """Mark in `state` (n,) the free frames that are near twins of those at `rows`."""
    for i in rows:
        mark_twins(i, views, twins, state)
