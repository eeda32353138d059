"""An export to a store in a process of its own: what `test_kill_stored_export.py` kills.

    kill_stored_export.py [FAULT] SESSIONS SID ADDRESS MARK

With a MARK that is not `-`, it stops for ever before the files that span shards are uploaded, and makes that file to
say so. The FAULT `--document-first` takes the protection away: `dataset.json` is uploaded before them.
"""

import sys
import time
from pathlib import Path

from ars_web.datasets import store_export
from ars_web.datasets.options import ExportOptions
from ars_web.recordings.stores import store_folder
from ars_web.sessions.store import SessionStore

upload_joined = store_export.upload_joined


def stop_before(mark: Path, *, document_first: bool):
    def stopped(target, files):
        if document_first:
            target.write("dataset.json", b"{}")
        mark.touch()
        time.sleep(600)

    return stopped


if __name__ == "__main__":
    sessions, sid, address, mark = [argument for argument in sys.argv[1:] if not argument.startswith("--")]
    if mark != "-":
        store_export.upload_joined = stop_before(Path(mark), document_first="--document-first" in sys.argv)
    with SessionStore(Path(sessions)) as store:
        snapshot = store.snapshot(sid)
    plan = store_export.plan_stored_export([snapshot], format="coco", options=ExportOptions(), frames_per_shard=4)
    store_export.run_stored_export(plan, store_folder(address))
