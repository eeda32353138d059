"""The token file, the login codes, the cookies."""

import os
import stat
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from ars_web.api import credentials
from ars_web.api.credentials import CODE_LIFETIME, COOKIE_LIFETIME, Cookies, LoginCodes, install_token
from ars_web.errors import StoreError


def test_the_token_is_made_once_and_only_for_its_owner(tmp_path: Path) -> None:
    before = os.umask(0)
    try:
        token = install_token(tmp_path)
    finally:
        os.umask(before)
    file = tmp_path / ".token"
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert len(token) >= 43
    assert install_token(tmp_path) == token
    assert [entry.name for entry in tmp_path.iterdir()] == [".token"]


def test_servers_that_start_together_agree_on_one_token(tmp_path: Path) -> None:
    with ThreadPoolExecutor(8) as pool:
        tokens = set(pool.map(install_token, [tmp_path] * 32))
    assert len(tokens) == 1
    assert [entry.name for entry in tmp_path.iterdir()] == [".token"]


@pytest.mark.parametrize("mode", [0o644, 0o640, 0o660, 0o606, 0o620])
def test_a_token_that_others_can_read_or_write_is_refused(tmp_path: Path, mode: int) -> None:
    install_token(tmp_path)
    (tmp_path / ".token").chmod(mode)
    with pytest.raises(StoreError, match=rf"mode {mode:03o}.*chmod 600"):
        install_token(tmp_path)


def test_a_token_file_that_is_a_link_is_refused(tmp_path: Path) -> None:
    (tmp_path / "known-to-others").write_text("known\n")
    (tmp_path / "known-to-others").chmod(0o600)
    (tmp_path / ".token").symlink_to("known-to-others")
    with pytest.raises(StoreError, match=r"\.token"):
        install_token(tmp_path)


def test_a_link_to_nowhere_is_not_written_through(tmp_path: Path) -> None:
    (tmp_path / ".token").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(StoreError):
        install_token(tmp_path)
    assert not (tmp_path / "elsewhere").exists()


@pytest.mark.parametrize("content", ["", "\n", "two words\n", "not ascii: ü\n", "a\nb\n"])
def test_a_file_without_a_token_is_refused(tmp_path: Path, content: str) -> None:
    (tmp_path / ".token").write_text(content)
    (tmp_path / ".token").chmod(0o600)
    with pytest.raises(StoreError, match="holds no token"):
        install_token(tmp_path)


def test_a_killed_start_leaves_no_half_written_token(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def killed(descriptor: int) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(credentials.os, "fsync", killed)
    with pytest.raises(KeyboardInterrupt):
        install_token(tmp_path)
    assert not (tmp_path / ".token").exists()


def test_a_code_works_once() -> None:
    codes = LoginCodes()
    code, other = codes.issue(), codes.issue()
    assert code != other
    assert not codes.redeem("")
    assert not codes.redeem(code + "x")
    assert codes.redeem(code)
    assert not codes.redeem(code)
    assert codes.redeem(other)


def test_a_code_works_for_a_quarter_of_an_hour() -> None:
    now = 1000.0
    codes = LoginCodes(clock=lambda: now)
    fresh, stale = codes.issue(), codes.issue()
    now += CODE_LIFETIME - 1
    assert codes.redeem(fresh)
    now += 1
    assert not codes.redeem(stale)


def test_of_many_who_redeem_a_code_at_once_one_gets_in() -> None:
    codes = LoginCodes()
    code = codes.issue()
    with ThreadPoolExecutor(8) as pool:
        assert sum(pool.map(codes.redeem, [code] * 64)) == 1


def test_a_cookie_names_its_browser_until_it_expires() -> None:
    now = 1000.0
    cookies = Cookies("token", clock=lambda: now)
    value = cookies.issue()
    browser = cookies.browser(value)
    assert browser
    assert cookies.browser(cookies.issue(browser)) == browser
    now += COOKIE_LIFETIME - 1
    assert cookies.browser(value) == browser
    now += 1
    assert cookies.browser(value) is None


def test_a_cookie_does_not_hold_the_token() -> None:
    assert "sesame" not in Cookies("sesame").issue()
