"""driven tasks: what a task said at the end of a drive, and where its props were."""

import sqlalchemy as sa
from alembic import op

revision = "b2d9c4a7e610"
down_revision = "c5631a66e27a"
branch_labels = None
depends_on = None


def upgrade() -> None:
    with op.batch_alter_table("drive", schema=None) as batch_op:
        batch_op.add_column(sa.Column("outcome", sa.JSON(), nullable=True))
    with op.batch_alter_table("sample_chunk", schema=None) as batch_op:
        batch_op.add_column(sa.Column("props", sa.LargeBinary(), nullable=True))


def downgrade() -> None:
    with op.batch_alter_table("sample_chunk", schema=None) as batch_op:
        batch_op.drop_column("props")
    with op.batch_alter_table("drive", schema=None) as batch_op:
        batch_op.drop_column("outcome")
