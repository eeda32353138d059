"""Places spread evenly."""

from ars_web.geometry.even_spacing import evenly


def test_even_spacing_takes_the_middles_of_equal_stretches() -> None:
    assert evenly(10, 5).tolist() == [1, 3, 5, 7, 9]
    assert evenly(3, 9).tolist() == [0, 1, 2]
    assert evenly(0, 4).tolist() == []
    assert evenly(7, 0).tolist() == []
    assert evenly(100, 1).tolist() == [50]
