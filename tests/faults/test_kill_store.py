"""Every acknowledged edit survives kill -9; and the test that says so can fail."""

import os
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).with_name("kill_store.py")
CHECKOUT = Path(__file__).parents[2]


def killed(*options: str) -> subprocess.CompletedProcess[str]:
    # The script runs the ars_web beside it, whether or not one is installed.
    search = {**os.environ, "PYTHONPATH": str(CHECKOUT)}
    return subprocess.run([sys.executable, SCRIPT, *options], capture_output=True, text=True, env=search, timeout=300)


def test_twenty_kills_lose_nothing():
    done = killed("--rounds", "20")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "20 kills" in done.stdout
    assert int(done.stdout.split(", ")[1].split()[0]) > 20, "hardly an edit was made"


def test_death_between_the_log_and_the_tables_loses_nothing():
    done = killed("--rounds", "10", "--die-between")
    assert done.returncode == 0, done.stdout + done.stderr


def test_without_the_transaction_the_same_death_is_seen():
    done = killed("--rounds", "10", "--die-between", "--without", "transaction")
    assert done.returncode == 1, done.stdout + done.stderr
    assert "the log does not lead to revision" in done.stdout


def test_acknowledging_before_the_commit_is_seen():
    done = killed("--rounds", "10", "--die-between", "--without", "order")
    assert done.returncode == 1, done.stdout + done.stderr
    assert "was acknowledged, the session is at" in done.stdout
