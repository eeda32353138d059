"""Names of a dataset's files: made from the frames' own, safe everywhere, unique, and the same every time."""

import re
from collections.abc import Iterable

LONGEST = 120
"""Characters of a stem. Folder, extension and a number against twins still fit into the 255 bytes of a name."""

_EXTENSION = re.compile(r"\.(jpe?g|png|bmp|tiff?|webp|p[bgpn]m)$", re.IGNORECASE)


def stems(frame_names: Iterable[str]) -> list[str]:
    """A file name without extension for each frame name.

    Characters other than ASCII letters, digits, `.`, `_` and `-` become `_`, folders included. Names that would
    then coincide, case aside (two images that differ by folder or extension only), are told apart by `-2`, `-3`
    and so on, in the frames' order. Call it with all names of a session, not only the chosen ones: then a frame's
    name does not depend on which others are exported.
    """
    taken: set[str] = set()
    found: list[str] = []
    for name in frame_names:
        stem = safe(_EXTENSION.sub("", name))
        candidate, number = stem, 1
        while candidate.lower() in taken:
            number += 1
            candidate = f"{stem}-{number}"
        taken.add(candidate.lower())
        found.append(candidate)
    return found


def safe(name: str) -> str:
    """`name` as one path component of plain ASCII: never empty, hidden, an option's look-alike or overlong."""
    plain = re.sub(r"[^A-Za-z0-9._-]", "_", name)[-LONGEST:]
    return re.sub(r"^[.-]", "_", plain).rstrip(".") or "_"
