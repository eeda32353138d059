"""What the command line shows: progress, tables, JSON. Results go to stdout, everything else to stderr."""

import os
import sys
import time
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ars_web.datasets.planned import ExportPlan

LINES_EVERY = 5.0
"""Seconds between two lines of progress where there is no terminal to draw a bar on."""

OnProgress = Callable[[int, int], None]
"""Called with how much is done and how much there is in all."""


def note(line: str) -> None:
    """One line to the person at the keyboard, on stderr."""
    print(line, file=sys.stderr, flush=True)


def json_bytes(value: object) -> bytes:
    """`value` as JSON; records become objects, times ISO 8601, paths texts."""
    import orjson

    return orjson.dumps(value, default=_json_value, option=orjson.OPT_INDENT_2 | orjson.OPT_APPEND_NEWLINE)


def print_json(value: object) -> None:
    """`value` as JSON on stdout."""
    sys.stdout.write(json_bytes(value).decode())


def write_json(file: Path, value: object) -> None:
    """`value` as JSON in a file, whole or not at all."""
    from ars_web.reporting.whole_file import write_whole

    write_whole(file, json_bytes(value))


def _json_value(value: object) -> str:
    if isinstance(value, Path):
        return str(value).encode(errors="backslashreplace").decode()
    raise TypeError(f"{type(value).__name__} has no form in JSON")


def print_table(titles: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Aligned columns on stdout, numbers to the right; nothing is cut, whatever the terminal's width."""
    cells = [[str(cell) for cell in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(titles, *cells, strict=True)]
    right = [bool(rows) and all(isinstance(row[i], int | float) for row in rows) for i in range(len(titles))]
    for line in [list(titles), *cells]:
        padded = (
            cell.rjust(width) if numeric else cell.ljust(width)
            for cell, width, numeric in zip(line, widths, right, strict=True)
        )
        print("  ".join(padded).rstrip())


def print_forecast(plan: "ExportPlan", *, as_json: bool) -> None:
    """What an export would write, and which frames it takes of which session."""
    from ars_web.datasets.forecast import forecast

    found = forecast(plan)
    if as_json:
        chosen = {
            session.id: plan.frames.index[plan.frames.session == number].tolist()
            for number, session in enumerate(plan.sessions)
        }
        print_json({"forecast": found.model_dump(mode="json"), "frames": chosen})
        return
    seen = found.directions.splits
    rows = [(name, s.images, s.negatives, s.labels, seen[name]) for name, s in found.splits.items()]
    print_table(("split", "images", "without a label", "labels", "directions"), rows)
    print(*found.lines(), sep="\n")
    print_lost(found.dropped, found.losses)


def print_lost(dropped: Mapping[str, int], losses: Sequence[str]) -> None:
    """The labels that an export drops, by reason, and what its format cannot hold."""
    reasons = ", ".join(f"{count} {reason.replace('_', ' ')}" for reason, count in dropped.items() if count)
    print(f"dropped: {reasons or 'none'}")
    for loss in losses:
        print(f"lost: {loss}")


@contextmanager
def progress(title: str) -> Generator[OnProgress]:
    """A bar on a terminal, a plain line every few seconds and at the end elsewhere; both on stderr."""
    if sys.stderr.isatty():
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        columns = (
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
        )
        with Progress(*columns, console=Console(stderr=True)) as bar:
            task = bar.add_task(title, total=None)
            yield lambda done, total: bar.update(task, completed=done, total=total)
        return

    last = time.monotonic()

    def line(done: int, total: int) -> None:
        nonlocal last
        if done == total or time.monotonic() - last >= LINES_EVERY:
            last = time.monotonic()
            note(f"{title}: {done} of {total}")

    yield line


def has_screen() -> bool:
    """Whether there is somebody to show a page to: a terminal, and a desktop to open a browser on."""
    desktop = sys.platform == "darwin" or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
    return sys.stdin.isatty() and desktop


def open_browser(url: str) -> None:
    """The page at `url`, in the person's browser; whoever calls does not wait for it."""
    import threading
    import webbrowser

    threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()
