"""The commands of `ars-web boxes`: a session's virtual boxes in, out, and made from outlines."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ars_web import arguments as take
from ars_web.errors import BadFile, BadInput, Conflict, Locked, NotFound
from ars_web.terminal import note, print_json, print_table, write_json

if TYPE_CHECKING:
    from ars_web.geometry.visual_hull import VisualHull
    from ars_web.sessions.model import VirtualBox
    from ars_web.sessions.object_mesh import SourcedMesh

AUTHOR = "cli"
"""Who the edit log says made the changes of this program."""

app = typer.Typer(
    help="A session's virtual boxes: in and out as JSON, made from masks, given meshes.", rich_markup_mode=None
)


@app.command("import")
def import_boxes(
    session: take.Session,
    file: Annotated[Path, typer.Argument(metavar="FILE", help="JSON list of boxes, as the API answers it.")],
    sessions: take.Sessions = take.SESSIONS,
    as_json: take.Json = False,
) -> None:
    """Add all boxes of a file, as one step that one undo takes back."""
    from ars_web.sessions.boxes_json import box_json, read_boxes_file
    from ars_web.sessions.editing import SessionEditor
    from ars_web.sessions.store import SessionStore

    with SessionStore(sessions) as store:
        sid, drafts = store.find(session), read_boxes_file(file)
        try:
            added = SessionEditor(store).add_boxes(sid, drafts, author=AUTHOR)
        except BadInput as error:
            raise BadFile(file, f"{error}; boxes are counted from 0") from error
    if as_json:
        print_json([box_json(box) for box in added])
    else:
        print(f"{len(added)} boxes added")


@app.command("from-masks")
def boxes_from_masks(
    session: take.Session,
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="JSON as POST boxes/from-masks takes it, or a list; - for stdin.")
    ],
    sessions: take.Sessions = take.SESSIONS,
    as_json: take.Json = False,
) -> None:
    """Make boxes from outlines of objects in two frames or more; each is one step that one undo takes back.

    An object whose outlines do not fit is left out, and said so at the end; the others are made.
    """
    from ars_web.masks.boxing import ObjectBoxes
    from ars_web.masks.masks_json import made_box_json, outlines_of, read_masks_file
    from ars_web.masks.views import hull_of, photographs
    from ars_web.sessions.editing import SessionEditor
    from ars_web.sessions.store import SessionStore

    source = "standard input" if str(file) == "-" else file
    made: list[tuple[VirtualBox, VisualHull, int]] = []
    refused: list[BadFile] = []
    with SessionStore(sessions) as store:
        sid = store.find(session)
        objects = read_masks_file(source, sys.stdin.buffer.read() if source != file else file.read_bytes())
        taken, maker = photographs(store, sid), ObjectBoxes(store, SessionEditor(store))
        for i, wanted in enumerate(objects):
            try:
                box = maker.from_masks(sid, outlines_of(taken, wanted.views), **wanted.asked, author=AUTHOR)
            except (BadInput, NotFound, Conflict, Locked) as error:
                refused.append(BadFile(source, f"object {i}: {error}" if len(objects) > 1 else str(error)))
            else:
                made.append((box, hull_of(store, sid, box), len(wanted.views)))
    if as_json:
        print_json([made_box_json(box, hull) for box, hull, _ in made])
    elif made:
        rows = [(box.id, box.name, masks, _millimetres(box), f"{1e6 * hull.volume:.2f}") for box, hull, masks in made]
        print_table(("id", "name", "masks", "size, mm", "hull, cm3"), rows)
    for error in refused[:-1]:
        note(f"ars-web: {error}")
    if refused:
        raise refused[-1]


@app.command("refine")
def refine_box(
    session: take.Session,
    box_id: take.BoxId,
    file: Annotated[
        Path | None,
        typer.Argument(metavar="FILE", help="JSON as POST boxes/BOX/refine takes it; - for stdin; default: its masks."),
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Say how the box would fit, and leave it.")] = False,
    sessions: take.Sessions = take.SESSIONS,
    as_json: take.Json = False,
) -> None:
    """Move, turn and size a box until its labels agree best with its masks, or with what a file says is seen.

    It is one step that one undo takes back. How far each side of a label is off is printed for each frame.
    """
    from ars_web.masks.box_fitting import BoxFitting
    from ars_web.masks.fit_json import FitJson, fitted_json, read_fit_file, sightings_of
    from ars_web.masks.views import photographs
    from ars_web.sessions.drafting import existing_box
    from ars_web.sessions.editing import SessionEditor
    from ars_web.sessions.store import SessionStore

    wish = FitJson()  # pyright: ignore[reportCallIssue]: it knows no defaults behind Annotated
    if file is not None:
        is_file = str(file) != "-"
        wish = read_fit_file(
            file if is_file else "standard input", file.read_bytes() if is_file else sys.stdin.buffer.read()
        )
    with SessionStore(sessions) as store:
        sid = store.find(session)
        fitting = BoxFitting(store, SessionEditor(store))
        seen = None if wish.views is None else sightings_of(photographs(store, sid), wish.views)
        before = existing_box(store.state(sid), box_id)
        if dry_run or wish.dry_run:
            fitted = fitting.try_fit(sid, box_id, seen, orientation=wish.orientation)
        else:
            fitted = fitting.fit(
                sid,
                box_id,
                seen,
                orientation=wish.orientation,
                expected_revision=before.revision,
                author=AUTHOR,
            )
    if as_json:
        print_json(fitted_json(fitted))
        return
    rows = [
        (frame, *(f"{side:+.1f}" for side in sides), "stands out" if outlier else "")
        for frame, sides, outlier in zip(
            fitted.frames, fitted.fit.residuals_px.tolist(), fitted.fit.outliers.tolist(), strict=True
        )
    ]
    print_table(("frame", "left, px", "top, px", "right, px", "bottom, px", ""), rows)
    print(
        f"{fitted.box.name}: {_millimetres(fitted.box)} mm, moved by {1e3 * fitted.moved:.1f} mm,"
        f" {fitted.fit.rms_px:.1f} px off on the average"
    )
    for warning in fitted.warnings:
        note(f"ars-web: {warning}")


@app.command("mesh")
def box_mesh(
    session: take.Session,
    box_id: take.BoxId,
    file: take.MeshFile = None,
    unit: take.MeshUnit = None,
    axes: take.MeshAxes = None,
    origin: take.MeshOrigin = "centre",
    remove: take.Remove = False,
    sessions: take.Sessions = take.SESSIONS,
    as_json: take.Json = False,
) -> None:
    """Give the object in a box a mesh of its own, or take it away: one step that one undo takes back.

    It counts before the mesh of its class: `ars-web classes mesh`.
    """
    mesh, notes = take.read_mesh(file, unit=unit, axes=axes, origin=origin, remove=remove)
    _give_mesh(sessions, session, box_id, lambda _: mesh, as_json=as_json)
    for line in notes:
        note(f"ars-web: {line}")


@app.command("polygon")
def box_polygon(
    session: take.Session,
    box_id: take.BoxId,
    file: Annotated[
        Path | None,
        typer.Argument(metavar="FILE", help="JSON as PUT boxes/BOX/polygon takes it; - for stdin; none with --remove."),
    ] = None,
    remove: take.Remove = False,
    sessions: take.Sessions = take.SESSIONS,
    as_json: take.Json = False,
) -> None:
    """Have the object in a box be a planar polygon, or nothing of its own: one step that one undo takes back."""
    from ars_web.sessions.mesh_reading import object_from_polygon
    from ars_web.sessions.polygon_json import read_polygon_file

    if remove == (file is not None):
        raise BadInput("a polygon needs its file; --remove takes it away, and needs none")
    if file is None:
        _give_mesh(sessions, session, box_id, lambda _: None, as_json=as_json)
        return
    is_file = str(file) != "-"
    try:
        data = file.read_bytes() if is_file else sys.stdin.buffer.read()
    except OSError as error:
        raise BadFile(file, f"cannot be read: {error.strerror}") from error
    source = file if is_file else "standard input"
    wish = read_polygon_file(source, data)

    def made(box: "VirtualBox") -> "SourcedMesh":
        try:
            return object_from_polygon(wish.corners, box.box, in_world=wish.frame_of == "world")
        except BadInput as error:
            raise BadFile(source, str(error)) from error

    _give_mesh(sessions, session, box_id, made, as_json=as_json)


@app.command("export")
def export_boxes(
    session: take.Session,
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Where the JSON list goes; - for stdout.")],
    force: take.Force = False,
    sessions: take.Sessions = take.SESSIONS,
) -> None:
    """Write a session's boxes as the JSON list that the API answers."""
    from ars_web.sessions.boxes_json import box_json
    from ars_web.sessions.store import SessionStore

    with SessionStore(sessions) as store:
        boxes = [box_json(box) for box in store.state(store.find(session)).boxes.values()]
    if str(file) == "-":
        print_json(boxes)
        return
    if file.exists() and not force:
        raise BadInput(f"{file} exists already: name another file, or replace it with --force")
    if not file.parent.is_dir():
        raise BadInput(f"{file} cannot be written: there is no folder {file.parent}; make it first")
    write_json(file, boxes)
    note(f"{len(boxes)} boxes in {file}")


def _give_mesh(
    sessions: Path,
    session: str,
    box_id: int,
    mesh_for: "Callable[[VirtualBox], SourcedMesh | None]",
    *,
    as_json: bool,
) -> None:
    from ars_web.sessions.boxes_json import box_json
    from ars_web.sessions.drafting import existing_box
    from ars_web.sessions.editing import SessionEditor
    from ars_web.sessions.store import SessionStore

    with SessionStore(sessions) as store:
        sid = store.find(session)
        before = existing_box(store.state(sid), box_id)
        mesh = mesh_for(before)
        after = SessionEditor(store).change_box(
            sid, box_id, expected_revision=before.revision, mesh=mesh, author=AUTHOR
        )
    if as_json:
        print_json(box_json(after))
    else:
        print(f"{after.name}: {'no mesh of its own' if mesh is None else mesh_text(mesh)}")


def mesh_text(sourced: "SourcedMesh") -> str:
    """A mesh in a few words."""
    extent = " x ".join(f"{1000 * side:.1f}" for side in sourced.mesh.extent)
    return f"{sourced.source.name}, {len(sourced.mesh.faces)} faces, {extent} mm"


def _millimetres(box: "VirtualBox") -> str:
    return " x ".join(f"{1000 * side:.1f}" for side in box.box.size)
