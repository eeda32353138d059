"""From a one-time URL, or the token, to the page."""

import httpx
import pytest

SESSION = "/sessions/abcdefghijk1"


def test_a_one_time_url_logs_in_once(server) -> None:
    code = server.services.codes.issue()
    with server.stranger() as client:
        answer = client.get("/login", params={"code": code})
        assert (answer.status_code, answer.headers["location"]) == (303, "/")
        cookie = answer.headers["set-cookie"].lower()
        assert "httponly" in cookie
        assert "samesite=strict" in cookie
        assert "path=/" in cookie
        assert answer.headers["cache-control"] == "no-store"
        assert "Log in" not in client.get("/").text
        assert client.get("/api/sessions").status_code == 200
    with server.stranger() as other:
        assert other.get("/login", params={"code": code}).status_code == 403
        assert "set-cookie" not in other.get("/login", params={"code": code}).headers
        assert other.get("/api/sessions").status_code == 401


def test_a_wrong_code_is_not_reflected(server) -> None:
    with server.stranger() as client:
        for code in ("", "<script>alert(1)</script>", "x" * 100):
            answer = client.get("/login", params={"code": code})
            assert answer.status_code == 403
            assert "script>alert" not in answer.text
            assert "Log in" in answer.text
        assert client.get("/login").status_code == 403
        assert client.get("/login", params={"code": "x" * 5000}).status_code == 422


def test_the_token_logs_in_too(server) -> None:
    with server.stranger(Origin=server.url) as client:
        wrong = client.post("/login", json={"token": "wrong"})
        assert wrong.status_code == 401
        assert "set-cookie" not in wrong.headers
        assert client.post("/login", json={"token": server.services.door.token}).status_code == 204
        assert client.get("/api/sessions").status_code == 200


def test_another_origin_cannot_log_a_browser_in(server) -> None:
    with server.stranger(Origin="http://evil.example") as client:
        assert client.post("/login", json={"token": server.services.door.token}).status_code == 403


def test_a_browser_that_logs_in_again_stays_who_it_was(server) -> None:
    """So it can still undo what it did before."""
    door = server.services.door
    with server.stranger() as client:
        names = []
        for _ in range(2):
            client.get("/login", params={"code": server.services.codes.issue()})
            names.append(door.cookies.browser(client.cookies[door.cookie_name]))
    assert names[0]
    assert names[0] == names[1]
    with server.stranger() as other:
        other.get("/login", params={"code": server.services.codes.issue()})
        assert door.cookies.browser(other.cookies[door.cookie_name]) not in names


def test_pages_are_files_of_the_page_and_nothing_else(client: httpx.Client) -> None:
    for path in (
        "/static/../pyproject.toml",
        "/static/..%2fpyproject.toml",
        "/static/%2e%2e/ars_web/app.py",
        "/static/",
    ):
        assert client.get(httpx.URL(client.base_url, raw_path=path.encode())).status_code in (401, 404), path
    assert client.get("/static/main.js").headers["content-type"].startswith("text/javascript")


def test_a_one_time_url_leads_to_the_session_that_it_names(server) -> None:
    with server.stranger() as client:
        asked = {"code": server.services.codes.issue(), "next": SESSION}
        answer = client.get("/login", params=asked)
        assert (answer.status_code, answer.headers["location"]) == (303, SESSION)
        assert "set-cookie" in answer.headers
        # Who opens it again, and is logged in by now, goes on, too.
        again = client.get("/login", params=asked)
        assert (again.status_code, again.headers["location"]) == (303, SESSION)
        assert "set-cookie" not in again.headers
    with server.stranger() as other:
        assert other.get("/login", params=asked).status_code == 403


@pytest.mark.parametrize(
    "elsewhere",
    [
        "//evil.example",
        "//evil.example/sessions/abcdefghijk1",
        "/\\evil.example",
        "\\\\evil.example",
        "https://evil.example",
        "https:evil.example",
        "javascript:alert(1)",
        "/sessions/abcdefghijk1/../../login",
        "/sessions/abcdefghijk1\n",
        "/sessions/abcdefghijk1\r\nLocation: https://evil.example",
        "/sessions//evil.example",
        "/sessions/abcdefghijk1@evil.example",
        "/sessions/ABCDEFGHIJK1",
        "sessions/abcdefghijk1",
        " /sessions/abcdefghijk1",
        "/sessions/%2e%2e/x",
        "/api/sessions",
        "/login?code=x",
        "",
        "x" * 100_000,
    ],
)
def test_a_login_leads_nowhere_else(server, elsewhere: str) -> None:
    with server.browser() as client:
        answer = client.get("/login", params={"code": "", "next": elsewhere[:10_000]})
        assert (answer.status_code, answer.headers["location"]) == (303, "/")
        assert "evil" not in str(answer.headers)


def test_a_sessions_page_is_open_as_the_list_is(server, sid: str) -> None:
    """It holds nothing of the session, and does not say whether there is one."""
    with server.stranger() as client:
        there, not_there = client.get(f"/sessions/{sid}"), client.get(SESSION)
        assert (there.status_code, there.text) == (200, client.get("/").text)
        assert "Log in" in there.text
        assert (not_there.status_code, not_there.text) == (200, there.text)
        assert there.headers["cache-control"] == "no-store"
        assert client.post(f"/sessions/{sid}").status_code == 405
    with server.browser() as client:
        page, list_page = client.get(f"/sessions/{sid}"), client.get("/")
        assert page.status_code == 200
        assert page.headers["content-type"].startswith("text/html")
        assert "Log in" not in page.text
        assert page.text == client.get(SESSION).text
        assert page.text != list_page.text
        assert "Content-Security-Policy" in page.headers


@pytest.mark.parametrize(
    "path",
    [
        "/sessions/",
        "/sessions/short",
        "/sessions/abcdefghijk1/",
        "/sessions/abcdefghijk1%0a",
        "/sessions/abcdefghijk1/frames",
        "/sessions/abcdefghijk1%2f..%2f..%2fapi",
        "/sessions/%2e%2e/api",
        "/Sessions/abcdefghijk1",
        "/sessions/ABCDEFGHIJK1",
    ],
)
def test_nothing_else_below_sessions_is_open(server, path: str) -> None:
    with server.stranger() as client:
        assert client.get(httpx.URL(client.base_url, raw_path=path.encode())).status_code == 401, path
    with server.browser() as client:
        assert client.get(httpx.URL(client.base_url, raw_path=path.encode())).status_code == 404, path
