"""A sensor's noise: it depends on the pixel and the frame only, the same in every run and in every order."""

from ars_web.demo.compiled import compiled


@compiled
def hashed(i: int, j: int, seed: int) -> int:
    """32 well mixed bits of two integers and a seed (multiply and xor-shift)."""
    h = (i * 374761393 + j * 668265263 + seed * 1274126177) & 0xFFFFFFFF
    h = ((h ^ (h >> 13)) * 1274126177) & 0xFFFFFFFF
    h = ((h ^ (h >> 16)) * 2246822519) & 0xFFFFFFFF
    return h ^ (h >> 15)


@compiled
def bell(i: int, j: int, seed: int) -> float:
    """A number of mean 0 and variance 1, near enough normal: the sum of the hash's four bytes."""
    h = hashed(i, j, seed)
    total = (h & 255) + (h >> 8 & 255) + (h >> 16 & 255) + (h >> 24 & 255)
    return (total / 255.0 - 2.0) * 1.7320508
