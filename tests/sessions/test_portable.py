"""A session carried elsewhere is the same session; what came from a stranger is looked at first."""

import os
import shutil
import sqlite3
import threading
import zipfile
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from ars_web.errors import BadFile, BadInput, NotFound, RefusedPath, StoreError, TooLarge
from ars_web.geometry.box import Box
from ars_web.geometry.keypoints import Keypoint
from ars_web.geometry.polygon import Polygon
from ars_web.geometry.symmetry import Symmetry
from ars_web.recordings.recording import Recording, SkippedFrame
from ars_web.sessions import migration, session_folders
from ars_web.sessions.archive import ArchiveLimits
from ars_web.sessions.editing import MaskDraft, SessionEditor
from ars_web.sessions.edits import Edit, differences
from ars_web.sessions.hull_mesh import HullMesh
from ars_web.sessions.model import HullOptions
from ars_web.sessions.object_mesh import SourcedMesh
from ars_web.sessions.portable import export_session, import_session
from ars_web.sessions.store import SessionStore

MakeBox = Callable[..., Box]


@pytest.fixture
def plain(store: SessionStore, editor: SessionEditor, make_recording: Callable[..., Recording], a_box: MakeBox) -> str:
    """A session with images, and edits of two authors."""
    recording = make_recording(4, images=True, skipped=(SkippedFrame("x.jpg", "no pose", "poses.txt:3"),))
    sid = store.create(recording, name="table").id
    editor.add_class(sid, name="ring", author="me")
    editor.add_box(sid, class_id=1, box=a_box(), author="you", key="k")
    editor.change_box(sid, 1, expected_revision=2, size=np.array([1.0, 2.0, 3.0]), author="me")
    editor.undo(sid, author="me")
    return sid


@pytest.fixture
def sid(
    store: SessionStore,
    editor: SessionEditor,
    plain: str,
    a_box: MakeBox,
    a_hull: Callable[..., HullMesh],
    a_mesh: Callable[..., SourcedMesh],
    outline: Callable[..., tuple[Polygon, ...]],
) -> str:
    """That session with a box, its hull, masks and mesh, a class with a shape, and an outline without a box."""
    sid = plain
    editor.change_class(
        sid, 0, expected_revision=store.state(sid).classes[0].revision, mesh=a_mesh(), author="you",
        symmetry=Symmetry("continuous", axis=(0.0, 0.0, 1.0)), keypoints=[Keypoint("tip", (0.0, 0.0, 0.5))],
    )  # fmt: skip
    masks = [MaskDraft(frame, outline(20 + frame)) for frame in (0, 2)]
    editor.put_object(
        sid, box_id=None, class_id=0, box=a_box(1.0), hull=a_hull(), hull_options=HullOptions("upright"),
        masks=masks, author="you",
    )  # fmt: skip
    made = store.state(sid).boxes[2]
    editor.change_box(sid, 2, expected_revision=made.revision, mesh=a_mesh(0.5), author="you")
    editor.put_mask(sid, box_id=None, frame=1, class_id=0, polygons=outline(), expected_revision=None, author="you")
    return sid


@pytest.fixture
def elsewhere(tmp_path: Path):
    with SessionStore(tmp_path / "elsewhere") as store:
        yield store


def told(edit: Edit) -> tuple[object, ...]:
    return (edit.revision, edit.author, edit.summary, edit.undoes, edit.redoes, edit.at)


@pytest.mark.parametrize("name", ["carried", "carried.zip"])
@pytest.mark.parametrize("copied", [False, True])
def test_a_session_comes_back_whole(
    store: SessionStore, elsewhere: SessionStore, sid: str, a_box: MakeBox, tmp_path: Path, name: str, copied: bool
):
    if copied:  # a session whose images lie within it is exported likewise
        export_session(store, sid, tmp_path / "first")
        sid = import_session(store, tmp_path / "first").id
    seen: list[tuple[int, int]] = []
    export_session(store, sid, tmp_path / name, progress=lambda *done: seen.append(done))
    assert seen == [(1, 4), (2, 4), (3, 4), (4, 4)]
    original, log, cameras = store.snapshot(sid), store.edits(sid), store.cameras(sid)
    skipped = store.skipped(sid)
    shutil.rmtree(tmp_path / "recording")
    imported = import_session(elsewhere, tmp_path / name)
    carried = elsewhere.snapshot(imported.id)
    assert differences(carried.state, original.state) == []
    assert [told(edit) for edit in elsewhere.edits(imported.id)] == [told(edit) for edit in log]
    assert elsewhere.skipped(imported.id) == skipped
    assert {k: hull.vertices.tolist() for k, hull in carried.hulls.items()} == {
        k: hull.vertices.tolist() for k, hull in original.hulls.items()
    }
    assert (len(carried.hulls), len(carried.state.masks)) == (1, 3)
    assert [mesh.digest for mesh in carried.meshes.values()] == list(carried.meshes)
    assert set(carried.meshes) == set(original.meshes) == {carried.state.classes[0].mesh, carried.state.boxes[2].mesh}
    assert all(
        elsewhere.mesh(imported.id, digest).source == store.mesh(sid, digest).source for digest in carried.meshes
    )
    assert carried.cameras == cameras
    assert carried.frames.names == original.frames.names
    assert np.array_equal(carried.frames.Ts_world_camera, original.frames.Ts_world_camera)
    assert [image.read_bytes() for image in carried.frames.images] == [b"image %d" % i * 50 for i in range(4)]
    assert all(image.is_relative_to(elsewhere.folder / imported.id / "images") for image in carried.frames.images)
    assert elsewhere.check() == []
    editor = SessionEditor(elsewhere)
    assert editor.redo(imported.id, author="me").redoes == 4
    assert editor.add_box(imported.id, class_id=1, box=a_box(), author="you", key="k").revision == 2


def test_an_import_may_be_given_a_name(store: SessionStore, elsewhere: SessionStore, sid: str, tmp_path: Path):
    export_session(store, sid, tmp_path / "carried")
    imported = import_session(elsewhere, tmp_path / "carried", name="desk")
    assert (imported.name, imported.revision) == ("desk", 9)
    assert elsewhere.edits(imported.id, after=8)[0].summary == "Rename the session to desk"
    assert import_session(elsewhere, tmp_path / "carried", name="table").revision == 8
    with pytest.raises(BadInput, match="a session needs a name"):
        import_session(elsewhere, tmp_path / "carried", name="")


def test_an_export_is_one_revision_though_someone_edits(
    store: SessionStore, elsewhere: SessionStore, editor: SessionEditor, sid: str, tmp_path: Path
):
    stop = threading.Event()

    def edit() -> None:
        i = 0
        while not stop.is_set():
            editor.add_class(sid, name=f"class {i}", author="busy")
            i += 1

    thread = threading.Thread(target=edit)
    thread.start()
    try:
        for i in range(5):
            export_session(store, sid, tmp_path / f"{i}.zip")
    finally:
        stop.set()
        thread.join(30)
    revisions = [import_session(elsewhere, tmp_path / f"{i}.zip").revision for i in range(5)]
    assert revisions == sorted(revisions)
    assert elsewhere.check() == []


def test_a_zip_is_stored_and_says_nothing_of_this_machine(store: SessionStore, sid: str, tmp_path: Path):
    export_session(store, sid, tmp_path / "carried.zip")
    with zipfile.ZipFile(tmp_path / "carried.zip") as archive:
        assert {info.compress_type for info in archive.infolist()} == {zipfile.ZIP_STORED}
        assert sorted(archive.namelist())[-1] == "session.sqlite"
        database = archive.read("session.sqlite")
    assert str(tmp_path / "recording" / "images").encode() not in database


def test_nothing_is_overwritten_or_left_behind(store: SessionStore, sid: str, tmp_path: Path):
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine").write_text("x")
    (tmp_path / "mine.zip").write_text("x")
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    (tmp_path / "folder.zip").mkdir()
    for there in ("full", "mine.zip", "link", "folder.zip"):
        with pytest.raises(BadInput, match=there):
            export_session(store, sid, tmp_path / there)
    with pytest.raises(NotFound):
        export_session(store, "abcdefghijkl", tmp_path / "new")
    store.frames(sid).images[2].unlink()
    for name in ("new", "new.zip"):
        with pytest.raises(StoreError, match=r"00002\.jpg: the session cannot be exported: No such file"):
            export_session(store, sid, tmp_path / name)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "folder.zip", "full", "link", "mine.zip", "recording", "sessions",
    ]  # fmt: skip
    assert (tmp_path / "mine.zip").read_text() == "x"


@pytest.fixture
def carried(store: SessionStore, sid: str, tmp_path: Path) -> Path:
    export_session(store, sid, tmp_path / "carried")
    return tmp_path / "carried"


def assert_refused(store: SessionStore, source: Path, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        import_session(store, source)
    assert store.list() == []
    assert session_folders.leftovers(store.folder) == []


def zipped(folder: Path) -> Path:
    return Path(shutil.make_archive(str(folder), "zip", folder))


@pytest.mark.parametrize("pack", [Path, zipped])
def test_what_is_missing_is_named(elsewhere: SessionStore, carried: Path, pack: Callable[[Path], Path]):
    (carried / "images" / "cam1" / "00003.jpg").unlink()
    assert_refused(elsewhere, pack(carried), BadFile, r"images/cam1/00003\.jpg is missing")
    (carried / "session.sqlite").unlink()
    assert_refused(elsewhere, pack(carried), BadFile, r"session\.sqlite is missing: this is no exported session")
    assert_refused(elsewhere, carried.with_name("nothing"), BadFile, "nothing here to import")


def test_links_are_not_followed(elsewhere: SessionStore, carried: Path, tmp_path: Path):
    secret = tmp_path / "secret"
    secret.write_text("secret")
    image = carried / "images" / "cam1" / "00003.jpg"
    image.unlink()
    image.symlink_to(secret)
    assert_refused(elsewhere, carried, RefusedPath, r"images/cam1/00003\.jpg is, or lies behind, a link")
    image.unlink()
    image.write_bytes(b"x")
    (carried / "images").rename(tmp_path / "moved")
    (carried / "images").symlink_to(tmp_path / "moved")
    assert_refused(elsewhere, carried, RefusedPath, "lies behind, a link")


def test_a_session_in_use_is_not_taken_for_an_exported_one(
    store: SessionStore, elsewhere: SessionStore, editor: SessionEditor, sid: str
):
    editor.add_class(sid, name="rod", author="me")
    assert_refused(elsewhere, store.folder / sid, BadFile, "a session in use, not an exported one: export it first")
    store.close()
    assert_refused(elsewhere, store.folder / sid, BadFile, "the image of frame .* lies outside of it")


TAMPERINGS = {
    "not a database": (
        None,
        "cannot be used: .*no session database",
    ),
    "a trigger": (
        "CREATE TRIGGER t AFTER UPDATE ON session BEGIN DELETE FROM box; END",
        "it has a trigger 't'",
    ),
    "a view": (
        "CREATE VIEW v AS SELECT * FROM box",
        "it has a view 'v'",
    ),
    "a table": (
        "CREATE TABLE more (x)",
        "it has a table 'more'",
    ),
    "no table": (
        "DROP TABLE skipped",
        "no such table",
    ),
    "no column": (
        "ALTER TABLE camera DROP COLUMN fx",
        "no such column",
    ),
    "a newer schema": (
        "UPDATE alembic_version SET version_num = '9999'",
        "newer ars-web",
    ),
    "a place on this machine": (
        "UPDATE frame SET image = '/etc/passwd' WHERE idx = 1",
        "frame 'cam1/00001.jpg' lies outside",
    ),
    "a name that leaves": (
        "UPDATE frame SET name = '../../x.jpg' WHERE idx = 1",
        r"'\.\./\.\./x\.jpg' cannot name an image",
    ),
    "a name that is a number": (
        "UPDATE frame SET name = x'00' WHERE idx = 1",
        "frame.name holds a value that is no text",
    ),
    "a gap in the frames": (
        "UPDATE frame SET idx = 9 WHERE idx = 3",
        "not numbered from 0 without gaps",
    ),
    "no frames": (
        "DELETE FROM frame",
        "a row of mask refers to a row of frame that is not there",
    ),
    "a pose that is none": (
        "UPDATE frame SET pose = zeroblob(96) WHERE idx = 2",
        "1 poses are no rigid transforms, the first that of frame 2",
    ),
    "a pose cut short": (
        "UPDATE frame SET pose = x'00' WHERE idx = 2",
        "a stored pose is damaged",
    ),
    "a camera that is none": (
        "UPDATE camera SET fx = -1",
        "focal lengths must be positive",
    ),
    "a camera's numbers are text": (
        "UPDATE camera SET fx = 'wide'",
        "camera.fx holds a value",
    ),
    "no session": (
        "DELETE FROM session",
        "the row that describes the session is gone",
    ),
    "a class that is gone": (
        "DELETE FROM object_class WHERE id = 1",
        "refers to a row of object_class",
    ),
    "a box moved in the table": (
        "UPDATE box SET size_x = 7",
        "the log and the tables differ in box 1",
    ),
    "a box locked in the table": (
        "UPDATE box SET locked = 1",
        "the log and the tables differ in box 1",
    ),
    "a lock that is none": (
        "UPDATE box SET locked = 'yes'",
        "box.locked holds a value that is no integer",
    ),
    "a class given a size in the table": (
        "UPDATE object_class SET default_size = '[1, 2, 3]' WHERE id = 0",
        "differ in class 0",
    ),
    "a class with a size that is none": (
        "UPDATE object_class SET default_size = '[0, 1, 1]' WHERE id = 0",
        "a class's size in the session's database cannot be read: .*each > 0",
    ),
    "a class with a size that is no JSON": (
        "UPDATE object_class SET default_size = 'big' WHERE id = 0",
        "a class's size in the session's database cannot be read",
    ),
    "a class with numbers instead of a size": (
        "UPDATE object_class SET default_size = '7' WHERE id = 0",
        "a class's size in the session's database cannot be read",
    ),
    "a size in the log that is none": (
        """UPDATE edit SET changes = replace(changes, '"default_size":null', '"default_size":[1,"a",2]')""",
        "an entry of the session's log",
    ),
    "a class renamed in the table": (
        "UPDATE object_class SET name = 'x' WHERE id = 0",
        "differ in class 0",
    ),
    "a colour that is none": (
        """UPDATE edit SET changes = replace(changes, '"#', '"url(#') WHERE revision = 1""",
        "an entry of the session's log",
    ),
    "a hole in the log": (
        "DELETE FROM edit WHERE revision = 3",
        "refers to a row of edit|missing",
    ),
    "a log that is longer": (
        "UPDATE session SET revision = 2",
        "does not lead to revision 2",
    ),
    "a log of nonsense": (
        "UPDATE edit SET changes = '[1]' WHERE revision = 2",
        "an entry of the session's log",
    ),
    "a beginning of nonsense": (
        "UPDATE session SET origin = '{}'",
        "the state that the session's log starts from",
    ),
    "a date that is none": (
        "UPDATE edit SET at = 'yesterday'",
        "holds 'yesterday' where a moment should be",
    ),
    "a hull that is gone": (
        "UPDATE box SET hull = NULL; DELETE FROM hull",
        "a box of the log has hull [0-9a-f]{64}, which is not there",
    ),
    "a hull without its row": (
        "PRAGMA foreign_keys = OFF; DELETE FROM hull",
        "a row of box refers to a row of hull that is not there",
    ),
    "a hull under another's name": (
        "UPDATE hull SET vertices = zeroblob(48)",
        "hull '[0-9a-f]{64}' in the session's database is damaged: it holds another one",
    ),
    "a hull with faces of no vertices": (
        f"UPDATE hull SET faces = x'{'09000000' * 12}'",
        "hull .* is damaged: .*whole numbers from 0 to 3",
    ),
    "a hull cut short": (
        "UPDATE hull SET faces = x'ff0000'",
        "hull .* is damaged",
    ),
    "a hull that is text": (
        "UPDATE hull SET vertices = 'round'",
        "hull.vertices holds a value that is no blob",
    ),
    "a hull's making that is none": (
        "UPDATE box SET hull_options = '{}'",
        "how a box was made cannot be read",
    ),
    "a hull's making changed in the table": (
        "UPDATE box SET hull_options = replace(hull_options, 'upright', 'free')",
        "the log and the tables differ in box 2",
    ),
    "a hull's name in the log that is none": (
        """UPDATE edit SET changes = replace(changes, '"hull":"', '"hull":"../')""",
        "an entry of the session's log cannot be read: a hull is named by 64",
    ),
    "a mesh that is gone": (
        "UPDATE box SET mesh = NULL; UPDATE object_class SET mesh = NULL; DELETE FROM mesh",
        "a class or a box of the log has mesh [0-9a-f]{64}, which is not there",
    ),
    "a mesh without its row": (
        "PRAGMA foreign_keys = OFF; DELETE FROM mesh",
        "a row of (box|object_class) refers to a row of mesh that is not there",
    ),
    "a mesh under another's name": (
        "UPDATE mesh SET vertices = zeroblob(48)",
        "mesh '[0-9a-f]{64}' in the session's database is damaged: it holds another one",
    ),
    "a mesh that is open": (
        f"UPDATE mesh SET faces = x'{'000000000100000002000000' * 2}'",
        "mesh .* is damaged: .*must be closed",
    ),
    "a mesh cut short": (
        "UPDATE mesh SET faces = x'ff0000'",
        "mesh .* is damaged",
    ),
    "a mesh in a unit that is none": (
        "UPDATE mesh SET unit = 'ells'",
        "mesh .* is damaged: a mesh's unit must be one of",
    ),
    "a mesh with axes that are none": (
        "UPDATE mesh SET axes = 'up'",
        "mesh .* is damaged: a mesh's axes must be such as",
    ),
    "a mesh's name in the log that is none": (
        """UPDATE edit SET changes = replace(changes, '"mesh":"', '"mesh":"../')""",
        "an entry of the session's log cannot be read: a mesh is named by 64",
    ),
    "a symmetry that is none": (
        "UPDATE object_class SET symmetry = '{}'",
        "a class's symmetry in the session's database cannot be read",
    ),
    "a symmetry of nonsense": (
        """UPDATE object_class SET symmetry = '{"kind": "discrete", "rotations": [7]}'""",
        "a class's symmetry in the session's database cannot be read",
    ),
    "a symmetry changed in the table": (
        """UPDATE object_class SET symmetry = replace(symmetry, 'false', 'true')""",
        "the log and the tables differ in class 0",
    ),
    "keypoints that are none": (
        "UPDATE object_class SET keypoints = '[1]'",
        "a class's keypoints in the session's database cannot be read",
    ),
    "keypoints of one name in the log": (
        """UPDATE edit SET changes = replace(changes, '"keypoints":[{',
            '"keypoints":[{"name":"tip","place":[0,0,0]},{')""",
        "an entry of the session's log cannot be read: there are two keypoints",
    ),
    "a mask moved in the table": (
        "UPDATE mask SET polygons = replace(polygons, '80.0', '81.0')",
        "the log and the tables differ in mask",
    ),
    "a mask of a frame that is not there": (
        "UPDATE mask SET frame = 99 WHERE id = 1",
        "a row of mask refers to a row of frame",
    ),
    "a mask of nonsense": (
        "UPDATE mask SET polygons = '[[1]]' WHERE id = 1",
        "mask 1 in the session's database is damaged",
    ),
    "a mask of an unknown origin": (
        "UPDATE mask SET origin = 'guessed' WHERE id = 1",
        "mask 1 in the session's database is damaged: .*not 'guessed'",
    ),
    "a mask far outside the image": (
        "UPDATE mask SET polygons = replace(polygons, '80.0', '9000.0');"
        " UPDATE edit SET changes = replace(changes, '80.0', '9000.0')",
        r"mask 1, of object 2 in frame 0: .*image of 640 x 480.*\(9000, ",
    ),
    "a mask without an outline in the log": (
        """UPDATE edit SET changes = replace(changes, '"polygons":[{', '"polygons":[],"more":[{')""",
        "an entry of the session's log cannot be read: an outline needs at least one polygon",
    ),
    "another next mask": (
        "UPDATE session SET next_mask_id = 1",
        "differ in next_mask_id",
    ),
    "another next id": (
        "UPDATE session SET next_box_id = 1",
        "differ in next_box_id",
    ),
}


@pytest.mark.parametrize("what", TAMPERINGS)
def test_a_database_that_was_tampered_with_is_refused(elsewhere: SessionStore, carried: Path, what: str):
    statement, message = TAMPERINGS[what]
    path = carried / "session.sqlite"
    if statement is None:
        path.write_bytes(b"nothing" * 1000)
    else:
        with closing(sqlite3.connect(path)) as connection:
            connection.executescript(statement)
            connection.commit()
    assert_refused(elsewhere, carried, BadFile, message)


def test_a_session_without_frames_is_refused(store: SessionStore, elsewhere: SessionStore, plain: str, tmp_path: Path):
    export_session(store, plain, tmp_path / "carried")
    with closing(sqlite3.connect(tmp_path / "carried" / "session.sqlite")) as connection:
        connection.execute("DELETE FROM frame")
        connection.commit()
    assert_refused(elsewhere, tmp_path / "carried", BadFile, "not numbered from 0 without gaps, or there are none")


def test_damaged_pages_are_found(elsewhere: SessionStore, carried: Path):
    path = carried / "session.sqlite"
    raw = bytearray(path.read_bytes())
    for page in range(2, len(raw) // 4096):
        raw[page * 4096 : page * 4096 + 64] = os.urandom(64)
    path.write_bytes(raw)
    assert_refused(elsewhere, carried, BadFile, "damaged|malformed")


def test_archives_are_unpacked_within_limits(elsewhere: SessionStore, carried: Path, tmp_path: Path):
    packed = zipped(carried)
    with pytest.raises(TooLarge, match="more than 1000 bytes"):
        import_session(elsewhere, packed, limits=ArchiveLimits(bytes=1000))
    with zipfile.ZipFile(packed, "a") as archive:
        archive.writestr("../../escaped", b"x")
    assert_refused(elsewhere, packed, RefusedPath, "escaped")
    packed.write_bytes(packed.read_bytes()[:-100])
    assert_refused(elsewhere, packed, BadFile, "no zip archive or a damaged one")
    assert not (tmp_path / "escaped").exists()


@pytest.mark.parametrize("schema", ["0001", "0002", "0003", "0004"])
def test_an_older_programs_session_is_migrated_on_its_way_in(
    store: SessionStore,
    elsewhere: SessionStore,
    plain: str,
    tmp_path: Path,
    schema: str,
    made_by_older_program: Callable[[Path, str], None],
):
    carried = tmp_path / "carried"
    export_session(store, plain, carried)
    made_by_older_program(carried / "session.sqlite", schema)
    imported = import_session(elsewhere, carried)
    assert differences(elsewhere.state(imported.id), store.state(plain)) == []
    with closing(sqlite3.connect(elsewhere.folder / imported.id / "session.sqlite")) as connection:
        assert connection.execute("SELECT version_num FROM alembic_version").fetchall() == [(migration.SCHEMA,)]
