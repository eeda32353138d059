"""A multipart form with one file, written to disk piece by piece and counted while it comes.

The framework's own form parser would keep fields of any size in memory and the file in the system's folder for
temporary files, which may be memory as well.
"""

from collections.abc import AsyncIterable, Callable, Collection
from pathlib import Path, PurePath
from typing import IO

from python_multipart.exceptions import FormParserError
from python_multipart.multipart import MultipartParser, parse_options_header
from starlette.concurrency import run_in_threadpool

from ars_web.errors import BadInput, StoreError, TooLarge

LONGEST_FIELD = 1000
"""Bytes of a field that is not the file."""


class MultipartForm:
    """What has come of a form so far: python_multipart calls these methods.

    Attributes:
        archive: where the part `file` goes.
        file_name: what the client calls it, without folders; None until it comes.
        fields: the other parts.
        whole: whether the form's end has come.
    """

    def __init__(self, archive: Path, *, known: Collection[str]) -> None:
        self.archive = archive
        self.file_name: str | None = None
        self.fields: dict[str, bytes] = {}
        self.whole = False
        self._known = known
        self._header_name = b""
        self._header_value = b""
        self._disposition = b""
        self._part = ""
        self._target: IO[bytes] | None = None

    async def receive(
        self,
        content_type: str,
        pieces: AsyncIterable[bytes],
        *,
        declared: str | None,
        most: int,
        remedy: str = "import the recording from a declared root instead",
    ) -> None:
        """Take the form in; `declared` is its Content-Length, and `remedy` what to do with one over `most` bytes.

        Raises:
            TooLarge: it is over `most` bytes, whatever its headers say.
            BadInput: it is no multipart form, is cut short, or has parts that are not known.
            StoreError: the file cannot be kept.
        """
        kind, options = parse_options_header(content_type)
        boundary = options.get(b"boundary")
        if kind != b"multipart/form-data" or not boundary:
            raise BadInput(f"a multipart/form-data request is needed, with {', '.join(('`file`', *self._known))}")
        too_large = TooLarge(f"the upload is over {most} bytes; {remedy}")
        if declared is not None and declared.isdigit() and int(declared) > most:
            raise too_large
        received = 0
        try:
            parser = MultipartParser(boundary, self._callbacks())  # pyright: ignore[reportArgumentType]: plain callables
            async for piece in pieces:
                received += len(piece)
                if received > most:
                    raise too_large
                await run_in_threadpool(parser.write, piece)
        except FormParserError as error:
            raise BadInput(f"the form cannot be read: {error}") from error
        except OSError as error:
            raise StoreError(f"the upload cannot be kept: {error.strerror}") from error
        finally:
            self._part_end()
        if not self.whole:
            raise BadInput("the form ends before its last part does")
        if self.file_name is None:
            raise BadInput("the form's part `file` is missing")

    def _callbacks(self) -> dict[str, Callable[..., None]]:
        return {
            "on_part_begin": self._part_begin,
            "on_header_field": self._on_header_name,
            "on_header_value": self._on_header_value,
            "on_header_end": self._header_end,
            "on_headers_finished": self._headers_finished,
            "on_part_data": self._part_data,
            "on_part_end": self._part_end,
            "on_end": self._end,
        }

    def _part_begin(self) -> None:
        self._disposition = b""

    def _on_header_name(self, data: bytes, start: int, end: int) -> None:
        self._header_name += data[start:end]

    def _on_header_value(self, data: bytes, start: int, end: int) -> None:
        self._header_value += data[start:end]

    def _header_end(self) -> None:
        if self._header_name.lower() == b"content-disposition":
            self._disposition = self._header_value
        self._header_name = self._header_value = b""

    def _headers_finished(self) -> None:
        _, options = parse_options_header(self._disposition)
        self._part = options.get(b"name", b"").decode(errors="replace")
        if self._part == "file" and self.file_name is None:
            name = options.get(b"filename", b"").decode(errors="replace").replace("\\", "/")
            self.file_name = "".join(c for c in PurePath(name).name if c.isprintable())[:200]
            self._target = self.archive.open("xb")
        elif self._part in self._known and self._part not in self.fields:
            self.fields[self._part] = b""
        else:
            raise BadInput(f"the form's part {self._part[:100]!r} is unknown or given twice")

    def _part_data(self, data: bytes, start: int, end: int) -> None:
        if self._target is not None:
            self._target.write(memoryview(data)[start:end])
            return
        self.fields[self._part] += data[start:end]
        if len(self.fields[self._part]) > LONGEST_FIELD:
            raise TooLarge(f"the form's part {self._part} is over {LONGEST_FIELD} bytes")

    def _part_end(self) -> None:
        if self._target is not None:
            self._target.close()
            self._target = None

    def _end(self) -> None:
        self.whole = True
