"""The views of sessions as they were last asked for: what a page asks again and again while somebody looks at it."""

import threading
from collections.abc import Callable

from cachetools import LRUCache, cached

from ars_web.datasets.coverage import SessionViews, session_views
from ars_web.datasets.options import ExportOptions
from ars_web.sessions.model import SessionSnapshot

KEPT = 4
"""Sessions at a revision, with options; of 36,000 frames and 20 boxes each is 18 MB."""


class KeptViews:
    """Finds how frames see a session's boxes. Nothing of a session at a revision ever changes, so answers are kept."""

    def __init__(self) -> None:
        kept: LRUCache[tuple[str, int, str], SessionViews] = LRUCache(KEPT)
        find: Callable[[SessionSnapshot, ExportOptions], SessionViews] = session_views
        self._find = cached(kept, key=_key, condition=threading.Condition())(find)

    def find(self, snapshot: SessionSnapshot, options: ExportOptions) -> SessionViews:
        """The same as `session_views` of all frames."""
        return self._find(snapshot, options)


def _key(snapshot: SessionSnapshot, options: ExportOptions) -> tuple[str, int, str]:
    deciding = options.model_dump_json(include={"shape", "min_visible", "max_truncated", "min_area_px"})
    return snapshot.id, snapshot.state.revision, deciding
