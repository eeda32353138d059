"""The first schema: a recording, its classes and boxes, and the log of edits."""

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None


def upgrade() -> None:
    op.create_table(
        "session",
        sa.Column("id", sa.Integer, sa.CheckConstraint("id = 1", name="one_session"), primary_key=True),
        sa.Column("name", sa.Text, nullable=False),
        sa.Column("revision", sa.Integer, nullable=False),
        sa.Column("next_class_id", sa.Integer, nullable=False),
        sa.Column("next_box_id", sa.Integer, nullable=False),
        sa.Column("format", sa.Text, nullable=False),
        sa.Column("source", sa.Text, nullable=False),
        sa.Column("created", sa.Text, nullable=False),
        sa.Column("changed", sa.Text, nullable=False),
        sa.Column("origin", sa.Text, nullable=False),
    )
    op.create_table(
        "camera",
        sa.Column("id", sa.Integer, primary_key=True),
        sa.Column("width", sa.Integer, nullable=False),
        sa.Column("height", sa.Integer, nullable=False),
        sa.Column("fx", sa.Float, nullable=False),
        sa.Column("fy", sa.Float, nullable=False),
        sa.Column("cx", sa.Float, nullable=False),
        sa.Column("cy", sa.Float, nullable=False),
        sa.Column("model", sa.Text, nullable=False),
        sa.Column("distortion", sa.Text, nullable=False),
    )
    op.create_table(
        "frame",
        sa.Column("idx", sa.Integer, primary_key=True),
        sa.Column("name", sa.Text, nullable=False, unique=True),
        sa.Column("image", sa.Text),
        sa.Column("camera_id", sa.Integer, sa.ForeignKey("camera.id"), nullable=False),
        sa.Column("pose", sa.LargeBinary, nullable=False),
    )
    op.create_table(
        "skipped",
        sa.Column("idx", sa.Integer, primary_key=True),
        sa.Column("name", sa.Text, nullable=False),
        sa.Column("reason", sa.Text, nullable=False),
        sa.Column("place", sa.Text, nullable=False),
    )
    op.create_table(
        "object_class",
        sa.Column("id", sa.Integer, primary_key=True),
        sa.Column("name", sa.Text, nullable=False, unique=True),
        sa.Column("color", sa.Text, nullable=False),
        sa.Column("revision", sa.Integer, nullable=False),
    )
    op.create_table(
        "box",
        sa.Column("id", sa.Integer, primary_key=True),
        sa.Column("class_id", sa.Integer, sa.ForeignKey("object_class.id"), nullable=False),
        sa.Column("name", sa.Text, nullable=False),
        sa.Column("pose", sa.LargeBinary, nullable=False),
        sa.Column("size_x", sa.Float, nullable=False),
        sa.Column("size_y", sa.Float, nullable=False),
        sa.Column("size_z", sa.Float, nullable=False),
        sa.Column("has_hull", sa.Boolean, nullable=False, server_default=sa.false()),
        sa.Column("revision", sa.Integer, nullable=False),
    )
    op.create_table(
        "edit",
        sa.Column("revision", sa.Integer, primary_key=True),
        sa.Column("author", sa.Text, nullable=False),
        sa.Column("summary", sa.Text, nullable=False),
        sa.Column("changes", sa.Text, nullable=False),
        sa.Column("undoes", sa.Integer, sa.ForeignKey("edit.revision")),
        sa.Column("redoes", sa.Integer, sa.ForeignKey("edit.revision")),
        sa.Column("at", sa.Text, nullable=False),
    )
    op.create_index("edit_by_author", "edit", ["author", "revision"])
