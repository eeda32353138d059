"""The one place where the API, the page, the store and the export jobs are joined, opened and closed."""

import errno
import gc
import ipaddress
import logging
import socket
import sys
from collections.abc import AsyncGenerator, Callable, Mapping
from contextlib import AbstractAsyncContextManager, asynccontextmanager, suppress
from importlib.resources import files
from pathlib import Path
from typing import Any

import uvicorn
from fastapi import FastAPI
from starlette.concurrency import run_in_threadpool
from starlette.staticfiles import StaticFiles

from ars_web import __version__
from ars_web.api import (
    boxes,
    classes,
    coverage,
    exports,
    folders,
    formats,
    frames,
    health,
    history,
    hull_preview,
    hulls,
    imports,
    labels_import,
    labels_preview,
    live,
    login,
    marks,
    masks,
    meshes,
    openapi,
    outline_jobs,
    points,
    polygons,
    problems,
    refine,
    report,
    scene_door,
    segment,
    sessions,
    telling_frames,
    tour,
)
from ars_web.api.body_limit import BodyLimit
from ars_web.api.credentials import CODE_LIFETIME, Cookies, LoginCodes, install_token
from ars_web.api.dependencies import Services
from ars_web.api.events import EventHub
from ars_web.api.head_requests import HeadRequests
from ars_web.api.live_line import GOODBYE_SECONDS, LiveLines
from ars_web.api.pictures import Pictures
from ars_web.api.presence import Presence
from ars_web.api.security import Door, Guard
from ars_web.api.telling import TellingViews
from ars_web.api.websocket_wire import WebsocketWire
from ars_web.datasets.cluster import cluster_at
from ars_web.datasets.exports import ExportJobs
from ars_web.errors import BadInput, StoreError
from ars_web.masks.boxing import ObjectBoxes
from ars_web.masks.grab_cut import GrabCutSegmenter
from ars_web.masks.onnx_segmenter import OnnxSegmenter
from ars_web.masks.propagation_jobs import OutlineJobs
from ars_web.masks.segmenter import Segmenter
from ars_web.scene.server import SceneServers
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.import_jobs import ImportJobs
from ars_web.sessions.import_looks import ImportLooks
from ars_web.sessions.store import SessionStore
from ars_web.sessions.uploads import Uploads
from ars_web.settings import Settings
from ars_web.studies.kept_views import KeptViews

SHUTDOWN_SECONDS = 5
"""How long a server that is stopped waits for answers that are being sent."""

WEBSOCKETS: Mapping[str, Any] = {
    "ws": WebsocketWire,
    "ws_max_size": 2**20,
    # A page that vanished, with its laptop's lid or its network, is noticed after twice that.
    "ws_ping_interval": 20.0,
    "ws_ping_timeout": 20.0,
    # Costs each line 60 KB and time, and what goes over it is small.
    "ws_per_message_deflate": False,
}
"""How uvicorn speaks websocket."""


def create_app(settings: Settings) -> FastAPI:
    """The application. Nothing is written or kept open before its lifespan begins; all is closed when that ends.

    Raises:
        BadFile: the segmenter's file holds none.
    """
    segmenter = GrabCutSegmenter() if settings.segmenter is None else OnnxSegmenter(settings.segmenter)
    app = FastAPI(
        title="ARS Web",
        version=__version__,
        lifespan=_lifespan(settings, segmenter),
        openapi_url=None,
        docs_url=None,
        redoc_url=None,
        redirect_slashes=False,
    )
    static = static_folder()
    problems.install(app)
    for module in (
        health,
        folders,
        imports,
        sessions,
        classes,
        coverage,
        tour,
        frames,
        marks,
        labels_preview,
        labels_import,
        points,
        boxes,
        hulls,
        meshes,
        masks,
        segment,
        outline_jobs,
        hull_preview,
        refine,
        polygons,
        telling_frames,
        history,
        live,
        scene_door,
        exports,
        formats,
        report,
    ):
        app.include_router(module.router)
    app.include_router(login.router(static))
    openapi.install(app)
    app.mount("/static", StaticFiles(directory=static), name="static")
    # The last one added is the first to see a request.
    app.add_middleware(HeadRequests)
    app.add_middleware(BodyLimit, largest=settings.largest_body)
    app.add_middleware(problems.Unexpected)
    app.add_middleware(Guard, door=lambda: app.state.services.door)
    return app


def _lifespan(settings: Settings, segmenter: Segmenter) -> Callable[[FastAPI], AbstractAsyncContextManager[None]]:
    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncGenerator[None]:
        cluster = cluster_at(
            settings.executor, ca_file=settings.tls_ca_file, cert=settings.tls_cert, key=settings.tls_key
        )
        token = sessions_token(settings)
        with SessionStore(settings.sessions) as store:
            jobs = ExportJobs(settings.sessions, store.snapshot, workers=settings.workers, cluster=cluster)
            uploads = Uploads(settings.sessions)
            import_jobs = ImportJobs(store, uploads)
            editor = SessionEditor(store)
            outlines = OutlineJobs(store, editor)
            kept_views = KeptViews()
            try:
                uploads.sweep()
                jobs.resume_unfinished()
                scene_servers = SceneServers(store, editor, kept_views=kept_views)
                async with EventHub(store).running() as hub, _closing(scene_servers) as scenes:
                    unlisten = editor.listen(hub.wake)
                    app.state.services = Services(
                        store=store,
                        editor=editor,
                        objects=ObjectBoxes(store, editor),
                        outlines=outlines,
                        segmenter=segmenter,
                        exports=jobs,
                        uploads=uploads,
                        looks=ImportLooks(),
                        imports=import_jobs,
                        events=hub,
                        lines=LiveLines(),
                        presence=Presence(),
                        scene=scenes,
                        scene_pages=scenes,
                        door=Door(
                            token=token,
                            cookies=Cookies(token),
                            cookie_name=f"ars_web_{settings.port}",
                            host=settings.host,
                            hosts=settings.hosts,
                        ),
                        codes=LoginCodes(),
                        roots=settings.roots,
                        largest_upload=settings.largest_upload,
                        pictures=Pictures(),
                        telling=TellingViews(store),
                        views=kept_views,
                    )
                    try:
                        yield
                    finally:
                        unlisten()
            finally:
                await run_in_threadpool(outlines.close)
                await run_in_threadpool(import_jobs.close)
                await run_in_threadpool(jobs.close)

    return lifespan


@asynccontextmanager
async def _closing(scenes: SceneServers) -> AsyncGenerator[SceneServers]:
    try:
        yield scenes
    finally:
        await run_in_threadpool(scenes.close)


def sessions_token(settings: Settings) -> str:
    """The token of the settings, else the one kept in the sessions folder, which is made where it is missing.

    Raises:
        StoreError: the folder cannot be made, or the token in it is not safe.
    """
    try:
        settings.sessions.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StoreError(f"{settings.sessions}: the sessions folder cannot be made: {error.strerror}") from error
    return settings.token or install_token(settings.sessions)


def static_folder() -> Path:
    """Where the page's files are: in the installed package, or at the root of a checkout.

    Raises:
        StoreError: in neither.
    """
    package = Path(str(files("ars_web")))
    for folder in (package / "static", package.parent / "static"):
        if (folder / "index.html").is_file():
            return folder
    raise StoreError(f"{package / 'static'}: the page's files are missing; install ARS Web again")


def serve(
    settings: Settings,
    *,
    session: str | None = None,
    or_any_port: bool = False,
    on_ready: Callable[[str], None] | None = None,
) -> None:
    """Serve until interrupted. Prints where, with a one-time login URL, which `on_ready` is called with, too.

    Args:
        session: that the login leads to; None: to the list of sessions.
        or_any_port: take a free port where the one of the settings is taken, and say so.

    Raises:
        BadInput: the address cannot be listened on.
        StoreError: the sessions folder or its token cannot be used.
    """
    token = sessions_token(settings)
    with listening(settings.host, settings.port, or_any=or_any_port) as listener:
        port = listener.getsockname()[1]
        if or_any_port and settings.port not in (0, port):
            sys.stdout.write(f"Port {settings.port} is taken; this is another.\n")
        settings = settings.model_copy(update={"token": token, "port": port})
        app = create_app(settings)
        # No access log: the one-time code is part of an address. No proxy headers: they could be anyone's.
        config = uvicorn.Config(
            app,
            log_level="warning",
            access_log=False,
            proxy_headers=False,
            server_header=False,
            timeout_graceful_shutdown=SHUTDOWN_SECONDS,
            **WEBSOCKETS,
        )

        def ready() -> None:
            base = f"http://{_shown_host(settings.host)}:{port}"
            url = f"{base}/login?code={app.state.services.codes.issue()}"
            if session is not None:
                url += f"&next=/sessions/{session}"
            _announce(settings, base, url)
            if on_ready is not None:
                on_ready(url)

        # What the imports made stays to the end: the collector need not look through it again and again.
        gc.freeze()
        # uvicorn raises the signal that stopped it once more, when all is closed.
        try:
            with suppress(KeyboardInterrupt):
                _Server(config, app, ready).run(sockets=[listener])
        finally:
            # Whoever interrupts a second time does not wait for the lifespan's end; an export must not keep it up.
            if hasattr(app.state, "services"):
                app.state.services.scene_pages.close()
                app.state.services.outlines.close()
                app.state.services.imports.close()
                app.state.services.exports.close()


class _Server(uvicorn.Server):
    """Says when it is ready, and ends event streams and live lines before it waits for connections to close."""

    def __init__(self, config: uvicorn.Config, app: FastAPI, ready: Callable[[], None]) -> None:
        super().__init__(config)
        self._app = app
        self._ready = ready

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        if self.started:
            self._ready()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        services: Services = self._app.state.services
        services.events.close()
        # uvicorn would close them with another code, and a page learn less of why.
        await services.lines.all_closed(seconds=GOODBYE_SECONDS)
        await super().shutdown(sockets)


def listening(host: str, port: int, *, or_any: bool = False) -> socket.socket:
    """A socket that listens on `host`; port 0 takes a free one, and so does `or_any` where the port is taken.

    Raises:
        BadInput: the address cannot be had.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    # asyncio turns off Nagle's algorithm only on sockets that say they are TCP; otherwise each small answer waits for
    # the client's delayed acknowledgement, 40 ms.
    listener = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((host, port))
        listener.listen(2048)
    except OSError as error:
        listener.close()
        if or_any and error.errno == errno.EADDRINUSE:
            return listening(host, 0)
        raise BadInput(f"cannot listen on {host}:{port}: {error.strerror}; choose another host or port") from error
    return listener


def _shown_host(host: str) -> str:
    """A host to put into a URL: a wildcard address is reached by loopback."""
    try:
        address = ipaddress.ip_address(host)
    except ValueError:
        return host
    if address.is_unspecified:
        return "127.0.0.1" if address.version == 4 else "[::1]"
    return f"[{host}]" if address.version == 6 else host


def _announce(settings: Settings, base: str, url: str) -> None:
    lines = [
        f"ARS Web is at {base}/ with the sessions in {settings.sessions}",
        f"Log in, once, within {CODE_LIFETIME // 60} minutes: {url}",
    ]
    sys.stdout.write("".join(f"{line}\n" for line in lines))
    sys.stdout.flush()
    if settings.host not in ("localhost", "::1") and not settings.host.startswith("127."):
        logging.getLogger(__name__).warning(
            "listening on %s: whoever can reach this machine can try the door, and nothing on the way is encrypted",
            settings.host,
        )
