from pathlib import Path

import pytest

from ars_web.errors import BadFile
from ars_web.geometry.camera import Camera
from ars_web.recordings.intrinsics import read_camera_file


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "camera_intrinsics.txt"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("text", "camera"),
    [
        (
            "64 48 60 61 32 24 0.1 0.2 0.3 0.4",
            Camera(64, 48, 60.0, 61.0, 32.0, 24.0, "brown", (0.1, 0.2, 0.3, 0.4, 0.0)),
        ),
        (
            "64 48 60 61 32 24 0.1 0.2 0.3 0.4 0.5",
            Camera(64, 48, 60.0, 61.0, 32.0, 24.0, "brown", (0.1, 0.2, 0.3, 0.4, 0.5)),
        ),
        ("64 48 60 61 32 24 0 0 0 0", Camera(64, 48, 60.0, 61.0, 32.0, 24.0)),
        ("64 48 60 61 32 24", Camera(64, 48, 60.0, 61.0, 32.0, 24.0)),
        ("6.4e1\n48.0\n60\n61\n32\n24\n0\n0\n0\n0\n", Camera(64, 48, 60.0, 61.0, 32.0, 24.0)),
    ],
)
def test_camera_files(tmp_path: Path, text: str, camera: Camera) -> None:
    assert read_camera_file(written(tmp_path, text)) == camera


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("64 48 60 61 32 24 0", r"txt:1: has 7 values; a line has .* or 10 numbers \(w h fx fy cx cy k1 k2 p1 p2\)"),
        ("#\n64.5 48 60 61 32 24", r"txt:2: an image size is a whole number of pixels, not 64.5 x 48"),
        ("nan 48 60 61 32 24", r"txt:1: an image size is a whole number"),
        ("0 48 60 61 32 24", r"txt:1: a camera's image must be at least 1 x 1"),
        ("64 48 -60 61 32 24", r"txt:1: focal lengths must be positive"),
        ("64 48 60 61 nan 24", r"txt:1: a camera's numbers must be finite"),
        ("64 48 60 61 32 24\n64 48 60 61 32 24", r"txt:2: holds more than one camera"),
        ("64\n48\n60\n", r"txt:1: a camera has 10 numbers, .*, not 3"),
    ],
)
def test_bad_camera_files(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(BadFile, match=message):
        read_camera_file(written(tmp_path, text))
