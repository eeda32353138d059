"""What every test stands on: shapes checked at run time, and the recorded data where it is present."""

from pathlib import Path

from jaxtyping import install_import_hook

# Every annotated shape in geometry/ is checked while the tests run. Kernel modules hold numba code, which takes
# no such wrapper.
install_import_hook(
    [f"ars_web.geometry.{name}" for name in ("rigid_transform", "camera", "box", "labels", "occlusion")],
    "beartype.beartype",
)

SHARED = Path(__file__).parents[2] / "shared"
"""Recorded data and checks beside the checkout; absent on a user's machine."""

# Tests under recorded/ read that data. They are not collected where it is absent: nothing is skipped, and the
# header says so.
collect_ignore = [] if (SHARED / "data").is_dir() else ["recorded"]


def pytest_report_header() -> str:
    return f"recorded data: {SHARED if (SHARED / 'data').is_dir() else 'absent, tests/recorded/ is not collected'}"
