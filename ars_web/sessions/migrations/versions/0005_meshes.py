"""What is known of an object's shape: meshes of classes and boxes, and the symmetry and keypoints of a class."""

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"


def upgrade() -> None:
    op.create_table(
        "mesh",
        sa.Column("digest", sa.Text, primary_key=True),
        sa.Column("vertices", sa.LargeBinary, nullable=False),
        sa.Column("faces", sa.LargeBinary, nullable=False),
        sa.Column("source", sa.Text, nullable=False),
        sa.Column("unit", sa.Text, nullable=False),
        sa.Column("axes", sa.Text, nullable=False),
        sa.Column("origin", sa.Text, nullable=False),
    )
    # Built anew, as in 0004.
    with op.batch_alter_table("object_class") as object_class:
        object_class.add_column(sa.Column("mesh", sa.Text, sa.ForeignKey("mesh.digest", name="class_mesh")))
        object_class.add_column(sa.Column("symmetry", sa.Text))
        object_class.add_column(sa.Column("keypoints", sa.Text))
    with op.batch_alter_table("box") as box:
        box.add_column(sa.Column("mesh", sa.Text, sa.ForeignKey("mesh.digest", name="box_mesh")))
