"""Which frames tell most of a box: against boxes that are really moved, and against other choices of frames."""

import numpy as np
import pytest

from ars_web.errors import BadInput
from ars_web.geometry import box_sensitivity as sensitivity
from ars_web.geometry import camera as cameras
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import CORNER_SIGNS, EDGES, Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.labels import labels_of_boxes, wireframe

PINHOLE = Camera(640, 480, 500.0, 510.0, 300.0, 250.0)
BROWN = Camera(640, 480, 500.0, 505.0, 300.0, 250.0, "brown", (-0.28, 0.09, 0.0011, -0.0009, -0.01))
FISHEYE = Camera(640, 480, 320.0, 322.0, 330.0, 235.0, "fisheye", (0.02, -0.01, 0.003, -0.0005))
EVERY = pytest.mark.parametrize("camera", [PINHOLE, BROWN, FISHEYE], ids=lambda camera: camera.model)

BOX = Box(
    rigid_transform.from_rotation(
        rigid_transform.rotation_from_wxyz(np.array([0.9, 0.1, -0.2, 0.3])), np.array([0.05, -0.1, 0.08])
    ),
    np.array([0.2, 0.12, 0.15]),
)


def circling(n: int, *, turns: float = 1.0) -> np.ndarray:
    """`Ts_world_camera` (n, 4, 4) of a camera that circles the box, looks past it, and comes nearer."""
    s = np.linspace(0, 1, n)
    angle = 2 * np.pi * turns * s
    distance = 1.0 - 0.5 * s
    centre = np.column_stack([distance * np.cos(angle), distance * np.sin(angle), 0.4 + 0.3 * np.sin(5 * angle)])
    target = np.column_stack([0.3 * np.sin(3 * angle), 0.2 * np.cos(7 * angle), np.zeros(n)])
    z = target - centre
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return rigid_transform.from_rotation(np.stack([x, np.cross(z, x), z], axis=-1), centre)


def moved(box: Box, parameter: int, by: float) -> Box:
    """The box with one of its nine parameters changed by a length."""
    along = by * np.eye(3)[parameter % 3]
    if parameter < 3:
        return Box(box.T_world_box @ rigid_transform.from_rotation(np.eye(3), along), box.size)
    if parameter < 6:
        half = np.tan(along / (np.linalg.norm(box.size) / 2) / 2)
        turn = rigid_transform.rotation_from_wxyz(np.array([1.0, *half]))
        return Box(box.T_world_box @ rigid_transform.from_rotation(turn, np.zeros(3)), box.size)
    return Box(box.T_world_box, box.size + along)


def corners_in_image(camera: Camera, T_world_camera: np.ndarray, box: Box) -> np.ndarray:
    T = rigid_transform.invert(T_world_camera)
    points = rigid_transform.transform_points(T, box.corners_world)
    return cameras.image_from_pixels(cameras.pixels_from_camera_points(camera, points))


@EVERY
def test_a_millimetre_moves_the_drawn_box_as_predicted(camera: Camera):
    """What `geometry.labels` draws: an edge that lies whole in the image begins and ends at its corners."""
    moves = sensitivity.parameter_moves(BOX)
    compared = 0
    for T in circling(7):
        slopes = sensitivity.corner_slopes(camera, T[None], BOX)
        if not labels_of_boxes(camera, T[None], [BOX]).truncated[0, 0] == 0.0:
            continue
        before = wireframe(camera, T, BOX)
        assert len(before) == 12
        for parameter in range(9):
            after = wireframe(camera, T, moved(BOX, parameter, 1e-3))
            for (first, last), was, now in zip(EDGES, before, after, strict=True):
                for corner, end in ((first, 0), (last, -1)):
                    if slopes.seen[0, corner]:
                        predicted = slopes.by_place[0, corner] @ moves[corner, :, parameter] * 1e-3
                        np.testing.assert_allclose(now[end] - was[end], predicted, atol=0.02)
                        compared += 1
    assert compared > 200


@pytest.mark.parametrize("seed", range(30))
def test_slopes_of_any_scene_are_the_limit_of_differences(seed: int, random_scene):
    camera, T, box = random_scene(seed)
    slopes = sensitivity.corner_slopes(camera, T[None], box)
    moves = sensitivity.parameter_moves(box)
    h = 1e-7
    for parameter in range(9):
        ahead = corners_in_image(camera, T, moved(box, parameter, h))
        back = corners_in_image(camera, T, moved(box, parameter, -h))
        want = (ahead - back) / (2 * h)
        found = np.einsum("kij,kj->ki", slopes.by_place[0], moves[:, :, parameter])
        seen = slopes.seen[0]
        np.testing.assert_allclose(
            found[seen], want[seen], rtol=1e-3, atol=1e-3 * (1 + np.abs(want[seen]).max(initial=0))
        )
    assert (slopes.by_place[0][~slopes.seen[0]] == 0).all()


@pytest.mark.parametrize("seed", range(30))
def test_a_corner_is_seen_where_nothing_of_the_box_is_before_it(seed: int, random_scene):
    """By the ray from the camera: just before the corner, it is outside the box all the way."""
    camera, T, box = random_scene(seed)
    T_box_world = rigid_transform.invert(box.T_world_box)
    start = T_box_world[:3, :3] @ T[:3, 3] + T_box_world[:3, 3]
    corners = CORNER_SIGNS * box.size / 2
    t = np.linspace(0, 1, 4000, endpoint=False)[:, None, None]
    inside = (np.abs(start + t * (corners - start)) < box.size / 2 * (1 - 1e-9)).all(axis=2).any(axis=0)
    image = corners_in_image(camera, T, box)
    depth = rigid_transform.transform_points(rigid_transform.invert(T), box.corners_world)[:, 2]
    shown = cameras.in_image(camera, image - 0.5) & (depth >= 0.01)
    np.testing.assert_array_equal(sensitivity.corner_slopes(camera, T[None], box).seen[0], shown & ~inside)


def test_information_is_the_sum_over_the_corners():
    slopes = sensitivity.corner_slopes(BROWN, circling(9), BOX)
    J = np.einsum("nkri,kip->nkrp", slopes.by_place, sensitivity.parameter_moves(BOX)).reshape(9, 16, 9)
    np.testing.assert_allclose(sensitivity.information(slopes, BOX), J.transpose(0, 2, 1) @ J, rtol=1e-9, atol=1e-6)


def shown_rows(Ts: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Information and sides of the frames that show the box, and their indices."""
    slopes = sensitivity.corner_slopes(BROWN, Ts, BOX)
    rows = np.flatnonzero(slopes.seen.any(axis=1))
    towards = Ts[rows, :3, 3] - BOX.T_world_box[:3, 3]
    sides = towards / np.linalg.norm(towards, axis=1, keepdims=True)
    return sensitivity.information(slopes, BOX)[rows], sides, rows


def log_det(matrices: np.ndarray, rows: list[int]) -> float:
    return float(np.linalg.slogdet(sensitivity.prior(BOX) + matrices[rows].sum(axis=0))[1])


def test_the_choice_is_the_greedy_one():
    matrices, sides, _ = shown_rows(circling(300))
    found = sensitivity.most_informative(matrices, sensitivity.prior(BOX), sides, count=6, apart=0.0)
    plain: list[int] = []
    for _ in range(6):
        open_rows = [i for i in range(len(matrices)) if i not in plain]
        plain.append(max(open_rows, key=lambda i: log_det(matrices, [*plain, i])))
    assert found == plain


def test_the_choice_beats_even_spacing_and_chance():
    matrices, sides, _ = shown_rows(circling(400, turns=2))
    chosen = sensitivity.most_informative(matrices, sensitivity.prior(BOX), sides, count=6)
    assert len(set(chosen)) == 6
    best = log_det(matrices, chosen)
    random = np.random.default_rng(0)
    n = len(matrices)
    for start in range(0, n // 6, 5):
        assert best > log_det(matrices, [start + i * (n // 6) for i in range(6)])
    for _ in range(200):
        assert best > log_det(matrices, random.choice(n, 6, replace=False).tolist())


def test_chosen_frames_show_the_box_from_different_sides():
    matrices, sides, _ = shown_rows(circling(2000))
    chosen = sensitivity.most_informative(matrices, sensitivity.prior(BOX), sides, count=6)
    cosines = sides[chosen] @ sides[chosen].T - 2 * np.eye(6)
    assert np.degrees(np.arccos(cosines.max())) >= 10


def test_where_all_frames_are_from_one_side_there_are_still_enough():
    T = circling(1)[0]
    Ts = np.repeat(T[None], 8, axis=0)
    Ts[4:, 0, 3] += 1e-3
    found = sensitivity.telling_frames({0: BROWN}, np.zeros(8, dtype=np.int64), Ts, BOX, count=6)
    assert len({one.frame for one in found}) == 6


def test_every_parameter_is_told_by_the_chosen_frames():
    """From one side the distance and the size are one; six frames must tell them apart."""
    matrices, sides, _ = shown_rows(circling(500))
    chosen = sensitivity.most_informative(matrices, sensitivity.prior(BOX), sides, count=6)
    off = np.sqrt(np.diag(np.linalg.inv(matrices[chosen].sum(axis=0))))
    assert off.max() < 2e-3  # metres, for corners seen to a pixel
    alone = np.linalg.inv(sensitivity.prior(BOX) + matrices[chosen[0]])
    assert np.sqrt(np.diag(alone)).max() > 3 * off.max()


def test_px_per_metre_is_the_most_that_a_corner_can_move():
    Ts = circling(60)
    (one,) = sensitivity.telling_frames({0: BROWN}, np.zeros(60, dtype=np.int64), Ts, BOX, count=1)
    T = Ts[one.frame]
    seen = sensitivity.corner_slopes(BROWN, T[None], BOX).seen[0]
    random = np.random.default_rng(1)
    before = corners_in_image(BROWN, T, BOX)
    most = 0.0
    for way in random.normal(size=(2000, 3)):
        shift = rigid_transform.from_rotation(np.eye(3), 1e-3 * way / np.linalg.norm(way))
        after = corners_in_image(BROWN, T, Box(BOX.T_world_box @ shift, BOX.size))
        most = max(most, float(np.linalg.norm(after - before, axis=1)[seen].max()))
    assert one.px_per_metre * 1e-3 == pytest.approx(most, rel=0.01)


def test_frames_that_do_not_show_the_box_are_not_chosen():
    Ts = circling(12)
    away = Ts @ np.diag([-1.0, 1.0, -1.0, 1.0])  # each looks back
    both = np.concatenate([away, Ts[:2]])
    found = sensitivity.telling_frames({0: BROWN}, np.zeros(14, dtype=np.int64), both, BOX, count=6)
    assert {one.frame for one in found} <= {12, 13}
    assert sensitivity.telling_frames({0: BROWN}, np.zeros(12, dtype=np.int64), away, BOX, count=6) == []


def test_frames_that_show_a_corner_only_are_left_to_the_last():
    """A near one, turned away until one corner is left in the image, and two far ones that show all of the box."""
    whole = circling(40)[:2]
    near = circling(40)[30:31]
    turned = near
    for angle in np.linspace(0.0, 1.5, 400):
        turn = rigid_transform.rotation_from_wxyz(np.array([np.cos(angle / 2), 0.0, np.sin(angle / 2), 0.0]))
        turned = near @ rigid_transform.from_rotation(turn, np.zeros(3))
        if sensitivity.corner_slopes(BROWN, turned, BOX).seen.sum() == 1:
            break
    assert sensitivity.corner_slopes(BROWN, turned, BOX).seen.sum() == 1
    Ts, ids = np.concatenate([turned, whole]), np.zeros(3, dtype=np.int64)
    for count, expected in ((1, 1), (2, 2), (3, 3)):
        rows = {one.frame for one in sensitivity.telling_frames({0: BROWN}, ids, Ts, BOX, count=count)}
        assert len(rows) == expected
        assert (0 in rows) == (count == 3)


def test_frames_of_several_cameras_are_weighed_together():
    """The one with four times the pixels tells most."""
    fine = Camera(2560, 1920, 2001.5, 2021.5, 1201.5, 1001.5, "brown", BROWN.distortion)
    ids = np.tile([3, 8], 20)
    found = sensitivity.telling_frames({3: BROWN, 8: fine}, ids, np.repeat(circling(20), 2, axis=0), BOX, count=4)
    assert len(found) == 4
    assert {ids[one.frame] for one in found} == {8}


def test_no_frames_at_all_cannot_be_asked_for():
    with pytest.raises(BadInput, match="not 0"):
        sensitivity.telling_frames({0: BROWN}, np.zeros(1, dtype=np.int64), circling(1), BOX, count=0)
