"""How a wrist held the camera of a session's recording, where that is known."""

from dataclasses import dataclass
from pathlib import Path

from ars_web.errors import BadFile, NotFound, RefusedPath
from ars_web.geometry.rigid_transform import Transform
from ars_web.recordings.hand_eye import recorded_hand_eye


@dataclass(frozen=True, eq=False)
class RecordedWrist:
    """How a wrist held the camera of a recording, or why nobody knows; one of the two is None."""

    T_wrist_camera: Transform | None
    unknown: str | None


def recorded_wrist(format: str, source: Path) -> RecordedWrist:  # noqa: A002 - as the registry calls it
    """What the recording says that a session was made from, if it is still where it was."""
    try:
        return RecordedWrist(recorded_hand_eye(format, source), None)
    except (NotFound, BadFile, RefusedPath) as error:
        return RecordedWrist(None, str(error))
