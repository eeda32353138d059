"""XML files element by element, whatever their size. Document types and with them entities are refused: a few lines of
those stand for gigabytes, or for other files."""

from collections.abc import Generator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.parsers import expat

from ars_web.errors import BadFile

DEEPEST = 40
"""Elements within each other."""

_CHUNK = 1 << 16


@dataclass(eq=False)
class XmlElement:
    """One element with all that is in it.

    Attributes:
        text: within it, that of its children left out.
        line: where it begins.
    """

    tag: str
    attributes: dict[str, str]
    line: int
    text: str = ""
    children: list["XmlElement"] = field(default_factory=list["XmlElement"])

    def child(self, tag: str) -> "XmlElement | None":
        """The first child of that name."""
        return next((child for child in self.children if child.tag == tag), None)


class _Builder:
    """What expat calls: elements below the root are kept until they are whole, then handed on."""

    def __init__(self, file: Path, root: str) -> None:
        self.whole: list[XmlElement] = []
        self._file = file
        self._root = root
        self._open: list[XmlElement] = []
        self._parser = expat.ParserCreate()
        self._parser.buffer_text = True
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.CharacterDataHandler = self._text
        self._parser.StartDoctypeDeclHandler = self._refuse

    def feed(self, data: bytes, *, last: bool) -> None:
        try:
            self._parser.Parse(data, last)
        except expat.ExpatError as error:
            raise BadFile(self._file, f"is not XML: {expat.ErrorString(error.code)}", line=error.lineno) from error

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        line = self._parser.CurrentLineNumber
        if not self._open and tag != self._root:
            raise BadFile(self._file, f"begins with <{tag[:40]}>, not with <{self._root}>", line=line)
        if len(self._open) >= DEEPEST:
            raise BadFile(self._file, "is nested too deeply", line=line)
        self._open.append(XmlElement(tag, attributes, line))

    def _end(self, tag: str) -> None:
        element = self._open.pop()
        if len(self._open) == 1:
            self.whole.append(element)
        elif self._open:
            self._open[-1].children.append(element)

    def _text(self, text: str) -> None:
        if len(self._open) > 1:
            self._open[-1].text += text

    def _refuse(self, *doctype: Any) -> None:
        raise BadFile(
            self._file,
            "has a document type (<!DOCTYPE …>), which could hold entities and is not read; take it out",
            line=self._parser.CurrentLineNumber,
        )


def elements_of(file: Path, *, root: str) -> Generator[XmlElement]:
    """The children of the root, which must be called `root`, one by one.

    Raises:
        BadFile: it cannot be read, is no XML, begins otherwise, or has a document type; the message names the line.
    """
    builder = _Builder(file, root)
    with file.open("rb") as data:
        while chunk := data.read(_CHUNK):
            builder.feed(chunk, last=False)
            yield from builder.whole
            builder.whole.clear()
    builder.feed(b"", last=True)
    yield from builder.whole
