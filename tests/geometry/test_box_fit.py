"""Boxes refined on where their objects are seen: near the truth from rough starts, and refused where they cannot be."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest
import shapely

from ars_web.errors import BadInput
from ars_web.geometry import camera as cameras
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.box_fit import BoxFit, fit_box
from ars_web.geometry.box_sighting import Sighting, sighting_of_region
from ars_web.geometry.camera import Camera
from ars_web.geometry.labels import labels_of_boxes, outline

BROWN = Camera(1280, 720, 920.0, 918.0, 640.5, 362.0, "brown", (-0.28, 0.09, 0.0008, -0.0005, -0.012))
FISHEYE = Camera(640, 480, 220.0, 222.0, 330.0, 235.0, "fisheye", (0.02, -0.01, 0.003, -0.0005))
SIZE = np.array([0.1, 0.07, 0.05])


def looking(at: Sequence[float], centre: Sequence[float]) -> np.ndarray:
    """`T_world_camera` of a camera at `centre` that looks at a point, the world's z up."""
    z = np.subtract(at, centre)
    z = z / np.linalg.norm(z)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    return rigid_transform.from_rotation(np.column_stack([x, np.cross(z, x), z]), np.array(centre))


def round_about(n: int, random: np.random.Generator) -> np.ndarray:
    """`Ts_world_camera` (n, 4, 4) evenly round the origin and above it, near and far, none quite at it."""
    azimuths = 2 * np.pi * (np.arange(n) + random.uniform(0, 0.5, n)) / n + (n == 2) * np.arange(n) * -np.pi / 2
    elevations, distances = np.radians(random.uniform(20, 60, n)), random.uniform(0.4, 0.7, n)
    flat = distances * np.cos(elevations)
    centres = np.column_stack([flat * np.cos(azimuths), flat * np.sin(azimuths), distances * np.sin(elevations)])
    return np.array([looking(random.normal(0, 0.03, 3), centre) for centre in centres])


def thing(random: np.random.Generator, *, tilted: bool = False) -> Box:
    turn = rigid_transform.rotation_about_z(random.uniform(-np.pi, np.pi))
    if tilted:
        turn = turn @ rigid_transform.rotation_from_wxyz(np.append(1.0, random.normal(0, 0.2, 3)))
    return Box(rigid_transform.from_rotation(turn, random.uniform(-0.03, 0.03, 3)), SIZE)


def roughly(box: Box, random: np.random.Generator, *, tilted: bool = False) -> Box:
    """The box as a person places it: 25 mm off, turned by 20 degrees, its sides wrong by some 15 %."""
    axis = random.normal(size=3) if tilted else np.array([0.0, 0.0, random.choice([-1.0, 1.0])])
    half = np.radians(20) / 2
    turn = rigid_transform.rotation_from_wxyz(np.append(np.cos(half), np.sin(half) * axis / np.linalg.norm(axis)))
    away = random.normal(size=3)
    place = box.T_world_box[:3, 3] + 0.025 * away / np.linalg.norm(away)
    size = box.size * np.exp(random.normal(0, 0.15, 3))
    return Box(rigid_transform.from_rotation(turn @ box.T_world_box[:3, :3], place), size)


def boxes_seen(
    camera: Camera, Ts: np.ndarray, box: Box, random: np.random.Generator, *, noise: float = 1.0
) -> list[Sighting]:
    """The box's labels, each side off by `noise` pixels."""
    seen = labels_of_boxes(camera, Ts, [box]).bbox[:, 0] + random.normal(0, noise, (len(Ts), 4))
    return [Sighting(frame, camera, T, bbox) for frame, (T, bbox) in enumerate(zip(Ts, seen, strict=True))]


def outlines_seen(camera: Camera, Ts: np.ndarray, box: Box, random: np.random.Generator) -> list[Sighting]:
    """The box's outlines, each corner off by a pixel."""
    found: list[Sighting] = []
    for frame, T in enumerate(Ts):
        ring = shapely.Polygon(outline(camera, T, box)).simplify(0.5)
        corners = shapely.get_coordinates(ring)[:-1]
        drawn = shapely.MultiPolygon([shapely.Polygon(corners + random.normal(0, 1.0, corners.shape))])
        found.append(sighting_of_region(frame, camera, T, drawn))
    return found


def off_by(fit: BoxFit, box: Box) -> float:
    """Metres between the centres."""
    return float(np.linalg.norm(fit.box.T_world_box[:3, 3] - box.T_world_box[:3, 3]))


def corners_off(fit: BoxFit, box: Box) -> float:
    """Metres from a fitted corner to the nearest true one, the largest."""
    apart = np.linalg.norm(fit.box.corners_world[:, None] - box.corners_world[None], axis=2)
    return float(apart.min(axis=1).max())


@pytest.mark.parametrize(
    ("orientation", "views", "by_outline", "centre_mm", "corner_mm"),
    [
        ("upright", 4, False, 0.6, 2.0),
        ("upright", 8, False, 0.45, 1.2),
        ("upright", 2, True, 1.0, 2.5),
        ("upright", 4, True, 0.6, 1.5),
        ("free", 8, False, 0.5, 2.0),
        ("free", 4, True, 0.6, 2.0),
    ],
)
def test_a_rough_box_comes_near_the_truth(
    orientation,
    views: int,
    by_outline: bool,
    centre_mm: float,
    corner_mm: float,
    record_testsuite_property: Callable[[str, object], None],
):
    centres, corners = [], []
    for seed in range(3):
        random = np.random.default_rng(seed)
        Ts, box = round_about(views, random), thing(random, tilted=orientation == "free")
        see = outlines_seen if by_outline else boxes_seen
        start = roughly(box, random, tilted=orientation == "free")
        fit = fit_box(start, see(BROWN, Ts, box, random), orientation=orientation)
        assert fit.by_outline == by_outline
        assert fit.rms_px < 2
        assert not fit.outliers.any()
        centres.append(1e3 * off_by(fit, box))
        corners.append(1e3 * corners_off(fit, box))
    what = f"{orientation} box from {views} {'outlines' if by_outline else 'boxes'} with 1 px of noise"
    record_testsuite_property(f"{what}: centre off, mm", round(float(np.median(centres)), 2))
    assert np.median(centres) < centre_mm
    assert np.median(corners) < corner_mm
    # None may be quite wrong: that would be a bad answer that looks good.
    assert max(corners) < 16


def test_outlines_tell_more_than_their_boxes():
    by_boxes, by_outlines = [], []
    for seed in range(2):
        random = np.random.default_rng(seed)
        Ts, box = round_about(3, random), thing(random)
        by_boxes.append(fit_box(roughly(box, random), boxes_seen(BROWN, Ts, box, random)).corner_error)
        by_outlines.append(fit_box(roughly(box, random), outlines_seen(BROWN, Ts, box, random)).corner_error)
    assert np.median(by_outlines) < 0.7 * np.median(by_boxes)


def test_cameras_of_several_kinds_agree():
    random = np.random.default_rng(0)
    Ts, box = round_about(6, random), thing(random)
    seen = [*boxes_seen(BROWN, Ts, box, random)[::2], *boxes_seen(FISHEYE, Ts, box, random)[1::2]]
    fit = fit_box(roughly(box, random), seen)
    assert corners_off(fit, box) < 5e-3
    labels = labels_of_boxes(FISHEYE, Ts[1:2], [fit.box]).bbox[0, 0]
    np.testing.assert_allclose(fit.residuals_px[3], labels - seen[3].bbox, atol=0.05)


def test_boxes_and_outlines_of_several_cameras_go_together():
    random = np.random.default_rng(2)
    Ts, box = round_about(4, random), thing(random)
    seen = [*outlines_seen(BROWN, Ts[:3], box, random), boxes_seen(FISHEYE, Ts, box, random)[3]]
    fit = fit_box(roughly(box, random), seen)
    assert fit.by_outline
    assert corners_off(fit, box) < 3e-3


@pytest.mark.parametrize("size", [[1e-300, 0.07, 1e4], [1e-300] * 3])
def test_a_start_of_any_size_will_do(size: list[float]):
    random = np.random.default_rng(6)
    Ts, box = round_about(4, random), thing(random)
    start = Box(box.T_world_box, np.array(size))
    assert corners_off(fit_box(start, outlines_seen(BROWN, Ts, box, random)), box) < 3e-3


def test_the_axes_keep_their_names():
    random = np.random.default_rng(5)
    Ts, box = round_about(8, random), thing(random)
    # The start lies on another side: what is its x is the true box's z.
    swap = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    T = box.T_world_box @ rigid_transform.from_rotation(swap, np.zeros(3))
    start = roughly(Box(T, box.size[::-1]), random)
    for orientation in ("upright", "free"):
        fit = fit_box(start, boxes_seen(BROWN, Ts, box, random), orientation=orientation)
        np.testing.assert_allclose(fit.box.size, box.size[::-1], atol=3e-3)
        assert np.trace(fit.box.T_world_box[:3, :3].T @ T[:3, :3]) > 2.95


def test_an_upright_box_is_upright():
    random = np.random.default_rng(1)
    Ts, box = round_about(6, random), thing(random)
    fit = fit_box(roughly(box, random, tilted=True), boxes_seen(BROWN, Ts, box, random))
    assert np.abs(fit.box.T_world_box[2, :3]).max() == pytest.approx(1, abs=1e-12)


def test_sides_at_the_border_count_as_reached():
    """One camera sees half of the object: its box ends at the image's border, and the object does not."""
    random = np.random.default_rng(2)
    Ts, box = round_about(5, random), thing(random)
    Ts[0] = Ts[0] @ rigid_transform.from_rotation(aside(0.66), np.zeros(3))
    seen = boxes_seen(BROWN, Ts, box, random, noise=0.3)
    cut = seen[0].cut
    assert cut.sum() == 1
    fit = fit_box(roughly(box, random), seen)
    assert corners_off(fit, box) < 2e-3
    assert fit.residuals_px[0][cut] == pytest.approx(0)
    # The same, drawn: it stops a little before the border, as drawings do.
    drawn = [*seen[1:], Sighting(0, BROWN, Ts[0], np.where(cut, np.abs(seen[0].bbox - 1.0), seen[0].bbox))]
    assert drawn[-1].cut.tolist() == cut.tolist()
    assert corners_off(fit_box(roughly(box, random), drawn), box) < 2e-3
    # A box that is known to go on beyond the border says where it ends.
    whole = labels_of_boxes(BROWN, Ts[:1], [box]).bbox_amodal[0, 0]
    known = Sighting(0, BROWN, Ts[0], whole)
    assert known.is_amodal
    assert not known.cut.any()
    fit = fit_box(roughly(box, random), [known, *seen[1:]])
    assert corners_off(fit, box) < 2e-3
    np.testing.assert_allclose(fit.residuals_px[0], 0, atol=1.5)


def aside(angle: float) -> np.ndarray:
    """A camera turned about its y."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def test_a_wrong_frame_is_named_and_counts_for_little():
    for seed in range(2):
        random = np.random.default_rng(seed)
        Ts, box = round_about(7, random), thing(random)
        seen = boxes_seen(BROWN, Ts, box, random)
        seen[3] = Sighting(3, BROWN, Ts[3], seen[3].bbox + np.array([25, 10, 25, 10]))
        fit = fit_box(roughly(box, random), seen)
        assert fit.outliers.tolist() == [frame == 3 for frame in range(7)]
        assert fit.doubts[3] > 3.5
        assert off_by(fit, box) < 3e-3


def test_a_ball_gets_the_box_whose_labels_are_right():
    """The corners of the box round a ball stick out in the images; the one that is fitted gives better labels."""
    random = np.random.default_rng(3)
    Ts, centre, radius = round_about(20, random), np.array([0.01, -0.02, 0.03]), 0.05
    around = Box(rigid_transform.from_rotation(np.eye(3), centre), np.full(3, 2 * radius))
    seen = [sighting_of_region(i, BROWN, T, ball_seen(BROWN, T, centre, radius)) for i, T in enumerate(Ts)]
    fit = fit_box(roughly(around, random), seen[::3])
    assert not fit.by_outline
    labels = labels_of_boxes(BROWN, Ts, [fit.box, around]).bbox_amodal
    true = np.array([sighting.bbox for sighting in seen])
    fitted, surrounding = iou(labels[:, 0], true).mean(), iou(labels[:, 1], true).mean()
    assert fitted > 0.82
    assert fitted > surrounding + 0.2


def ball_seen(camera: Camera, T_world_camera: np.ndarray, centre: np.ndarray, radius: float) -> shapely.MultiPolygon:
    """The outline of a ball: the points of it from which the camera is seen at a right angle."""
    towards = T_world_camera[:3, 3] - centre
    distance = np.linalg.norm(towards)
    normal = towards / distance
    across = np.linalg.svd(normal[None])[2][1:]
    angles = np.linspace(0, 2 * np.pi, 200, endpoint=False)[:, None]
    ring = across[0] * np.cos(angles) + across[1] * np.sin(angles)
    along = radius / distance
    points = centre + radius * (along * normal + np.sqrt(1 - along**2) * ring)
    points = rigid_transform.transform_points(rigid_transform.invert(T_world_camera), points)
    ring = cameras.image_from_pixels(cameras.pixels_from_camera_points(camera, points))
    return shapely.MultiPolygon([shapely.Polygon(ring)])


def iou(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    shared = np.clip(np.minimum(a[:, 2:], b[:, 2:]) - np.maximum(a[:, :2], b[:, :2]), 0, None).prod(axis=1)
    return shared / ((a[:, 2:] - a[:, :2]).prod(axis=1) + (b[:, 2:] - b[:, :2]).prod(axis=1) - shared)


def test_a_start_far_away_does_as_well():
    """Behind some of the cameras, even: the frames tell where to look."""
    random = np.random.default_rng(4)
    Ts, box = round_about(4, random), thing(random)
    start = Box(rigid_transform.from_rotation(np.eye(3), np.array([1.5, 0.3, 0.0])), np.full(3, 0.3))
    assert corners_off(fit_box(start, boxes_seen(BROWN, Ts, box, random)), box) < 5e-3


class TestWhatCannotBeFitted:
    @pytest.fixture(scope="class", autouse=True)
    @staticmethod
    def a_box_seen(request: pytest.FixtureRequest) -> None:
        """Not as the class is read: every process would compile the labels while it collects its tests."""
        its = request.cls
        its.random = np.random.default_rng(0)
        its.Ts = round_about(8, its.random)
        its.box = thing(its.random)
        its.start = roughly(its.box, its.random)
        its.seen = boxes_seen(BROWN, its.Ts, its.box, its.random)

    def test_one_frame(self):
        with pytest.raises(BadInput, match="seen in two frames at least"):
            fit_box(self.start, self.seen[:1])

    def test_a_frame_twice(self):
        with pytest.raises(BadInput, match="frame 2 is given twice"):
            fit_box(self.start, [*self.seen[:4], self.seen[2]])

    @pytest.mark.parametrize("degrees", [0.0, 3.0])
    def test_frames_from_one_side(self, degrees: float):
        there = self.Ts[0] @ rigid_transform.from_rotation(np.eye(3), np.zeros(3))
        turn = rigid_transform.from_rotation(rigid_transform.rotation_about_z(np.radians(degrees)), np.zeros(3))
        Ts = np.array([there, turn @ there])
        with pytest.raises(BadInput, match="add a frame from another side"):
            fit_box(self.start, boxes_seen(BROWN, Ts, self.box, self.random))

    def test_all_nine_numbers_from_two_boxes(self):
        with pytest.raises(BadInput, match="add a frame from another side"):
            fit_box(self.start, self.seen[:4:3], orientation="free")

    def test_nothing_that_is_one_object(self):
        random = np.random.default_rng(1)
        elsewhere = [
            Sighting(s.frame, s.camera, s.T_world_camera, s.bbox + np.tile(random.uniform(-250, 250, 2), 2))
            for s in self.seen
        ]
        with pytest.raises(BadInput, match="no one box agrees with frames 0, 1, 2"):
            fit_box(self.start, elsewhere)

    def test_a_frame_that_looks_away(self):
        away = self.Ts[0] @ rigid_transform.from_rotation(aside(np.pi), np.zeros(3))
        looking_away = Sighting(0, BROWN, away, self.seen[0].bbox)
        with pytest.raises(BadInput, match=r"seen in frame 0 .* leave that frame out"):
            fit_box(self.start, [looking_away, *self.seen[1:]])

    @pytest.mark.parametrize(
        ("bbox", "words"),
        [
            ([10, 10, np.nan, 20], "must be finite"),
            ([10, 10, 10.5, 20], r"\[10, 10, 10.5, 20\] is no box to fit to"),
            ([30, 10, 20, 20], "is no box to fit to"),
            ([1300, 10, 1400, 20], "is outside the image, which is 1280 x 720"),
            ([-30, 10, -1, 20], "is outside the image"),
        ],
    )
    def test_a_box_that_is_none(self, bbox: list[float], words: str):
        with pytest.raises(BadInput, match="frame 4: .*" + words):
            Sighting(4, BROWN, self.Ts[0], np.array(bbox, dtype=float))

    @pytest.mark.parametrize("pieces", [[], [shapely.box(1300, 0, 1400, 50)], [shapely.box(5, 5, 5, 50)]])
    def test_a_mask_with_nothing_in_the_image(self, pieces: list[shapely.Polygon]):
        with pytest.raises(BadInput, match="frame 4: the mask has nothing in the image"):
            sighting_of_region(4, BROWN, self.Ts[0], shapely.MultiPolygon(pieces))
