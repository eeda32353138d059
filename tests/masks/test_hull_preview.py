"""Hull previews of anything that people may draw: scribbles, specks, outlines over the border and over each other."""

import numpy as np
import pytest
import shapely

from ars_web.errors import ArsError
from ars_web.geometry.polygon import Polygon
from ars_web.masks.hull_preview import preview_hull
from ars_web.masks.views import Photographs, object_of, views_of
from ars_web.sessions.model import FrameTable, HullOptions


@pytest.fixture(scope="module")
def taken(ring_scene) -> Photographs:
    frames = ring_scene.FRAMES
    names = tuple(str(frame) for frame in range(frames))
    return Photographs({0: ring_scene.CAMERA}, FrameTable(names, (), np.zeros(frames, int), ring_scene.poses()))


def drawn(ring_scene, random: np.random.Generator) -> list[tuple[int, list[Polygon]]]:
    """Outlines in one frame to six: of the ball, or of nothing."""
    outlines: list[tuple[int, list[Polygon]]] = []
    for frame in random.choice(ring_scene.FRAMES, random.integers(1, 7), replace=False).tolist():
        polygons: list[Polygon] = []
        for _ in range(random.integers(1, 3)):
            corners, spread = random.integers(3, 14), 10 ** random.uniform(-2, 2.3)
            ring = random.uniform([-50, -50], [370, 290]) + random.normal(0, spread, (corners, 2))
            if random.random() < 0.5:
                ring = ring_scene.outline(frame) + random.normal(0, 10, 2) * (random.random() < 0.7)
            if random.random() < 0.2:
                ring = np.clip(ring, [0, 0], [320, 240])
            if random.random() < 0.2:
                ring = ring.round()
            polygons.append(Polygon(ring))
        outlines.append((frame, polygons))
    return outlines


# The first one's silhouette fell into pieces that overlapped by rounding.
@pytest.mark.parametrize("seed", [1608686208, *range(12)])
def test_whatever_is_drawn_gives_a_hull_or_a_reason(taken: Photographs, ring_scene, seed: int) -> None:
    random = np.random.default_rng(seed)
    outlines = drawn(ring_scene, random)
    options = HullOptions(
        random.choice(["world", "upright", "free"]),
        random.choice(["box", "mass"]),
        float(random.choice([0, 0, 1, 20])),
        None if random.random() < 0.7 else float(random.normal(0.04, 0.05)),
    )
    try:
        views = views_of(taken, outlines)
    except ArsError:
        return  # a speck, or too far outside the image
    found = preview_hull(taken, views, options, show_in=[0, 3, 5])
    for overlay in found.overlays:
        for polygon in overlay.polygons:
            assert shapely.Polygon(polygon.outer, polygon.holes).is_valid
    if len(views) > 1:
        assert (found.hull is None) == (found.box is None) == (found.problem is not None)
    if found.hull is None:
        return
    box, hull = object_of(views, options)
    assert hull.digest
    assert found.hull.volume <= found.box.volume * (1 + 1e-9)
    assert box.size == pytest.approx(found.box.size, rel=1e-9)
    along = (found.hull.vertices - box.T_world_box[:3, 3]) @ box.T_world_box[:3, :3]
    assert (np.abs(along) <= box.size / 2 + 1e-9).all()


def test_an_outline_of_something_else_that_leaves_a_sliver_is_told(taken: Photographs, ring_scene) -> None:
    def warnings(centre: tuple[float, float, float]) -> tuple[str, ...]:
        outlines = [(frame, [Polygon(ring_scene.outline(frame))]) for frame in (0, 5)]
        outlines.append((3, [Polygon(ring_scene.outline(3, centre=centre))]))
        found = preview_hull(taken, views_of(taken, outlines), HullOptions(), show_in=[])
        assert found.hull is not None
        return found.warnings

    assert warnings(ring_scene.CENTRE) == ()
    (warning,) = warnings((0.0, 0.0, 0.11))  # 60 mm above the ball, whose radius is 40
    assert warning.startswith("Little of the outlines is left in the hull (")
    assert "% in frame 3" in warning


def test_nobody_is_sent_round_an_object_that_no_frame_shows_from_there(taken: Photographs, ring_scene) -> None:
    few = FrameTable(("0", "1"), (), np.zeros(2, int), taken.frames.Ts_world_camera[:2])
    outlines = [(frame, [Polygon(ring_scene.outline(frame))]) for frame in (0, 1)]
    for photographs, advice in ((taken, "from further round"), (Photographs(taken.cameras, few), "fit the box")):
        found = preview_hull(photographs, views_of(photographs, outlines), HullOptions(), show_in=[])
        (warning,) = found.warnings
        assert "degrees apart at most" in warning
        assert advice in warning
