"""A stranger's client finds the HTTP contract kept."""

import subprocess
import sys
from pathlib import Path

import httpx

SHARED = Path(__file__).parents[3] / "shared"
TOKEN = "token-of-the-contract-test"


def test_a_strangers_client_finds_the_contract_kept(served, tmp_path: Path) -> None:
    with served(tmp_path / "sessions", "--token", TOKEN, "--root", f"data={SHARED / 'data'}") as (_, login):
        base = login.partition("/login")[0]
        with httpx.Client(base_url=base, headers={"Authorization": f"Bearer {TOKEN}"}, timeout=60) as client:
            body = {"name": "cell", "root": "data", "path": "cell", "classes": ["brick", "ball"]}
            made = client.post("/api/sessions", json=body)
            assert made.status_code == 201, made.text
        script = [sys.executable, str(SHARED / "checks" / "contract.py"), base, TOKEN, made.json()["id"]]
        done = subprocess.run([*script, "--masks", "--coverage"], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "contract kept" in done.stdout
