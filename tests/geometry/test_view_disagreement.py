"""Which views are named, and with how many pixels, where no object fits the outlines."""

import math
import pickle

import numpy as np
import pytest
import shapely

from ars_web.errors import BadInput, ViewsDisagree
from ars_web.geometry.polygon import Polygon
from ars_web.geometry.visual_hull import View, visual_hull


def shifted(view: View, x: float, y: float) -> View:
    """The same outlines elsewhere in the image."""
    moved = tuple(Polygon(polygon.outer + np.array([x, y])) for polygon in view.polygons)
    return View(view.frame, view.camera, view.T_world_camera, moved)


def widened(view: View, px: float) -> View:
    outline = shapely.Polygon(view.polygons[0].outer).buffer(px)
    ring = shapely.get_coordinates(outline.exterior)[:-1]
    return View(view.frame, view.camera, view.T_world_camera, (Polygon(ring),))


def refused(views: list[View], **options: float) -> ViewsDisagree:
    with pytest.raises(ViewsDisagree) as raised:
        visual_hull(views, **options)
    return raised.value


@pytest.fixture
def ball_views(hulls):
    """`make(n)`: n views of a ball, numbered from 10."""

    def make(count: int, *, lens: str = "brown") -> list[View]:
        Ts = hulls.round_about(count)
        return [hulls.view_of(10 + i, hulls.CAMERAS[lens], T, hulls.shape("sphere")) for i, T in enumerate(Ts)]

    return make


@pytest.mark.parametrize("lens", ["pinhole", "brown", "fisheye"])
def test_two_outlines_that_do_not_meet_are_each_named_with_what_widening_would_do(lens: str, ball_views):
    views = ball_views(2, lens=lens)
    views[1] = shifted(views[1], 0, 95 if lens == "fisheye" else 150)
    error = refused(views)
    assert sorted(frame for frame, _ in error.misfits) == [10, 11]
    assert error.misfits[0][1] >= error.misfits[1][1] > 3
    for frame, px in error.misfits:
        i = frame - 10
        others = views[:i] + views[i + 1 :]
        assert visual_hull([*others, widened(views[i], px + 1.0)]).volume > 0
        assert refused([*others, widened(views[i], px - 1.0)]).misfits
        assert f"frame {frame}: {px:.1f} px" in str(error)


@pytest.mark.parametrize(("count", "shift"), [(5, 180), (8, 140), (16, 140)])
def test_one_bad_view_among_many_is_named_alone(count: int, shift: float, ball_views):
    views = ball_views(count)
    views[2] = shifted(views[2], 0, shift)
    error = refused(views)
    ((frame, px),) = error.misfits
    assert frame == 12
    # Of the shift, what is beyond the ball's own width.
    assert 5 < px < 100
    assert "frame 12" in str(error)
    assert "frame 11" not in str(error)
    others = views[:2] + views[3:]
    assert visual_hull(others).volume > 0
    assert visual_hull([*others, widened(views[2], px + 1.0)]).volume > 0
    # Also where it is off by no more than a pixel.
    ((frame, left),) = refused([*others, widened(views[2], px - 1.0)]).misfits
    assert frame == 12
    assert left == pytest.approx(1.0, abs=0.1)


def test_two_bad_views_among_many_are_both_named(ball_views):
    views = ball_views(8)
    views[1], views[6] = shifted(views[1], 0, 140), shifted(views[6], 0, -110)
    error = refused(views)
    assert {frame for frame, _ in error.misfits} == {11, 16}
    assert error.misfits[0][1] >= error.misfits[1][1] > 0


def test_an_object_behind_a_camera_has_no_misfit(ball_views, hulls):
    views = ball_views(2)
    away = np.diag([-1.0, 1.0, -1.0, 1.0])
    behind = View(11, views[1].camera, views[1].T_world_camera @ away, views[1].polygons)
    error = refused([views[0], behind])
    frame, px = error.misfits[0]
    assert frame == 11
    assert math.isnan(px)
    assert "frame 11: the others put the object behind its camera" in str(error)

    views = ball_views(6)
    views[3] = View(13, views[3].camera, views[3].T_world_camera @ away, views[3].polygons)
    ((frame, px),) = refused(views).misfits
    assert frame == 13
    assert math.isnan(px)


@pytest.mark.parametrize("degrees", [[0, 0.5], [0, 3], [0, 2, 4]])
def test_views_from_one_side_only_are_refused(degrees: list[float], hulls):
    turns = np.radians(degrees)
    Ts = [hulls.looking((0.45 * math.cos(turn), 0.45 * math.sin(turn), 0)) for turn in turns]
    views = hulls.views_of(hulls.shape("sphere"), hulls.CAMERAS["brown"], Ts)
    error = refused(views)
    assert [frame for frame, _ in error.misfits] == list(range(len(views)))
    assert all(math.isnan(px) for _, px in error.misfits)
    assert f"{degrees[-1]:.1f} degrees apart where 5 are needed" in str(error)
    # One more from another side, and they are of use.
    more = hulls.view_of(9, hulls.CAMERAS["brown"], hulls.looking((0, 0.45, 0.1)), hulls.shape("sphere"))
    assert visual_hull([*views, more]).volume > 0


def test_views_a_little_further_apart_are_taken(hulls):
    Ts = [hulls.looking((2 * math.cos(turn), 2 * math.sin(turn), 0)) for turn in np.radians([0, 6])]
    views = hulls.views_of(hulls.shape("sphere"), hulls.CAMERAS["pinhole"], Ts)
    assert visual_hull(views).volume > 5 * hulls.shape("sphere").volume


def test_frames_of_one_place_are_refused(hulls):
    mesh, T = hulls.shape("sphere"), hulls.looking((0.45, 0, 0))
    turned = hulls.looking((0.45, 0, 0), at=(0, 0.1, 0))
    error = refused(hulls.views_of(mesh, hulls.CAMERAS["pinhole"], [T, turned]))
    assert "were taken at one place" in str(error)
    assert [frame for frame, _ in error.misfits] == [0, 1]


def test_outlines_that_fill_the_views_leave_the_object_without_an_end(hulls):
    """From so near, both outlines have directions in common: what is there may be as far away as one likes."""
    eyes = [hulls.looking((0.09, 0, 0)), hulls.looking((0.08, 0.04, 0))]
    error = refused(hulls.views_of(hulls.shape("sphere"), hulls.CAMERAS["fisheye"], eyes))
    assert "leave open how far away the object ends" in str(error)
    assert [frame for frame, _ in error.misfits] == [0, 1]


def test_the_error_survives_the_way_to_another_process(ball_views):
    views = ball_views(8)
    views[2] = shifted(views[2], 0, 130)
    error = refused(views)
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error)
    assert again.misfits == error.misfits


def test_widening_mends_a_disagreement(ball_views):
    views = ball_views(8)
    views[2] = shifted(views[2], 0, 130)
    ((_, px),) = refused(views).misfits
    # All masks are widened, so that less is enough.
    assert visual_hull(views, widen=px + 1).volume > 0
    assert refused(views, widen=px / 8).misfits[0][1] < px


def test_a_mask_that_shows_another_object_at_the_border_is_named(ball_views, hulls):
    views = ball_views(5)
    strip = Polygon(np.array([[0.0, 20.0], [40.0, 20.0], [40.0, 90.0], [0.0, 90.0]]))
    views[4] = View(14, views[4].camera, views[4].T_world_camera, (strip,))
    ((frame, px),) = refused(views).misfits
    assert frame == 14
    assert px > 50


@pytest.mark.parametrize(
    ("ring", "said"),
    [
        ([[10.0, 10.0], [50.0, 50.0], [90.0, 90.0]], "outline in frame 11 encloses nothing"),
        ([[10.0, 10.0], [10.0, 10.0], [10.0, 10.0]], "outline in frame 11 encloses nothing"),
        ([[700.0, 10.0], [720.0, 10.0], [720.0, 50.0]], "outline in frame 11 lies outside the 640 x 480 pixels"),
    ],
)
def test_outlines_without_an_area_in_the_image_are_refused(ring: list[list[float]], said: str, ball_views):
    one, other = ball_views(2)
    with pytest.raises(BadInput, match=said):
        visual_hull([one, View(11, other.camera, other.T_world_camera, (Polygon(np.array(ring)),))])
    with pytest.raises(BadInput, match="outline in frame 11 encloses nothing"):
        visual_hull([one, View(11, other.camera, other.T_world_camera, ())])


def test_two_frames_are_needed_each_once(ball_views):
    one, other = ball_views(2)
    with pytest.raises(BadInput, match="outlines in two frames at least, not 1"):
        visual_hull([one])
    with pytest.raises(BadInput, match="frame 10 is given twice"):
        visual_hull([one, other, one])


@pytest.mark.parametrize("widen", [-1.0, math.nan, math.inf, 5000.0])
def test_masks_are_widened_by_a_sane_number_of_pixels(widen: float, ball_views):
    with pytest.raises(BadInput, match="can be widened by 0 to 1000 pixels"):
        visual_hull(ball_views(2), widen=widen)


def test_an_outline_of_a_pixel_or_two_is_enough(ball_views):
    one, other = ball_views(2)
    # The ball's middle in both images.
    middle = np.mean(shapely.Polygon(one.polygons[0].outer).centroid.coords[0]), None
    assert middle[0] > 0
    tiny = [
        View(v.frame, v.camera, v.T_world_camera, (square_at(shapely.Polygon(v.polygons[0].outer).centroid),))
        for v in (one, other)
    ]
    hull = visual_hull(tiny)
    assert np.ptp(hull.vertices, axis=0).max() < 0.005
    np.testing.assert_allclose(hull.centre_of_mass, 0.0, atol=2e-3)


def square_at(point: shapely.Point) -> Polygon:
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    return Polygon(corners + np.array([point.x, point.y]))
