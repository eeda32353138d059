"""Settings of one server, typed. Built by `cli.py` from its arguments, read there and in `app.py`, nowhere else."""

from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, field_validator

from ars_web.datasets.cluster import checked_executor
from ars_web.errors import BadInput

RootName = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,63}$")]

GIB = 2**30
MIB = 2**20


class Settings(BaseModel):
    """What a server is started with.

    Attributes:
        sessions: the folder that sessions, exports and the token live in; made where it is missing.
        host: the address to listen on. Anything but a loopback address opens the server to the network.
        port: 0 takes a free one.
        roots: folders that clients may import recordings from, by the name they use for it.
        hosts: further names that the server is reached by, such as a proxy's; loopback names and `host` always are.
        token: the bearer token; None: the one kept in `<sessions>/.token`.
        executor: where exports run: `local`, or a Dask scheduler at `tls://HOST:PORT`.
        tls_ca_file, tls_cert, tls_key: PEM files to reach it with; None: what Dask's own configuration says.
        workers: processes of a local export; None: one a core.
        segmenter: an ONNX file for the smart tool (`masks/onnx_segmenter.py` says what it must hold); None: GrabCut.
        largest_upload: bytes of an uploaded archive.
        largest_body: bytes of any other request's body.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    sessions: Path
    host: str = Field("127.0.0.1", min_length=1)
    port: int = Field(8000, ge=0, le=65535)
    roots: dict[RootName, Path] = Field(default_factory=dict[str, Path])
    hosts: tuple[str, ...] = ()
    token: Annotated[str, StringConstraints(pattern=r"^[\x21-\x7e]+$")] | None = None
    executor: str = "local"
    tls_ca_file: Path | None = None
    tls_cert: Path | None = None
    tls_key: Path | None = None
    workers: int | None = Field(None, ge=1)
    segmenter: Path | None = None
    largest_upload: int = Field(16 * GIB, ge=1)
    largest_body: int = Field(8 * MIB, ge=1)

    @field_validator("executor")
    @classmethod
    def _executor_is_safe(cls, executor: str) -> str:
        try:
            return checked_executor(executor)
        except BadInput as error:
            raise ValueError(str(error)) from error

    @field_validator("roots")
    @classmethod
    def _roots_are_folders(cls, roots: dict[str, Path]) -> dict[str, Path]:
        for name, path in roots.items():
            if not path.is_dir():
                raise ValueError(f"root {name}={path} is not a folder")
        return {name: path.resolve() for name, path in roots.items()}
