"""How a robot's wrist holds the camera: what recordings of the original tool say beside their poses."""

from pathlib import Path

from ars_web.errors import NotFound
from ars_web.geometry.rigid_transform import Transform
from ars_web.recordings import ars, roars
from ars_web.recordings.options import ReadOptions


def recorded_hand_eye(format: str, source: Path) -> Transform:  # noqa: A002 - as the registry calls it
    """`T_wrist_camera` of the recording that was read from `source`, which is looked at once more.

    Links that lead out of the recording's folder are not followed.

    Raises:
        NotFound: recordings of the format do not have it, or the recording is not there any more.
        BadFile: the file that holds it is missing or damaged.
        RefusedPath: that file lies elsewhere.
    """
    if format not in ("ars", "roars"):
        raise NotFound(f"a recording of format {format} does not say how a wrist held its camera")
    # The source of what was uploaded is the archive's name alone.
    if not source.is_absolute() or not source.exists():
        raise NotFound(f"the recording is not at {source} any more, which said how the wrist held the camera")
    options = ReadOptions(within=source if source.is_dir() else source.parent)
    if format == "roars":
        return roars.camera_in_wrist(source, options)
    return ars.camera_in_wrist(options.allowed(source / ars.EXTRINSICS_FILE))
