"""Roll, pitch and yaw as the page reckons them, in a real browser, held to SciPy's."""

from collections.abc import Iterator

import numpy as np
import pytest
from playwright.sync_api import Browser, Page
from scipy.spatial.transform import Rotation

from tests.browser.conftest import TOKEN, Shelf

EVERY = np.random.default_rng(7)


@pytest.fixture(scope="module")
def module(shelf: Shelf, browser: Browser) -> Iterator[Page]:
    """A page that may import the page's modules."""
    context = browser.new_context()
    assert context.request.post(f"{shelf.base}/login", data={"token": TOKEN}).ok
    page = context.new_page()
    page.goto(shelf.base)
    yield page
    context.close()


def wxyz_of(page: Page, angles: np.ndarray) -> np.ndarray:
    return np.array(
        page.evaluate(
            "async (all) => { const { wxyzOfAngles } = await import('/static/lib/rotation.js');"
            " return all.map((one) => wxyzOfAngles(one)); }",
            angles.tolist(),
        )
    )


def angles_of(page: Page, wxyz: np.ndarray, last: np.ndarray | None = None) -> np.ndarray:
    return np.array(
        page.evaluate(
            "async ([all, last]) => { const { anglesOfWxyz } = await import('/static/lib/rotation.js');"
            " return all.map((one, i) => anglesOfWxyz(one, last === null ? null : last[i])); }",
            [wxyz.tolist(), None if last is None else last.tolist()],
        )
    )


def rotation(angles: np.ndarray) -> Rotation:
    """R = Rz(yaw) Ry(pitch) Rx(roll): about the fixed axes x, then y, then z."""
    return Rotation.from_euler("xyz", angles, degrees=True)


def apart(a: Rotation, b: Rotation) -> float:
    """Radians, the largest."""
    return float(np.max((a.inv() * b).magnitude()))


def from_wxyz(wxyz: np.ndarray) -> Rotation:
    return Rotation.from_quat(wxyz, scalar_first=True)


ANYWHERE = EVERY.uniform([-180, -90, -180], [180, 90, 180], (200, 3))
NEAR_LOCK = np.array(
    [
        [roll, side * (90 - off), yaw]
        for roll in (-170.0, 0.0, 35.0)
        for side in (-1, 1)
        for off in (0.0, 1e-12, 1e-9, 1e-7, 1e-5, 1e-3)
        for yaw in (-33.0, 0.0, 120.0)
    ]
)


def test_quaternions_are_scipys_with_w_not_negative(module: Page) -> None:
    angles = np.concatenate([ANYWHERE, NEAR_LOCK, EVERY.uniform(-720, 720, (100, 3))])
    ours = wxyz_of(module, angles)
    assert (ours[:, 0] >= 0).all()
    np.testing.assert_allclose(np.linalg.norm(ours, axis=1), 1, atol=1e-15)
    assert apart(from_wxyz(ours), rotation(angles)) < 1e-14


def test_angles_are_scipys_where_there_is_one_answer(module: Page) -> None:
    wxyz = rotation(ANYWHERE).as_quat(canonical=True, scalar_first=True)
    np.testing.assert_allclose(angles_of(module, wxyz), ANYWHERE, atol=1e-9)


def test_angles_describe_the_rotation_at_every_pitch(module: Page) -> None:
    wxyz = rotation(NEAR_LOCK).as_quat(canonical=True, scalar_first=True)
    found = angles_of(module, wxyz)
    assert (np.abs(found[:, 1]) <= 90).all()
    assert apart(rotation(found), from_wxyz(wxyz)) < 2e-9


def test_angles_that_were_typed_stay_while_they_describe_the_rotation(module: Page) -> None:
    typed = np.concatenate([NEAR_LOCK, [[10, 100, 20], [350, 0, 0], [0, -90, 270], [180, 180, 180]]])
    # As the server answers: through a matrix and back.
    stored = Rotation.from_matrix(rotation(typed).as_matrix()).as_quat(canonical=True, scalar_first=True)
    np.testing.assert_array_equal(angles_of(module, stored, last=typed), typed)


@pytest.mark.parametrize("pitch", [90.0, -90.0])
def test_where_roll_and_yaw_turn_about_one_axis_the_roll_stays(module: Page, pitch: float) -> None:
    last = np.array([[25.0, pitch, 40.0]])
    turned = rotation(np.array([[25.0, pitch, 47.0]])).as_quat(canonical=True, scalar_first=True)
    np.testing.assert_allclose(angles_of(module, turned, last=last), [[25.0, pitch, 47.0]], atol=1e-6)


def test_a_turn_beyond_the_pole_does_not_make_the_angles_jump(module: Page) -> None:
    last = np.array([0.0, 80.0, 10.0])
    for pitch in np.arange(81.0, 101.0, 1.0):
        wxyz = rotation(np.array([[0.0, pitch, 10.0]])).as_quat(canonical=True, scalar_first=True)
        (found,) = angles_of(module, wxyz, last=last[None])
        np.testing.assert_allclose(found, [0.0, pitch, 10.0], atol=1e-6)
        last = found


def test_turning_further_is_scipys(module: Page) -> None:
    start = rotation(ANYWHERE[:50])
    turns = EVERY.uniform(-200, 200, (50, 3))
    for axes in ("box", "world"):
        found = np.array(
            module.evaluate(
                "async ([all, turns, axes]) => { const m = await import('/static/lib/rotation.js');"
                " return all.map((one, i) => m.rotatedByDegrees(one, turns[i], axes)); }",
                [start.as_quat(scalar_first=True).tolist(), turns.tolist(), axes],
            )
        )
        turn = Rotation.from_rotvec(turns, degrees=True)
        expected = start * turn if axes == "box" else turn * start
        assert (found[:, 0] >= 0).all()
        assert apart(from_wxyz(found), expected) < 1e-14


def test_vectors_are_turned_as_scipy_does(module: Page) -> None:
    vectors = EVERY.uniform(-2, 2, (200, 3))
    found = module.evaluate(
        "async ([all, vectors]) => { const m = await import('/static/lib/rotation.js');"
        " return all.map((one, i) => m.rotated(one, vectors[i])); }",
        [rotation(ANYWHERE).as_quat(scalar_first=True).tolist(), vectors.tolist()],
    )
    np.testing.assert_allclose(found, rotation(ANYWHERE).apply(vectors), atol=1e-14)
