"""What the commands take: arguments and options with their help, and how their texts become values."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from ars_web.errors import BadInput

if TYPE_CHECKING:
    from pydantic import ValidationError

    from ars_web.datasets.options import ExportOptions
    from ars_web.sessions.model import ObjectClass, SessionState
    from ars_web.sessions.object_mesh import SourcedMesh
    from ars_web.settings import Settings

SESSIONS = Path("sessions")
"""The sessions folder where nothing else is said."""

UNTELLING_STEMS = ("transforms", "poses", "groundtruth", "images", "cameras")
"""Names that every recording of a format has; its folder's says more."""

SPELLED_DIFFERENTLY = {"sessions": "--merge", "roots": "--root", "hosts": "--allow-host"}
"""Options whose name is not that of their setting with dashes."""


def _safe_executor(executor: str) -> str:
    """Where exports run.

    Raises:
        typer.BadParameter: it may not be used.
    """
    if executor == "local":
        return executor

    from ars_web.datasets import cluster

    try:
        return cluster.checked_executor(executor)
    except BadInput as error:
        raise typer.BadParameter(str(error), param_hint="--executor") from error


Sessions = Annotated[
    Path, typer.Option("--sessions", metavar="DIR", envvar="ARS_WEB_SESSIONS", help="The sessions folder.")
]
Session = Annotated[str, typer.Argument(metavar="SESSION", help="A session's id or its unique name.")]
OneBox = Annotated[int | None, typer.Option("--box", metavar="ID", min=0, help="This object alone.")]
OneClass = Annotated[str | None, typer.Option("--class", metavar="NAME", help="The objects of this class alone.")]
AzimuthBins = Annotated[
    int, typer.Option("--azimuth-bins", metavar="N", min=1, max=360, help="Bins round the box's z axis.")
]
PolarBins = Annotated[int, typer.Option("--polar-bins", metavar="N", min=1, max=360, help="Bins from +z down to -z.")]
Json = Annotated[bool, typer.Option("--json", help="Print JSON on stdout and nothing else.")]
Force = Annotated[bool, typer.Option("--force", help="Replace the file where it exists.")]
Name = Annotated[str | None, typer.Option("--name", metavar="NAME", help="The session's name; default: as it came.")]
Port = Annotated[int, typer.Option("--port", metavar="N", min=0, max=65535, help="Port; 0 takes a free one.")]
DemoPort = Annotated[
    int | None,
    typer.Option(
        "--port", metavar="N", min=0, max=65535, help="Port; default: 8000, or a free one where that is taken."
    ),
]

# serve
Host = Annotated[str, typer.Option("--host", metavar="HOST", help="Address to listen on.")]
Roots = Annotated[
    list[str] | None,
    typer.Option("--root", metavar="NAME=PATH", help="A folder clients may import from, and its name; repeatable."),
]
Token = Annotated[
    str | None,
    typer.Option("--token", metavar="TOKEN", envvar="ARS_WEB_TOKEN", help="Bearer token; default: the folder's own."),
]
Executor = Annotated[
    str,
    typer.Option(
        "--executor",
        metavar="local|tls://HOST:PORT",
        help="Where exports run: here, or on Dask.",
        callback=_safe_executor,
    ),
]
TlsCaFile = Annotated[
    Path | None,
    typer.Option("--tls-ca-file", metavar="FILE", help="Certificate of who signed the cluster's; default: Dask's own."),
]
TlsCert = Annotated[
    Path | None, typer.Option("--tls-cert", metavar="FILE", help="Certificate to show to the cluster's scheduler.")
]
TlsKey = Annotated[Path | None, typer.Option("--tls-key", metavar="FILE", help="That certificate's key.")]
Segmenter = Annotated[
    Path | None,
    typer.Option(
        "--segmenter", metavar="FILE.onnx", help="A network of your own for the smart tool; default: GrabCut."
    ),
]
AllowedHosts = Annotated[
    list[str] | None,
    typer.Option("--allow-host", metavar="NAME", help="A further name the server is reached by; repeatable."),
]

# classes and boxes
BoxId = Annotated[int, typer.Argument(metavar="BOX", help="The box's id.")]
MeshFile = Annotated[Path | None, typer.Argument(metavar="FILE", help="An obj, ply, glb or stl; none with --remove.")]
MeshUnit = Annotated[
    str | None, typer.Option("--unit", metavar="mm|cm|m|in", help="Of the file's numbers. Never guessed.")
]
MeshAxes = Annotated[
    str | None,
    typer.Option(
        "--axes", metavar="x,y,z", help="Which axes of the file run along the box's x, y and z, such as x,-z,y."
    ),
]
MeshOrigin = Annotated[
    str,
    typer.Option(
        "--origin",
        metavar="centre|file",
        help="What lies at the box's centre: the mesh's middle, or the file's origin.",
    ),
]
Remove = Annotated[bool, typer.Option("--remove", help="Take it away instead.")]

# import
RecordingPath = Annotated[Path, typer.Argument(metavar="PATH", help="A tracked recording: a folder or a file.")]
RecordingFormat = Annotated[
    str, typer.Option("--format", metavar="FORMAT", help="auto, or one that `ars-web formats` lists.")
]
ImageFolder = Annotated[
    str | None,
    typer.Option("--images", metavar="DIR", help="Image folder, if not the one the format implies; s3://BUCKET/DIR."),
]
CameraFile = Annotated[
    Path | None,
    typer.Option("--camera", metavar="FILE", help="w h fx fy cx cy k1 k2 p1 p2, for formats without a camera."),
]
ClassNames = Annotated[str | None, typer.Option("--classes", metavar="A,B,C", help="Classes to begin with.")]
Copy = Annotated[bool, typer.Option("--copy", help="Copy the images into the session.")]

# export
DatasetFormat = Annotated[str, typer.Option("--format", metavar="FORMAT", help="One that `ars-web formats` lists.")]
DatasetFolder = Annotated[
    str | None,
    typer.Option("--out", metavar="DIR", help="The dataset's folder, new or empty; s3://BUCKET/DIR for a store."),
]
FramesStep = Annotated[int | None, typer.Option("--frames-step", metavar="N", help="Every N-th frame; default 1.")]
FramesStart = Annotated[int | None, typer.Option("--frames-start", metavar="N", help="From this index; default 0.")]
FramesStop = Annotated[
    int | None, typer.Option("--frames-stop", metavar="N", help="Up to this index, without it; default: the end.")
]
FramesList = Annotated[str | None, typer.Option("--frames-list", metavar="1,2,3", help="These indices alone.")]
FramesCount = Annotated[int | None, typer.Option("--frames-count", metavar="N", help="So many in all; default: all.")]
FramesBy = Annotated[
    Literal["coverage", "even"] | None,
    typer.Option("--frames-by", help="Choose those that cover most directions (default), or evenly spaced ones."),
]
FramesNearDegrees = Annotated[
    float | None,
    typer.Option("--frames-near-degrees", metavar="DEG", help="Leave out near twins of chosen views; default 0: none."),
]
FramesNearFrames = Annotated[
    int | None,
    typer.Option("--frames-near-frames", metavar="N", help="Leave out the N frames beside chosen ones; default 0."),
]
FramesSector = Annotated[
    str | None,
    typer.Option("--frames-sector", metavar="FROM:TO", help="Cameras between these angles round the objects, degrees."),
]
FramesSectorBox = Annotated[
    int | None,
    typer.Option(
        "--frames-sector-box",
        metavar="ID",
        help="Angles as this box's coverage has them; default: about the world's z, round all.",
    ),
]
Images = Annotated[
    Literal["link", "copy", "rectify", "none"] | None,
    typer.Option("--images", help="Hard links (default), copies, undistorted copies, or no images."),
]
Shape = Annotated[
    Literal["box", "hull", "mesh"] | None,
    typer.Option("--shape", help="What is projected; default: the hull where a box has one, else the box."),
]
Masks = Annotated[
    Literal["write", "none"] | None,
    typer.Option("--masks", help="Of bop: two PNG files a label (default), or none, which is much faster."),
]
MinVisible = Annotated[
    float | None, typer.Option("--min-visible", metavar="SHARE", help="Drop labels less visible; default 0.")
]
MaxTruncated = Annotated[
    float | None, typer.Option("--max-truncated", metavar="SHARE", help="Drop labels more outside; default 1.")
]
MinArea = Annotated[
    float | None, typer.Option("--min-area-px", metavar="PX", help="Drop labels of smaller area; default 4.")
]
HeadingBins = Annotated[
    int | None,
    typer.Option("--heading-bins", metavar="N", help="compass: bins of a turn, 0 for angles; default 18."),
]
SplitTrain = Annotated[float | None, typer.Option("--split-train", metavar="SHARE", help="Default 0.8.")]
SplitVal = Annotated[float | None, typer.Option("--split-val", metavar="SHARE", help="Default 0.2.")]
SplitTest = Annotated[float | None, typer.Option("--split-test", metavar="SHARE", help="Default 0.")]
SplitBy = Annotated[
    Literal["block", "frame", "session", "sector"] | None,
    typer.Option("--split-by", help="Divide runs of frames (default), frames, whole sessions, or sides looked from."),
]
SplitHoldOut = Annotated[
    str | None,
    typer.Option("--split-hold-out", metavar="SESSION,SESSION", help="Sessions for val or test; others train."),
]
SplitSeed = Annotated[int | None, typer.Option("--split-seed", metavar="N", help="Default 0.")]
DryRun = Annotated[
    bool,
    typer.Option("--dry-run", help="Write nothing: print what would be written, and which directions it covers."),
]
Check = Annotated[
    bool,
    typer.Option("--check", help="Read the set back, and compare each label with the session's; 1 if any differs."),
]
# The option is called `sessions` elsewhere; here that name is the sessions folder's.
Merge = Annotated[
    str | None, typer.Option("--merge", metavar="SESSION,SESSION", help="Further sessions in the same dataset.")
]
Workers = Annotated[int | None, typer.Option("--workers", metavar="N", min=1, help="Processes; default: one a core.")]


def read_mesh(
    file: Path | None, *, unit: str | None, axes: str | None, origin: str, remove: bool
) -> "tuple[SourcedMesh | None, tuple[str, ...]]":
    """The mesh that a command is given, or None for none, and what was changed of it, in words.

    Raises:
        BadInput, BadFile: a file, its unit or its axes are missing, or cannot be; or there is a file to `remove`.
    """
    if remove:
        if file is not None:
            raise BadInput("--remove takes the mesh away; leave the file out")
        return None, ()
    if file is None or unit is None or axes is None:
        raise BadInput("a mesh needs its file, --unit and --axes, such as: bottle.stl --unit mm --axes x,y,z")
    from ars_web.sessions.mesh_reading import object_from_file

    # By its name alone: that is what the session keeps.
    return object_from_file(file, name=file.name, unit=unit, axes=axes, origin=origin)


def comma_separated(text: str | None, option: str) -> list[str]:
    """The items of `text`, none where it is None.

    Raises:
        typer.BadParameter: an item is empty.
    """
    if text is None:
        return []
    items = [item.strip() for item in text.split(",")]
    if not all(items):
        raise typer.BadParameter(f"{text!r} has an empty item between its commas", param_hint=option)
    return items


def whole_numbers(text: str | None, option: str) -> list[int]:
    """The items of `text` as numbers, none where it is None.

    Raises:
        typer.BadParameter: an item is empty or no whole number.
    """
    try:
        return [int(item) for item in comma_separated(text, option)]
    except ValueError as error:
        raise typer.BadParameter(f"{text!r} must be whole numbers with commas between", param_hint=option) from error


def number_range(text: str | None, option: str, *, example: str = "0.3:0.8") -> tuple[float, float] | None:
    """The two numbers of `FROM:TO`; None where it is None.

    Raises:
        typer.BadParameter: it is no such pair; `example` is one that is.
    """
    if text is None:
        return None
    low, colon, high = text.partition(":")
    try:
        if colon:
            return float(low), float(high)
    except ValueError:
        pass
    raise typer.BadParameter(f"{text!r} must be two numbers with a colon between, such as {example}", param_hint=option)


def session_name(recording: Path) -> str:
    """What to call a session where nobody said: after the folder, or the file where its name says something."""
    path = recording.resolve()
    if path.is_dir():
        return path.name
    return path.parent.name if path.stem in UNTELLING_STEMS else path.stem


def named_roots(items: list[str] | None) -> dict[str, Path]:
    """Folders by name, from `NAME=PATH` items.

    Raises:
        typer.BadParameter: an item is no such pair, or a name comes twice.
    """
    roots: dict[str, Path] = {}
    for item in items or []:
        name, _, path = item.partition("=")
        if not name or not path:
            raise typer.BadParameter(f"{item!r} is not NAME=PATH", param_hint="--root")
        if name in roots:
            raise typer.BadParameter(f"two folders are called {name!r}", param_hint="--root")
        roots[name] = Path(path)
    return roots


def export_options(given: Mapping[str, object]) -> "ExportOptions":
    """Export options from what was given, by the options' dotted names (`frames.step`); None: not given.

    Raises:
        typer.BadParameter: a value that its option cannot take; it is named as the command line spells it.
    """
    from pydantic import ValidationError

    from ars_web.datasets.options import ExportOptions

    nested: dict[str, object] = {}
    groups: dict[str, dict[str, object]] = {"frames": {}, "split": {}}
    for name, value in given.items():
        if value is not None:
            group, dot, key = name.partition(".")
            (groups[group] if dot else nested)[key if dot else name] = value
    try:
        return ExportOptions.model_validate({**nested, **groups})
    except ValidationError as error:
        raise _refused(error) from error


def refuse_foreign_options(kind: str, given: Mapping[str, object]) -> None:
    """Refuse what was given of options that mean something to other formats alone; None: not given.

    Raises:
        typer.BadParameter: it names the formats that the option is of.
    """
    from ars_web.datasets.registry import WRITERS

    for name, value in given.items():
        owners = [writer.format for writer in WRITERS.values() if name in writer.own_options]
        if value is not None and owners and kind not in owners:
            option = "--" + name.replace("_", "-")
            raise typer.BadParameter(f"it is an option of {', '.join(owners)}, not of {kind}", param_hint=option)


def server_settings(given: Mapping[str, object]) -> "Settings":
    """A server's settings by their names.

    Raises:
        typer.BadParameter: a value that its option cannot take.
    """
    from pydantic import ValidationError

    from ars_web.settings import Settings

    try:
        return Settings.model_validate(given)
    except ValidationError as error:
        raise _refused(error) from error


def _refused(error: "ValidationError") -> typer.BadParameter:
    """The first fault, named as the command line spells it."""
    fault = error.errors()[0]
    names = [part for part in fault["loc"] if isinstance(part, str)]
    option = SPELLED_DIFFERENTLY.get(names[0], "--" + "-".join(names).replace("_", "-")) if names else None
    message = fault["msg"].removeprefix("Value error, ")
    if names == ["split"]:
        of_held_out = message.startswith("hold_out")
        option = "--split-hold-out" if of_held_out else "--split-train, --split-val, --split-test"
    elif names == ["frames"]:
        option = "--frames-..."
    given = "" if isinstance(fault["input"], dict) else f", not {fault['input']}"
    return typer.BadParameter(f"{message}{given}", param_hint=option)


def class_named(state: "SessionState", name: str) -> "ObjectClass":
    """The class of that name, or id.

    Raises:
        BadInput: there is none.
    """
    for one in state.classes.values():
        if one.name == name:
            return one
    if name.isdecimal() and int(name) in state.classes:
        return state.classes[int(name)]
    known = ", ".join(f"{one.id} {one.name}" for one in state.classes.values()) or "none yet"
    raise BadInput(f"there is no class {name!r} in this session; its classes are: {known}")
