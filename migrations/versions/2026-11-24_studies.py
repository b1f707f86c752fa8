"""studies: protocols, accounts, questionnaires, notes and the audit trail.

Who took part before takes part in the study "demo" from now on, at the step they had reached.
"""

import json
from datetime import UTC, datetime

import sqlalchemy as sa
from alembic import op

revision = "f30a6d17b9c2"
down_revision = "e81b5c20d9f4"
branch_labels = None
depends_on = None

_STEPS = ("consent", "practice", "queries", "training", "driving")


def upgrade() -> None:
    _make_tables()
    db = op.get_bind()
    tasks = [row[0] for row in db.execute(sa.text("SELECT DISTINCT task FROM participant"))]
    now = datetime.now(UTC).replace(tzinfo=None)
    if tasks:
        _make_demo(db, tasks, now)
    with op.batch_alter_table("participant") as batch:
        batch.add_column(sa.Column("study_id", sa.String(), nullable=False, server_default="demo"))
        batch.add_column(sa.Column("protocol_id", sa.String(), nullable=False, server_default=""))
        batch.add_column(sa.Column("cell", sa.Integer(), nullable=False, server_default="0"))
        batch.add_column(sa.Column("place", sa.Integer(), nullable=False, server_default="0"))
        batch.add_column(sa.Column("state", sa.String(), nullable=False, server_default="active"))
        batch.add_column(sa.Column("external_id", sa.String(), nullable=True))
        batch.add_column(sa.Column("seen_at", sa.DateTime(), nullable=True))
        batch.add_column(sa.Column("ended_at", sa.DateTime(), nullable=True))
        batch.add_column(sa.Column("excluded", sa.String(), nullable=True))
    db.execute(sa.text("UPDATE participant SET protocol_id = 'demo-' || task"))
    for place, step in enumerate(_STEPS):
        db.execute(
            sa.text("UPDATE participant SET place = :place WHERE step = :step"),
            {"place": place, "step": step},
        )
    for table, has_step in (
        ("query", False),
        ("job", False),
        ("alignment", False),
        ("drive", True),
    ):
        with op.batch_alter_table(table) as batch:
            batch.add_column(sa.Column("task", sa.String(), nullable=False, server_default=""))
            if has_step:
                batch.add_column(
                    sa.Column("step", sa.String(), nullable=False, server_default="driving")
                )
        db.execute(
            sa.text(
                f"UPDATE {table} SET task = "
                f"(SELECT task FROM participant WHERE participant.id = {table}.participant_id)"
            )
        )
    with op.batch_alter_table("query") as batch:
        batch.add_column(sa.Column("repeats", sa.String(), nullable=True))
        batch.drop_constraint("uq_query_participant_id", type_="unique")
        batch.create_unique_constraint(
            "uq_query_participant_id", ["participant_id", "task", "position"]
        )
        batch.create_foreign_key("fk_query_repeats_query", "query", ["repeats"], ["id"])
        batch.alter_column("task", server_default=None)
    with op.batch_alter_table("job") as batch:
        batch.drop_constraint("uq_job_participant_id", type_="unique")
        batch.create_unique_constraint(
            "uq_job_participant_id", ["participant_id", "task", "data_hash"]
        )
        batch.alter_column("task", server_default=None)
    with op.batch_alter_table("alignment") as batch:
        batch.alter_column("task", server_default=None)
    with op.batch_alter_table("drive") as batch:
        batch.alter_column("task", server_default=None)
        batch.alter_column("step", server_default=None)
    with op.batch_alter_table("participant") as batch:
        batch.drop_column("step")
        batch.drop_column("task")
        for name in ("study_id", "protocol_id", "cell", "place", "state"):
            batch.alter_column(name, server_default=None)
        batch.alter_column("token_hash", existing_type=sa.String(), nullable=True)
        batch.create_unique_constraint("uq_participant_study_id", ["study_id", "external_id"])
        batch.create_check_constraint(
            "state", "state IN ('active', 'completed', 'abandoned', 'withdrawn')"
        )
        batch.create_foreign_key("fk_participant_study_id_study", "study", ["study_id"], ["id"])
        batch.create_foreign_key(
            "fk_participant_protocol_id_protocol", "protocol", ["protocol_id"], ["id"]
        )
        batch.create_index("ix_participant_study_id", ["study_id"])


def _make_tables() -> None:
    op.create_table(
        "experimenter",
        sa.Column("id", sa.String(), nullable=False),
        sa.Column("name", sa.String(), nullable=False),
        sa.Column("password_hash", sa.String(), nullable=False),
        sa.Column("role", sa.String(), nullable=False),
        sa.Column("created_at", sa.DateTime(), nullable=False),
        sa.Column("disabled_at", sa.DateTime(), nullable=True),
        sa.CheckConstraint("role IN ('owner', 'assistant', 'viewer')", name="role"),
        sa.PrimaryKeyConstraint("id", name="pk_experimenter"),
        sa.UniqueConstraint("name", name="uq_experimenter_name"),
    )
    op.create_table(
        "study",
        sa.Column("id", sa.String(), nullable=False),
        sa.Column("title", sa.String(), nullable=False),
        sa.Column("state", sa.String(), nullable=False),
        sa.Column("link_hash", sa.String(), nullable=True),
        sa.Column("created_at", sa.DateTime(), nullable=False),
        sa.Column("created_by", sa.String(), nullable=True),
        sa.ForeignKeyConstraint(
            ["created_by"], ["experimenter.id"], name="fk_study_created_by_experimenter"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_study"),
        sa.UniqueConstraint("link_hash", name="uq_study_link_hash"),
    )
    op.create_table(
        "protocol",
        sa.Column("id", sa.String(), nullable=False),
        sa.Column("study_id", sa.String(), nullable=False),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("content", sa.JSON(), nullable=False),
        sa.Column("created_at", sa.DateTime(), nullable=False),
        sa.Column("frozen_at", sa.DateTime(), nullable=True),
        sa.ForeignKeyConstraint(["study_id"], ["study.id"], name="fk_protocol_study_id_study"),
        sa.PrimaryKeyConstraint("id", name="pk_protocol"),
        sa.UniqueConstraint("study_id", "version", name="uq_protocol_study_id"),
    )
    op.create_index("ix_protocol_study_id", "protocol", ["study_id"])
    op.create_table(
        "response",
        sa.Column("id", sa.Integer(), autoincrement=True, nullable=False),
        sa.Column("participant_id", sa.String(), nullable=False),
        sa.Column("step", sa.String(), nullable=False),
        sa.Column("questionnaire", sa.String(), nullable=False),
        sa.Column("item", sa.String(), nullable=False),
        sa.Column("value", sa.String(), nullable=True),
        sa.Column("answered_at", sa.DateTime(), nullable=False),
        sa.Column("received_at", sa.DateTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["participant_id"], ["participant.id"], name="fk_response_participant_id_participant"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_response"),
        sa.UniqueConstraint("participant_id", "step", "item", name="uq_response_participant_id"),
    )
    op.create_index("ix_response_participant_id", "response", ["participant_id"])
    op.create_table(
        "note",
        sa.Column("id", sa.String(), nullable=False),
        sa.Column("participant_id", sa.String(), nullable=False),
        sa.Column("experimenter_id", sa.String(), nullable=False),
        sa.Column("text", sa.String(), nullable=False),
        sa.Column("written_at", sa.DateTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["participant_id"], ["participant.id"], name="fk_note_participant_id_participant"
        ),
        sa.ForeignKeyConstraint(
            ["experimenter_id"], ["experimenter.id"], name="fk_note_experimenter_id_experimenter"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_note"),
    )
    op.create_index("ix_note_participant_id", "note", ["participant_id"])
    op.create_table(
        "audit",
        sa.Column("id", sa.Integer(), autoincrement=True, nullable=False),
        sa.Column("at", sa.DateTime(), nullable=False),
        sa.Column("experimenter_id", sa.String(), nullable=True),
        sa.Column("action", sa.String(), nullable=False),
        sa.Column("subject", sa.String(), nullable=True),
        sa.Column("detail", sa.JSON(), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_audit"),
    )
    # Whoever was logged in has no account yet: they make one with the next link.
    op.drop_table("login")
    op.drop_table("setup_link")
    op.create_table(
        "setup_link",
        sa.Column("token_hash", sa.String(), nullable=False),
        sa.Column("role", sa.String(), nullable=False),
        sa.Column("made_by", sa.String(), nullable=True),
        sa.Column("created_at", sa.DateTime(), nullable=False),
        sa.Column("used_at", sa.DateTime(), nullable=True),
        sa.ForeignKeyConstraint(
            ["made_by"], ["experimenter.id"], name="fk_setup_link_made_by_experimenter"
        ),
        sa.PrimaryKeyConstraint("token_hash", name="pk_setup_link"),
    )
    op.create_table(
        "login",
        sa.Column("token_hash", sa.String(), nullable=False),
        sa.Column("experimenter_id", sa.String(), nullable=False),
        sa.Column("created_at", sa.DateTime(), nullable=False),
        sa.Column("expires_at", sa.DateTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["experimenter_id"], ["experimenter.id"], name="fk_login_experimenter_id_experimenter"
        ),
        sa.PrimaryKeyConstraint("token_hash", name="pk_login"),
    )
    op.create_index("ix_login_experimenter_id", "login", ["experimenter_id"])
    op.create_table(
        "api_token",
        sa.Column("id", sa.String(), nullable=False),
        sa.Column("experimenter_id", sa.String(), nullable=False),
        sa.Column("name", sa.String(), nullable=False),
        sa.Column("scope", sa.String(), nullable=False),
        sa.Column("token_hash", sa.String(), nullable=False),
        sa.Column("created_at", sa.DateTime(), nullable=False),
        sa.Column("expires_at", sa.DateTime(), nullable=True),
        sa.Column("used_at", sa.DateTime(), nullable=True),
        sa.Column("revoked_at", sa.DateTime(), nullable=True),
        sa.CheckConstraint("scope IN ('read', 'write')", name="scope"),
        sa.ForeignKeyConstraint(
            ["experimenter_id"],
            ["experimenter.id"],
            name="fk_api_token_experimenter_id_experimenter",
        ),
        sa.PrimaryKeyConstraint("id", name="pk_api_token"),
        sa.UniqueConstraint("token_hash", name="uq_api_token_token_hash"),
    )
    op.create_index("ix_api_token_experimenter_id", "api_token", ["experimenter_id"])


def _make_demo(db: sa.Connection, tasks: list[str], now: datetime) -> None:
    db.execute(
        sa.text(
            "INSERT INTO study (id, title, state, link_hash, created_at, created_by) "
            "VALUES ('demo', 'Try it out', 'open', NULL, :now, NULL)"
        ),
        {"now": now},
    )
    for version, task in enumerate(sorted(tasks), start=1):
        content = {
            "title": "Try it out",
            "tasks": [{"task": task}],
            "strategies": ["all-priors", "task-space", "no-priors", "no-align"],
            "order": "fixed",
            "is_free": True,
        }
        db.execute(
            sa.text(
                "INSERT INTO protocol (id, study_id, version, content, created_at, frozen_at) "
                "VALUES (:id, 'demo', :version, :content, :now, :now)"
            ),
            {
                "id": f"demo-{task}",
                "version": version,
                "content": json.dumps(content),
                "now": now,
            },
        )


def downgrade() -> None:
    raise RuntimeError("There is no way back from studies; restore the backup made before.")
