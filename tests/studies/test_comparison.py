"""The annotation study on a scene of three boxes whose rectangles are worked by hand."""

import json
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from ars_web.annotations.foreign import ForeignImage, ForeignLabels, ForeignOutline, ForeignPose, ForeignRectangle
from ars_web.annotations.registry import read_labels
from ars_web.datasets.drawing import Color, color_of
from ars_web.datasets.jobs import plan_export, run_export
from ars_web.datasets.options import ExportOptions
from ars_web.errors import BadFile, BadInput
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.polygon import Polygon
from ars_web.sessions.model import FrameTable, ObjectClass, SessionSnapshot, SessionState, VirtualBox
from ars_web.studies import comparison_pictures
from ars_web.studies.agreement import Agreement, Confusion, Matches, Offsets, RectangleAgreement, rectangle_agreement
from ars_web.studies.compared_frames import Sides
from ars_web.studies.comparison import Comparison, compare
from ars_web.studies.comparison_report import comparison_page, offset_rows
from ars_web.studies.comparison_warnings import comparison_warnings
from ars_web.studies.hidden_bands import HiddenBand, hidden_bands
from ars_web.studies.rectangle_matching import Pairs, Rectangles

CAMERA = Camera(200, 200, 100.0, 100.0, 99.5, 99.5)
"""A point at X, Y, Z lies at 100 + 100 X / Z, 100 + 100 Y / Z in image coordinates."""

NAMES = ("a.png", "b.png", "c.png")


def box(x: tuple[float, float], y: tuple[float, float], z: tuple[float, float]) -> Box:
    low, high = np.array([x, y, z], dtype=np.float64).T
    T = np.eye(4)
    T[:3, 3] = (low + high) / 2
    return Box(T, high - low)


OBJECTS = (
    # Its front, at Z = 10, is from 90 to 110 both ways.
    ("cup", box((-1, 1), (-1, 1), (10, 12))),
    # Its front, at Z = 20: 100 - 5 = 95 to 100 + 35 = 135, and 90 to 110. The cup hides it up to 110.
    ("plate", box((-1, 7), (-2, 2), (20, 22))),
    # Front at Z = 10: -20 to 20; back at Z = 20: 40 to 60; 90 to 110. The image cuts it at 0.
    ("cup", box((-12, -8), (-1, 1), (10, 20))),
)

CUP, PLATE, CUT = [90, 90, 110, 110], [95, 90, 135, 110], [0, 90, 60, 110]


@pytest.fixture
def make_session(tmp_path: Path) -> Callable[..., SessionSnapshot]:
    """Makes a session of three frames, all seen from the world's origin."""

    def make(*, objects: tuple[tuple[str, Box], ...] = OBJECTS, names: tuple[str, ...] = NAMES) -> SessionSnapshot:
        (tmp_path / "images").mkdir(exist_ok=True)
        paths = tuple(tmp_path / "images" / name.replace("/", " ") for name in names)
        for path in paths:
            assert cv2.imwrite(str(path), np.full((200, 200, 3), 120, dtype=np.uint8))
        classes = list(dict.fromkeys(name for name, _ in objects))
        state = SessionState(
            revision=5,
            name="table",
            classes={i: ObjectClass(i, name, "#e6194b", 1) for i, name in enumerate(classes)},
            boxes={i: VirtualBox(i, classes.index(n), str(i), b, 1) for i, (n, b) in enumerate(objects, start=1)},
            next_class_id=len(classes),
            next_box_id=len(objects) + 1,
        )
        poses = np.tile(np.eye(4), (len(names), 1, 1))
        frames = FrameTable(names, paths, np.zeros(len(names), dtype=np.int64), poses)
        return SessionSnapshot("s1", state, {0: CAMERA}, frames)

    return make


def by_hand(images: dict[str, list[tuple[str, list[float]]]]) -> ForeignLabels:
    """Rectangles by image."""
    rectangles = [
        ForeignRectangle(place, name, None, np.array(bbox, dtype=np.float64), f"{image}, row {row}")
        for place, (image, rows) in enumerate(images.items())
        for row, (name, bbox) in enumerate(rows)
    ]
    return ForeignLabels(
        "voc", Path("labels"), tuple(ForeignImage(name=name) for name in images), rectangles=tuple(rectangles)
    )


def study(session: SessionSnapshot, labels: ForeignLabels, **given: object) -> Comparison:
    options = ExportOptions.model_validate({k: given.pop(k) for k in ("min_visible", "shape") if k in given})
    return compare(session, labels, options=options, **given)


LABELS = {
    "a.png": [
        # 18 of 20 columns are the cup's: IoU 360 / 440 = 9/11.
        ("cup", [92, 90, 112, 110]),
        # What is seen of the plate: 25 of its 40 columns, IoU 0.625 with the whole, 1 with what is seen.
        ("plate", [110, 90, 135, 110]),
        # In the image as it is; 60 of 80 columns of the whole, IoU 0.75.
        ("cup", [0, 90, 60, 110]),
    ],
    "b.png": [
        # Where the cup is, IoU 9/11; with the plate 260 / 940 = 0.277, too little. The other two are labelled by none.
        ("plate", [88, 90, 108, 110]),
        ("cup", [150, 150, 170, 170]),
    ],
}
NINE_ELEVENTHS = 9 / 11


def test_numbers_by_hand(make_session: Callable[..., SessionSnapshot]) -> None:
    found = study(make_session(), by_hand(LABELS))
    assert [frame.name for frame in found.frames] == ["a.png", "b.png"]
    # Three objects in two frames, five labels by hand, three pairs, whatever is drawn round.
    ious = {"in_image": [NINE_ELEVENTHS, 0.625, 1.0], "amodal": [NINE_ELEVENTHS, 0.625, 0.75]}
    ious["visible"] = [NINE_ELEVENTHS, 1.0, 1.0]
    for kind, expected in ious.items():
        total = found.rectangles[kind].total
        assert (total.manual, total.automatic, total.matched) == (5, 6, 3)
        assert (total.precision, total.recall) == (3 / 6, 3 / 5)
        assert total.mean_iou == pytest.approx(sum(expected) / 3)
        assert total.median_iou == pytest.approx(sorted(expected)[1])
    in_image = found.rectangles["in_image"]
    cup, plate = (one.agreement for one in in_image.classes)
    assert (cup.manual, cup.automatic, cup.matched, plate.manual, plate.automatic, plate.matched) == (3, 4, 2, 2, 2, 1)
    assert cup.mean_iou == pytest.approx((NINE_ELEVENTHS + 1) / 2)
    assert plate == Agreement(2, 2, 1, 0.5, 0.5, pytest.approx(0.625), pytest.approx(0.625))
    assert in_image.confusion == (
        Confusion("cup", "cup", 2),
        Confusion("cup", None, 1),
        Confusion("plate", "cup", 1),
        Confusion("plate", "plate", 1),
        Confusion(None, "cup", 1),
        Confusion(None, "plate", 1),
    )
    # Parts of 0.05: 9/11 is in the 17th, 0.625 in the 13th, 1 in the last.
    assert [i for i, count in enumerate(in_image.histogram) if count] == [12, 16, 19]
    # Left sides are 2 and 15 px further left, and the same; the others 0 in the median.
    offsets = in_image.offsets
    assert (offsets.left, offsets.top, offsets.right, offsets.bottom) == pytest.approx((-2, 0, 0, 0), abs=1e-9)


def test_frames_and_bands_by_hand(make_session: Callable[..., SessionSnapshot]) -> None:
    found = study(make_session(), by_hand(LABELS), worst=1)
    first, second = found.frames
    assert first.agreement == first.mean_iou == pytest.approx((NINE_ELEVENTHS + 0.625 + 1) / 3)
    # Two labels by hand and three automatic ones, none with a partner of its class.
    assert (second.manual, second.automatic, second.matched, second.mean_iou, second.agreement) == (2, 3, 0, None, 0.0)
    (worst,) = found.worst
    assert worst.frame == second
    told = [(label.by, label.class_name, label.iou, label.other_class) for label in worst.labels]
    assert told == [
        ("hand", "plate", None, "cup"),
        ("hand", "cup", None, None),
        ("program", "cup", None, "plate"),
        ("program", "plate", None, None),
        ("program", "cup", None, None),
    ]
    assert worst.labels[3].bbox == pytest.approx(PLATE)
    assert worst.labels[3].visible_bbox == pytest.approx([110, 90, 135, 110])
    # 25 of 40 columns are seen: 0.625.
    matched = {(band.lowest, band.highest): band.matched for band in found.bands}
    assert matched == {(0.95, 1.0): 2, (0.75, 0.95): 0, (0.5, 0.75): 1, (0.0, 0.5): 0}
    assert (found.bands[2].in_image, found.bands[2].visible) == (pytest.approx(0.625), pytest.approx(1.0))
    assert (found.bands[1].in_image, found.bands[1].visible) == (None, None)


def test_a_higher_threshold_parts_pairs(make_session: Callable[..., SessionSnapshot]) -> None:
    found = study(make_session(), by_hand(LABELS), iou=0.7)
    matched = {kind: one.total.matched for kind, one in found.rectangles.items()}
    assert matched == {"in_image": 2, "amodal": 2, "visible": 3}


def test_what_is_hidden_wholly_is_no_label_that_people_draw(make_session: Callable[..., SessionSnapshot]) -> None:
    behind = ("plate", box((-0.5, 0.5), (-0.5, 0.5), (14, 15)))
    labels = by_hand({"a.png": [("cup", CUP), ("plate", [0, 0, 9, 9])]})
    found = study(make_session(objects=(*OBJECTS[:1], behind)), labels)
    assert found.hidden == 1
    automatic = {kind: one.total.automatic for kind, one in found.rectangles.items()}
    assert automatic == {"in_image": 2, "amodal": 2, "visible": 1}
    # Of an export that drops such labels there is none at all.
    found = study(make_session(objects=(*OBJECTS[:1], behind)), labels, min_visible=0.1)
    assert (found.hidden, found.rectangles["in_image"].total.automatic) == (0, 1)


def test_an_image_labelled_with_nothing_counts_and_one_not_labelled_does_not(
    make_session: Callable[..., SessionSnapshot],
) -> None:
    found = study(make_session(), by_hand({"a.png": [("cup", CUP), ("cup", CUT), ("plate", PLATE)], "b.png": []}))
    total = found.rectangles["in_image"].total
    # b.png's three are too many, c.png's are not looked at.
    assert (total.manual, total.automatic, total.matched) == (3, 6, 3)
    assert [(frame.index, frame.agreement) for frame in found.frames] == [(0, pytest.approx(1.0)), (1, 0.0)]


def test_of_an_outline_the_rectangle_counts(make_session: Callable[..., SessionSnapshot]) -> None:
    ring = np.array([[90, 100], [100, 90], [110, 100], [100, 110]], dtype=np.float64)
    images = (ForeignImage(name="a.png"),)
    outline = ForeignOutline(0, "cup", None, (Polygon(ring),), "annotation 1")
    found = study(make_session(), ForeignLabels("coco", Path("x.json"), images, outlines=(outline,)))
    assert found.rectangles["in_image"].total.mean_iou == pytest.approx(1.0)


def test_classes_that_only_one_side_has_are_told_and_not_counted(make_session: Callable[..., SessionSnapshot]) -> None:
    labels = by_hand({"a.png": [("cup", CUP), ("dish", PLATE), ("spoon", [0, 0, 5, 5])]})
    found = study(make_session(), labels)
    total = found.rectangles["in_image"].total
    assert (total.manual, total.automatic, total.matched) == (1, 2, 1)
    (plate,) = found.never_by_hand
    assert (plate.class_name, plate.labels, plate.often, plate.times) == ("plate", 1, "dish", 1)
    assert [(one.class_name, one.labels, one.often) for one in found.unknown] == [
        ("dish", 1, "plate"),
        ("spoon", 1, None),
    ]
    assert any("no class 'dish'" in line and "--classes dish=plate" in line for line in found.warnings)
    assert any("'plate' was never labelled by hand: its 1 automatic label" in line for line in found.warnings)
    named = study(make_session(), labels, classes={"dish": "plate"})
    total = named.rectangles["in_image"].total
    assert (total.manual, total.automatic, total.matched, named.never_by_hand) == (2, 3, 2, ())


def test_labels_in_other_images_are_left_out_and_told(make_session: Callable[..., SessionSnapshot]) -> None:
    found = study(make_session(), by_hand({"a.png": [("cup", CUP)], "z.png": [("cup", CUP)] * 2}))
    (reason,) = found.left_out
    assert (reason.count, reason.examples) == (2, ("z.png, row 0", "z.png, row 1"))
    assert "none of the session's frames" in reason.reason
    assert found.notes == ("1 of its 2 images are not compared, no frames: z.png",)


def test_a_session_without_boxes_has_missed_everything(make_session: Callable[..., SessionSnapshot]) -> None:
    session = make_session()
    empty = replace(session, state=replace(session.state, boxes={}))
    total = study(empty, by_hand(LABELS)).rectangles["in_image"].total
    assert total == Agreement(5, 0, 0, None, 0.0, None, None)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"iou": 0.0}, "above 0 and at most 1, not 0"),
        ({"iou": 1.01}, "not 1.01"),
        ({"iou": float("nan")}, "not nan"),
        ({"classes": {"mug": "cup"}}, "no manual label is of class 'mug'; their classes are cup, plate"),
        ({"classes": {"cup": "mug"}}, "no class 'mug'; its classes are cup, plate"),
        ({"shape": "mesh"}, "needs a mesh"),
    ],
)
def test_what_cannot_be_is_refused(
    make_session: Callable[..., SessionSnapshot], given: dict[str, object], said: str
) -> None:
    with pytest.raises(BadInput, match=said):
        study(make_session(), by_hand(LABELS), **given)


def test_labels_that_have_nothing_in_common_are_refused(make_session: Callable[..., SessionSnapshot]) -> None:
    with pytest.raises(BadInput, match=r"no class of the manual labels \(dish\) .* \(cup, plate\); .*--classes"):
        study(make_session(), by_hand({"a.png": [("dish", PLATE)]}))
    with pytest.raises(BadFile, match="none of its 1 images is a frame"):
        study(make_session(), by_hand({"z.png": []}))
    with pytest.raises(BadFile, match="lists no image"):
        study(make_session(), by_hand({}))
    posed = replace(by_hand(LABELS), poses=(ForeignPose(0, "1", np.eye(4), "image 0"),))
    with pytest.raises(BadFile, match="holds poses"):
        study(make_session(), posed)


MANY = tuple(f"{i}.png" for i in range(20))
"""Frames with two cups each: pairs enough to speak of conventions."""


def cups(*, left: float = 0, top: float = 0, right: float = 0, bottom: float = 0) -> ForeignLabels:
    """Both cups in all of MANY, sides moved by so much."""
    off = np.array([left, top, right, bottom])
    return by_hand({name: [("cup", CUP + off), ("cup", CUT + off)] for name in MANY})


def test_labels_that_are_all_moved_are_told(make_session: Callable[..., SessionSnapshot]) -> None:
    session = make_session(names=MANY)
    assert [line for line in study(session, cups()).warnings if "never labelled" not in line] == []
    moved = study(session, cups(left=0.5, right=0.5, top=-1, bottom=-1)).warnings
    assert any(line.startswith("Automatic labels lie 0.5 px further left than manual ones") for line in moved)
    assert any(line.startswith("Automatic labels lie 1.0 px further down than manual ones") for line in moved)
    (counted_from_nought,) = (line for line in study(session, cups(left=-1, top=-1)).warnings if "VOC" in line)
    assert "begin 1.0 px further left and up" in counted_from_nought


def test_labels_that_are_all_narrower_are_told(make_session: Callable[..., SessionSnapshot]) -> None:
    """Nothing hides the cups, and 14 x 14 of 20 x 20 px, 54 x 14 of 60 x 20 are left of them: 0.49 and 0.63."""
    found = study(make_session(names=MANY), cups(left=3, top=3, right=-3, bottom=-3))
    assert any("that nothing hides overlap by 0.56 only" in line for line in found.warnings)


def test_sides_that_are_where_they_should_be_have_one_sign(make_session: Callable[..., SessionSnapshot]) -> None:
    found = study(make_session(names=MANY), cups(left=1e-4, right=-1e-4, top=1e-4, bottom=-1e-4))
    assert offset_rows(found)[0][1:] == ("+0.00",) * 4


def test_few_pairs_are_told(make_session: Callable[..., SessionSnapshot]) -> None:
    found = study(make_session(), by_hand(LABELS))
    assert any(line.startswith("Only 3 labels have a partner") for line in found.warnings)


def test_an_empty_frame_of_a_video_counts(make_session: Callable[..., SessionSnapshot], tmp_path: Path) -> None:
    """Three frames, a cup drawn in the middle one: in the other two the session's labels have no partner."""
    sides = 'xtl="90" ytl="90" xbr="110" ybr="110" outside="0"'
    (tmp_path / "annotations.xml").write_text(
        "<annotations><meta><task><size>3</size></task></meta>"
        f'<track id="0" label="cup"><box frame="1" {sides}/></track></annotations>'
    )
    found = study(make_session(), read_labels(tmp_path / "annotations.xml"))
    assert [(one.name, one.manual, one.automatic, one.matched) for one in found.frames] == [
        ("a.png", 0, 2, 0),
        ("b.png", 1, 2, 1),
        ("c.png", 0, 2, 0),
    ]
    total = found.rectangles["in_image"].total
    assert (total.precision, total.recall, total.mean_iou) == (1 / 6, 1.0, pytest.approx(1.0))


@pytest.mark.parametrize(
    ("kind", "least"), [("yolo", 0.999), ("coco", 0.999), ("voc", 0.97), ("cvat", 0.99), ("cvat-video", 0.99)]
)
def test_our_own_exports_agree_with_the_session(
    make_session: Callable[..., SessionSnapshot], tmp_path: Path, kind: str, least: float
) -> None:
    session = make_session(names=("left/1.png", "right/1.png", "one two.png"))
    options = ExportOptions.model_validate({"images": "none"})
    run_export(plan_export([session], format=kind, options=options, out=tmp_path / "out"))
    found = study(session, read_labels(tmp_path / "out"))
    total = found.rectangles["in_image"].total
    assert (total.manual, total.automatic, total.matched, total.precision, total.recall) == (9, 9, 9, 1.0, 1.0)
    assert total.mean_iou > least
    assert len(found.frames) == 3
    assert found.left_out == ()


@pytest.mark.parametrize("kind", ["yolo", "coco", "voc", "cvat"])
def test_an_export_of_two_sessions_is_compared_with_each(
    make_session: Callable[..., SessionSnapshot], tmp_path: Path, kind: str
) -> None:
    """Their frames have the same names; names of files begin with the sessions' ids."""
    first = make_session()
    second = replace(first, id="s2")
    options = ExportOptions.model_validate({"images": "none"})
    run_export(plan_export([first, second], format=kind, options=options, out=tmp_path / "out"))
    for session in (first, second):
        found = study(session, read_labels(tmp_path / "out"))
        assert [(one.name, one.manual, one.matched) for one in found.frames] == [(name, 3, 3) for name in NAMES]
        assert any("3 of its 6 images are not compared" in note for note in found.notes)


def test_a_report_escapes_names_and_needs_nothing_beside_it(make_session: Callable[..., SessionSnapshot]) -> None:
    script = "<script>alert(1)</script>"
    objects = ((script, OBJECTS[0][1]), *OBJECTS[1:])
    session = make_session(objects=objects, names=(f"{script[:8]}.png", "b.png"))
    labels = by_hand({f"{script[:8]}.png": [(script, [92, 90, 112, 110])], f"{script}.png": [("cup", CUP)]})
    found = study(session, labels)
    page = comparison_page(found, session, name=script)
    assert "<script" not in page
    assert page.count("&lt;script&gt;alert(1)&lt;/script&gt;") >= 4
    assert "98.49 %" in page
    assert page.count("data:image/jpeg") == 1
    assert page.count("data:image/png") == 2
    assert 'src="http' not in page
    assert comparison_page(found, session, name=script) == page


def test_a_report_without_pairs_or_pictures_says_so(make_session: Callable[..., SessionSnapshot]) -> None:
    session = make_session()
    for image in session.frames.images:
        Path(image).unlink()
    found = study(session, by_hand({"a.png": []}))
    # Nobody labelled anything, so nothing is judged.
    assert (found.rectangles["in_image"].total.automatic, found.worst) == (0, ())
    assert {one.class_name for one in found.never_by_hand} == {"cup", "plate"}
    assert "There is no label to compare." in comparison_page(found, session, name="table")
    found = study(session, by_hand({"a.png": [("cup", [0, 0, 5, 5])]}))
    page = comparison_page(found, session, name="table")
    assert "No picture: a.png" in page
    # Reports are passed on.
    assert str(session.frames.images[0].parent) not in page
    assert "data:image" not in page


def test_the_same_labels_give_the_same_numbers_in_any_order(make_session: Callable[..., SessionSnapshot]) -> None:
    turned = {name: rows[::-1] for name, rows in reversed(LABELS.items())}
    first, second = (study(make_session(), by_hand(labels)) for labels in (LABELS, turned))
    assert first.rectangles == second.rectangles
    assert first.frames == second.frames
    assert json.dumps(first.bands, default=vars) == json.dumps(second.bands, default=vars)


def test_a_label_that_is_hidden_wholly_counts_only_where_its_class_is_compared(
    make_session: Callable[..., SessionSnapshot],
) -> None:
    behind = ("plate", box((-0.5, 0.5), (-0.5, 0.5), (14, 15)))
    found = study(make_session(objects=(*OBJECTS[:1], behind)), by_hand({"a.png": [("cup", CUP)]}))
    assert (found.hidden, [one.class_name for one in found.never_by_hand]) == (0, ["plate"])
    # What is too much of a class that nobody labelled is in no number.
    assert [one for one in found.rectangles["in_image"].confusion if one.automatic == "plate"] == []


def test_a_share_on_a_band_s_border_belongs_to_the_better_seen_band() -> None:
    rows = np.arange(5)
    bbox = np.tile([0.0, 0.0, 4.0, 4.0], (5, 1))
    rectangles = Rectangles(rows, np.zeros(5, dtype=np.int64), bbox)
    none = np.zeros(0, dtype=np.int64)
    found = Matches(Pairs(rows, rows, np.linspace(0.5, 0.9, 5)), Pairs(none, none, np.zeros(0)))
    every = np.ones(5, dtype=bool)
    sides = Sides(rectangles, rectangles, bbox, found, every, every, ("cup",))
    bands = hidden_bands(sides, np.array([0.0, 0.5, 0.75, 0.95, 1.0]))
    assert [band.matched for band in bands] == [2, 1, 1, 1]
    assert [band.in_image for band in bands] == pytest.approx([0.85, 0.7, 0.6, 0.5])
    assert [band.visible for band in bands] == [1.0] * 4


def test_the_histogram_has_twenty_parts_of_one() -> None:
    rows, ious = np.arange(5), np.array([0.3, 0.50001, 0.94999, 0.95001, 1.0])
    rectangles = Rectangles(rows, np.zeros(5, dtype=np.int64), np.tile([0.0, 0.0, 4.0, 4.0], (5, 1)))
    none = np.zeros(0, dtype=np.int64)
    found = Matches(Pairs(rows, rows, ious), Pairs(none, none, np.zeros(0)))
    told = rectangle_agreement(rectangles, rectangles, found, names=("cup",), compared=frozenset({0}))
    assert [i for i, count in enumerate(told.histogram) for _ in range(count)][1:] == [10, 18, 19, 19]
    assert sum(told.histogram) == 5
    assert told.total.median_iou == 0.94999


def offsets(left: float, top: float, right: float, bottom: float) -> list[str]:
    """What is said of so much between all sides."""
    total = Agreement(100, 100, 100, 1.0, 1.0, 0.9, 0.9)
    agreement = RectangleAgreement(total, (), (), (), Offsets(left, top, right, bottom))
    return list(comparison_warnings(agreement, (HiddenBand(0.95, 1.0, 100, 0.9, 0.9),), (), ()))


def test_only_what_moves_both_sides_one_way_is_a_shift() -> None:
    assert offsets(0.39, 0.39, 0.39, 0.39) == []
    assert offsets(-2.0, -2.0, 2.0, 2.0) == [], "wider is not moved"
    (right,) = offsets(0.4, 0.0, 1.0, 0.0)
    assert "0.7 px further right" in right
    (up,) = offsets(0.0, -0.6, 0.0, -0.4)
    assert "0.5 px further up" in up
    # Moved to the right by as much as VOC's counting would, but the right side too.
    (moved,) = offsets(1.0, 1.0, 1.0, 0.3)
    assert "further right" in moved
    (counted,) = offsets(1.0, 0.8, 0.3, -0.3)
    assert "begin 0.8 px further left and up" in counted


def test_what_is_seen_is_drawn_only_where_something_hides_and_strangers_are_not_lonely(
    make_session: Callable[..., SessionSnapshot], monkeypatch: pytest.MonkeyPatch
) -> None:
    session, drawn, said = make_session(), list[tuple[list[np.ndarray], object, float]](), list[str]()

    class Recorded(comparison_pictures.Canvas):
        def lines(self, lines: list[np.ndarray], color: Color, *, width: float) -> None:
            drawn.append((lines, color, width))

        def tag(self, bbox: object, name: str, word: str, color: object) -> None:
            said.append(f"{name}: {word}")

    monkeypatch.setattr(comparison_pictures, "Canvas", Recorded)
    labels = {"a.png": [("plate", PLATE), ("cup", [70, 90, 90, 110]), ("dish", [20, 20, 60, 40])]}
    (worst,) = study(session, by_hand(labels)).worst
    assert comparison_pictures.picture(session, worst).startswith(b"\xff\xd8")
    # The cup hides the plate; the two cups are seen whole.
    dashed = [lines for lines, *_ in drawn if len(lines) > 1]
    assert len(dashed) == 1
    ends = np.concatenate(dashed[0])
    assert [*ends.min(axis=0), *ends.max(axis=0)] == pytest.approx([110, 90, 135, 110])
    by_color = Counter((color, width) for lines, color, width in drawn if len(lines) == 1)
    manual, automatic, lonely = (
        color_of(one) for one in (comparison_pictures.MANUAL, comparison_pictures.AUTOMATIC, comparison_pictures.LONELY)
    )
    # A pair of plates; a cup by hand and two by the program that have no partner; the dish is not compared.
    assert by_color == {(manual, 2.0): 1, (automatic, 2.0): 1, (lonely, 2.0): 3, (manual, 1.0): 1}
    assert sorted(said) == ["cup: hand alone", "cup: program alone", "cup: program alone"]
