"""stick settings: how each participant's stick is set."""

import sqlalchemy as sa
from alembic import op

revision = "e81b5c20d9f4"
down_revision = "d7f1a2c3b4e5"
branch_labels = None
depends_on = None


def upgrade() -> None:
    with op.batch_alter_table("participant", schema=None) as batch_op:
        batch_op.add_column(sa.Column("stick", sa.JSON(), nullable=True))


def downgrade() -> None:
    with op.batch_alter_table("participant", schema=None) as batch_op:
        batch_op.drop_column("stick")
