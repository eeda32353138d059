import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ars_web.recordings.pose_checks import poses_from_matrices, poses_from_quaternions


def test_good_poses_have_no_problem() -> None:
    rotation = Rotation.random(20, random_state=1)
    position = np.random.default_rng(1).normal(size=(20, 3))
    by_quaternion = poses_from_quaternions(position, rotation.as_quat()[:, [3, 0, 1, 2]] * 1.005)
    matrices = np.tile(np.eye(4), (20, 1, 1))
    matrices[:, :3, :3], matrices[:, :3, 3] = rotation.as_matrix(), position
    by_matrix = poses_from_matrices(matrices)
    assert by_quaternion.problems == by_matrix.problems == {}
    np.testing.assert_allclose(by_quaternion.Ts, matrices, atol=1e-12)
    np.testing.assert_allclose(by_matrix.Ts, matrices, atol=1e-12)


@pytest.mark.parametrize(
    ("position", "wxyz", "problem"),
    [
        ([np.nan, 0, 0], [1, 0, 0, 0], "position nan 0 0 is not finite"),
        ([0, np.inf, 0], [1, 0, 0, 0], "position 0 inf 0 is not finite"),
        ([0, 1e9, 0], [1, 0, 0, 0], "beyond all maps"),
        ([0, 0, 0], [1, np.nan, 0, 0], "quaternion is not finite"),
        ([0, 0, 0], [0, 0, 0, 0], "length 0, not 1"),
        ([0, 0, 0], [1.02, 0, 0, 0], "length 1.02, not 1"),
        ([0, 0, 0], [1e200, 1e200, 0, 0], "length inf, not 1"),
    ],
)
def test_bad_quaternion_poses(position: list[float], wxyz: list[float], problem: str) -> None:
    good = [0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 0.0]
    poses = poses_from_quaternions(np.array([good[0], position, good[0]]), np.array([good[1], wxyz, good[1]]))
    assert list(poses.problems) == [1]
    assert problem in poses.problems[1]
    assert np.isfinite(poses.Ts).all()
    assert poses.Ts[2, 2, 3] == 1.0


def matrix(**changes: object) -> np.ndarray:
    T = np.eye(4)
    for name, value in changes.items():
        T[int(name[1]), int(name[2])] = value
    return T


@pytest.mark.parametrize(
    ("T", "problem"),
    [
        (matrix(m00=np.nan), "not finite"),
        (matrix(m03=np.inf), "position inf 0 0 is not finite"),
        (np.diag([2.0, 2.0, 2.0, 1.0]), "off the identity by 3 (is there a scale in it?)"),
        (matrix(m01=0.1), "not a rotation"),
        (np.diag([1.0, 1.0, -1.0, 1.0]), "reflection"),
        (matrix(m30=0.5), "last row must be 0 0 0 1, not [0.5, 0.0, 0.0, 1.0]"),
        (np.diag([1e200, 1.0, 1.0, 1.0]), "not a rotation"),
        (np.zeros((4, 4)), "last row"),
    ],
)
def test_bad_matrices(T: np.ndarray, problem: str) -> None:
    poses = poses_from_matrices(np.array([np.eye(4), T, np.eye(4)]))
    assert list(poses.problems) == [1]
    assert problem in poses.problems[1]
    np.testing.assert_array_equal(poses.Ts[1], np.eye(4))


def test_no_pose_at_all() -> None:
    assert poses_from_matrices(np.zeros((0, 4, 4))).Ts.shape == (0, 4, 4)
    assert poses_from_quaternions(np.zeros((0, 3)), np.zeros((0, 4))).Ts.shape == (0, 4, 4)
