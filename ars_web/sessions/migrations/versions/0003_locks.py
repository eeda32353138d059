"""Boxes that are locked, classes with a usual size, and looking up what took an edit back."""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"


def upgrade() -> None:
    op.add_column("object_class", sa.Column("default_size", sa.Text))
    op.add_column("box", sa.Column("locked", sa.Boolean, nullable=False, server_default=sa.false()))
    op.create_index("edit_by_undone", "edit", ["undoes"], sqlite_where=sa.text("undoes IS NOT NULL"))
    op.create_index("edit_by_redone", "edit", ["redoes"], sqlite_where=sa.text("redoes IS NOT NULL"))
