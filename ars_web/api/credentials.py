"""Who may come in: the token kept per install, one-time login codes, and the cookie that a code is traded for."""

import hashlib
import hmac
import os
import secrets
import stat
import time
from collections.abc import Callable
from pathlib import Path
from threading import Lock

from ars_web.errors import StoreError

CODE_LIFETIME = 15 * 60
"""Seconds that a one-time login URL works."""

COOKIE_LIFETIME = 30 * 24 * 3600
"""Seconds that a browser stays logged in."""


def install_token(folder: Path) -> str:
    """The token kept in `folder/.token`, made on first use: 256 random bits, mode 0600.

    Raises:
        StoreError: the file is a link, someone else's, empty, or open to other users of the machine.
    """
    path = folder / ".token"
    try:
        if not path.is_symlink() and not path.exists():
            _write_new(path, secrets.token_urlsafe(32))
        # A link could name a file whose content someone else knows.
        descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC)
    except OSError as error:
        raise StoreError(f"{path}: cannot be used as the token file: {error.strerror}") from error
    with os.fdopen(descriptor, encoding="ascii", errors="replace") as file:
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode) or status.st_uid != os.geteuid():
            raise StoreError(f"{path}: is not a file of the user that runs the server; delete it and start again")
        if status.st_mode & 0o077:
            mode = stat.S_IMODE(status.st_mode)
            raise StoreError(
                f"{path}: mode {mode:03o} lets other users of this machine read the token; delete it and start again"
                " for a new one, or `chmod 600` it where nobody can have read it"
            )
        token = file.read(4096).strip()
    if not token or not token.isascii() or not token.isprintable() or " " in token:
        raise StoreError(f"{path}: holds no token; delete it and start again for a new one")
    return token


def _write_new(path: Path, token: str) -> None:
    """Whole or not at all, and never over a token that another process wrote meanwhile."""
    part = path.with_name(f".token-{secrets.token_hex(8)}")
    descriptor = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
    try:
        with os.fdopen(descriptor, "w", encoding="ascii") as file:
            file.write(token + "\n")
            file.flush()
            os.fsync(descriptor)
        try:
            path.hardlink_to(part)
        except FileExistsError:
            return
    finally:
        part.unlink()


class LoginCodes:
    """One-time codes: each works once, for CODE_LIFETIME seconds. Safe to use from several threads."""

    def __init__(self, *, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._expiry: dict[str, float] = {}
        self._lock = Lock()

    def issue(self) -> str:
        """A new code."""
        code = secrets.token_urlsafe(24)
        with self._lock:
            self._expiry[code] = self._clock() + CODE_LIFETIME
        return code

    def redeem(self, code: str) -> bool:
        """Whether `code` was issued, is still fresh, and had not been redeemed before."""
        with self._lock:
            now = self._clock()
            self._expiry = {known: expiry for known, expiry in self._expiry.items() if expiry > now}
            match = next((known for known in self._expiry if same(known, code)), None)
            if match is None:
                return False
            del self._expiry[match]
            return True


class Cookies:
    """Login cookies: a browser's random name and an expiry, signed with the token, so that none needs storing and
    all end when the token is replaced."""

    def __init__(self, token: str, *, clock: Callable[[], float] = time.time) -> None:
        self._key = hashlib.sha256(b"ars-web login cookie\0" + token.encode()).digest()
        self._clock = clock

    def issue(self, browser: str | None = None) -> str:
        """A cookie's value for `browser`, or for a new one."""
        payload = f"{browser or secrets.token_hex(4)}.{int(self._clock()) + COOKIE_LIFETIME}"
        return f"{payload}.{self._signature(payload)}"

    def browser(self, value: str) -> str | None:
        """The browser that the value was issued for; None where it is forged or has expired."""
        payload, _, signature = value.rpartition(".")
        if not same(signature, self._signature(payload)):
            return None
        browser, _, expiry = payload.partition(".")
        return browser if int(expiry) > self._clock() else None

    def _signature(self, payload: str) -> str:
        return hmac.new(self._key, payload.encode(errors="surrogateescape"), hashlib.sha256).hexdigest()


def same(a: str, b: str) -> bool:
    """Whether two secrets are equal, in a time that does not tell where they differ."""
    return hmac.compare_digest(a.encode(errors="surrogateescape"), b.encode(errors="surrogateescape"))
