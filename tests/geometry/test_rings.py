import numpy as np
from numpy.testing import assert_array_equal

from ars_web.geometry.rings import one_ring_each, rings_of

SQUARE = np.array([[0.0, 0], [0, 9], [9, 9], [9, 0]])
HOLE = np.array([[3.0, 3], [6, 3], [6, 6]])


def test_the_rings_of_each_label_come_back():
    labels = [[SQUARE, HOLE], [], [SQUARE + 20]]
    found = rings_of(labels)
    assert found.ring_starts.tolist() == [0, 4, 7, 11]
    assert found.label_starts.tolist() == [0, 2, 2, 3]
    for label, rings in enumerate(labels):
        assert len(found.of(label)) == len(rings)
        for one, other in zip(found.of(label), rings, strict=True):
            assert_array_equal(one, other)


def test_one_ring_a_label_or_none():
    points = np.concatenate([SQUARE, HOLE])
    found = one_ring_each(points, np.array([0, 0, 4, 4, 7, 7]))
    assert found.label_starts.tolist() == [0, 0, 1, 1, 2, 2]
    assert [len(found.of(label)) for label in range(5)] == [0, 1, 0, 1, 0]
    assert_array_equal(found.of(1)[0], SQUARE)
    assert_array_equal(found.of(3)[0], HOLE)


def test_no_labels_have_no_rings():
    assert rings_of([]).label_starts.tolist() == [0]
    assert one_ring_each(np.zeros((0, 2)), np.array([0])).ring_starts.tolist() == [0]
