"""Names are what files, pages and people can hold."""

import pytest

from ars_web.errors import BadInput, RefusedPath
from ars_web.sessions.names import LONGEST_NAME, checked_image_name, checked_key, checked_name, unused_name


@pytest.mark.parametrize("name", ["", "  ", "a" * 101, "a\nb", "a\0b", "\ud800", "a\u2028b", "a\x7fb"])
def test_what_cannot_be_a_name_is_refused(name: str):
    with pytest.raises(BadInput, match="a class"):
        checked_name(name, what="a class")


@pytest.mark.parametrize("name", ["cube", "Würfel 3", "立方体", "a" * LONGEST_NAME, "<b>&"])
def test_what_people_write_is_a_name(name: str):
    assert checked_name(f" {name}\t", what="a class") == name


def test_a_taken_name_gets_the_next_number_and_stays_short_enough():
    assert unused_name("cube", []) == "cube"
    assert unused_name("cube", ["cube", "cube 2", "cube 4"]) == "cube 3"
    long = "a" * LONGEST_NAME
    assert unused_name(long, [long]) == "a" * (LONGEST_NAME - 2) + " 2"


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
