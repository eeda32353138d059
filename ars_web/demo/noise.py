"""Randomness that depends on where it is asked for only: the same on every run and in every order."""

import math

from ars_web.demo.compiled import compiled


@compiled
def hashed(i: int, j: int, seed: int) -> int:
    """32 well mixed bits of two integers and a seed (multiply and xor-shift)."""
    h = (i * 374761393 + j * 668265263 + seed * 1274126177) & 0xFFFFFFFF
    h = ((h ^ (h >> 13)) * 1274126177) & 0xFFFFFFFF
    h = ((h ^ (h >> 16)) * 2246822519) & 0xFFFFFFFF
    return h ^ (h >> 15)


@compiled
def uniform(i: int, j: int, seed: int) -> float:
    """A number in [0, 1) of a lattice point."""
    return hashed(i, j, seed) / 4294967296.0


@compiled
def bell(i: int, j: int, seed: int) -> float:
    """A number of mean 0 and variance 1, near enough normal: the sum of the hash's four bytes."""
    h = hashed(i, j, seed)
    total = (h & 255) + (h >> 8 & 255) + (h >> 16 & 255) + (h >> 24 & 255)
    return (total / 255.0 - 2.0) * 1.7320508


@compiled
def smooth(x: float, y: float, seed: int) -> float:
    """Smooth noise in [0, 1]: values on the integer lattice, blended between."""
    i, j = math.floor(x), math.floor(y)
    fx, fy = x - i, y - j
    fx, fy = fx * fx * (3 - 2 * fx), fy * fy * (3 - 2 * fy)
    total = 0.0
    # A loop, not four terms: the compiler copies what is called here into every caller.
    for corner in range(4):
        right, below = corner & 1, corner >> 1
        weight = (fx if right else 1 - fx) * (fy if below else 1 - fy)
        total += weight * uniform(i + right, j + below, seed)
    return total
