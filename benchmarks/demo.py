"""How long a new user waits for the demo: python benchmarks/demo.py

From the command to the session's page answered over HTTP, in an empty sessions folder, with nothing compiled before;
then to the datasets and pictures; then the same once more with everything there. On a busy machine the processor's
seconds say more than the clock's: they are the programs' own, children included.
"""

import os
import re
import resource
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from urllib.request import HTTPCookieProcessor, build_opener


def run(sessions: Path, compiled: Path) -> None:
    """Start the demo, wait for its page and its datasets, and print when each was there."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(compiled)}
    command = [sys.executable, "-m", "ars_web", "demo", "--no-browser", "--port", "0", "--sessions", str(sessions)]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    begin = time.perf_counter()
    pipes = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    with subprocess.Popen(command, text=True, env=environment, **pipes) as process:
        assert process.stdout is not None
        for line in process.stdout:
            login = re.search(r"http://\S+/login\?\S+", line)
            if login is not None:
                # What a browser does: it is sent on to the session's page, with its cookie.
                with build_opener(HTTPCookieProcessor()).open(login[0], timeout=60) as page:
                    assert "/sessions/" in page.url, page.url
                    page.read()
                print(f"  page answered     {time.perf_counter() - begin:6.1f} s")
            if line.startswith("pictures"):
                print(f"  datasets written  {time.perf_counter() - begin:6.1f} s")
                break
        process.send_signal(signal.SIGINT)
        process.wait()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(f"  processor, in all {after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime:6.1f} s")


if __name__ == "__main__":
    print(f"{os.cpu_count()} cores, {os.getloadavg()[0]:.1f} programs running beside")
    with tempfile.TemporaryDirectory() as folder:
        for title in ("first run", "second run"):
            print(title)
            run(Path(folder) / "sessions", Path(folder) / "compiled")
