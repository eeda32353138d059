"""Cameras from the numbers of a file, and the original tool's camera file."""

from pathlib import Path

from ars_web.errors import BadFile, BadInput
from ars_web.geometry.camera import Camera, Model
from ars_web.recordings.number_rows import read_rows
from ars_web.recordings.options import ReadOptions, real

CAMERA_FILE = "camera_intrinsics.txt"

_NAMES = "w h fx fy cx cy k1 k2 p1 p2 k3".split()


def camera_from(
    width: float,
    height: float,
    *,
    focal: tuple[float, float],
    centre_pixels: tuple[float, float],
    model: Model,
    distortion: tuple[float, ...],
) -> Camera:
    """A camera from numbers as files hold them: whole sizes written as floats, distortion that may be all zero.

    Brown without distortion is a pinhole, so that equal cameras from two formats are equal.

    Args:
        focal: fx, fy.
        centre_pixels: cx, cy with the top left pixel's centre at (0, 0).

    Raises:
        BadInput: a number cannot be a camera's.
    """
    if not (float(width).is_integer() and float(height).is_integer()):
        raise BadInput(f"an image size is a whole number of pixels, not {width:g} x {height:g}")
    if model == "brown" and not any(distortion):
        model, distortion = "pinhole", ()
    return Camera(int(width), int(height), *focal, *centre_pixels, model, distortion)


def camera_from_numbers(numbers: list[float]) -> Camera:
    """A camera from `w h fx fy cx cy k1 k2 p1 p2`, a k3 behind them or the last four left out.

    Raises:
        BadInput: there are more or fewer numbers, or one cannot be a camera's.
    """
    if len(numbers) not in (6, 10, 11):
        raise BadInput(
            f"a camera has 10 numbers, {' '.join(_NAMES[:10])} (k3 may follow, or all after cy be left out),"
            f" not {len(numbers)}"
        )
    width, height, fx, fy, cx, cy, *distortion = numbers
    coefficients = tuple(distortion) + (0.0,) * (5 - len(distortion))
    return camera_from(width, height, focal=(fx, fy), centre_pixels=(cx, cy), model="brown", distortion=coefficients)


def read_camera_file(path: Path) -> Camera:
    """The camera in a file of `w h fx fy cx cy k1 k2 p1 p2` (k3 may follow), on one line or one number a line.

    Raises:
        BadFile: the file cannot be read or does not hold one camera.
    """
    widths = {1: "one a line", 6: " ".join(_NAMES[:6]), 10: " ".join(_NAMES[:10]), 11: " ".join(_NAMES)}
    rows = read_rows(path, columns=widths)
    if rows.values.shape[1] > 1 and len(rows.values) > 1:
        raise BadFile(path, "holds more than one camera; it is for one", line=int(rows.lines[1]))
    try:
        return camera_from_numbers(rows.values.ravel().tolist())
    except BadInput as error:
        raise BadFile(path, str(error), line=int(rows.lines[0])) from error


def find_camera_file(folders: list[Path], options: ReadOptions) -> Path:
    """The camera file that was named, or the one in `folders`.

    Raises:
        BadFile: there is none.
        BadInput: several folders hold one each, and they differ.
        RefusedPath: it lies outside `options.within`.
    """
    if options.camera is not None:
        return options.allowed(options.camera)
    places = list(dict.fromkeys(real(folder) / CAMERA_FILE for folder in folders))
    found = [options.allowed(place) for place in places if place.is_file()]
    if not found:
        looked = " or ".join(str(place) for place in places)
        raise BadFile(
            places[0],
            f"is missing: the format holds no camera of its own. Give a camera file ({' '.join(_NAMES[:10])}), or put"
            f" one at {looked}",
        )
    if any(read_camera_file(place) != read_camera_file(found[0]) for place in found[1:]):
        raise BadInput(f"{' and '.join(map(str, found))} hold different cameras; give the camera file that is meant")
    return found[0]
