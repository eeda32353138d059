"""Compiled loops are compiled anew when what they are made of changes."""

import hashlib
from pathlib import Path

import ars_web.geometry
from ars_web.geometry import raster_kernels

FOLDER = Path(ars_web.geometry.__file__).parent


def test_entries_name_the_parts_that_they_were_compiled_of() -> None:
    """numba looks at the file of the entry alone: a digest there changes it when a part's file changes."""
    now = {name: hashlib.sha256((FOLDER / f"{name}.py").read_bytes()).hexdigest() for name in raster_kernels.PARTS}
    assert now == raster_kernels.PARTS, "write these digests into raster_kernels.PARTS"
