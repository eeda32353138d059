"""The commands of `ars-web`: each parses, calls what is below, and prints.

Everything of ARS Web that takes long to import is imported inside the command that needs it, so that `--help` is
there at once.
"""

import os
import signal
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from io import TextIOWrapper
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ars_web import arguments as take
from ars_web import box_commands, class_commands, judging_commands, kernel_cache, label_commands, study_commands
from ars_web.errors import ArsError
from ars_web.option_groups import DatasetChoices, grouped
from ars_web.terminal import (
    has_screen,
    note,
    open_browser,
    print_forecast,
    print_json,
    print_lost,
    print_table,
    progress,
)

if TYPE_CHECKING:
    from ars_web.recordings.recording import SkippedFrame

DRY_RUN_FOLDER = ".ars-web-dry-run"
"""Where a dataset would be that nobody named a folder for; it is never made."""

INTERRUPTED = 130
"""Exit status after Ctrl-C, as shells count it: 128 + SIGINT."""

DEMO_PORT = 8000
"""Where the demo is served, unless something else is there."""

SKIPPED_SHOWN = 5
"""Skipped frames that `import` names one by one; the rest are counted."""

app = typer.Typer(
    name="ars-web",
    help="Turns a tracked camera recording and a few virtual boxes into a labelled training set.",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"max_content_width": 120},
)
app.add_typer(box_commands.app, name="boxes")
app.add_typer(class_commands.app, name="classes")
app.add_typer(label_commands.app, name="labels")
app.add_typer(study_commands.app)
app.add_typer(judging_commands.app)


@app.callback(invoke_without_command=True)
def top(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print the version and stop.")] = False,
) -> None:
    from ars_web import __version__

    if version:
        print(f"ars-web {__version__}")
    elif context.invoked_subcommand is None:
        print(context.get_help())
    else:
        return
    raise typer.Exit


@app.command()
def demo(
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the session's page, where there is a screen.")
    ] = True,
    port: take.DemoPort = None,
    serve_it: Annotated[
        bool, typer.Option("--serve/--no-serve", help="Serve it until Ctrl-C, or make all of it and end.")
    ] = True,
    sessions: take.Sessions = take.SESSIONS,
) -> None:
    """Make the generated recording, import and box it, and open it in the browser.

    What is there already is kept, so a second run is quick. Datasets and pictures are made while it is served.
    """
    from ars_web import demonstration

    made = demonstration.prepare(sessions, show=progress)
    print(f"session   {made.session} in {sessions.resolve()}", flush=True)
    if not serve_it:
        demonstration.make_datasets(sessions, made, show=progress)
        print(*made.lines(), sep="\n")
        return

    from ars_web.app import serve as run_server

    settings = take.server_settings(
        {"sessions": sessions, "port": DEMO_PORT if port is None else port, "roots": {"demo": made.home}}
    )

    def say(line: str) -> None:
        print(line, flush=True)

    with ExitStack() as stack:

        def ready(url: str) -> None:
            if browser and has_screen():
                open_browser(url)
            stack.enter_context(demonstration.making_datasets(sessions, made, tell=say))

        run_server(settings, session=made.session, or_any_port=port is None, on_ready=ready)


@app.command()
def serve(
    host: take.Host = "127.0.0.1",
    port: take.Port = 8000,
    root: take.Roots = None,
    token: take.Token = None,
    executor: take.Executor = "local",
    tls_ca_file: take.TlsCaFile = None,
    tls_cert: take.TlsCert = None,
    tls_key: take.TlsKey = None,
    workers: take.Workers = None,
    segmenter: take.Segmenter = None,
    allow_host: take.AllowedHosts = None,
    sessions: take.Sessions = take.SESSIONS,
) -> None:
    """Answer the HTTP API, and the page, for a sessions folder."""
    from ars_web.app import serve as run_server

    given = {
        "sessions": sessions,
        "host": host,
        "port": port,
        "roots": take.named_roots(root),
        "token": token,
        "executor": executor,
        "tls_ca_file": tls_ca_file,
        "tls_cert": tls_cert,
        "tls_key": tls_key,
        "workers": workers,
        "segmenter": segmenter,
        "hosts": allow_host or [],
    }
    run_server(take.server_settings(given))


@app.command("import")
def import_recording(
    path: take.RecordingPath,
    name: take.Name = None,
    kind: take.RecordingFormat = "auto",
    images: take.ImageFolder = None,
    camera: take.CameraFile = None,
    classes: take.ClassNames = None,
    copy: take.Copy = False,
    sessions: take.Sessions = take.SESSIONS,
    as_json: take.Json = False,
) -> None:
    """Make a session from a tracked recording; its id is the last line printed."""
    from ars_web.recordings.registry import READERS, ReadOptions, read_recording
    from ars_web.recordings.stored_images import read_with_stored_images
    from ars_web.recordings.stores import StoreFolder, place
    from ars_web.sessions.store import SessionStore

    if kind != "auto" and kind not in READERS:
        raise typer.BadParameter(f"{kind!r} is none of auto, {', '.join(READERS)}", param_hint="--format")
    class_names = take.comma_separated(classes, "--classes")
    folder = None if images is None else place(images)
    if isinstance(folder, StoreFolder):
        recording = read_with_stored_images(path, folder, format=kind, options=ReadOptions(camera=camera))
    else:
        recording = read_recording(path, format=kind, options=ReadOptions(images=folder, camera=camera))
    with SessionStore(sessions) as store, progress("Importing frames") as advance:
        made = store.create(
            recording,
            name=take.session_name(path) if name is None else name,
            class_names=class_names,
            copy_images=copy,
            progress=advance,
        )
    if as_json:
        print_json({"session": made, "skipped": recording.skipped})
        return
    _note_skipped(recording.skipped)
    note(f"{made.name}: {made.frames} frames ({made.format}), {made.classes} classes, {made.boxes} boxes")
    print(made.id)


@app.command("list")
def list_sessions(sessions: take.Sessions = take.SESSIONS, as_json: take.Json = False) -> None:
    """The sessions in the folder."""
    from ars_web.sessions.store import SessionStore

    with SessionStore(sessions) as store:
        found = store.list()
    if as_json:
        print_json(found)
        return
    columns = ("id", "name", "format", "frames", "skipped", "classes", "boxes", "revision", "changed")
    print_table(columns, [[*(getattr(s, c) for c in columns[:-1]), f"{s.changed:%Y-%m-%d %H:%M}"] for s in found])


@app.command()
@grouped
def export(
    session: take.Session,
    kind: take.DatasetFormat,
    *,
    out: take.DatasetFolder = None,
    choices: DatasetChoices,
    masks: take.Masks = None,
    heading_bins: take.HeadingBins = None,
    split_hold_out: take.SplitHoldOut = None,
    merge: take.Merge = None,
    executor: take.Executor = "local",
    tls_ca_file: take.TlsCaFile = None,
    tls_cert: take.TlsCert = None,
    tls_key: take.TlsKey = None,
    workers: take.Workers = None,
    check: take.Check = False,
    dry_run: take.DryRun = False,
    sessions: take.Sessions = take.SESSIONS,
    as_json: take.Json = False,
) -> None:
    """Write a training set. Ctrl-C stops it; the same command then goes on from there."""
    from ars_web.datasets.cluster import cluster_at
    from ars_web.datasets.jobs import plan_export, run_export
    from ars_web.datasets.readback.comparison import compare
    from ars_web.datasets.registry import WRITERS
    from ars_web.datasets.store_export import plan_stored_export, run_stored_export
    from ars_web.recordings.stores import place
    from ars_web.sessions.store import SessionStore

    if kind not in WRITERS:
        raise typer.BadParameter(f"{kind!r} is none of {', '.join(WRITERS)}", param_hint="--format")
    take.refuse_foreign_options(kind, {"masks": masks, "heading_bins": heading_bins})
    if out is None and not dry_run:
        raise typer.BadParameter("name the folder for the dataset, or ask for a --dry-run", param_hint="--out")
    if check and dry_run:
        raise typer.BadParameter("there is nothing to read back of a --dry-run", param_hint="--check")
    target = place(DRY_RUN_FOLDER if out is None else out)
    if check and not isinstance(target, Path):
        raise typer.BadParameter(
            f"a set on a store is not read back; export it to a folder, not to {target}", param_hint="--check"
        )
    cluster = cluster_at(executor, ca_file=tls_ca_file, cert=tls_cert, key=tls_key)
    with SessionStore(sessions) as store:
        ids = [store.find(name) for name in (session, *take.comma_separated(merge, "--merge"))]
        own = {
            "masks": masks,
            "heading_bins": heading_bins,
            "split.hold_out": [store.find(name) for name in take.comma_separated(split_hold_out, "--split-hold-out")],
            "sessions": ids[1:],
        }
        options = take.export_options({**choices.given(), **own})
        snapshots = [store.snapshot(sid) for sid in ids]
    if dry_run:
        planned = (
            plan_export(snapshots, format=kind, options=options, out=target)
            if isinstance(target, Path)
            else plan_stored_export(snapshots, format=kind, options=options)
        )
        print_forecast(planned, as_json=as_json)
        return
    try:
        if isinstance(target, Path):
            plan = plan_export(snapshots, format=kind, options=options, out=target)
            target = plan.out
            with progress("Exporting") as advance:
                report = run_export(plan, workers=workers, cluster=cluster, on_progress=advance)
        else:
            plan = plan_stored_export(snapshots, format=kind, options=options)
            with progress("Exporting") as advance:
                report = run_stored_export(plan, target, workers=workers, cluster=cluster, on_progress=advance)
    except KeyboardInterrupt:
        note("ars-web: stopped; the same command goes on from here")
        raise typer.Exit(INTERRUPTED) from None
    checked = compare(plan, plan.out) if check else None
    if as_json:
        print_json(
            {
                "out": target if isinstance(target, Path) else str(target),
                "report": report.model_dump(mode="json"),
                "check": checked,
            }
        )
    else:
        rows = [(name, s.images, s.negatives, s.labels) for name, s in report.splits.items()]
        print_table(("split", "images", "without a label", "labels"), rows)
        print_lost(report.dropped, report.losses)
        if checked is not None:
            print(*checked.lines(), sep="\n")
        print(target)
    if checked is not None and not checked.agrees:
        raise typer.Exit(1)


@app.command()
def preview(
    session: take.Session,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the pictures.")],
    frames: Annotated[int, typer.Option("--frames", metavar="N", min=1, help="How many.")] = 6,
    kind: Annotated[
        str | None, typer.Option("--format", metavar="FORMAT", help="Draw what this format holds of each label.")
    ] = None,
    shape: take.Shape = None,
    sessions: take.Sessions = take.SESSIONS,
    as_json: take.Json = False,
) -> None:
    """Draw the labels into a few frames, as PNG, and print the files."""
    from ars_web.datasets.preview import preview as draw
    from ars_web.sessions.store import SessionStore

    with SessionStore(sessions) as store:
        snapshot = store.snapshot(store.find(session))
    pictures = draw(snapshot, out, count=frames, format=kind, shape=shape)
    if as_json:
        print_json(pictures)
    else:
        print(*pictures, sep="\n")


@app.command()
def pack(
    session: take.Session,
    target: Annotated[Path, typer.Argument(metavar="TARGET", help="A new folder, or a new file ending in .zip.")],
    sessions: take.Sessions = take.SESSIONS,
) -> None:
    """Write a whole session, images included, into one portable folder or zip."""
    from ars_web.sessions.portable import export_session
    from ars_web.sessions.store import SessionStore

    with SessionStore(sessions) as store:
        export_session(store, store.find(session), target)
    print(target)


@app.command()
def unpack(
    source: Annotated[Path, typer.Argument(metavar="SOURCE", help="What pack wrote: a folder or a zip.")],
    name: take.Name = None,
    sessions: take.Sessions = take.SESSIONS,
    as_json: take.Json = False,
) -> None:
    """Take a packed session in as a new one; its id is the last line printed."""
    from ars_web.sessions.portable import import_session
    from ars_web.sessions.store import SessionStore

    with SessionStore(sessions) as store:
        made = import_session(store, source, name=name)
    if as_json:
        print_json(made)
    else:
        print(made.id)


@app.command()
def formats(as_json: take.Json = False) -> None:
    """The formats that recordings and labels come in and datasets go out."""
    from ars_web.annotations.registry import READERS as LABEL_READERS
    from ars_web.datasets.registry import WRITERS
    from ars_web.recordings.registry import READERS

    rows = [
        *(("import", reader.format, f"{reader.title}: {reader.needs}") for reader in READERS.values()),
        *(("labels", reader.format, f"{reader.title}: {reader.needs}") for reader in LABEL_READERS.values()),
        *(("export", writer.format, writer.title) for writer in WRITERS.values()),
    ]
    if as_json:
        print_json([dict(zip(("direction", "format", "title"), row, strict=True)) for row in rows])
    else:
        print_table(("", "format", "what"), rows)


@app.command()
def check(sessions: take.Sessions = take.SESSIONS, as_json: take.Json = False) -> None:
    """Look at the install, the sessions folder and its databases: what is wrong, and how to mend it."""
    from ars_web.installation import findings

    found = findings(sessions)
    if as_json:
        print_json(found)
    else:
        print_table(("", "what", "found"), [("ok" if f.ok else "WRONG", f.subject, f.found) for f in found])
        for finding in found:
            if not finding.ok:
                note(f"{finding.subject}: {finding.remedy}")
    if not all(finding.ok for finding in found):
        raise typer.Exit(1)


@app.command()
def openapi() -> None:
    """Print the API's OpenAPI document."""
    from ars_web.app import create_app

    print_json(create_app(take.server_settings({"sessions": take.SESSIONS})).openapi())


def main() -> None:
    """Run the command line and end the process with its exit status."""
    # The small matrices here gain nothing from a BLAS with threads, and every worker of an export would start some.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    kernel_cache.find_place(os.environ, package=Path(__file__).parent)
    # A path that is not UTF-8 can be shown, if not kept: as backslashes and numbers.
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
    # Whoever ends it politely gets the same clean end as with Ctrl-C.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    sys.exit(run(sys.argv[1:]))


def run(arguments: Sequence[str]) -> int:
    """The exit status of one command line: 0 done, 2 wrong arguments, 130 stopped by Ctrl-C, 1 anything else."""
    try:
        status = app(list(arguments), prog_name="ars-web", standalone_mode=False)
        sys.stdout.flush()
    except BrokenPipeError:
        # Whoever read the output has seen enough; what is left of it goes nowhere, also at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except typer.TyperException as error:
        command = getattr(getattr(error, "ctx", None), "command_path", "ars-web")
        _name_refused_value(error)
        _fail(f"{error.format_message()} (see `{command} --help`)")
        return error.exit_code
    except ArsError as error:
        _fail(str(error))
        return 1
    except OSError as error:
        _fail(f"{error.filename}: {error.strerror}" if error.filename else str(error))
        return 1
    return status if isinstance(status, int) else 0


def _name_refused_value(error: typer.TyperException) -> None:
    """Add to the message what was given, which pydantic's, of a number beyond its limits, does not say."""
    from pydantic import ValidationError

    if isinstance(error.__cause__, ValidationError):
        fault = error.__cause__.errors()[0]
        said, given = fault["msg"].removeprefix("Value error, ").rstrip("."), str(fault["input"])
        error.message = said if given in said else f"{said}, not {given}"


def _fail(message: str) -> None:
    note("ars-web: " + " ".join(message.split("\n")))


def _note_skipped(skipped: Sequence["SkippedFrame"]) -> None:
    for frame in skipped[:SKIPPED_SHOWN]:
        note(f"skipped {frame.name}: {frame.reason} ({frame.where})")
    if len(skipped) > SKIPPED_SHOWN:
        note(f"and {len(skipped) - SKIPPED_SHOWN} more: {len(skipped)} frames are skipped in all; --json lists them")
