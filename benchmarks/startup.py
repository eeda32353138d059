"""How long the command line takes to be there, beside Python itself: python benchmarks/startup.py"""

import os
import statistics
import subprocess
import sys
import tempfile
import time

RUNS = 15


def seconds(*arguments: str) -> float:
    """The median of RUNS runs of Python with these arguments, after one that fills the caches."""
    times: list[float] = []
    with tempfile.TemporaryDirectory() as sessions:
        environment = {**os.environ, "ARS_WEB_SESSIONS": sessions}
        for _ in range(RUNS + 1):
            begin = time.perf_counter()
            subprocess.run([sys.executable, *arguments], check=True, stdout=subprocess.DEVNULL, env=environment)
            times.append(time.perf_counter() - begin)
    return statistics.median(times[1:])


if __name__ == "__main__":
    print(f"{'python -c pass':24} {seconds('-c', 'pass'):6.3f} s")
    for command in ("--help", "list", "formats"):
        print(f"{'ars-web ' + command:24} {seconds('-m', 'ars_web', command):6.3f} s")
