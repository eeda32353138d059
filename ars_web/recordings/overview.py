"""What a recording holds, in a few numbers and words: for a person to look at before it is imported."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ars_web.geometry.camera import Camera
from ars_web.recordings.recording import Recording

SAMPLES = 6
"""Frames picked out to be looked at."""

OWN_SCALE = frozenset({"colmap", "nerfstudio"})
"""Formats whose lengths are usually not metres."""

STILL = 1e-3
"""Metres; a camera that goes no farther is taken to stand still."""

_MANY_SKIPPED = 0.1
_JUMP_IN_STEPS = 20.0
_JUMP_IN_EXTENT = 0.1


@dataclass(frozen=True)
class CameraUse:
    """A camera of the recording, and how many frames are of it."""

    id: int
    camera: Camera
    frames: int


@dataclass(frozen=True)
class Overview:
    """What a recording holds.

    Attributes:
        cameras: in the recording's order.
        path_length: metres that the camera went from frame to frame; of the one that went farthest.
        sample_frames: indices, spread evenly from the first frame to the last.
        warnings: what a person should look at before the import, in words.
    """

    cameras: tuple[CameraUse, ...]
    path_length: float
    sample_frames: tuple[int, ...]
    warnings: tuple[str, ...]


def overview(recording: Recording) -> Overview:
    """Look a recording over."""
    count = len(recording.frames)
    ids = np.array([frame.camera_id for frame in recording.frames])
    positions = recording.Ts_world_camera[:, :3, 3]
    paths = {id_: positions[ids == id_] for id_ in recording.cameras}
    cameras = tuple(CameraUse(id_, camera, len(paths[id_])) for id_, camera in recording.cameras.items())
    path_length = max((float(_steps(path).sum()) for path in paths.values()), default=0.0)
    return Overview(
        cameras=cameras,
        path_length=path_length,
        sample_frames=tuple(np.unique(np.linspace(0, count - 1, min(SAMPLES, count)).round().astype(int)).tolist()),
        warnings=tuple(_warnings(recording, path_length, [np.flatnonzero(ids == id_) for id_ in recording.cameras])),
    )


def _steps(path: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, " m"]:
    return np.linalg.norm(np.diff(path, axis=0), axis=1)


def _warnings(recording: Recording, path_length: float, of_cameras: list[np.ndarray]) -> list[str]:
    found: list[str] = []
    used, skipped = len(recording.frames), len(recording.skipped)
    if skipped > _MANY_SKIPPED * (used + skipped):
        found.append(f"{skipped} of {used + skipped} cannot be used; the reasons are listed")
    if recording.format in OWN_SCALE:
        found.append(
            "lengths are the model's own, which need not be metres: compare the size of something known in the scene"
        )
    elif used > 1 and path_length < STILL:
        found.append("the camera stands still, so boxes cannot be placed in depth: were the poses recorded?")
    for frames in of_cameras:
        found += _jumps(recording, frames)
    return found


def _jumps(recording: Recording, frames: np.ndarray) -> list[str]:
    """Steps far longer than a camera's others: where tracking may have been lost."""
    if len(frames) < 3:
        return []
    path = recording.Ts_world_camera[frames, :3, 3]
    steps = _steps(path)
    extent = float(np.linalg.norm(path.max(axis=0) - path.min(axis=0)))
    far = np.flatnonzero((steps > _JUMP_IN_STEPS * np.median(steps)) & (steps > _JUMP_IN_EXTENT * extent))
    if not far.size or extent < STILL:
        return []
    first = int(far[0])
    more = f", and in {far.size - 1} more places" if far.size > 1 else ""
    return [
        f"the camera jumps {steps[first]:.2g} m between frames {frames[first]} and {frames[first + 1]}{more}; where it"
        " was filmed in one go, tracking was lost there"
    ]
