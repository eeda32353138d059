import re

from hypothesis import given
from hypothesis import strategies as st

from ars_web.datasets.file_names import LONGEST, safe, stems


def test_ordinary_names_keep_their_stem() -> None:
    assert stems(["000001.jpg", "rgb/a-b_c.PNG", "1341845688.562017.png", "1341845688.5620"]) == [
        "000001",
        "rgb_a-b_c",
        "1341845688.562017",
        "1341845688.5620",
    ]


def test_names_that_would_coincide_are_told_apart() -> None:
    assert stems(["a/b.jpg", "a_b.jpg", "A_B.jpg", "a_b.png", "a_b-2.jpg"]) == [
        "a_b",
        "a_b-2",
        "A_B-3",
        "a_b-4",
        "a_b-2-2",
    ]


def test_a_name_does_not_depend_on_the_names_after_it() -> None:
    names = ["x.jpg", "y/x.jpg", "x.png"]
    assert stems(names)[:2] == stems(names[:2])


def test_strange_names_become_harmless() -> None:
    assert safe("../../etc/passwd") == "_._.._etc_passwd"
    assert safe("-rf") == "_rf"
    assert safe(".hidden") == "_hidden"
    assert safe("") == "_"
    assert safe("...") == "_"
    assert safe("straße 1") == "stra_e_1"
    assert len(safe("x" * 1000)) == LONGEST


@given(st.lists(st.text(max_size=20), max_size=30))
def test_all_stems_are_unique_plain_components(names: list[str]) -> None:
    found = stems(names)
    assert len({stem.lower() for stem in found}) == len(names)
    assert all(re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9._-]*", stem) and not stem.endswith(".") for stem in found)
