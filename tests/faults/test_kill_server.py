"""kill -9 of the server loses nothing that it acknowledged; and the tests that say so can fail."""

import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).with_name("kill_server.py")


def killed(*options: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, SCRIPT, *options], capture_output=True, text=True, timeout=900)


def test_twenty_kills_during_edits_lose_nothing() -> None:
    done = killed("--rounds", "20")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "20 kills" in done.stdout
    assert int(done.stdout.split(", ")[1].split()[0]) > 20, "hardly an edit was made"


def test_answering_before_the_commit_is_seen() -> None:
    done = killed("--rounds", "1", "--without", "commit")
    assert done.returncode == 1, done.stdout + done.stderr
    assert "LOST: revision" in done.stdout


def test_an_export_that_was_killed_ends_as_if_it_had_not() -> None:
    done = killed("--export")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "as in an undisturbed export" in done.stdout


def test_an_export_that_nobody_resumes_is_seen() -> None:
    done = killed("--export", "--without", "resume")
    assert done.returncode == 1, done.stdout + done.stderr
    assert "for ever" in done.stdout
