"""Some places of many, spread evenly."""

import numpy as np
from jaxtyping import Int


def evenly(n: int, count: int) -> Int[np.ndarray, "k"]:
    """`count` of n places, or all: the middles of as many stretches of equal length."""
    count = min(n, count)
    return (2 * np.arange(count) + 1) * n // max(1, 2 * count)
