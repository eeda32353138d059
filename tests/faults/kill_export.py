"""An export, or a server's export jobs, in a process of its own: what `test_kill_export.py` kills.

    kill_export.py [FAULT] export SESSIONS SID OUT FORMAT
    kill_export.py [FAULT] serve SESSIONS [SID FORMAT]

A FAULT takes one protection away, so that the tests can be seen to fail: `--in-place` writes shards where they are
looked for, instead of beside it; `--no-watch` lets workers outlive their parent; `--once` does not run a shard again
whose worker was killed.
"""

import sys
from pathlib import Path

from ars_web.datasets import jobs, shard_runs, worker
from ars_web.datasets.exports import ExportJobs
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.plan import plan_export
from ars_web.sessions.store import SessionStore

OPTIONS = ExportOptions.model_validate({"images": "rectify"})


def in_place(partial: Path, number: int) -> Path:
    folder = worker.shard_folder(partial, number)
    folder.mkdir(exist_ok=True)
    return folder


# Workers are spawned, and import this file too: the faults reach them by the arguments that they inherit.
if "--in-place" in sys.argv:
    worker.new_folder = in_place
if "--no-watch" in sys.argv:
    worker._exit_after = lambda sentinel: None
if "--once" in sys.argv:
    shard_runs.MOST_DEATHS = 1


def export(sessions: str, sid: str, out: str, kind: str) -> None:
    with SessionStore(Path(sessions)) as store:
        snapshot = store.snapshot(sid)
    plan = plan_export([snapshot], format=kind, options=OPTIONS, out=Path(out), frames_per_shard=10)
    # Of two shards that were begun it is not known which one killed its worker: both would have a second try.
    jobs.run_export(plan, workers=1 if "--once" in sys.argv else 2)


def serve(sessions: str, *wanted: str) -> None:
    with SessionStore(Path(sessions)) as store:
        exports = ExportJobs(Path(sessions), store.snapshot, workers=2)
        exports.resume_unfinished()
        if wanted:
            sid, kind = wanted
            sys.stdout.write(exports.start(sid, format=kind, options=OPTIONS).id + "\n")
            sys.stdout.flush()
        for job in exports.list():
            exports.wait(job.id)
        exports.close()


if __name__ == "__main__":
    command, *arguments = [argument for argument in sys.argv[1:] if not argument.startswith("--")]
    {"export": export, "serve": serve}[command](*arguments)
