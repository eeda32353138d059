"""Which frames a CVAT video has. Tracks list those with shapes; those that show nothing are in the head alone.

    <meta><task> <size>12</size> <start_frame>100</start_frame> <stop_frame>155</stop_frame>
                 <frame_filter>step=5</frame_filter> </task></meta>

Frame i of a task, from 0, is numbered start_frame + i * step in the file. Of a <job>, a part of a task, the head
has the places within the task instead: they are numbers where the task has no step, and begins at frame 0.

Source: CVAT's own writer, cvat/apps/dataset_manager/bindings.py (meta_for_task, abs_frame_id)
"""

import re
from collections.abc import Collection, Iterator
from pathlib import Path

from ars_web.annotations.xml_elements import XmlElement
from ars_web.errors import BadFile

MOST_FRAMES = 1_000_000
"""Of a video; a line of a file can say any number."""

_STEP = re.compile(r"step\s*=\s*([1-9]\d{0,8})")


def tasks_of(meta: XmlElement) -> list[XmlElement]:
    """Every <task> of the head, or the <job>."""
    return [element for element in _all(meta) if element.tag in ("task", "job")]


def frame_numbers(file: Path, task: XmlElement) -> range | None:
    """The numbers of a task's frames; None where its head does not say them.

    Raises:
        BadFile: a number of the head is none, or there are over MOST_FRAMES; the message names the line.
    """
    size, start, stop = (_whole(file, task, tag) for tag in ("size", "start_frame", "stop_frame"))
    told = task.child("frame_filter")
    filtered = "" if told is None else told.text.strip()
    match = _STEP.fullmatch(filtered)
    if (filtered and match is None) or (filtered and task.tag == "job"):
        return None
    step = int(match[1]) if match else 1
    first = start or 0
    if size is None and stop is None:
        return None
    # Of images some versions write a last frame of 0, whatever their number.
    ends = [first + size * step] if size is not None else []
    ends += [stop + 1] if stop is not None and (size is None or stop > first) else []
    found = range(first, min(ends), step)
    if len(found) > MOST_FRAMES:
        raise BadFile(
            file, f"<{task.tag}> says that it has {len(found)} frames; over {MOST_FRAMES} are too many", line=task.line
        )
    return found


def are_all_of(numbers: range, listed: Collection[int]) -> bool:
    """Whether the frames that tracks list are among those; where they are not, the head means something else."""
    return all(number in numbers for number in listed)


def _all(element: XmlElement) -> Iterator[XmlElement]:
    yield element
    for child in element.children:
        yield from _all(child)


def _whole(file: Path, task: XmlElement, tag: str) -> int | None:
    child = task.child(tag)
    text = "" if child is None else child.text.strip()
    if child is None or not text:
        return None
    if not (text.isascii() and text.isdecimal() and len(text) < 10):
        raise BadFile(file, f"<{tag}> must hold a whole number of frames, not {text[:40]!r}", line=child.line)
    return int(text)
