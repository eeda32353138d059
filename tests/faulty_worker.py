"""Preloaded by workers of a test's cluster: shards that can be held, and shards that kill their worker.

In the folder FAULTS (an environment variable), a file `hold-N` keeps the worker in shard N for as long as it is there,
and a file `poison-N` has the shard kill it.
"""

import os
import signal
import time
from pathlib import Path

from ars_web.datasets import worker


def _faulty(plan, number, *rest):
    faults = Path(os.environ["FAULTS"])
    if (faults / f"poison-{number}").exists():
        os.kill(os.getpid(), signal.SIGKILL)
    while (faults / f"hold-{number}").exists():
        time.sleep(0.01)
    return worker._real_shard(plan, number, *rest)


# Loaded more than once in a process.
if not hasattr(worker, "_real_shard"):
    worker._real_shard = worker._shard
    worker._shard = _faulty
