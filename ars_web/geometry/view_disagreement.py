"""Which outlines are at fault where viewing cones share nothing, and by how many pixels."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely
from manifold3d import Manifold

from ars_web.errors import BadInput, ViewsDisagree
from ars_web.geometry.cone_intersection import ConeScene
from ars_web.geometry.mesh_silhouette import silhouette
from ars_web.geometry.viewing_cone import ViewingCone

SLIVER = 0.1
"""Of a volume, below which another says nothing beside it."""


def disagreement(scene: ConeScene) -> BadInput:
    """The error that says why cones share nothing.

    A view is at fault where the others share something without it. How far its mask is from the silhouette of that is
    by how much the mask must be widened: a point of both is a ray that meets what the others share. Where no single
    view is at fault, those are that do not agree with as many others as do agree.
    """
    solids = _Solids(replace(scene, far=min(scene.far, scene.tellable)))
    if scene.ground is not None and not solids.shared(scene.cones, ground=False).is_empty():
        return BadInput(
            f"nothing that the outlines leave possible is above the support plane at z = {scene.ground:g} m; set the"
            " plane lower, or leave it out"
        )
    misfits = [(cone.frame, _misfit(cone, rest)) for cone, rest in _suspects(solids)]
    if not misfits:
        agreeing, rest = solids.agreeing()
        misfits = [(cone.frame, _misfit(cone, rest)) for cone in scene.cones if cone not in agreeing]
    behind = _behind(scene.cones) if len(scene.cones) == 2 else None
    misfits = [(frame, math.nan if frame == behind else px) for frame, px in misfits]
    misfits.sort(key=lambda misfit: (not math.isnan(misfit[1]), -misfit[1] if misfit[1] == misfit[1] else 0.0))
    return ViewsDisagree(_message(misfits, len(scene.cones)), tuple(misfits))


def _suspects(solids: "_Solids") -> list[tuple[ViewingCone, Manifold]]:
    """Each view without which the others share something, and that; of more than two views only those without which
    they share about the most: what is left without a good view is the sliver that a bad one leaves of the object."""
    found = [(cone, rest, rest.volume()) for cone, rest in solids.without_each() if not rest.is_empty()]
    most = max((volume for _, _, volume in found), default=0.0)
    return [(cone, rest) for cone, rest, volume in found if volume >= SLIVER * most or len(solids) == 2]


def _message(misfits: Sequence[tuple[int, float]], views: int) -> str:
    said = [
        f"frame {frame}: the others put the object behind its camera or out of its sight"
        if math.isnan(px)
        else f"frame {frame}: {px:.1f} px off"
        for frame, px in misfits
    ]
    which = "the outlines do not meet" if views == 2 else "outlines disagree with the others"
    return f"no object fits: {which} ({'; '.join(said)}); draw them again, or widen the masks by the poses' error"


def _behind(cones: Sequence[ViewingCone]) -> int | None:
    """The frame of two behind whose camera the lines of sight come nearest to each other; None for neither."""
    (p, q), (u, v) = [c.centre_world for c in cones], [c.middle_world for c in cones]
    w, uv = q - p, float(u @ v)
    if 1 - uv * uv < 1e-12:
        return None
    along_u = float(w @ u - uv * (w @ v)) / (1 - uv * uv)
    along_v = float(uv * (w @ u) - w @ v) / (1 - uv * uv)
    depth = {cones[0].frame: along_u, cones[1].frame: along_v}
    frame = min(depth, key=lambda frame: depth[frame])
    return frame if depth[frame] < 0 else None


def _misfit(cone: ViewingCone, rest: Manifold) -> float:
    mesh = rest.to_mesh64()
    vertices = np.asarray(mesh.vert_properties)[:, :3]
    shown = silhouette(cone.camera, cone.T_world_camera, vertices, np.asarray(mesh.tri_verts).astype(np.int64))
    return math.nan if shown.is_empty else float(shapely.distance(shown, cone.mask))


class _Solids:
    """The cones of a scene in full length, in the world; those of masks that touch the border as if they ended there,
    because what was found to be empty is so with more reason."""

    def __init__(self, scene: ConeScene) -> None:
        self._scene = scene
        self._solid = {
            cone.frame: cone.solid(cone.rings, near=scene.near, far=scene.far, origin=np.zeros(3))
            for cone in scene.cones
        }

    def __len__(self) -> int:
        return len(self._scene.cones)

    def everything(self, *, ground: bool = True) -> Manifold:
        """A cube that holds all cones."""
        centres = np.array([cone.centre_world for cone in self._scene.cones])
        reach = 4 * self._scene.far + float(np.ptp(centres, axis=0).max())
        cube = Manifold.cube((2 * reach, 2 * reach, 2 * reach), True).translate(centres.mean(axis=0))
        if ground and self._scene.ground is not None:
            cube = cube.trim_by_plane((0.0, 0.0, 1.0), self._scene.ground)
        return cube

    def cut(self, solid: Manifold, cone: ViewingCone) -> Manifold:
        """What of a solid is in a cone."""
        return solid ^ self._solid[cone.frame]

    def shared(self, cones: Sequence[ViewingCone], *, ground: bool) -> Manifold:
        """What cones share."""
        solid = self.everything(ground=ground)
        for cone in cones:
            solid = self.cut(solid, cone)
        return solid

    def without_each(self) -> list[tuple[ViewingCone, Manifold]]:
        """Each cone with what all others share: what those before it share, cut by what those after it do."""
        cones = self._scene.cones
        before, after = [self.everything()], [self.everything()]
        for cone in cones[:-1]:
            before.append(self.cut(before[-1], cone))
        for cone in reversed(cones[1:]):
            after.append(self.cut(after[-1], cone))
        return [(cone, a ^ b) for cone, a, b in zip(cones, before, reversed(after), strict=True)]

    def agreeing(self) -> tuple[list[ViewingCone], Manifold]:
        """Many cones that share something, and what that is: those that agree with most others come first."""
        cones, everything = self._scene.cones, self.everything()
        agrees = {cone.frame: 0 for cone in cones}
        for i, one in enumerate(cones):
            alone = self.cut(everything, one)
            for other in cones[:i]:
                if not self.cut(alone, other).is_empty():
                    agrees[one.frame] += 1
                    agrees[other.frame] += 1
        chosen, shared = list[ViewingCone](), everything
        for cone in sorted(cones, key=lambda cone: -agrees[cone.frame]):
            smaller = self.cut(shared, cone)
            if not smaller.is_empty():
                chosen, shared = [*chosen, cone], smaller
        return chosen, shared
