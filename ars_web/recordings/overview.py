"""What a recording holds, in a few numbers and words: for a person to look at before it is imported."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

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
    centres = recording.Ts_world_camera[:, :3, 3]
    went = path_length(centres, ids)
    return Overview(
        cameras=tuple(CameraUse(i, camera, int((ids == i).sum())) for i, camera in recording.cameras.items()),
        path_length=went,
        sample_frames=tuple(np.unique(np.linspace(0, count - 1, min(SAMPLES, count)).round().astype(int)).tolist()),
        warnings=tuple(_warnings(recording, went, centres, ids)),
    )


def path_length(centres_world: Float[np.ndarray, "n 3"], camera_ids: Int[np.ndarray, "n"]) -> float:
    """Metres that the camera went from frame to frame; of several the one that went farthest."""
    return max((float(_steps(centres_world[camera_ids == i]).sum()) for i in np.unique(camera_ids)), default=0.0)


def jumps(centres_world: Float[np.ndarray, "n 3"], camera_ids: Int[np.ndarray, "n"]) -> list[str]:
    """Where a camera went far more in one step than in its others, in words: tracking may have been lost there."""
    return [line for i in np.unique(camera_ids) for line in _jumps(centres_world, np.flatnonzero(camera_ids == i))]


def _steps(path: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, " m"]:
    return np.linalg.norm(np.diff(path, axis=0), axis=1)


def _warnings(
    recording: Recording, went: float, centres_world: Float[np.ndarray, "n 3"], camera_ids: Int[np.ndarray, "n"]
) -> list[str]:
    found: list[str] = []
    used, skipped = len(recording.frames), len(recording.skipped)
    if skipped > _MANY_SKIPPED * (used + skipped):
        found.append(f"{skipped} of {used + skipped} cannot be used; the reasons are listed")
    if recording.format in OWN_SCALE:
        found.append(
            "lengths are the model's own, which need not be metres: compare the size of something known in the scene"
        )
    elif used > 1 and went < STILL:
        found.append("the camera stands still, so boxes cannot be placed in depth: were the poses recorded?")
    return found + jumps(centres_world, camera_ids)


def _jumps(centres_world: Float[np.ndarray, "n 3"], frames: Int[np.ndarray, " m"]) -> list[str]:
    if len(frames) < 3:
        return []
    path = centres_world[frames]
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
