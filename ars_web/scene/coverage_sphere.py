"""The sphere round an object in one view: how many views there are from each direction, holes marked.

    sphere = CoverageSphere(client, nodes, read=…, workers=…)   one a client
    sphere.show(sight, dark=…)        None: no sphere. What it counts follows as soon as it is read
    sphere.edited()                   the session may be another than before
    sphere.meets(ray)                 -> SphereHit | None, for clicks
    sphere.close()

The nodes are `/coverage` (the box's place, without its size), in it `sphere`, one mesh of all cells with their
colours, and `chosen`, the outline of what is chosen. The mesh is made anew when a count or the theme changes, and never
else: moving the box moves `/coverage`.
"""

import asyncio
import math
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import trimesh
import viser
from jaxtyping import Float, Int, UInt8
from trimesh.visual.material import PBRMaterial
from trimesh.visual.texture import TextureVisuals

from ars_web.errors import ArsError
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.sphere_bins import SphereBins
from ars_web.geometry.sphere_tiles import Tiles, bin_patches, cell_patches, dots, outlines, stand_ins, tiles
from ars_web.geometry.symmetry import Symmetry
from ars_web.geometry.view_directions import folded
from ars_web.scene.boxes import BoxNodes
from ars_web.scene.hardening import is_gone
from ars_web.scene.picking import Ray
from ars_web.scene.poses import place
from ars_web.studies.sphere_counts import SphereCounts
from ars_web.workspace import CoverageSight

COVERAGE = "/coverage"

RADIUS = 0.85
"""Of the sphere, in diagonals of its box: all of the box is inside, and what stands beside it mostly not."""

HEAT = ("#472a7a", "#39568c", "#297b8e", "#1f9f88", "#46c06f", "#9dd93b", "#fde725")
"""From one view to the most; viridis, as in the page's tokens (--heat-1 to --heat-7)."""

HOLE = {True: "#3a4653", False: "#8e9caa"}
"""A direction without a view, by whether the page is dark: as far from what is behind it as it may be, and no heat."""

HOLE_DOT = {True: "#f0a839", False: "#b35c00"}

SEEN_OPACITY, HOLE_OPACITY = 0.88, 0.42

GAP = math.radians(0.45)
DOT = math.radians(1.5)

CHOSEN_WIDTH, HALO_WIDTH = 3.0, 7.0
"""Pixels, of the outline of what is chosen and of what sets it off from any colour."""

ABOVE_HALO = 1.012
"""Where the outline is drawn, in halo's radii: at one depth the two would show through each other."""

CHOSEN, HALO = (255, 255, 255), (13, 17, 23)


@dataclass(frozen=True)
class SphereHit:
    """Where a ray meets the sphere: the bin and the cell that its direction is folded into, and how far along."""

    bin: int
    cell: int
    distance: float


Read = Callable[[CoverageSight], SphereCounts]
"""Counts what a sphere shows; it blocks."""


def heat_colors(counts: Int[np.ndarray, "k"]) -> UInt8[np.ndarray, "k 3"]:
    """sRGB of numbers of views, each at least 1: by their logarithm, so that few and many are both told apart."""
    stops = np.array([list(bytes.fromhex(color[1:])) for color in HEAT], dtype=float)
    most = max(1, int(counts.max(initial=1)))
    share = np.log(np.maximum(counts, 1)) / math.log(most) if most > 1 else np.ones(len(counts))
    at = share * (len(stops) - 1)
    return (
        np.stack([np.interp(at, np.arange(len(stops)), stops[:, c]) for c in range(3)], axis=-1)
        .round()
        .astype(np.uint8)
    )


def sphere_glb(bins: SphereBins, counts: Int[np.ndarray, "k"], *, dark: bool) -> bytes:
    """The unit sphere's cells with their colours, holes with a dot, as binary glTF."""
    cells = _cell_tiles(bins)
    holes = np.flatnonzero(counts == 0)
    spots = dots(bins.cell_directions[holes], radius=min(DOT, 0.4 / math.sqrt(bins.cells)))
    rgb = heat_colors(counts)
    rgb[holes] = list(bytes.fromhex(HOLE[dark][1:]))
    opacity = np.where(counts > 0, SEEN_OPACITY, HOLE_OPACITY)
    colors = np.concatenate([_linear(rgb), (255 * opacity[:, None]).round()], axis=-1)[cells.owners]
    dot = _linear(np.array([list(bytes.fromhex(HOLE_DOT[dark][1:]))], dtype=np.uint8))
    dot_colors = np.repeat(np.concatenate([dot, [[255.0]]], axis=-1), len(spots.vertices), axis=0)
    visual = TextureVisuals(
        material=PBRMaterial(metallicFactor=0.0, roughnessFactor=1.0, alphaMode="BLEND", doubleSided=False)
    )
    visual.vertex_attributes["color"] = np.concatenate([colors, dot_colors]).round().astype(np.uint8)
    vertices = np.concatenate([cells.vertices, 1.004 * spots.vertices])
    faces = np.concatenate([cells.faces, len(cells.vertices) + spots.faces])
    mesh = trimesh.Trimesh(vertices, faces, process=False, visual=visual)
    made = mesh.export(file_type="glb")
    assert isinstance(made, bytes)
    return made


@lru_cache(maxsize=4)
def _cell_tiles(bins: SphereBins) -> Tiles:
    """The cells, which are made on the event loop: kept, since every other count and colour has the same."""
    return tiles(cell_patches(bins), gap=GAP)


def _linear(rgb: UInt8[np.ndarray, "k 3"]) -> Float[np.ndarray, "k 3"]:
    """sRGB as glTF has colours of vertices, 0 to 255 still."""
    share = rgb / 255.0
    return 255.0 * np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


class CoverageSphere:
    """The sphere of one view. `show`, `edited` and `close` belong to the event loop; boxes may move by any thread."""

    def __init__(self, client: viser.ClientHandle, nodes: BoxNodes, *, read: Read, workers: Executor) -> None:
        """
        Args:
            read: called on a worker; raises ArsErrors where there is nothing to show.
        """
        self._client = client
        self._boxes = nodes
        self._lock = nodes.lock
        self._read = read
        self._workers = workers
        self._sight: CoverageSight | None = None
        self._dark = True
        self._turn = 0
        self._known: tuple[CoverageSight, int] | None = None
        self._found: SphereCounts | None = None
        self._drawn: tuple[SphereCounts, bool] | None = None
        self._at: viser.FrameHandle | None = None
        self._sphere: viser.GlbHandle | None = None
        self._outline: tuple[viser.LineSegmentsHandle, viser.LineSegmentsHandle] | None = None
        self._reading: asyncio.Task[None] | None = None
        self._closed = False
        self._stop = nodes.watch(self._moved)

    def show(self, sight: CoverageSight | None, *, dark: bool) -> None:
        """Show this sphere, or none."""
        with self._lock:
            self._sight, self._dark = sight, dark
        self._draw()
        if sight is not None and self._reading is None and self._known != self._wanted():
            self._reading = asyncio.create_task(self._read_on())

    def edited(self) -> None:
        """Count anew."""
        self._turn += 1
        if self._sight is not None:
            self.show(self._sight, dark=self._dark)

    def meets(self, ray: Ray) -> SphereHit | None:
        """Where a ray meets the sphere first, or, from within, at all; None: nowhere, or there is no sphere."""
        with self._lock:
            shown = self._shown()
        if shown is None:
            return None
        sight, box, found = shown
        offset = ray.origin - box.T_world_box[:3, 3]
        along, radius = float(offset @ ray.direction), _radius(box)
        reach = along**2 - float(offset @ offset) + radius**2
        if reach < 0.0:
            return None
        distance = next((d for d in (-along - math.sqrt(reach), -along + math.sqrt(reach)) if d > 0.0), None)
        if distance is None:
            return None
        world = offset + distance * ray.direction
        direction = rigid_transform.invert(box.T_world_box)[:3, :3] @ (world / radius)
        bins = SphereBins(sight.azimuth_bins, sight.polar_bins)
        angles, cells = bins.of(folded(direction[None], found.symmetry))
        return SphereHit(int(angles[0]), int(cells[0]), distance)

    def close(self) -> list[asyncio.Task[None]]:
        """The browser is gone; what is still being read ends soon."""
        self._stop()
        with self._lock:
            self._closed = True
        if self._reading is None:
            return []
        self._reading.cancel()
        return [self._reading]

    def _wanted(self) -> tuple[CoverageSight, int] | None:
        """What is to be counted, of the session after how many edits."""
        sight = self._sight
        return None if sight is None else (_counted(sight), self._turn)

    async def _read_on(self) -> None:
        """Read until what is known is what is wanted; of what was wanted meanwhile only the last."""
        try:
            while (wanted := self._wanted()) is not None and wanted != self._known and not self._closed:
                found: SphereCounts | None = None
                try:
                    found = await asyncio.get_running_loop().run_in_executor(self._workers, self._read, wanted[0])
                except ArsError:
                    pass  # the page asks for the same counts, and says what is wrong with them
                with self._lock:
                    self._known, self._found = wanted, found
                self._draw()
        finally:
            self._reading = None

    def _moved(self, box_ids: frozenset[int]) -> None:
        with self._lock:
            if self._sight is not None and self._sight.box_id in box_ids:
                self._draw()

    def _draw(self) -> None:
        with self._lock:
            if self._closed or is_gone(self._client):
                return
            shown = self._shown()
            with self._client.atomic():
                if shown is not None:
                    self._draw_sphere(*shown)
                elif self._at is not None:
                    self._at.visible = False
            self._client.flush()

    def _shown(self) -> tuple[CoverageSight, Box, SphereCounts] | None:
        """What is drawn, or None. Call it with the lock.

        Counts of the same bins are shown until newer ones are there; those of other objects are not.
        """
        sight, found, known = self._sight, self._found, self._known
        box = None if sight is None else self._boxes.box(sight.box_id)
        if sight is None or box is None or found is None or known is None or known[0] != _counted(sight):
            return None
        return sight, box, found

    def _draw_sphere(self, sight: CoverageSight, box: Box, found: SphereCounts) -> None:
        scene, radius = self._client.scene, _radius(box)
        bins = SphereBins(sight.azimuth_bins, sight.polar_bins)
        if self._at is None:
            self._at = scene.add_frame(COVERAGE, show_axes=False)
        place(self._at, box.T_world_box)
        self._at.visible = True
        same = self._drawn is not None and self._drawn[1] == self._dark and _equal(self._drawn[0], found)
        if self._sphere is None or not same:
            made = sphere_glb(bins, found.counts, dark=self._dark)
            if self._sphere is None:
                self._sphere = scene.add_glb(
                    f"{COVERAGE}/sphere", made, scale=radius, cast_shadow=False, receive_shadow=False
                )
            else:
                self._sphere.glb_data = made
            self._drawn = (found, self._dark)
        self._sphere.scale = radius
        lines = chosen_lines(sight, found.symmetry).astype(np.float32)
        if self._outline is None:
            if not len(lines):
                return
            self._outline = (
                scene.add_line_segments(
                    f"{COVERAGE}/halo", lines, HALO, thickness=HALO_WIDTH, thickness_units="screen", scale=radius
                ),
                scene.add_line_segments(
                    f"{COVERAGE}/chosen", lines, CHOSEN, thickness=CHOSEN_WIDTH, thickness_units="screen", scale=radius
                ),
            )
        for outline, above in zip(self._outline, (1.0, ABOVE_HALO), strict=True):
            outline.visible = len(lines) > 0
            if len(lines):
                outline.points = lines
            outline.scale = above * radius


def chosen_lines(sight: CoverageSight, symmetry: Symmetry) -> Float[np.ndarray, "m 2 3"]:
    """The outline of the chosen bin or cell, and of all that are drawn as it since the symmetry folds them to it."""
    bins = SphereBins(sight.azimuth_bins, sight.polar_bins)
    angles, cells = stand_ins(bins, symmetry)
    if sight.chosen_bin is not None:
        chosen, patches, stand_in = sight.chosen_bin, bin_patches(bins), angles
    elif sight.chosen_cell is not None:
        chosen, patches, stand_in = sight.chosen_cell, cell_patches(bins), cells
    else:
        return np.zeros((0, 2, 3))
    alike = np.flatnonzero(stand_in == chosen)
    # One that is cut by the edge of what directions are folded to may stand for no whole one.
    return 1.006 * outlines(patches[alike if len(alike) else [chosen]])


def _counted(sight: CoverageSight) -> CoverageSight:
    """The sight without what is only outlined."""
    return replace(sight, chosen_bin=None, chosen_cell=None)


def _equal(a: SphereCounts, b: SphereCounts) -> bool:
    return len(a.counts) == len(b.counts) and bool((a.counts == b.counts).all())


def _radius(box: Box) -> float:
    return RADIUS * float(np.linalg.norm(box.size))
