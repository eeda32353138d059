"""The commands of `ars-web classes`: what a session knows of the shape of its kinds of objects."""

import re
from typing import TYPE_CHECKING, Annotated

import typer

from ars_web import arguments as take
from ars_web.box_commands import AUTHOR, mesh_text
from ars_web.errors import BadInput
from ars_web.terminal import note, print_json, print_table

if TYPE_CHECKING:
    from ars_web.geometry.keypoints import Keypoint
    from ars_web.geometry.symmetry import Axis, Symmetry

app = typer.Typer(help="A session's classes: size, symmetry, keypoints, mesh.", rich_markup_mode=None)

ClassName = Annotated[str, typer.Argument(metavar="CLASS", help="The class's name or id.")]


@app.command("list")
def list_classes(session: take.Session, sessions: take.Sessions = take.SESSIONS, as_json: take.Json = False) -> None:
    """The session's classes, and what is known of their objects' shape."""
    from ars_web.sessions.boxes_json import class_json
    from ars_web.sessions.store import SessionStore

    with SessionStore(sessions) as store:
        sid = store.find(session)
        classes, meshes = list(store.state(sid).classes.values()), store.meshes(sid)
    if as_json:
        print_json([class_json(one, meshes) for one in classes])
        return
    rows = [
        (
            one.id,
            one.name,
            one.color,
            "" if one.default_size is None else " x ".join(f"{1000 * side:.1f}" for side in one.default_size),
            symmetry_text(one.symmetry),
            len(one.keypoints) or "",
            "" if one.mesh is None else mesh_text(meshes[one.mesh]),
        )
        for one in classes
    ]
    print_table(("id", "name", "color", "size, mm", "symmetry", "keypoints", "mesh"), rows)


@app.command("add")
def add_class(
    session: take.Session,
    name: Annotated[str, typer.Argument(metavar="NAME", help="The new class's name; no other has it.")],
    size: Annotated[str | None, typer.Option("--size", metavar="X,Y,Z", help="Metres, of new boxes.")] = None,
    color: Annotated[
        str | None, typer.Option("--color", metavar="#RRGGBB", help="In pictures and the page; default: a new one.")
    ] = None,
    sessions: take.Sessions = take.SESSIONS,
    as_json: take.Json = False,
) -> None:
    """Add a class, which boxes and labels can then be of."""
    from ars_web.sessions.boxes_json import class_json
    from ars_web.sessions.editing import SessionEditor
    from ars_web.sessions.store import SessionStore

    with SessionStore(sessions) as store:
        sid = store.find(session)
        default_size = None if size is None else _three(size, "--size")
        added = SessionEditor(store).add_class(sid, name=name, color=color, default_size=default_size, author=AUTHOR)
        meshes = store.meshes(sid)
    if as_json:
        print_json(class_json(added, meshes))
    else:
        print(f"{added.name}: class {added.id}")


@app.command("set")
def set_class(
    session: take.Session,
    name: ClassName,
    symmetry: Annotated[
        str | None,
        typer.Option(
            "--symmetry",
            metavar="SYMMETRY",
            help="none; z4,x2: quarter turns about z and half turns about x; continuous:z, or continuous:z+flip where"
            " the ends look alike. An axis may be 1/1/0, as in 1/1/1^3.",
        ),
    ] = None,
    keypoint: Annotated[
        list[str] | None,
        typer.Option(
            "--keypoint",
            metavar="NAME=X,Y,Z",
            help="A point of the object in units of its box's sizes, from the centre; repeatable. They replace those"
            " there are.",
        ),
    ] = None,
    default_keypoints: Annotated[
        bool, typer.Option("--default-keypoints", help="The box's centre and corners again.")
    ] = False,
    size: Annotated[
        str | None, typer.Option("--size", metavar="X,Y,Z", help="Metres, of new boxes; none: not set any more.")
    ] = None,
    color: Annotated[str | None, typer.Option("--color", metavar="#RRGGBB", help="In pictures and the page.")] = None,
    sessions: take.Sessions = take.SESSIONS,
    as_json: take.Json = False,
) -> None:
    """Set what is given of a class and leave the rest, as one step that one undo takes back."""
    from ars_web.sessions.boxes_json import class_json
    from ars_web.sessions.editing import UNSET, SessionEditor
    from ars_web.sessions.store import SessionStore

    if keypoint and default_keypoints:
        raise BadInput("--keypoint and --default-keypoints exclude each other")
    points = UNSET if keypoint is None else [_keypoint(text) for text in keypoint]
    with SessionStore(sessions) as store:
        sid = store.find(session)
        before = take.class_named(store.state(sid), name)
        after = SessionEditor(store).change_class(
            sid,
            before.id,
            expected_revision=before.revision,
            color=color,
            default_size=UNSET if size is None else None if size == "none" else _three(size, "--size"),
            symmetry=UNSET if symmetry is None else symmetry_from_text(symmetry),
            keypoints=() if default_keypoints else points,
            author=AUTHOR,
        )
        meshes = store.meshes(sid)
    if as_json:
        print_json(class_json(after, meshes))
    else:
        print(f"{after.name}: {'changed' if after.revision != before.revision else 'as it was'}")


@app.command("mesh")
def class_mesh(
    session: take.Session,
    name: ClassName,
    file: take.MeshFile = None,
    unit: take.MeshUnit = None,
    axes: take.MeshAxes = None,
    origin: take.MeshOrigin = "centre",
    fit_size: Annotated[
        bool | None,
        typer.Option(
            "--fit-size/--keep-size", help="Whether the class's size becomes the mesh's; default: where it has none."
        ),
    ] = None,
    remove: take.Remove = False,
    sessions: take.Sessions = take.SESSIONS,
    as_json: take.Json = False,
) -> None:
    """Give a class the mesh of its objects, or take it away: one step that one undo takes back.

    A box may have a mesh of its own, which counts before its class's: `ars-web boxes mesh`.
    """
    from ars_web.sessions.boxes_json import class_json
    from ars_web.sessions.editing import SessionEditor
    from ars_web.sessions.store import SessionStore

    mesh, notes = take.read_mesh(file, unit=unit, axes=axes, origin=origin, remove=remove)
    with SessionStore(sessions) as store:
        sid = store.find(session)
        before = take.class_named(store.state(sid), name)
        after = SessionEditor(store).change_class(
            sid,
            before.id,
            expected_revision=before.revision,
            mesh=mesh,
            fit_size=False if mesh is None else fit_size,
            author=AUTHOR,
        )
        meshes = store.meshes(sid)
    if as_json:
        print_json(class_json(after, meshes))
    else:
        print(f"{after.name}: {'no mesh' if mesh is None else mesh_text(mesh)}")
    for line in notes:
        note(f"ars-web: {line}")


def symmetry_from_text(text: str) -> "Symmetry":
    """`none`, `z4,x2`, `1/1/1^3` or `continuous:z+flip` as a symmetry.

    Raises:
        BadInput: it is none of them.
    """
    from ars_web.geometry.symmetry import NO_SYMMETRY, Symmetry

    if text == "none":
        return NO_SYMMETRY
    if text.startswith("continuous:"):
        axis = text.removeprefix("continuous:").removesuffix("+flip")
        return Symmetry("continuous", axis=_axis(axis), flip=text.endswith("+flip"))
    rotations: list[tuple[Axis, int]] = []
    for part in text.split(","):
        found = re.fullmatch(r"([xyz]|[^^]+(?=\^))\^?([0-9]{1,3})", part.strip())
        if found is None:
            raise BadInput(
                "--symmetry takes none, turns such as z4,x2 or 1/1/1^3, continuous:z or continuous:z+flip, not"
                f" {text!r}"
            )
        rotations.append((_axis(found[1]), int(found[2])))
    return Symmetry("discrete", tuple(rotations))


def symmetry_text(symmetry: "Symmetry") -> str:
    """The symmetry as `symmetry_from_text` reads it; nothing for none."""
    if symmetry.axis is not None:
        return f"continuous:{_axis_text(symmetry.axis)}{'+flip' if symmetry.flip else ''}"
    names = [(_axis_text(axis), order) for axis, order in symmetry.rotations]
    return ",".join(f"{axis}{order}" if len(axis) == 1 else f"{axis}^{order}" for axis, order in names)


def _axis(text: str) -> "Axis":
    if text in ("x", "y", "z"):
        x, y, z = (float(text == name) for name in "xyz")
        return x, y, z
    return _three(text, "an axis", separator="/")


def _axis_text(axis: "Axis") -> str:
    for name in "xyz":
        if axis == _axis(name):
            return name
    return "/".join(f"{along:.6g}" for along in axis)


def _keypoint(text: str) -> "Keypoint":
    from ars_web.geometry.keypoints import Keypoint

    name, equals, place = text.rpartition("=")
    if not equals:
        raise BadInput(f"--keypoint takes NAME=X,Y,Z, such as tip=0,0,0.5, not {text!r}")
    return Keypoint(name, _three(place, f"keypoint {name!r}"))


def _three(text: str, what: str, *, separator: str = ",") -> tuple[float, float, float]:
    try:
        x, y, z = (float(part) for part in text.split(separator))
    except ValueError as error:
        raise BadInput(f"{what} needs three numbers such as {separator.join(('0', '0', '1'))}, not {text!r}") from error
    return x, y, z
