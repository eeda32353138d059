"""Rectangles round what is seen: exact where nothing hides, at a pixel's edge where something does."""

from pathlib import Path

import numpy as np
import pytest

from ars_web.datasets.samples import labels_of_shapes
from ars_web.datasets.shapes import posed_shapes
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.sessions.model import FrameTable, ObjectClass, SessionSnapshot, SessionState, VirtualBox
from ars_web.studies.visible_rectangles import visible_rectangles

CAMERA = Camera(200, 200, 100.0, 100.0, 99.5, 99.5)
"""A point at X, Y, Z lies at 100 + 100 X / Z, 100 + 100 Y / Z in image coordinates."""


def box(x: tuple[float, float], y: tuple[float, float], z: tuple[float, float]) -> Box:
    low, high = np.array([x, y, z], dtype=np.float64).T
    T = np.eye(4)
    T[:3, 3] = (low + high) / 2
    return Box(T, high - low)


def seen(*boxes: Box, told: list[tuple[int, int]] | None = None) -> np.ndarray:
    """(b, 4) in one frame from the world's origin."""
    virtual = {i: VirtualBox(i, 0, str(i), one, 1) for i, one in enumerate(boxes, start=1)}
    state = SessionState(1, "a session", {0: ObjectClass(0, "cup", "#e6194b", 1)}, virtual, 1, len(boxes) + 1)
    frames = FrameTable(("a.png",), (Path("a.png"),), np.zeros(1, dtype=np.int64), np.eye(4)[None])
    shapes = posed_shapes(SessionSnapshot("s1", state, {0: CAMERA}, frames), [0], shape=None)
    progress = None if told is None else lambda done, count: told.append((done, count))
    return visible_rectangles(shapes, labels_of_shapes(shapes), progress=progress)[0]


def test_where_nothing_hides_a_side_is_the_label_s_own() -> None:
    told: list[tuple[int, int]] = []
    (alone,) = seen(box((-1.03, 1.04), (-1.02, 1.01), (10, 12)), told=told)
    assert alone == pytest.approx([89.7, 89.8, 110.4, 110.1], abs=1e-6)
    assert told == [(1, 1)]


def test_where_something_hides_a_side_is_a_pixel_s_edge() -> None:
    # At Z = 20 from 95.15 to 135.15, both ways within the height of what hides it up to 110.4.
    front, behind = seen(box((-1.03, 1.04), (-1.02, 1.01), (10, 12)), box((-0.97, 7.03), (-1.01, 1.01), (20, 22)))
    assert front == pytest.approx([89.7, 89.8, 110.4, 110.1], abs=1e-6)
    assert behind == pytest.approx([110.0, 94.95, 135.15, 105.05], abs=1e-6)


def test_what_is_hidden_wholly_or_not_in_the_image_has_none() -> None:
    _, hidden, outside = seen(
        box((-1, 1), (-1, 1), (10, 12)), box((-0.5, 0.5), (-0.5, 0.5), (14, 15)), box((0, 1), (0, 1), (-9, -8))
    )
    assert np.isnan(hidden).all()
    assert np.isnan(outside).all()


def test_what_is_too_thin_for_a_pixel_s_middle_counts_as_seen() -> None:
    (thin,) = seen(box((-1.0, 1.0), (0.001, 0.002), (10, 10.001)))
    assert thin == pytest.approx([90.0, 100.01, 110.0, 100.02], abs=1e-2)
