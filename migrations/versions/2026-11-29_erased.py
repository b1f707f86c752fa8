"""erased: when what somebody gave was erased."""

import sqlalchemy as sa
from alembic import op

revision = "c3d81f5a9b07"
down_revision = "a64c09e2f8d1"
branch_labels = None
depends_on = None


def upgrade() -> None:
    with op.batch_alter_table("participant", schema=None) as batch_op:
        batch_op.add_column(sa.Column("erased_at", sa.DateTime(), nullable=True))
    # Of whom everything was erased before, nothing is left to draw their questions by.
    op.execute("UPDATE participant SET erased_at = ended_at WHERE state = 'withdrawn' AND seed = 0")


def downgrade() -> None:
    with op.batch_alter_table("participant", schema=None) as batch_op:
        batch_op.drop_column("erased_at")
