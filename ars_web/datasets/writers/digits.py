"""Numbers as ASCII digits, written by compiled code into a byte buffer. Each answers the place after the last byte.

Numbers with decimals arrive scaled to integers (hundredths, millionths) and rounded by `scaled`, so that what is
written is decided by integers alone and is the same on every machine.
"""

import math

import numpy as np
from jaxtyping import UInt8
from numba import njit

Buffer = UInt8[np.ndarray, "size"]


@njit(cache=True)
def scaled(value: float, scale: float) -> int:
    """`value * scale` to the nearest integer, halves up."""
    return math.floor(value * scale + 0.5)


@njit(cache=True)
def put_bytes(buffer: Buffer, place: int, text: Buffer) -> int:
    """The bytes of `text`."""
    for byte in text:
        buffer[place] = byte
        place += 1
    return place


@njit(cache=True)
def put_integer(buffer: Buffer, place: int, value: int) -> int:
    """A decimal integer."""
    if value < 0:
        buffer[place] = 45  # "-"
        place += 1
        value = -value
    count = 1
    rest = value
    while rest >= 10:
        rest //= 10
        count += 1
    for digit in range(count - 1, -1, -1):
        buffer[place + digit] = 48 + value % 10
        value //= 10
    return place + count


@njit(cache=True)
def put_decimal(buffer: Buffer, place: int, value: int, decimals: int) -> int:
    """`value / 10 ** decimals` with that many decimals."""
    if value < 0:
        buffer[place] = 45
        place += 1
        value = -value
    unit = 10**decimals
    place = put_integer(buffer, place, value // unit)
    buffer[place] = 46  # "."
    fraction = value % unit
    for digit in range(decimals, 0, -1):
        buffer[place + digit] = 48 + fraction % 10
        fraction //= 10
    return place + decimals + 1
