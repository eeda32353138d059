"""What people type for lengths and angles, read by the page's own code in a real browser."""

from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser, Page

from tests.browser.conftest import TOKEN, Shelf


@pytest.fixture(scope="module")
def module(shelf: Shelf, browser: Browser) -> Iterator[Page]:
    """A page that may import the page's modules."""
    context = browser.new_context()
    assert context.request.post(f"{shelf.base}/login", data={"token": TOKEN}).ok
    page = context.new_page()
    page.goto(shelf.base)
    yield page
    context.close()


def read(page: Page, text: str, kind: str = "length") -> dict[str, Any]:
    return page.evaluate(
        "async ([text, kind]) => (await import('/static/lib/quantity.js')).parseQuantity(text, kind)", [text, kind]
    )


def called(page: Page, function: str, *arguments: object) -> str:
    return page.evaluate(
        "async ([name, given]) => (await import('/static/lib/quantity.js'))[name](...given)", [function, arguments]
    )


@pytest.mark.parametrize(
    ("text", "metres"),
    [
        ("85", 0.085),
        ("85 mm", 0.085),
        ("8.5cm", 0.085),
        ("8,5 cm", 0.085),
        ("0.085 m", 0.085),
        ("0,085 m", 0.085),
        (" 85\u00a0MM ", 0.085),
        ("85/2", 0.0425),
        ("85/2 mm", 0.0425),  # half of 85 mm: the unit is the whole product's
        ("85/2*3 cm", 1.275),
        ("85 mm / 2", 0.0425),
        ("2*85mm", 0.17),
        ("(10+5)*2", 0.03),
        ("((1))", 0.001),
        ("(10+5) cm", 0.15),
        ("85.0+1cm", 0.095),  # a number without a unit is in what the field shows
        ("1 m - 15", 0.985),
        ("100*(85mm/170mm)", 0.05),
        ("10-2-3", 0.005),
        ("12/2/3", 0.002),
        ("2+3*4", 0.014),
        ("-60", -0.06),
        ("\u221260", -0.06),
        ("--5", 0.005),
        ("2*-3", -0.006),
        ("3\u00d74", 0.012),
        ("12:4", 0.003),
        (".5", 0.0005),
        ("5.", 0.005),
        ("1e3", 1.0),
        ("1234,5", 1.2345),
        ("12,345 ", None),
        ("0,123", 0.000123),
    ],
)
def test_a_length(module: Page, text: str, metres: float | None) -> None:
    parsed = read(module, text)
    if metres is None:
        assert not parsed["ok"]
    else:
        assert parsed == {"ok": True, "value": metres}


@pytest.mark.parametrize(
    ("text", "degrees"),
    [("12", 12), ("12°", 12), ("12.5 deg", 12.5), ("-33,5°", -33.5), ("90/4", 22.5), ("180°-33", 147), ("2 rad", 360)],
)
def test_an_angle(module: Page, text: str, degrees: float) -> None:
    parsed = read(module, text, "angle")
    expected = degrees if "rad" not in text else 2 * 180 / 3.141592653589793
    assert parsed == {"ok": True, "value": pytest.approx(expected, abs=1e-12)}


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "Type a length, such as 85, 8.5 cm or 85/2."),
        ("  ", "Type a length, such as 85, 8.5 cm or 85/2."),
        ("5 kg", "“kg” is not a unit of length; use mm, cm or m."),
        ("5 constructor", "“constructor” is not a unit of length; use mm, cm or m."),
        ("12°", "“°” is not a unit of length; use mm, cm or m."),
        ("mm", "There is no number before “mm”."),
        ("5 mm mm", "“mm” is one unit too many."),
        ("(5 mm) cm", "“cm” is one unit too many."),
        ("5mm*5mm", "A length times a length is not a length."),
        ("5/(2mm)", "A number divided by a length is not a length."),
        ("1/0", "Nothing can be divided by 0."),
        ("5+", "Something is missing at the end."),
        ("*5", "There is no number before “*”."),
        ("(5", "There is a ( without its )."),
        ("5)", "There is a ) without its (."),
        ("5 5", "“5” is not expected there; is a sign such as + missing?"),
        ("1.2.3", "“1.2.3” has more than one decimal point."),
        ("1,234", "“1,234” can be read in two ways; type 1234 or 1.234."),
        ("1,234.5", "“1,234.5” has more than one decimal point."),
        ("5?", "“?” cannot be read; type numbers, units and + - * / ( )."),
        ("alert(1)", "There is no number before “alert”."),
        ("1e400", "“1e400” is too large."),
        ("1e200*1e200", "The result is too large."),
        ("1" * 101, "At most 100 characters can be read."),
    ],
)
def test_what_cannot_be_read_is_said_in_words(module: Page, text: str, problem: str) -> None:
    assert read(module, text) == {"ok": False, "problem": problem}


def test_brackets_as_deep_as_the_text_may_be_long_are_read(module: Page) -> None:
    assert read(module, "(" * 49 + "5" + ")" * 49) == {"ok": True, "value": 0.005}


def test_the_words_for_angles_are_of_angles(module: Page) -> None:
    assert read(module, "5 mm", "angle")["problem"] == "“mm” is not a unit of angle; use ° or rad."
    assert read(module, "", "angle")["problem"] == "Type an angle, such as 12, 12.5° or 90/4."
    assert read(module, "2°*3°", "angle")["problem"] == "An angle times an angle is not an angle."


@pytest.mark.parametrize(
    ("size", "text"),
    [
        ([0.085, 0.0850004, 0.0849996], "85 mm"),
        ([0.12, 0.08, 0.045], "120 \u00d7 80 \u00d7 45 mm"),
        ([0.0004, 0.001, 0.002], "0.4 \u00d7 1 \u00d7 2 mm"),
        ([2.5, 2.5, 2.5], "2500 mm"),
    ],
)
def test_a_size_in_a_list(module: Page, size: list[float], text: str) -> None:
    assert called(module, "sizeText", size) == text


def test_numbers_are_shown_without_a_sign_on_zero_and_with_the_decimals_that_they_have(module: Page) -> None:
    assert called(module, "millimetres", -0.00001) == "0.0"
    assert called(module, "millimetres", -0.215) == "-215.0"
    assert [called(module, "trimmed", value, 1, 3) for value in (85, 85.25, 85.12345)] == ["85.0", "85.25", "85.123"]
    assert called(module, "trimmed", 100, 0, 3) == "100"


def test_what_is_shown_while_editing_is_read_as_it_was(module: Page) -> None:
    for millimetres in (0, 0.001, 85, -215.037, 12345.678):
        shown = called(module, "trimmed", millimetres, 1, 3)
        assert read(module, shown)["value"] == pytest.approx(millimetres / 1000, abs=1e-15)
