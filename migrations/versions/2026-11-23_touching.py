"""touching: every recorded tick says whether the arm touched the obstacle."""

import zlib
from collections.abc import Callable

import numpy as np
import sqlalchemy as sa
from alembic import op

revision = "d7f1a2c3b4e5"
down_revision = "b2d9c4a7e610"
branch_labels = None
depends_on = None

_BEFORE = 29  # columns of a tick, up to "hold"
_CHUNKS = sa.table(
    "sample_chunk", sa.column("id", sa.Integer), sa.column("samples", sa.LargeBinary)
)


def upgrade() -> None:
    # What was not recorded is not a number.
    _rewrite(_BEFORE, lambda rows: np.column_stack([rows, np.full(len(rows), np.nan)]))


def downgrade() -> None:
    _rewrite(_BEFORE + 1, lambda rows: rows[:, :-1])


def _rewrite(columns: int, change: Callable[[np.ndarray], np.ndarray]) -> None:
    db = op.get_bind()
    ids = [row.id for row in db.execute(sa.select(_CHUNKS.c.id))]
    for chunk in ids:
        where = _CHUNKS.c.id == chunk
        samples = db.scalars(sa.select(_CHUNKS.c.samples).where(where)).one()
        rows = np.frombuffer(zlib.decompress(samples), dtype="<f8").reshape(-1, columns)
        changed = np.ascontiguousarray(change(rows), dtype="<f8")
        packed = zlib.compress(changed.tobytes(), level=1)
        db.execute(sa.update(_CHUNKS).where(where).values(samples=packed))
