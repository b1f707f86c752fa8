"""browsers: which browser a place in a study was taken with, by the shared link."""

import sqlalchemy as sa
from alembic import op

revision = "a64c09e2f8d1"
down_revision = "f30a6d17b9c2"
branch_labels = None
depends_on = None


def upgrade() -> None:
    with op.batch_alter_table("participant", schema=None) as batch_op:
        batch_op.add_column(sa.Column("browser_hash", sa.String(), nullable=True))


def downgrade() -> None:
    with op.batch_alter_table("participant", schema=None) as batch_op:
        batch_op.drop_column("browser_hash")
