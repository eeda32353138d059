"""The tables of one session's database. `migrations/` makes them; a test holds the two to each other.

One database holds one session, so no table needs a session's id: a session folder can be moved or copied whole.
"""

from sqlalchemy import (
    Boolean,
    CheckConstraint,
    Column,
    Float,
    ForeignKey,
    Index,
    Integer,
    LargeBinary,
    MetaData,
    Table,
    Text,
    UniqueConstraint,
    false,
    text,
)

metadata = MetaData()

session = Table(
    "session",
    metadata,
    Column("id", Integer, CheckConstraint("id = 1", name="one_session"), primary_key=True),
    Column("name", Text, nullable=False),
    Column("revision", Integer, nullable=False),
    Column("next_class_id", Integer, nullable=False),
    Column("next_box_id", Integer, nullable=False),
    Column("format", Text, nullable=False),
    Column("source", Text, nullable=False),
    Column("created", Text, nullable=False),
    Column("changed", Text, nullable=False),
    # The state at revision 0, as JSON: what the log is replayed from.
    Column("origin", Text, nullable=False),
    Column("next_mask_id", Integer, nullable=False, server_default=text("1")),
)

camera = Table(
    "camera",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("width", Integer, nullable=False),
    Column("height", Integer, nullable=False),
    Column("fx", Float, nullable=False),
    Column("fy", Float, nullable=False),
    Column("cx", Float, nullable=False),
    Column("cy", Float, nullable=False),
    Column("model", Text, nullable=False),
    Column("distortion", Text, nullable=False),
)

frame = Table(
    "frame",
    metadata,
    Column("idx", Integer, primary_key=True),
    Column("name", Text, nullable=False, unique=True),
    # The absolute path of an image that lies elsewhere; NULL: `images/NAME` in the session's own folder.
    Column("image", Text),
    Column("camera_id", Integer, ForeignKey("camera.id"), nullable=False),
    # The upper three rows of T_world_camera, little-endian float64, row by row.
    Column("pose", LargeBinary, nullable=False),
)

skipped = Table(
    "skipped",
    metadata,
    Column("idx", Integer, primary_key=True),
    Column("name", Text, nullable=False),
    Column("reason", Text, nullable=False),
    Column("place", Text, nullable=False),
)

object_class = Table(
    "object_class",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("name", Text, nullable=False, unique=True),
    Column("color", Text, nullable=False),
    Column("revision", Integer, nullable=False),
    # Three lengths as a JSON list; NULL: nobody has said.
    Column("default_size", Text),
    Column("mesh", Text, ForeignKey("mesh.digest", name="class_mesh")),
    # As a JSON object; NULL: none.
    Column("symmetry", Text),
    # A JSON list; NULL: the box's centre and corners.
    Column("keypoints", Text),
)

box = Table(
    "box",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("class_id", Integer, ForeignKey("object_class.id"), nullable=False),
    Column("name", Text, nullable=False),
    # As `frame.pose`, of T_world_box.
    Column("pose", LargeBinary, nullable=False),
    Column("size_x", Float, nullable=False),
    Column("size_y", Float, nullable=False),
    Column("size_z", Float, nullable=False),
    Column("revision", Integer, nullable=False),
    Column("locked", Boolean, nullable=False, server_default=false()),
    Column("hull", Text, ForeignKey("hull.digest", name="box_hull")),
    # As a JSON object; NULL: it was not made from masks.
    Column("hull_options", Text),
    Column("mesh", Text, ForeignKey("mesh.digest", name="box_mesh")),
)

hull = Table(
    "hull",
    metadata,
    # Rows are named by what they hold and never deleted: the log names them, too, and undo brings them back.
    Column("digest", Text, primary_key=True),
    # Three little-endian float32 a vertex, in units of the box's sizes.
    Column("vertices", LargeBinary, nullable=False),
    # Three little-endian int32 a face.
    Column("faces", LargeBinary, nullable=False),
)

mesh = Table(
    "mesh",
    metadata,
    # As `hull.digest`.
    Column("digest", Text, primary_key=True),
    # Three little-endian float32 a vertex, metres along the box's axes from its centre.
    Column("vertices", LargeBinary, nullable=False),
    # Three little-endian int32 a face.
    Column("faces", LargeBinary, nullable=False),
    # Where it came from: the file's name, and how its numbers were read.
    Column("source", Text, nullable=False),
    Column("unit", Text, nullable=False),
    Column("axes", Text, nullable=False),
    Column("origin", Text, nullable=False),
)

mask = Table(
    "mask",
    metadata,
    Column("id", Integer, primary_key=True),
    # No reference: an object may be outlined before it has a box, whose id is kept for it.
    Column("box_id", Integer, nullable=False),
    Column("frame", Integer, ForeignKey("frame.idx"), nullable=False),
    Column("class_id", Integer, ForeignKey("object_class.id"), nullable=False),
    # A JSON list, as in the log.
    Column("polygons", Text, nullable=False),
    Column("origin", Text, nullable=False),
    Column("accepted", Boolean, nullable=False),
    Column("revision", Integer, nullable=False),
    UniqueConstraint("box_id", "frame", name="one_mask_a_frame"),
)

edit = Table(
    "edit",
    metadata,
    Column("revision", Integer, primary_key=True),
    Column("author", Text, nullable=False),
    Column("summary", Text, nullable=False),
    Column("changes", Text, nullable=False),
    Column("undoes", Integer, ForeignKey("edit.revision")),
    Column("redoes", Integer, ForeignKey("edit.revision")),
    Column("at", Text, nullable=False),
    Index("edit_by_author", "author", "revision"),
    # What takes a given edit back is looked up without reading the log.
    Index("edit_by_undone", "undoes", sqlite_where=text("undoes IS NOT NULL")),
    Index("edit_by_redone", "redoes", sqlite_where=text("redoes IS NOT NULL")),
)

request = Table(
    "request",
    metadata,
    # The client's idempotency key, what it asked for as a digest, and the edit that was the answer.
    Column("key", Text, primary_key=True),
    Column("digest", Text, nullable=False),
    Column("revision", Integer, ForeignKey("edit.revision"), nullable=False),
)
