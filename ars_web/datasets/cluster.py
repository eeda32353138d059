"""A Dask cluster that runs an export's shards: reached over TLS, looked at before any work, left as it was.

Whoever reaches a scheduler can have its workers run any code, and a plain port asks nobody who they are. So only
`tls://` addresses are taken, and `tcp://` ones on this machine alone. Dask is imported once a cluster is asked for.
"""

import importlib
import ipaddress
import re
import secrets
import threading
import time
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Executor, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ParamSpec, TypeVar
from urllib.parse import urlsplit

from ars_web import __version__
from ars_web.errors import BadInput
from ars_web.recordings import stores

P = ParamSpec("P")
T = TypeVar("T")

SECONDS_TO_REACH = 8.0
"""A scheduler that has not answered by then is not there."""

SECONDS_WITHOUT_WORKERS = 60.0
"""An export whose last worker went waits so long for another one: workers that are restarted need a while."""

SECONDS_TO_STOP = 30.0
"""How long an export that is stopped waits for workers that were told to."""

_LOOK_EVERY = 5.0

_ADDRESS = re.compile(r"(tls|tcp)://[^\s/@?#]+:[0-9]+")


@dataclass(frozen=True)
class Cluster:
    """A cluster that was asked for, not yet reached.

    Attributes:
        address: of its scheduler.
        ca_file, cert, key: PEM files: who is trusted, and what this program shows of itself; None: what Dask's own
            configuration says.
    """

    address: str
    ca_file: Path | None = None
    cert: Path | None = None
    key: Path | None = None


def cluster_at(
    executor: str, *, ca_file: Path | None = None, cert: Path | None = None, key: Path | None = None
) -> Cluster | None:
    """What an `--executor` names: None for `local`.

    Raises:
        BadInput: it is no address of a scheduler, is a plain one off this machine, a file is missing, or Dask is not
            installed.
    """
    checked_executor(executor)
    files = {"--tls-ca-file": ca_file, "--tls-cert": cert, "--tls-key": key}
    given = {option: file for option, file in files.items() if file is not None}
    if executor == "local" or not executor.startswith("tls://"):
        if given:
            raise BadInput(f"{next(iter(given))} is for a cluster at tls://HOST:PORT, and the executor is {executor}")
    if executor == "local":
        return None
    if given and len(given) < len(files):
        missing = next(option for option in files if option not in given)
        raise BadInput(f"{missing} is missing: give the CA's certificate, this program's own, and its key together")
    for option, file in given.items():
        if not file.is_file():
            raise BadInput(f"{option} {file}: there is no such file")
    _distributed(executor)
    return Cluster(executor, ca_file, cert, key)


def checked_executor(executor: str) -> str:
    """`executor` itself, where it is `local` or a scheduler's address that may be used.

    Raises:
        BadInput: it is neither.
    """
    if executor == "local":
        return executor
    if not _ADDRESS.fullmatch(executor):
        raise BadInput(
            f"{executor!r} is no place to run exports at: give local, or a Dask scheduler as tls://HOST:PORT"
        )
    parts = urlsplit(executor)
    if parts.scheme == "tcp" and not _is_loopback(parts.hostname or ""):
        raise BadInput(
            f"the executor {executor} is refused: a plain port runs the code of anyone who reaches it, and sends"
            " everything in the clear; start scheduler and workers with TLS and give tls://HOST:PORT"
        )
    return executor


def _is_loopback(host: str) -> bool:
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


class Connection:
    """A cluster that was reached."""

    def __init__(self, client: Any, address: str, killed: type[Exception]) -> None:
        self._client = client
        self._address = address
        self.killed = killed
        """What a shard ends with that its workers were killed at."""
        self._next_look = 0.0
        self._seen_workers = time.monotonic()

    def executor(self) -> Executor:
        """Dask's own executor, each call on one thread of OpenCV's and numba's."""
        return _ClusterExecutor(self._client.get_executor(pure=False))

    def check_workers(self, token: str, content: str, *, images: Sequence[str]) -> None:
        """Make sure that every worker can do the work.

        Args:
            token: a file, or an address in a store, that holds `content`; where the partial data lie.
            images: some that the work needs.

        Raises:
            BadInput: there is no worker, or some have another Python or program, or do not see these files.
        """
        workers = self._workers()
        if not workers:
            raise BadInput(
                f"the cluster at {self._address} has no workers; start some with the same TLS files"
                f" (dask worker {self._address} ...) and try again"
            )
        faults = self._other_python()
        if not faults:
            told = self._client.run(_asking(), on_error="return")
            faults = {worker: fault for worker, answer in told.items() if (fault := _program_fault(answer))}
        if not faults:
            told = self._client.run(unseen, token, content, tuple(images), on_error="return")
            faults = {worker: str(answer) for worker, answer in told.items() if answer is not None}
        if faults:
            named = "; ".join(f"{workers.get(worker, worker)} {fault}" for worker, fault in sorted(faults.items()))
            raise BadInput(f"no shard was run, for {len(faults)} of {len(workers)} workers cannot do it: {named}")

    def watching(self, cancelled: Callable[[], bool]) -> Callable[[], bool]:
        """`cancelled`, which now also notices that the cluster is gone.

        What is returned raises ConnectionError where the scheduler, or for a while every worker, is.
        """

        def watched() -> bool:
            now = time.monotonic()
            if now >= self._next_look:
                self._next_look = now + _LOOK_EVERY
                if self._client.status not in ("running", "connecting"):
                    raise ConnectionError(f"the scheduler at {self._address} is gone")
                if self._workers():
                    self._seen_workers = now
                elif now > self._seen_workers + SECONDS_WITHOUT_WORKERS:
                    raise ConnectionError(f"the cluster at {self._address} has no workers any more")
            return cancelled()

        return watched

    def _workers(self) -> dict[str, str]:
        """What to call each worker, by address."""
        try:
            found: dict[str, Any] = self._client.scheduler_info(n_workers=-1)["workers"]
        except OSError as error:
            raise ConnectionError(f"the scheduler at {self._address} is gone") from error
        return {
            address: address if worker["name"] == address else f"{worker['name']} ({address})"
            for address, worker in found.items()
        }

    def _other_python(self) -> dict[str, str]:
        """Workers of another Python: code cannot be sent to those, not even a question."""
        versions = self._client.get_versions()
        own = _release(versions["client"])
        return {
            worker: f"runs Python {_release(found)}, and this is {own}"
            for worker, found in versions["workers"].items()
            if _release(found) != own
        }


@contextmanager
def connected(cluster: Cluster) -> Generator[Connection]:
    """Reach the cluster's scheduler; the connection ends with the block.

    Raises:
        BadInput: it cannot be reached, or does not trust this program, or the other way round.
    """
    distributed = _distributed(cluster.address)
    reach = f"the scheduler at {cluster.address} cannot be reached"
    try:
        client = distributed.Client(
            cluster.address,
            security=_security(cluster, distributed),
            timeout=SECONDS_TO_REACH,
            set_as_default=False,
            name="ars-web",
        )
    except OSError as error:
        raise BadInput(
            f"{reach}: {str(error) or type(error).__name__}; is it running, is the address its own, and do both"
            " sides' TLS files belong together?"
        ) from error
    try:
        yield Connection(client, cluster.address, distributed.scheduler.KilledWorker)
    finally:
        client.close(timeout=SECONDS_TO_REACH)


def _security(cluster: Cluster, distributed: Any) -> Any:
    if not cluster.address.startswith("tls://"):
        return None
    own = {} if cluster.ca_file is None else {"tls_ca_file": str(cluster.ca_file)}
    if cluster.cert is not None and cluster.key is not None:
        own |= {"tls_client_cert": str(cluster.cert), "tls_client_key": str(cluster.key)}
    security = distributed.Security(require_encryption=True, **own)
    try:
        context = security.get_connection_args("client").get("ssl_context")
    except OSError as error:  # ssl's errors are among them
        raise BadInput(f"the TLS files for {cluster.address} cannot be used: {error}") from error
    if context is None:
        raise BadInput(
            f"the executor {cluster.address} needs TLS files: give --tls-ca-file, --tls-cert and --tls-key, or name"
            " them in Dask's configuration (distributed.comm.tls)"
        )
    return security


def _distributed(executor: str) -> Any:
    try:
        # Its name is not imported above: Dask is wanted only where a cluster is.
        return importlib.import_module("distributed")
    except ImportError as error:
        raise BadInput(
            f"the executor {executor} needs Dask's package `distributed`, which is not installed: install the extra"
            " `cluster` (pip install 'ars-web[cluster]')"
        ) from error


def _release(versions: Any) -> str:
    """`3.11` out of what Dask knows of a process."""
    host: dict[str, str] = dict(versions["host"])
    return ".".join(host["python"].split(".")[:2])


def _asking() -> Callable[[], str]:
    """What asks a worker for its program.

    A function within a function travels as code. One of this module would travel as its name, which a worker without
    this program does not know.
    """

    def program() -> str:
        try:
            import ars_web  # the worker's
        except ImportError:
            return ""
        return ars_web.__version__

    return program


def _program_fault(answer: object) -> str | None:
    if answer == __version__:
        return None
    if answer == "":
        return f"does not have this program: install ars-web[cluster] {__version__} there"
    if isinstance(answer, str):
        return f"has version {answer} of this program, and this is {__version__}: install the same everywhere"
    return f"did not answer: {answer}"


def new_token() -> str:
    """Something that only a reader of the right file can know."""
    return secrets.token_hex(16)


def unseen(token: str, content: str, images: Sequence[str]) -> str | None:
    """What of these files the process that runs this does not see, in words; None: it sees all.

    Runs on a worker.
    """
    try:
        seen = _read(token)
    except BadInput as error:
        return f"cannot read {token}: {error}"
    except OSError:
        seen = b""
    if seen != content.encode():
        folder = token.rpartition("/")[0]
        return f"does not see {folder}: the dataset must lie where every worker has it under that name"
    for image in images:
        if not _is_file(image):
            return f"does not see the image {image}: images must lie where every worker has them under that name"
    return None


def _read(file: str) -> bytes:
    if not stores.is_address(file):
        return Path(file).read_bytes()
    folder, name = stores.split_address(file)
    return folder.read(name)


def _is_file(file: str) -> bool:
    if not stores.is_address(file):
        return Path(file).is_file()
    folder, name = stores.split_address(file)
    try:
        return folder.has(name)
    except OSError:
        return False


class _ClusterExecutor(Executor):
    """Dask's executor, which has no way to be shut down that waits for what runs but not for what does not."""

    def __init__(self, inner: Executor) -> None:
        self._inner = inner
        self._futures: list[Future[Any]] = []

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        future = self._inner.submit(_on_one_thread, __version__, fn, *args, **kwargs)
        self._futures.append(future)
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        if wait and cancel_futures:
            # All of them were told to stop, those that have not begun included. A worker that goes on writing would
            # do it into a folder that is being removed.
            _wait(self._futures)
        self._inner.shutdown(wait=wait and not cancel_futures)


def _wait(futures: Sequence[Future[Any]]) -> None:
    wait(futures, timeout=SECONDS_TO_STOP)


def _on_one_thread(version: str, work: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
    """Do the work as `worker.start_worker` would have it done, in a process that is not ours alone."""
    if version != __version__:
        # A worker that came later than the others were looked at.
        raise BadInput(f"a worker has version {__version__} of this program, and the export is by {version}")
    with _ONE_THREAD:
        return work(*args, **kwargs)


class _OneThread:
    """While anybody is in it, OpenCV has one thread in this process, and numba in the threads that are in it."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._inside = 0
        self._before = 1
        self._numba = threading.local()

    def __enter__(self) -> None:
        import cv2
        import numba

        with self._lock:
            if self._inside == 0:
                self._before = cv2.getNumThreads()
                cv2.setNumThreads(1)
            self._inside += 1
        self._numba.before = numba.get_num_threads()
        numba.set_num_threads(1)

    def __exit__(self, *exc: object) -> None:
        import cv2
        import numba

        numba.set_num_threads(self._numba.before)
        with self._lock:
            self._inside -= 1
            if self._inside == 0:
                cv2.setNumThreads(self._before)


_ONE_THREAD = _OneThread()
