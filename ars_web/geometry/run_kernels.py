"""The compiled loops behind `run_lengths.py`."""

import numpy as np

from ars_web.geometry.compiled import entry

Array = np.ndarray


@entry
def runs(mask: Array, row: int, column: int, height: int, width: int) -> Array:
    """Lengths of the runs, column by column, of an image that is `mask` from `row` and `column` on and else nothing."""
    rows, columns = mask.shape
    counts, k, inside = np.empty(64, np.int64), 0, False
    length = column * height
    for j in range(columns):
        if inside and row > 0:
            counts[k], length, inside = length, 0, False
            k += 1
        length += row
        for i in range(rows):
            if mask[i, j] != inside:
                if k + 2 > len(counts):
                    more = np.empty(2 * len(counts), np.int64)
                    more[:k] = counts[:k]
                    counts = more
                counts[k], length, inside = length, 0, not inside
                k += 1
            length += 1
        below = height - row - rows
        if inside and below > 0:
            if k + 2 > len(counts):
                more = np.empty(2 * len(counts), np.int64)
                more[:k] = counts[:k]
                counts = more
            counts[k], length, inside = length, 0, False
            k += 1
        length += below
    after = (width - column - columns) * height
    if inside and after > 0:
        counts[k], length = length, 0
        k += 1
    length += after
    # An image of no pixels has no runs.
    if length > 0:
        counts[k] = length
        k += 1
    return counts[:k].copy()


@entry
def packed(counts: Array) -> Array:
    """The characters of COCO's short form of counts (k,)."""
    found, n = np.empty(13 * len(counts) + 1, np.uint8), 0
    for k in range(len(counts)):
        left = counts[k] - (counts[k - 2] if k > 2 else 0)
        more = True
        while more:
            bits = left & 31
            left >>= 5
            more = left != -1 if bits & 16 else left != 0
            found[n] = 48 + (bits | 32 if more else bits)
            n += 1
    return found[:n].copy()


@entry
def unpacked(characters: Array) -> Array:
    """The counts that characters of COCO's short form tell; what does not end a number is left out."""
    counts, k = np.empty(len(characters), np.int64), 0
    number, shift = np.int64(0), np.int64(0)
    for n in range(len(characters)):
        bits = np.int64(characters[n]) - 48
        # More than a count can have, and more than a shift can take.
        if shift < 60:
            number |= (bits & 31) << shift
        shift += 5
        if not bits & 32:
            if bits & 16 and shift < 64:
                number |= np.int64(-1) << shift
            counts[k] = number + (counts[k - 2] if k > 2 else 0)
            k += 1
            number, shift = np.int64(0), np.int64(0)
    return counts[:k].copy()
