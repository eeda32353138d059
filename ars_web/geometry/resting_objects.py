"""Where objects lie that stay where they are, from what many images say of their poses: one place for each object.

Several objects of one kind are told apart by where they are. Poses are noisy, some are wrong, and those of an object
that looks the same from several sides differ by its symmetry.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ars_web.geometry import rigid_transform
from ars_web.geometry.rigid_transform import Transform
from ars_web.geometry.symmetry import NO_SYMMETRY, Symmetry, rotations_of

MOVED = 0.010
"""Metres. An object whose poses are farther than this from their middle, in the median, does not rest."""

TURNED = np.radians(2.0)
"""Likewise, of its turns."""

MOST_REFERENCES = 25
"""Rotations among which the most typical is looked for."""


@dataclass(frozen=True, eq=False)
class RestingObject:
    """One object, seen in k images.

    Attributes:
        T_world_box: where it is: the median of positions, the mean of rotations.
        rows: (k,) which of the poses are its own.
        away: metres from there, the median of its poses.
        turned: radians from there, the median, its symmetry respected.
        alone: whether it is seen there in one image only, while its kind is seen in many and in more places than
            there ever are objects of it in one image.
    """

    T_world_box: Transform
    rows: Int[np.ndarray, "k"]
    away: float
    turned: float
    alone: bool = False

    @property
    def problem(self) -> str | None:
        """Why nobody can say where it rests; None: it does."""
        if self.alone:
            return (
                "it is seen at its place in one image only: it moves, its pose there is wrong, or images and poses are"
                " not each other's"
            )
        if self.away > MOVED or self.turned > TURNED:
            return (
                f"it does not rest: its poses are {1e3 * self.away:.0f} mm and {np.degrees(self.turned):.1f} degrees"
                f" from their middle (the median; up to {1e3 * MOVED:g} mm and {np.degrees(TURNED):g} degrees are"
                " noise); it moves, or cameras or scale are not those that its poses are for"
            )
        return None


def resting_objects(
    images: Int[np.ndarray, "n"],
    Ts_world_box: Float[np.ndarray, "n 4 4"],
    *,
    size: Float[np.ndarray, "3"],
    symmetry: Symmetry = NO_SYMMETRY,
) -> list[RestingObject]:
    """The objects of one kind that n poses are of, in the order in which they are first seen.

    What is seen in one image is of different objects. From image to image a pose belongs to the object whose place is
    nearest, within half the kind's diagonal.

    Args:
        images: (n,) of which image each pose is; ascending.
        size: metres, of the kind's box.
        symmetry: of the kind, in its box's frame.
    """
    rotations, axis = rotations_of(symmetry), None if symmetry.axis is None else np.array(symmetry.axis)
    tracks = _tracks(images, Ts_world_box[:, :3, 3], reach=float(np.linalg.norm(size)) / 2)
    most_at_once = int(np.unique(images, return_counts=True)[1].max(initial=0))
    many_places = len(np.unique(images)) >= 3 and len(tracks) > most_at_once
    found: list[RestingObject] = []
    for track in tracks:
        rows = np.array(track)
        Ts = Ts_world_box[rows]
        position = np.median(Ts[:, :3, 3], axis=0)
        R, angles = _mean_rotation(Ts[:, :3, :3], rotations, axis)
        found.append(
            RestingObject(
                rigid_transform.from_rotation(R, position),
                rows,
                float(np.median(np.linalg.norm(Ts[:, :3, 3] - position, axis=1))),
                float(np.median(angles)),
                alone=many_places and len(rows) == 1,
            )
        )
    return found


def _tracks(images: Int[np.ndarray, "n"], positions: Float[np.ndarray, "n 3"], *, reach: float) -> list[list[int]]:
    """The rows of each object, in the order in which they are first seen."""
    from scipy.optimize import linear_sum_assignment

    tracks: list[list[int]] = []
    places: list[np.ndarray] = []
    starts = np.flatnonzero(np.diff(images, prepend=images[:1] - 1))
    for rows in np.split(np.arange(len(images)), starts[1:]):
        new = rows.tolist()
        if tracks:
            last = positions[[track[-1] for track in tracks]]
            # To where it was last, or to where it is as a rule: a wrong pose must not lead an object astray.
            to_last = np.linalg.norm(positions[rows][:, None] - last, axis=2)
            to_place = np.linalg.norm(positions[rows][:, None] - np.array(places), axis=2)
            distances = np.minimum(to_last, to_place)
            # What is out of reach costs more than all that is within it, so that as many as can be are matched.
            costs = np.where(distances <= reach, distances, (reach + 1.0) * (len(rows) + 1))
            for i, j in zip(*linear_sum_assignment(costs), strict=True):
                if distances[i, j] <= reach:
                    tracks[j].append(int(rows[i]))
                    places[j] = np.median(positions[tracks[j][-MOST_REFERENCES:]], axis=0)
                    new.remove(int(rows[i]))
        tracks.extend([row] for row in new)
        places.extend(positions[row] for row in new)
    return tracks


def _mean_rotation(
    Rs: Float[np.ndarray, "k 3 3"], rotations: Float[np.ndarray, "m 3 3"], axis: Float[np.ndarray, "3"] | None
) -> tuple[Float[np.ndarray, "3 3"], Float[np.ndarray, "k"]]:
    """The mean of the rotations near the most typical one, and how far all are from it, radians."""
    among = np.unique(np.linspace(0, len(Rs) - 1, min(len(Rs), MOST_REFERENCES)).round().astype(np.int64))
    typical = min((Rs[i] for i in among), key=lambda R: float(np.median(_angles(_aligned(Rs, R, rotations, axis), R))))
    mean = typical
    for _ in range(2):
        aligned = _aligned(Rs, mean, rotations, axis)
        angles = _angles(aligned, mean)
        near = angles <= 3 * np.median(angles) + 1e-9
        # The mean of matrices, made a rotation again, is the chordal mean (Hartley et al. 2013).
        mean = rigid_transform.nearest_rotation(aligned[near].mean(axis=0))
    return mean, _angles(_aligned(Rs, mean, rotations, axis), mean)


def _aligned(
    Rs: Float[np.ndarray, "k 3 3"],
    reference: Float[np.ndarray, "3 3"],
    rotations: Float[np.ndarray, "m 3 3"],
    axis: Float[np.ndarray, "3"] | None,
) -> Float[np.ndarray, "k 3 3"]:
    """Of each rotation the one nearest to `reference` that looks the same."""
    candidates = Rs[:, None] @ rotations
    if axis is not None:
        candidates = candidates @ _nearest_turns(np.swapaxes(candidates, -1, -2) @ reference, axis)
    traces = np.einsum("kmij,ij->km", candidates, reference)
    return candidates[np.arange(len(Rs)), traces.argmax(axis=1)]


def _nearest_turns(Rs: Float[np.ndarray, "k m 3 3"], axis: Float[np.ndarray, "3"]) -> Float[np.ndarray, "k m 3 3"]:
    """The turns about `axis` that are nearest to rotations: their twists (Dobrowolski 2015)."""
    wxyz = rigid_transform.wxyz_from_rotation(Rs)
    along = wxyz[..., 1:] @ axis
    twist = np.concatenate([wxyz[..., :1], along[..., None] * axis], axis=-1)
    # A half turn across the axis has no twist; any will do.
    twist[np.linalg.norm(twist, axis=-1) < 1e-9] = [1.0, 0.0, 0.0, 0.0]
    return rigid_transform.rotation_from_wxyz(twist)


def _angles(Rs: Float[np.ndarray, "k 3 3"], reference: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "k"]:
    # From the chord, which is exact near zero where the trace is not: |A - B| = 2 sqrt 2 sin(angle / 2).
    chords: np.ndarray = np.linalg.norm(Rs - reference, axis=(1, 2))
    return 2 * np.arcsin(np.clip(chords / (2 * np.sqrt(2)), 0.0, 1.0))
