"""Which image a name means."""

import pytest

from ars_web.errors import BadInput
from ars_web.evaluation.image_names import ImageNames, stem_of

NAMES = ImageNames(
    ["images/val/1.jpg", "images/val/2.jpg", "images/train/2.jpg", "a/frame.01.png", "b/x.jpg", "b/x.png"]
)


@pytest.mark.parametrize(
    ("name", "place"),
    [
        ("1.jpg", 0),
        ("1", 0),
        ("val/1", 0),
        ("./images/val/1.jpg", 0),
        ("/data/set/images/val/1.jpg", 0),
        ("/data/set/images/val/1", 0),
        ("val\\2.jpg", 1),
        ("train/2", 2),
        ("frame.01", 3),
        ("1.png", 0),
        ("x.png", 5),
    ],
)
def test_a_name_means_the_image_that_ends_so(name: str, place: int) -> None:
    assert NAMES.place(name) == place


@pytest.mark.parametrize("name", ["3.jpg", "train/1.jpg", "mages/val/1.jpg", "01.png", "", "/"])
def test_another_name_means_none(name: str) -> None:
    with pytest.raises(BadInput, match="is not among the truth's 6"):
        NAMES.place(name)


@pytest.mark.parametrize("name", ["2.jpg", "2", "x"])
def test_a_name_of_several_images_means_none(name: str) -> None:
    with pytest.raises(BadInput, match="may be any of several of the truth; name it with its folder"):
        NAMES.place(name)


def test_stems_lose_an_images_ending_only() -> None:
    assert [stem_of(name) for name in ("a.JPG", "frame.01", "frame.01.png", ".jpg")] == [
        "a",
        "frame.01",
        "frame.01",
        ".jpg",
    ]
