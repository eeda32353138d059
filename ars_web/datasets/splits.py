"""Splits: which frames train, which validate, which test.

What is divided are units: contiguous blocks of frames, single frames, or whole sessions. Units are ranked by the
SHA-256 of the seed and their place, and the ranks are dealt out by the shares. So the choice depends on nothing
but the seed and the counts: not on a library's random stream, the machine, or a session's random id.

A split by sector orders each session's frames by the azimuth of their cameras round its objects, beginning behind the
widest gap between two of them, and takes one run of that order for validation and the next for test. Where the run
begins is the seed's. So each sees the objects from a side that training does not, and never across a gap.
"""

import hashlib
from collections.abc import Sequence
from typing import Literal

import numpy as np
from jaxtyping import Float, Int

from ars_web.datasets.options import SplitChoice
from ars_web.errors import BadInput

SPLITS: tuple[Literal["train", "val", "test"], ...] = ("train", "val", "test")
"""A split's number is its place here."""

BLOCKS = 30
"""Blocks in each session where it is long: enough to meet the shares and to spread over the recording."""

FEWEST_BLOCKS = 10
"""Blocks in a session that is too short for others: as many as tenths, which most shares are."""

BLOCK_FRAMES = 20
"""Frames that a block has where the session has enough: few validation frames then have a neighbour in training."""


def assign(
    frame_counts: Sequence[int],
    choice: SplitChoice,
    *,
    session_ids: Sequence[str] = (),
    azimuths: Sequence[Float[np.ndarray, "n"]] = (),
) -> Int[np.ndarray, "n"]:
    """The split number of each frame, the sessions' frames one after the other.

    `frame_counts` are the chosen frames of each session, `session_ids` what sessions to hold out are named by, and
    `azimuths` in degrees those of each session's frames, for a split by sector; NaN counts as 0. Shares are met to the
    nearest unit, within each session for all but whole sessions; every split with a positive share gets a unit where
    there are enough of them.

    Raises:
        BadInput: whole sessions are to be divided and there are fewer than splits; or those held out are not there,
            are all there are, have no frame, or are too few.
    """
    shares = (choice.train, choice.val, choice.test)
    if choice.by == "session":
        if choice.hold_out:
            of_session = _hold_out(frame_counts, session_ids, choice)
        else:
            _refuse_too_few([name for name, share in zip(SPLITS, shares, strict=True) if share > 0], frame_counts)
            of_session = _deal(len(frame_counts), shares, salt=f"{choice.seed}/sessions")
        return np.repeat(of_session, np.asarray(frame_counts, dtype=np.int64))
    if choice.by == "sector":
        found = [_by_sector(of_one, shares, salt=f"{choice.seed}/{i}/sector") for i, of_one in enumerate(azimuths)]
        return np.concatenate([np.zeros(0, dtype=np.int8), *found])
    parts = [np.zeros(0, dtype=np.int8)]
    for number, count in enumerate(frame_counts):
        units = _blocks(count) if choice.by == "block" else count
        of_unit = _deal(units, shares, salt=f"{choice.seed}/{number}")
        # Frame i lies in unit floor(i * units / count): lengths differ by one at most.
        parts.append(of_unit[np.arange(count) * units // max(count, 1)])
    return np.concatenate(parts)


def _refuse_too_few(wanted: Sequence[str], frame_counts: Sequence[int]) -> None:
    if len(frame_counts) < len(wanted):
        raise BadInput(
            f"a split by session needs a session for each of {', '.join(wanted)}, and this export has"
            f" {len(frame_counts)}; merge more sessions, or split by 'block'"
        )


def _hold_out(frame_counts: Sequence[int], session_ids: Sequence[str], choice: SplitChoice) -> Int[np.ndarray, "s"]:
    """The split number of each session: training, but for those held out, which val and test share."""
    held = [place for place, sid in enumerate(session_ids) if sid in choice.hold_out]
    for sid in choice.hold_out:
        if sid not in session_ids:
            raise BadInput(f"session {sid} is to be held out, but is not in this export of {', '.join(session_ids)}")
        if frame_counts[session_ids.index(sid)] == 0:
            raise BadInput(f"session {sid} is to be held out, but no frame of it is chosen; widen the choice of frames")
    wanted = [number for number, share in ((1, choice.val), (2, choice.test)) if share > 0]
    if len(held) < len(wanted):
        raise BadInput(
            f"val and test need a session each, and {session_ids[held[0]]} alone is held out; hold out another, or set"
            " the share of one of them to 0"
        )
    if len(held) == len(frame_counts) and choice.train > 0:
        raise BadInput("all sessions are held out, so that none is left to train on; merge another, or hold out fewer")
    of_session = np.zeros(len(frame_counts), dtype=np.int8)
    both = choice.val + choice.test
    dealt = _deal(len(held), (0.0, choice.val / both, choice.test / both), salt=f"{choice.seed}/held")
    of_session[held] = dealt
    return of_session


def _by_sector(azimuths: Float[np.ndarray, "n"], shares: Sequence[float], *, salt: str) -> Int[np.ndarray, "n"]:
    n = len(azimuths)
    degrees = np.nan_to_num(azimuths, nan=0.0)
    order = np.argsort(degrees, kind="stable")
    gaps = np.diff(degrees[order], append=degrees[order][:1] + 360.0)
    if n:
        order = np.roll(order, -(int(gaps.argmax()) + 1))
    _, val, test = apportion(n, shares)
    places = n - val - test + 1
    first = int.from_bytes(hashlib.sha256(salt.encode()).digest()[:8]) % places
    found = np.zeros(n, dtype=np.int8)
    found[order[first : first + val]] = 1
    found[order[first + val : first + val + test]] = 2
    return found


def places_in_splits(split: Int[np.ndarray, "n"]) -> Int[np.ndarray, "n"]:
    """The place of each frame among those of its split, from 0; `split` are split numbers."""
    places = np.zeros(len(split), dtype=np.int64)
    for number in range(len(SPLITS)):
        places[split == number] = np.arange(int((split == number).sum()))
    return places


def _blocks(frames: int) -> int:
    return min(frames, max(FEWEST_BLOCKS, min(BLOCKS, frames // BLOCK_FRAMES)))


def apportion(units: int, shares: Sequence[float]) -> list[int]:
    """How many of `units` each share gets: largest remainders, and at least one for a positive share where there
    are as many units as positive shares."""
    exact = [share * units for share in shares]
    # 0.29 * 100 is 28.999...: its remainder is then the largest, so that it gets the whole number all the same.
    counts = [int(value) for value in exact]
    by_remainder = sorted(range(len(shares)), key=lambda i: (counts[i] - exact[i], i))
    for i in by_remainder[: units - sum(counts)]:
        counts[i] += 1
    positive = [i for i, share in enumerate(shares) if share > 0]
    if units >= len(positive):
        for i in positive:
            if counts[i] == 0:
                counts[max(range(len(shares)), key=counts.__getitem__)] -= 1
                counts[i] = 1
    return counts


def _deal(units: int, shares: Sequence[float], *, salt: str) -> Int[np.ndarray, "m"]:
    """The split number of each unit."""
    ranked = sorted(range(units), key=lambda unit: hashlib.sha256(f"{salt}/{unit}".encode()).digest())
    of_unit = np.zeros(units, dtype=np.int8)
    of_unit[ranked] = np.repeat(np.arange(len(shares), dtype=np.int8), apportion(units, shares))
    return of_unit
