"""Texts for compiled writers, one after the other in one buffer, and text as XML wants it."""

from collections.abc import Iterable
from xml.sax.saxutils import escape

import numpy as np
from jaxtyping import Int

from ars_web.datasets.writers.digits import Buffer


def packed(texts: Iterable[str]) -> tuple[Buffer, Int[np.ndarray, "k"]]:
    """The texts in UTF-8, and where each begins and the last ends."""
    encoded = [text.encode() for text in texts]
    starts = np.cumsum([0, *map(len, encoded)], dtype=np.int64)
    return np.frombuffer(b"".join(encoded), dtype=np.uint8), starts


def xml_text(text: str) -> str:
    """`text` as XML content; XML has no way to write control characters, so they become `_`."""
    printable = (character if character.isprintable() else "_" for character in text)
    return escape("".join(printable))


def xml_value(text: str) -> str:
    """`text` as a value of an XML attribute, to be put between double quotes."""
    return xml_text(text).replace('"', "&quot;")
