"""Names are what files, pages and people can hold."""

import pytest

from ars_web.errors import BadInput, RefusedPath
from ars_web.sessions.names import LONGEST_NAME, FreshNames, checked_image_name, checked_key, checked_name


@pytest.mark.parametrize("name", ["", "  ", "a" * 101, "a\nb", "a\0b", "\ud800", "a\u2028b", "a\x7fb"])
def test_what_cannot_be_a_name_is_refused(name: str):
    with pytest.raises(BadInput, match="a class"):
        checked_name(name, what="a class")


@pytest.mark.parametrize("name", ["cube", "Würfel 3", "立方体", "a" * LONGEST_NAME, "<b>&"])
def test_what_people_write_is_a_name(name: str):
    assert checked_name(f" {name}\t", what="a class") == name


def test_a_taken_name_gets_the_next_number_and_stays_short_enough():
    assert FreshNames([]).give("cube") == "cube"
    names = FreshNames(["cube", "cube 2", "cube 4"])
    assert [names.give("cube") for _ in range(3)] == ["cube 3", "cube 5", "cube 6"]
    names.take("ring")
    assert names.give("ring") == "ring 2"
    long = "a" * LONGEST_NAME
    assert FreshNames([long]).give(long) == "a" * (LONGEST_NAME - 2) + " 2"


def test_a_copy_has_the_next_free_number():
    names = FreshNames(["cube", "cube 2", "ring 7", "3 balls", "nr 0", "x 1"])
    assert [names.give_copy(name) for name in ("cube", "cube", "cube 2", "ring 7", "3 balls", "nr 0", "x 1", "2")] == [
        "cube 3", "cube 4", "cube 5", "ring 8", "3 balls 2", "nr 0 2", "x 2", "2 2",
    ]  # fmt: skip
    long = "a" * LONGEST_NAME
    assert FreshNames([long]).give_copy(long) == "a" * (LONGEST_NAME - 2) + " 2"


def test_very_many_names_are_given_as_fast_as_few():
    names = FreshNames([])
    assert len({names.give("cube") for _ in range(100_000)}) == 100_000


@pytest.mark.parametrize("name", ["", "/etc/passwd", "../a.jpg", "a/../b.jpg", "a//b.jpg", "./a.jpg", "a/", "a\0.jpg"])
def test_an_image_name_never_leaves_its_folder(name: str):
    with pytest.raises(RefusedPath, match="cannot name an image"):
        checked_image_name(name)


def test_an_image_name_may_have_folders_and_blanks():
    assert checked_image_name("left cam/00 1.jpg") == "left cam/00 1.jpg"


@pytest.mark.parametrize("key", ["", "k" * 256, "a\nb"])
def test_what_cannot_be_an_idempotency_key_is_refused(key: str):
    with pytest.raises(BadInput, match="idempotency key"):
        checked_key(key)
