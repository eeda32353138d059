"""A Dask cluster with TLS on loopback, made of real processes, for tests: certificates, a scheduler and workers."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from ipaddress import ip_address
from pathlib import Path

import psutil
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec

from ars_web.datasets.cluster import Cluster

CHECKOUT = Path(__file__).parents[1]
PATIENCE = 60.0


@dataclass(frozen=True)
class Files:
    """PEM files of one who takes part."""

    ca_file: Path
    cert: Path
    key: Path

    def options(self) -> list[str]:
        """As Dask's commands and ours take them."""
        return ["--tls-ca-file", str(self.ca_file), "--tls-cert", str(self.cert), "--tls-key", str(self.key)]


def make_certificates(folder: Path) -> Files:
    """A certificate for loopback, signed by an authority of its own."""
    folder.mkdir()
    authority, own = ec.generate_private_key(ec.SECP256R1()), ec.generate_private_key(ec.SECP256R1())
    issuer = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "authority")])
    subject = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "cluster")])
    now = datetime.now(UTC)

    def builder(name: x509.Name, key: ec.EllipticCurvePrivateKey) -> x509.CertificateBuilder:
        return (
            x509.CertificateBuilder()
            .subject_name(name)
            .issuer_name(issuer)
            .public_key(key.public_key())
            .serial_number(x509.random_serial_number())
            .not_valid_before(now - timedelta(hours=1))
            .not_valid_after(now + timedelta(days=1))
        )

    of_authority = builder(issuer, authority).add_extension(x509.BasicConstraints(True, None), critical=True)
    loopback = x509.SubjectAlternativeName([x509.IPAddress(ip_address("127.0.0.1"))])
    of_cluster = builder(subject, own).add_extension(loopback, critical=False)
    files = Files(folder / "ca.pem", folder / "cert.pem", folder / "key.pem")
    pem = serialization.Encoding.PEM
    files.ca_file.write_bytes(of_authority.sign(authority, hashes.SHA256()).public_bytes(pem))
    files.cert.write_bytes(of_cluster.sign(authority, hashes.SHA256()).public_bytes(pem))
    plain = serialization.NoEncryption()
    files.key.write_bytes(own.private_bytes(pem, serialization.PrivateFormat.PKCS8, plain))
    return files


@dataclass
class RunningCluster:
    """A scheduler that runs, and the workers that were started."""

    address: str
    files: Files
    folder: Path
    environment: dict[str, str]
    workers: dict[str, subprocess.Popen[bytes]] = field(default_factory=dict)

    @property
    def cluster(self) -> Cluster:
        """As an export takes it."""
        return Cluster(self.address, self.files.ca_file, self.files.cert, self.files.key)

    def options(self) -> list[str]:
        """As the command line takes it."""
        return ["--executor", self.address, *self.files.options()]

    def start(self, name: str, *options: str, cwd: Path | None = None, **environment: str) -> None:
        """Start a worker; whoever needs it there waits for it with `until`."""
        line = [sys.executable, "-m", "distributed.cli.dask_worker", self.address, *self.files.options()]
        line += ["--name", name, "--nthreads", "1", "--no-dashboard", "--host", "127.0.0.1", *options]
        line += ["--local-directory", str(self.folder), "--memory-limit", "0"]
        self.workers[name] = _process(line, self.folder / f"{name}.log", self.environment | environment, cwd=cwd)

    def stop(self, name: str) -> None:
        """End a worker, and the process it keeps."""
        _end(self.workers.pop(name))

    def process_of(self, name: str) -> psutil.Process:
        """The process that does a worker's work: its keeper's child."""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            for child in psutil.Process(self.workers[name].pid).children():
                if "spawn_main" in " ".join(child.cmdline()):
                    return child
        raise AssertionError(f"worker {name} has no process: {(self.folder / f'{name}.log').read_text()}")


@contextmanager
def running_cluster(folder: Path, environment: dict[str, str]) -> Iterator[RunningCluster]:
    """A scheduler without workers; all that was started ends with the block."""
    folder.mkdir(parents=True)
    files, told = make_certificates(folder / "tls"), folder / "scheduler.json"
    # Whoever is told to end does so at once, and a restarted worker does not wait for its start to be noticed.
    environment = {**os.environ, "PYTHONPATH": str(CHECKOUT), "OPENBLAS_NUM_THREADS": "1", **environment}
    line = [sys.executable, "-m", "distributed.cli.dask_scheduler", *files.options(), "--protocol", "tls"]
    line += ["--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(told)]
    scheduler = _process(line, folder / "scheduler.log", environment)
    running: RunningCluster | None = None
    try:
        deadline = time.monotonic() + PATIENCE
        while not (told.is_file() and told.read_text().endswith("}")):
            assert scheduler.poll() is None, (folder / "scheduler.log").read_text()
            assert time.monotonic() < deadline
            time.sleep(0.02)
        running = RunningCluster(json.loads(told.read_text())["address"], files, folder, environment)
        yield running
    finally:
        for worker in [] if running is None else running.workers.values():
            _end(worker)
        _end(scheduler)


def _process(
    line: list[str], log: Path, environment: dict[str, str], *, cwd: Path | None = None
) -> subprocess.Popen[bytes]:
    with log.open("wb") as file:
        return subprocess.Popen(line, stdout=file, stderr=subprocess.STDOUT, env=environment, cwd=cwd)


def _end(process: subprocess.Popen[bytes]) -> None:
    """Kill a process and those it started."""
    family = [*psutil.Process(process.pid).children(recursive=True)] if process.poll() is None else []
    process.kill()
    process.wait()
    for child in family:
        try:
            child.kill()
        except psutil.NoSuchProcess:
            continue
