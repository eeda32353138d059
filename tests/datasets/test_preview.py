from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from ars_web.datasets.drawing import Canvas, color_of, plain, readable_on
from ars_web.datasets.preview import draw_frame, labelled_frames, preview, spread
from ars_web.errors import BadFile, BadInput, NotFound, StoreError
from ars_web.sessions.model import SessionSnapshot

Make = Callable[..., SessionSnapshot]


def test_pictures_are_spread_over_the_labelled_frames(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(12)
    paths = preview(snapshot, tmp_path / "new" / "pictures", count=3)
    assert [path.name for path in paths] == ["0001.png", "0005.png", "0008.png"]
    assert labelled_frames(snapshot) == list(range(10))
    for path in paths:
        assert path.read_bytes().startswith(b"\x89PNG")
        assert cv2.imread(str(path)).shape[1] >= 960


def test_pictures_show_what_a_format_holds(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(12)
    drawn = {
        kind: preview(snapshot, tmp_path / str(kind), count=1, format=kind)[0].read_bytes()
        for kind in (None, "yolo", "coco")
    }
    assert len(set(drawn.values())) == 3
    with pytest.raises(BadInput, match="'xyz' is unknown"):
        preview(snapshot, tmp_path / "xyz", format="xyz")


def test_spreading() -> None:
    assert spread(range(10), 3) == [1, 5, 8]
    assert spread([4, 7], 6) == [4, 7]
    assert spread([4], 1) == [4]
    assert spread(range(100), 1) == [50]


def test_labels_are_drawn_where_they_are(make_snapshot: Make) -> None:
    """The picture differs from the enlarged image round the boxes, and nowhere else."""
    snapshot = make_snapshot(12)
    frame = 2
    drawn = draw_frame(snapshot, frame)
    bare = Canvas(cv2.imread(str(snapshot.frames.images[frame]))).pixels
    scale = bare.shape[1] // 64
    changed = (np.abs(drawn[: bare.shape[0]].astype(int) - bare) > 40).any(axis=2)
    from ars_web.datasets.samples import frame_labels

    label = next(found for found in frame_labels(snapshot, frame) if found.bbox)
    for line in label.wireframe:
        middle = np.round((line[0] + line[-1]) / 2 * scale).astype(int)
        window = changed[max(middle[1] - 4, 0) : middle[1] + 5, max(middle[0] - 4, 0) : middle[0] + 5]
        assert window.any()
    corner = np.ones_like(changed)
    for found in frame_labels(snapshot, frame):
        if found.bbox:
            x0, y0, x1, y1 = (round(v * scale) for v in found.bbox)
            corner[max(y0 - 60, 0) : y1 + 60, max(x0 - 60, 0) : x1 + 260] = False
    assert corner.any()
    assert not (changed & corner).any()


def test_sessions_with_nothing_to_draw_are_told_so(make_snapshot: Make, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="nothing to draw: it has no boxes"):
        preview(make_snapshot(2, objects=[]), tmp_path)
    away = make_snapshot(12)
    turned = away.frames.Ts_world_camera.copy()
    turned[:] = turned[-1]
    object.__setattr__(away.frames, "Ts_world_camera", turned)
    with pytest.raises(BadInput, match="none of its 3 boxes is in any image"):
        preview(away, tmp_path)
    with pytest.raises(BadInput, match="at least one"):
        preview(make_snapshot(2), tmp_path, count=0)


def test_what_cannot_be_read_or_written_is_named(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(1)
    with pytest.raises(StoreError, match="/proc/pictures"):
        preview(snapshot, Path("/proc/pictures"))
    with pytest.raises(NotFound, match="no frame 1"):
        draw_frame(snapshot, 1)
    snapshot.frames.images[0].unlink()
    with pytest.raises(BadFile, match=r"0000\.jpg"):
        preview(snapshot, tmp_path)


@pytest.mark.parametrize("color", ["#000000", "#ffffff", "#e6194b", "#3cb44b", "#ffe119", "#4363d8", "#46f0f0"])
def test_ink_can_be_read_on_every_color(color: str) -> None:
    def luminance(bgr: tuple[int, int, int]) -> float:
        linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in (v / 255 for v in bgr)]
        return 0.0722 * linear[0] + 0.7152 * linear[1] + 0.2126 * linear[2]

    paper = color_of(color)
    low, high = sorted([luminance(paper), luminance(readable_on(paper))])
    assert (high + 0.05) / (low + 0.05) >= 4.0


def test_text_is_what_the_font_can_draw() -> None:
    assert plain("Würfel") == "Wurfel"
    assert plain("立方体") == "???"
    assert plain("x" * 60) == "x" * 25 + "..."
    assert color_of("#0180ff") == (255, 128, 1)


def test_tags_keep_out_of_each_others_way() -> None:
    canvas = Canvas(np.zeros((480, 640, 3), dtype=np.uint8))
    for _ in range(6):
        canvas.tag((100.0, 100.0, 140.0, 130.0), "cube", "100%", (0, 0, 255))
    taken = canvas._taken
    assert len(taken) == 6
    for i, (x0, y0, x1, y1) in enumerate(taken):
        assert 0 <= x0 < x1 <= canvas.pixels.shape[1]
        assert 0 <= y0 < y1 <= canvas.pixels.shape[0]
        assert all(x1 <= a or c <= x0 or y1 <= b or d <= y0 for a, b, c, d in taken[:i])
