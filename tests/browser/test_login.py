"""Logging in by the token leads back to where one wanted to go, and nowhere else."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.browser.conftest import TOKEN, Shelf

SESSION = "/sessions/abcdefghijk1"


@pytest.fixture
def base(shelf: Shelf) -> str:
    return shelf.base


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    context = browser.new_context()
    yield context.new_page()
    context.close()


@pytest.mark.parametrize(
    ("asked", "leads_to"),
    [
        ("/", "/"),
        (SESSION, SESSION),
        (f"/login?code=used&next={SESSION}", SESSION),
        ("/login?code=used&next=//evil.example", "/"),
        ("/login?code=used&next=/%5Cevil.example", "/"),
        ("/login?code=used&next=javascript:alert(1)", "/"),
        (f"/login?code=used&next={SESSION}/../../api/sessions", "/"),
    ],
)
def test_the_token_leads_to_where_one_wanted_to_go(base: str, page: Page, asked: str, leads_to: str) -> None:
    page.goto(base + asked)
    page.get_by_label("Or enter the token").fill(TOKEN)
    page.get_by_role("button", name="Log in").click()
    expect(page).to_have_url(re.compile(re.escape(base + leads_to) + r"(\?.*)?$"))
    expect(page.get_by_role("heading", name="Log in")).to_have_count(0)


def test_the_one_time_url_of_the_demo_leads_to_its_page(served, page: Page, tmp_path: Path) -> None:
    with served(tmp_path / "sessions") as (_, login):
        page.goto(f"{login}&next={SESSION}")
        assert page.url == login.partition("/login")[0] + SESSION  # the code is gone from the address
