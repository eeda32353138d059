"""Visual hulls against shapes whose hulls are known, and against points asked one by one."""

import math

import numpy as np
import pytest
import shapely
import trimesh
from hypothesis import event, given, settings
from hypothesis import strategies as st

from ars_web.errors import BadInput, ViewsDisagree
from ars_web.geometry import rigid_transform
from ars_web.geometry.camera import Camera
from ars_web.geometry.polygon import Polygon
from ars_web.geometry.visual_hull import View, VisualHull, angle_between, band, expected_widening, visual_hull

SHAPES = ("sphere", "box", "cylinder", "torus", "L")

LONG_LENS = Camera(1000, 1000, 25_000.0, 25_000.0, 499.5, 499.5)
"""Seen from 5 m, where its rays are nearly parallel, 0.1 m is 500 pixels."""


def is_closed(hull: VisualHull) -> bool:
    mesh = trimesh.Trimesh(hull.vertices, hull.faces, process=False)
    return bool(mesh.is_watertight and mesh.is_winding_consistent and mesh.is_volume)


def turned(view: View, angle: float) -> np.ndarray:
    """The view's `T_world_camera`, its camera turned about its own y."""
    T = view.T_world_camera.copy()
    c, s = math.cos(angle), math.sin(angle)
    T[:3, :3] = T[:3, :3] @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    return T


def shifted(view: View, x: float, y: float) -> View:
    """The same outlines elsewhere in the image."""
    by = np.array([x, y])
    moved = tuple(Polygon(p.outer + by, tuple(hole + by for hole in p.holes)) for p in view.polygons)
    return View(view.frame, view.camera, view.T_world_camera, moved)


@pytest.mark.parametrize("lens", ["pinhole", "brown", "wide", "fisheye"])
@pytest.mark.parametrize("name", SHAPES)
def test_points_are_in_the_hull_where_every_image_shows_them_in_the_mask(name: str, lens: str, hulls):
    mesh = hulls.shape(name)
    for count in (2, 5):
        views = hulls.views_of(mesh, hulls.CAMERAS[lens], hulls.round_about(count, distance=0.3))
        hull = visual_hull(views)
        assert is_closed(hull)
        assert hulls.wrong(hull, views, points=300) == 0
        assert hull.volume > 0.99 * mesh.volume


@pytest.mark.parametrize("name", SHAPES)
def test_more_views_leave_less(name: str, hulls):
    mesh = hulls.shape(name)
    volumes = [
        visual_hull(hulls.views_of(mesh, hulls.CAMERAS["brown"], hulls.round_about(count))).volume / mesh.volume
        for count in (2, 4, 8, 16)
    ]
    assert volumes == sorted(volumes, reverse=True)
    # No more than a voxel carver of 128^3 has left where that has as many views; cavities no view shows into are left.
    assert volumes[-1] < {"sphere": 1.05, "box": 1.45, "cylinder": 1.2, "torus": 1.1, "L": 1.35}[name]
    assert volumes[-1] > 0.99


def test_two_views_of_a_ball_from_afar_leave_two_crossed_cylinders(hulls):
    ball = hulls.shape("sphere")
    views = hulls.views_of(ball, LONG_LENS, [hulls.looking((5, 0, 0)), hulls.looking((0, 5, 0))])
    hull = visual_hull(views)
    assert hull.volume == pytest.approx(16 / 3 * 0.05**3, rel=0.01)
    np.testing.assert_allclose(hull.centre_of_mass, 0.0, atol=1e-3)


@pytest.mark.parametrize("name", ["box", "cylinder", "L"])
def test_views_along_its_axes_leave_the_shape_itself(name: str, hulls):
    mesh = hulls.shape(name)
    eyes = [hulls.looking((0, 0, 5), up=(0, 1, 0)), hulls.looking((5, 0, 0)), hulls.looking((0, 5, 0))]
    hull = visual_hull(hulls.views_of(mesh, LONG_LENS, eyes))
    # Rays from 5 m away are not quite parallel: the nearer end of the object looks bigger than the other.
    assert hull.volume == pytest.approx(mesh.volume, rel=0.03)
    np.testing.assert_allclose(hull.centre_of_mass, mesh.center_mass, atol=5e-4)
    np.testing.assert_allclose(np.ptp(hull.vertices, axis=0), mesh.extents, rtol=0.02)


def test_a_hole_in_a_mask_is_a_hole_in_the_hull(hulls):
    torus = hulls.shape("torus")
    hull = visual_hull(hulls.views_of(torus, hulls.CAMERAS["pinhole"], hulls.round_about(6)))
    assert trimesh.Trimesh(hull.vertices, hull.faces, process=False).euler_number == 0
    assert not hulls.inside(hull, np.zeros((1, 3)))[0]


def test_pieces_of_masks_are_pieces_of_the_hull(hulls):
    low, high = trimesh.creation.icosphere(3, 0.02), trimesh.creation.icosphere(3, 0.03)
    both = trimesh.util.concatenate([low.apply_translation([0.05, 0, 0]), high.apply_translation([-0.05, 0.02, 0])])
    views = hulls.views_of(both, hulls.CAMERAS["brown"], hulls.round_about(7))
    assert any(len(view.polygons) == 2 for view in views)
    hull = visual_hull(views)
    assert hulls.wrong(hull, views) == 0
    assert hulls.inside(hull, np.array([[0.05, 0, 0], [-0.05, 0.02, 0], [0, 0, 0]])).tolist() == [True, True, False]


def test_an_outline_that_crosses_itself_encloses_both_its_halves(hulls):
    bow = Polygon(np.array([[220.0, 200.0], [420.0, 280.0], [420.0, 200.0], [220.0, 280.0]]))
    halves = (
        Polygon(np.array([[220.0, 200.0], [320.0, 240.0], [220.0, 280.0]])),
        Polygon(np.array([[420.0, 200.0], [320.0, 240.0], [420.0, 280.0]])),
    )
    camera, (front, side) = hulls.CAMERAS["brown"], hulls.round_about(2)
    disc = view = hulls.view_of(1, camera, side, hulls.shape("sphere"))
    crossed = visual_hull([View(0, camera, front, (bow,)), disc])
    apart = visual_hull([View(0, camera, front, halves), disc])
    assert crossed.volume == pytest.approx(apart.volume, rel=1e-3)
    assert hulls.wrong(crossed, [View(0, camera, front, halves), view]) == 0


def test_rings_count_by_even_and_odd_whichever_polygon_they_belong_to(hulls):
    camera, (front, side) = hulls.CAMERAS["pinhole"], hulls.round_about(2)
    disc = hulls.view_of(1, camera, side, hulls.shape("sphere"))
    big = np.array([[250.0, 180.0], [390.0, 180.0], [390.0, 300.0], [250.0, 300.0]])
    small = (big - [320, 240]) / 2 + [320, 240]
    as_hole = visual_hull([View(0, camera, front, (Polygon(big, (small[::-1],)),)), disc])
    as_polygon = visual_hull([View(0, camera, front, (Polygon(big), Polygon(small))), disc])
    assert as_hole.volume == pytest.approx(as_polygon.volume, rel=1e-9)
    assert as_hole.volume < 0.85 * visual_hull([View(0, camera, front, (Polygon(big),)), disc]).volume


@pytest.mark.parametrize("lens", ["pinhole", "brown", "wide", "fisheye"])
@pytest.mark.parametrize("name", ["box", "torus"])
def test_a_mask_at_the_border_leaves_open_what_is_beyond_it(name: str, lens: str, hulls):
    mesh, camera = hulls.shape(name), hulls.CAMERAS[lens]
    views = hulls.views_of(mesh, camera, hulls.round_about(4, distance=0.3))
    whole = visual_hull(views)
    # Turned until the border cuts the object.
    angles = np.linspace(0.1, 1.6, 60)
    cut = next(v for v in (hulls.view_of(0, camera, turned(views[0], a), mesh) for a in angles) if touches_half(v))
    hull = visual_hull([cut, *views[1:]])
    assert is_closed(hull)
    assert hull.volume > 0.99 * whole.volume
    assert hull.volume < 1.02 * visual_hull(views[1:]).volume
    assert hulls.wrong(hull, [cut, *views[1:]], points=300) == 0


def touches_half(view: View) -> bool:
    """Whether the image's border cuts the outline, and about half is left."""
    points = np.concatenate([polygon.outer for polygon in view.polygons])
    return points[:, 0].min() <= 0 and np.ptp(points[:, 0]) < 0.7 * np.ptp(points[:, 1])


def test_a_piece_beyond_the_border_of_one_image_is_kept_where_others_show_it(hulls):
    camera = hulls.CAMERAS["pinhole"]
    balls = [trimesh.creation.icosphere(3, 0.02).apply_translation([0, y, 0]) for y in (-0.06, 0.06)]
    both = trimesh.util.concatenate(balls)
    views = hulls.views_of(both, camera, [hulls.looking((0.45, 0.1, 0.2)), hulls.looking((0.1, 0.3, 0.4))])
    # So near and turned that one ball is cut by the border, and the other beyond it.
    angles = np.linspace(0.3, 1.0, 60)
    near = View(2, camera, hulls.looking((-0.3, 0.0, 0.1)), views[0].polygons)
    turns = (hulls.view_of(2, camera, turned(near, angle), both) for angle in angles)
    cut = next(view for view in turns if len(view.polygons) == 1 and touches_half(view))
    hull = visual_hull([*views, cut])
    assert hulls.inside(hull, np.array([[0, -0.06, 0], [0, 0.06, 0]])).all()
    assert hulls.wrong(hull, [*views, cut]) == 0


def test_an_open_mask_and_one_other_leave_a_hull_that_ends(hulls):
    mesh, camera = hulls.shape("sphere"), hulls.CAMERAS["pinhole"]
    first, second = hulls.views_of(mesh, camera, hulls.round_about(2, distance=0.3))
    angles = np.linspace(0.1, 1.6, 60)
    cut = next(v for v in (hulls.view_of(0, camera, turned(first, a), mesh) for a in angles) if touches_half(v))
    hull = visual_hull([cut, second])
    assert is_closed(hull)
    # All of the ball is in it, and it is no more than a few times as long as the ball's hull from whole outlines.
    assert hulls.inside(hull, 0.95 * np.asarray(mesh.vertices)[::50]).all()
    assert np.ptp(hull.vertices, axis=0).max() < 4 * np.ptp(visual_hull([first, second]).vertices, axis=0).max()


def test_two_open_masks_leave_a_hull_that_ends(hulls):
    mesh, camera = hulls.shape("sphere"), hulls.CAMERAS["pinhole"]
    angles = np.linspace(0.1, 1.6, 60)
    views = [
        next(v for v in (hulls.view_of(w.frame, camera, turned(w, a), mesh) for a in angles) if touches_half(v))
        for w in hulls.views_of(mesh, camera, hulls.round_about(2, distance=0.3))
    ]
    hull = visual_hull(views)
    assert is_closed(hull)
    assert hulls.inside(hull, 0.95 * np.asarray(mesh.vertices)[::50]).mean() > 0.95
    assert np.ptp(hull.vertices, axis=0).max() < 1.0


def test_the_ground_caps_the_hull_from_below(hulls):
    mesh = hulls.shape("cylinder")
    views = hulls.views_of(mesh, hulls.CAMERAS["brown"], hulls.round_about(4))
    free, capped = visual_hull(views), visual_hull(views, ground=-0.05)
    assert free.vertices[:, 2].min() < -0.06
    assert capped.vertices[:, 2].min() == pytest.approx(-0.05, abs=1e-9)
    assert mesh.volume < capped.volume < free.volume
    assert is_closed(capped)
    with pytest.raises(BadInput, match=r"above the support plane at z = 0\.3 m") as raised:
        visual_hull(views, ground=0.3)
    assert not isinstance(raised.value, ViewsDisagree)


def test_the_ground_ends_what_two_views_leave_open(hulls):
    """Both cameras see the object from nearly above: without the ground its lower end may be anywhere."""
    mesh, camera = hulls.shape("box"), hulls.CAMERAS["pinhole"]
    views = hulls.views_of(mesh, camera, [hulls.looking((x, 0.02, 0.22)) for x in (-0.02, 0.02)])
    with pytest.raises(ViewsDisagree, match="leave open how far away the object ends"):
        visual_hull(views)
    assert visual_hull(views, ground=-0.03).vertices[:, 2].min() == pytest.approx(-0.03, abs=1e-9)


@pytest.mark.parametrize("lens", ["brown", "fisheye"])
def test_widened_masks_are_wider_by_so_many_pixels(lens: str, hulls):
    views = hulls.views_of(hulls.shape("L"), hulls.CAMERAS[lens], hulls.round_about(3))
    hull = visual_hull(views, widen=6.0)
    assert hull.volume > visual_hull(views).volume
    assert hulls.wrong(hull, views, widen=6.0) == 0


def noisy(views: list[View], random: np.random.Generator, *, metres: float, radians: float) -> list[View]:
    """Views whose poses are off by exactly so much, in random directions."""
    made: list[View] = []
    for view in views:
        axis, shift = (v / np.linalg.norm(v) for v in random.normal(size=(2, 3)))
        T = view.T_world_camera.copy()
        half = radians / 2
        T[:3, :3] = T[:3, :3] @ rigid_transform.rotation_from_wxyz(np.append(math.cos(half), math.sin(half) * axis))
        T[:3, 3] += metres * shift
        made.append(View(view.frame, view.camera, T, view.polygons))
    return made


def test_masks_widened_by_the_expected_error_keep_a_small_object(hulls):
    """2 mm and 0.2 degrees of pose noise, an object of 20 mm, a rod of 6 mm: the hull holds all of it, every time."""
    random = np.random.default_rng(3)
    ball = trimesh.creation.icosphere(3, 0.01)
    rod = trimesh.creation.cylinder(0.003, 0.06, sections=24)
    for mesh in (ball, rod):
        exact = hulls.views_of(mesh, hulls.CAMERAS["brown"], hulls.round_about(8))
        for _ in range(5):
            views = noisy(exact, random, metres=0.002, radians=math.radians(0.2))
            widen = expected_widening(views, np.zeros(3), position_error=0.002, angle_error=math.radians(0.2))
            assert 3 < widen < 10
            hull = visual_hull(views, widen=widen)
            assert hulls.inside(hull, 0.99 * np.asarray(mesh.vertices)[::10]).all()


def test_without_widening_noise_empties_the_hull_of_a_thin_object_and_the_error_says_by_how_much(hulls):
    random = np.random.default_rng(0)
    rod = trimesh.creation.cylinder(0.003, 0.12, sections=24)
    exact = hulls.views_of(rod, hulls.CAMERAS["brown"], hulls.round_about(8))
    views = noisy(exact, random, metres=0.006, radians=math.radians(0.6))
    with pytest.raises(ViewsDisagree) as raised:
        visual_hull(views)
    worst = raised.value.misfits[0][1]
    assert 0 < worst < 20
    assert visual_hull(views, widen=worst + 0.5).volume > 0


def test_expected_widening_is_how_far_a_point_moves_in_the_image(hulls):
    view = hulls.view_of(0, hulls.CAMERAS["pinhole"], hulls.looking((0.5, 0, 0)), hulls.shape("sphere"))
    # On the axis at 0.5 m: 500 to 510 pixels a radian.
    assert expected_widening([view], np.zeros(3), position_error=0.002, angle_error=0.0) == pytest.approx(2.04)
    assert expected_widening([view], np.zeros(3), position_error=0.0, angle_error=0.01) == pytest.approx(5.1)
    nearer = expected_widening([view], np.array([0.25, 0, 0]), position_error=0.002, angle_error=0.0)
    assert nearer == pytest.approx(4.08)
    with pytest.raises(BadInput, match="no frame shows the point"):
        expected_widening([view], np.array([1.0, 0, 0]))
    with pytest.raises(BadInput, match="cannot be negative"):
        expected_widening([view], np.zeros(3), position_error=-0.001)


@pytest.mark.parametrize("scale", [0.05, 1.0, 1000.0])
def test_the_scale_of_the_scene_does_not_matter(scale: float, hulls):
    """From a scene of 2 cm to one of 450 m, near the world's origin and far from it."""
    camera, views = (
        hulls.CAMERAS["brown"],
        hulls.views_of(hulls.shape("L"), hulls.CAMERAS["brown"], hulls.round_about(4)),
    )
    expected = visual_hull(views)
    away = np.array([2000.0, -1000.0, 300.0]) * scale
    grown = [
        View(
            v.frame,
            camera,
            rigid_transform.from_rotation(v.T_world_camera[:3, :3], scale * v.T_world_camera[:3, 3] + away),
            v.polygons,
        )
        for v in views
    ]
    hull = visual_hull(grown)
    assert hull.volume == pytest.approx(expected.volume * scale**3, rel=1e-6)
    np.testing.assert_allclose((hull.centre_of_mass - away) / scale, expected.centre_of_mass, atol=1e-7)


def test_a_camera_close_by_and_one_far_away_work_together(hulls):
    mesh = hulls.shape("box")
    far = Camera(1000, 1000, 150_000.0, 150_000.0, 499.5, 499.5)
    views = [
        hulls.view_of(0, hulls.CAMERAS["wide"], hulls.looking((0.15, 0.02, 0.05)), mesh),
        hulls.view_of(1, far, hulls.looking((0, 40, 3)), mesh),
        hulls.view_of(2, far, hulls.looking((5, -3, 50)), mesh),
    ]
    hull = visual_hull(views)
    assert hulls.wrong(hull, views) == 0
    assert 1 < hull.volume / mesh.volume < 1.5


def test_the_order_of_views_does_not_matter(hulls):
    views = hulls.views_of(hulls.shape("torus"), hulls.CAMERAS["brown"], hulls.round_about(5))
    one, other = visual_hull(views), visual_hull(views[::-1])
    assert one.volume == pytest.approx(other.volume, rel=1e-9)
    np.testing.assert_allclose(one.centre_of_mass, other.centre_of_mass, atol=1e-9)


def test_outlines_of_many_corners_are_simplified_without_loss_of_volume(hulls):
    views = hulls.views_of(hulls.shape("sphere"), hulls.CAMERAS["pinhole"], hulls.round_about(4))
    dense = [View(v.frame, v.camera, v.T_world_camera, (Polygon(smooth(v.polygons[0].outer)),)) for v in views]
    assert len(dense[0].polygons[0].outer) > 1000
    hull = visual_hull(dense)
    assert len(hull.vertices) < 1000
    assert hull.volume == pytest.approx(visual_hull(views).volume, rel=0.005)


def smooth(ring: np.ndarray) -> np.ndarray:
    return shapely.get_coordinates(shapely.segmentize(shapely.Polygon(ring), 0.3))[:-1]


def test_a_band_is_the_cone_of_one_view_between_two_depths(hulls):
    view = hulls.view_of(0, hulls.CAMERAS["pinhole"], hulls.looking((0.5, 0, 0)), hulls.shape("sphere"))
    cone = band([view], depth=(0.2, 3.0))
    assert is_closed(cone)
    along = (cone.vertices - view.T_world_camera[:3, 3]) @ view.T_world_camera[:3, 2]
    assert [along.min(), along.max()] == pytest.approx([0.2, 3.0])
    # A ball of 0.05 m at 0.5 m: its cone is 0.05 / sqrt(0.5^2 - 0.05^2) of the depth wide.
    slope = 0.05 / math.sqrt(0.5**2 - 0.05**2)
    assert cone.volume == pytest.approx(math.pi * slope**2 * (3.0**3 - 0.2**3) / 3, rel=0.01)


def test_a_band_of_two_views_is_their_hull_where_that_ends(hulls):
    views = hulls.views_of(hulls.shape("L"), hulls.CAMERAS["brown"], hulls.round_about(2))
    assert band(views, depth=(0.05, 5.0)).volume == pytest.approx(visual_hull(views).volume, rel=1e-6)
    with pytest.raises(ViewsDisagree):
        band([views[0], shifted(views[1], 0, 120)], depth=(0.05, 5.0))


def test_a_band_of_an_open_mask_ends_where_it_was_drawn_and_little_beyond(hulls):
    camera = hulls.CAMERAS["pinhole"]
    cut = Polygon(np.array([[0.0, 200.0], [60.0, 200.0], [60.0, 280.0], [0.0, 280.0]]))
    cone = band([View(0, camera, hulls.looking((0.5, 0, 0)), (cut,))], depth=(0.2, 1.0))
    assert is_closed(cone)
    assert cone.volume > 0


@pytest.mark.parametrize("depth", [(0.0, 1.0), (2.0, 1.0), (0.1, math.inf), (math.nan, 1.0)])
def test_depths_of_a_band_are_two_positive_numbers(depth: tuple[float, float], hulls):
    view = hulls.view_of(0, hulls.CAMERAS["pinhole"], hulls.looking((0.5, 0, 0)), hulls.shape("sphere"))
    with pytest.raises(BadInput, match="depths must be two positive numbers"):
        band([view], depth=depth)


def test_the_angle_between_views_is_that_of_the_two_furthest_apart(hulls):
    sphere = hulls.shape("sphere")
    eyes = [hulls.looking((0.5, 0, 0)), hulls.looking((0.5, 0.5, 0)), hulls.looking((0, 0.7, 0))]
    views = hulls.views_of(sphere, hulls.CAMERAS["pinhole"], eyes)
    assert angle_between(views, np.zeros(3)) == pytest.approx(math.pi / 2)
    assert angle_between(views[:2], np.zeros(3)) == pytest.approx(math.pi / 4)
    assert angle_between(views[:1], np.zeros(3)) == 0.0


@settings(max_examples=30)
@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(2, 6),
    size=st.floats(0.01, 0.1),
    lens=st.sampled_from(["pinhole", "brown", "wide", "fisheye"]),
)
def test_random_scenes(seed: int, count: int, size: float, lens: str, hulls):
    """A lump, cameras anywhere round it that see any part of it: no wrong point, or an error that names views."""
    random = np.random.default_rng(seed)
    lump = trimesh.convex.convex_hull(random.normal(size=(12, 3)) * size)
    camera = hulls.CAMERAS[lens]
    views: list[View] = []
    while len(views) < count:
        eye = random.normal(size=3)
        eye *= random.uniform(0.35, 2.0) / np.linalg.norm(eye)
        view = hulls.view_of(len(views), camera, hulls.looking(eye, random.normal(size=3) * 0.1), lump)
        if view.polygons:
            views.append(view)
    try:
        hull = visual_hull(views)
    except ViewsDisagree as error:
        said = str(error)
        event("refused")
    else:
        said = ""
        check_random_hull(hull, views, random.normal(size=(60, 3)) * size, lump, hulls)
    assert "nearly the same side" in said or "leave open" in said or not said


def check_random_hull(hull: VisualHull, views: list[View], around: np.ndarray, lump, hulls) -> None:
    assert is_closed(hull)
    around = np.concatenate([around, np.asarray(lump.vertices)])
    asked = hulls.ask(views, around)
    clear = asked.margin > 1.0
    within = hulls.inside(hull, around)
    assert not (within & ~asked.possible)[clear].any()
    # With fewer whole outlines, where the hull ends is a guess.
    whole = [all((p.outer > 1).all() and (p.outer < [639, 479]).all() for p in view.polygons) for view in views]
    if sum(whole) >= 2 or all(whole):
        np.testing.assert_array_equal(within[clear], asked.possible[clear])
