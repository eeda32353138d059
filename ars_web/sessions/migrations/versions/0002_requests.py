"""Idempotency keys: which edit answered which request, kept in the same transaction as the edit."""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"


def upgrade() -> None:
    op.create_table(
        "request",
        sa.Column("key", sa.Text, primary_key=True),
        sa.Column("digest", sa.Text, nullable=False),
        sa.Column("revision", sa.Integer, sa.ForeignKey("edit.revision"), nullable=False),
    )
