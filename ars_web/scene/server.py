"""The scenes of all sessions: opened when a browser first asks for one, closed when nobody has looked for a while."""

import logging
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from types import TracebackType
from typing import TYPE_CHECKING, Self

from ars_web.errors import ArsError, BadInput, NotFound, StoreError
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.edits import Edit
from ars_web.sessions.store import SessionStore
from ars_web.studies.kept_views import KeptViews
from ars_web.workspace import BoxPreview, NewBox, SceneAddress, ScenePage, ViewAction, ViewEvent, ViewState

if TYPE_CHECKING:  # viser takes a third of a second to import, which programs that show no scene need not wait for
    from ars_web.scene.session_scene import SessionScene
    from ars_web.scene.views import Page

log = logging.getLogger(__name__)

WORKERS = 4
"""Threads that read images and the store for all scenes."""


@dataclass(eq=False)
class _Attached:
    """A page whose live line is up.

    Attributes:
        lines: how many of its live lines are up; two for a moment, while one takes over from a broken one.
    """

    page: "Page"
    lines: int
    state: ViewState | None = None


@dataclass(eq=False)
class _Open:
    """An open scene, or one that is being opened under its lock."""

    lock: threading.Lock = field(default_factory=threading.Lock)
    scene: "SessionScene | None" = None
    closed: bool = False
    used: float = field(default_factory=time.monotonic)


class SceneServers:
    """The scenes, for the live line (`workspace.SceneViews`) and the proxy (`workspace.ScenePages`). Thread-safe.

    Attributes:
        idle_seconds: how long a scene without a browser stays open.
    """

    def __init__(
        self,
        store: SessionStore,
        editor: SessionEditor,
        *,
        kept_views: KeptViews | None = None,
        idle_seconds: float = 60.0,
        poll_seconds: float = 0.5,
    ) -> None:
        """
        Args:
            kept_views: where what spheres count is kept; by default the scenes' own.
        """
        self.idle_seconds = idle_seconds
        self._store = store
        self._editor = editor
        self._kept_views = KeptViews() if kept_views is None else kept_views
        self._poll_seconds = poll_seconds
        self._lock = threading.Lock()
        self._open: dict[str, _Open] = {}
        self._attached: dict[str, dict[str, _Attached]] = {}
        self._workers = ThreadPoolExecutor(WORKERS, thread_name_prefix="scene")
        self._closing = threading.Event()
        self._watcher: threading.Thread | None = None
        self._unlisten = editor.listen(self._edited)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Close all scenes; no thread of theirs is left. May be called twice."""
        self._unlisten()
        self._closing.set()
        with self._lock:
            watcher, self._watcher = self._watcher, None
            entries, self._open = list(self._open.values()), {}
        if watcher is not None:
            watcher.join()
        for entry in entries:
            self._close(entry)
        self._workers.shutdown()

    def page(self) -> ScenePage:
        """The scene's page."""
        from ars_web.scene.client_page import client_page

        return client_page()

    def address(self, sid: str, *, view: str, author: str) -> SceneAddress:
        """Where the session's scene is served; it is opened if it is not open.

        Raises:
            NotFound: there is no such session.
            BadInput: the view is somebody else's page.
        """
        from ars_web.scene.hardening import AUTHOR_HEADER, SECRET, SECRET_HEADER, VIEW_HEADER

        with self._lock:
            known = self._attached.get(sid, {}).get(view)
        if known is not None and known.page.author != author:
            raise BadInput("this view is somebody else's page; choose another random name")
        self._store.revision(sid)  # a scene may outlive its session, for as long as somebody looks
        scene = self._opened(sid)
        return SceneAddress(
            url=f"ws://127.0.0.1:{scene.port}/",
            headers={SECRET_HEADER: SECRET, VIEW_HEADER: view, AUTHOR_HEADER: author},
        )

    @property
    def open_sessions(self) -> frozenset[str]:
        """The sessions whose scene is open."""
        with self._lock:
            return frozenset(sid for sid, entry in self._open.items() if entry.scene is not None)

    def attach(self, sid: str, view: str, *, author: str, send: Callable[[ViewEvent], None]) -> None:
        """A page is there. `send` may be called by any thread."""
        from ars_web.scene.views import Page

        page = Page(view=view, author=author, send=send)
        with self._lock:
            known = self._attached.setdefault(sid, {}).get(view)
            lines, state = (1, None) if known is None else (known.lines + 1, known.state)
            self._attached[sid][view] = _Attached(page, lines, state)
            scene = self._scene(sid)
        if scene is not None:
            scene.attach(page)

    def detach(self, sid: str, view: str) -> None:
        """The page is gone, or its line was interrupted; a drag in progress is cancelled."""
        with self._lock:
            known = self._attached.get(sid, {}).get(view)
            if known is None:
                return
            known.lines -= 1
            if known.lines > 0:
                return
            del self._attached[sid][view]
            if not self._attached[sid]:
                del self._attached[sid]
            scene = self._scene(sid)
        if scene is not None:
            scene.detach(view)

    def show(self, sid: str, view: str, state: ViewState) -> None:
        """Show this, whatever was shown before."""
        with self._lock:
            known = self._attached.get(sid, {}).get(view)
            if known is None:
                return
            known.state = state
            scene = self._scene(sid)
        if scene is not None:
            scene.show(view, state)

    def act(self, sid: str, view: str, action: ViewAction) -> None:
        """Do this once."""
        with self._lock:
            known = self._attached.get(sid, {}).get(view)
            scene = self._scene(sid)
        if scene is not None:
            scene.act(view, action)
        elif known is not None and isinstance(action, NewBox):
            from ars_web.scene.placing import NOT_CONNECTED

            known.page.send(NOT_CONNECTED)

    def preview(self, sid: str, view: str, preview: BoxPreview | None) -> None:
        """Show a box as it is being typed, to all views of the session; None: no more."""
        with self._lock:
            scene = self._scene(sid)
        if scene is not None:
            scene.preview(view, preview)

    def _scene(self, sid: str) -> "SessionScene | None":
        entry = self._open.get(sid)
        return None if entry is None else entry.scene

    def _opened(self, sid: str) -> "SessionScene":
        while True:
            with self._lock:
                if self._closing.is_set():
                    raise StoreError("the server is stopping")
                entry = self._open.setdefault(sid, _Open())
                entry.used = time.monotonic()
            with entry.lock:
                if entry.closed:
                    continue
                if entry.scene is not None:
                    return entry.scene
                try:
                    scene = self._make(sid)
                except BaseException:
                    self._forget(sid, entry)
                    raise
                with self._lock:
                    entry.scene = scene
                    entry.used = time.monotonic()
                    attached = list(self._attached.get(sid, {}).values())
                    # Whoever attaches from here on tells the scene, too.
                    for one in attached:
                        scene.attach(one.page)
                        if one.state is not None:
                            scene.show(one.page.view, one.state)
                    self._watch()
            # An edit between the snapshot and here was told to nobody.
            scene.refresh()
            return scene

    def _make(self, sid: str) -> "SessionScene":
        from ars_web.scene.session_scene import SessionScene

        return SessionScene(
            sid, store=self._store, editor=self._editor, workers=self._workers, kept_views=self._kept_views
        )

    def _forget(self, sid: str, entry: _Open) -> None:
        entry.closed = True
        with self._lock:
            if self._open.get(sid) is entry:
                del self._open[sid]

    def _close(self, entry: _Open) -> None:
        with entry.lock:
            entry.closed = True
            scene, entry.scene = entry.scene, None
        if scene is not None:
            scene.close()

    def _edited(self, sid: str, edit: Edit) -> None:
        with self._lock:
            scene = self._scene(sid)
        if scene is not None:
            scene.refresh()

    def _watch(self) -> None:
        if self._watcher is None and not self._closing.is_set():
            self._watcher = threading.Thread(target=self._watch_all, name="scene-watcher")
            self._watcher.start()

    def _watch_all(self) -> None:
        """Tell watched scenes of other processes' edits, and close those that nobody has watched for a while."""
        while not self._closing.wait(self._poll_seconds):
            with self._lock:
                entries = [(sid, entry, entry.scene) for sid, entry in self._open.items() if entry.scene is not None]
            now = time.monotonic()
            for sid, entry, scene in entries:
                if scene.is_watched:
                    entry.used = now
                    self._look(sid, scene)
                elif now - entry.used > self.idle_seconds:
                    self._forget(sid, entry)
                    self._close(entry)

    def _look(self, sid: str, scene: "SessionScene") -> None:
        try:
            if self._store.revision(sid) != scene.revision:
                scene.refresh()
        except NotFound:
            pass  # deleted; the page is told by its live line
        except ArsError as error:
            log.warning("the scene of session %s is not kept up to date: %s", sid, error)
