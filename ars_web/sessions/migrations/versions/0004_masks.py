"""Masks and the hulls that they give. Which box has a hull is told by the hull's name; none had one before."""

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"


def upgrade() -> None:
    op.create_table(
        "hull",
        sa.Column("digest", sa.Text, primary_key=True),
        sa.Column("vertices", sa.LargeBinary, nullable=False),
        sa.Column("faces", sa.LargeBinary, nullable=False),
    )
    op.create_table(
        "mask",
        sa.Column("id", sa.Integer, primary_key=True),
        sa.Column("box_id", sa.Integer, nullable=False),
        sa.Column("frame", sa.Integer, sa.ForeignKey("frame.idx"), nullable=False),
        sa.Column("class_id", sa.Integer, sa.ForeignKey("object_class.id"), nullable=False),
        sa.Column("polygons", sa.Text, nullable=False),
        sa.Column("origin", sa.Text, nullable=False),
        sa.Column("accepted", sa.Boolean, nullable=False),
        sa.Column("revision", sa.Integer, nullable=False),
        sa.UniqueConstraint("box_id", "frame", name="one_mask_a_frame"),
    )
    op.add_column("session", sa.Column("next_mask_id", sa.Integer, nullable=False, server_default=sa.text("1")))
    # Built anew: older SQLites cannot drop a column, nor add one that refers to another table with a name.
    with op.batch_alter_table("box") as box:
        box.drop_column("has_hull")
        box.add_column(sa.Column("hull", sa.Text, sa.ForeignKey("hull.digest", name="box_hull")))
        box.add_column(sa.Column("hull_options", sa.Text))
