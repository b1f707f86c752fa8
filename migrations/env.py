"""How Alembic reaches the database: the address comes from the caller, the tables from the app."""

from typing import Any

from alembic import context
from sqlalchemy import Connection, create_engine, event

from app.storage.tables import Row

config = context.config


def run() -> None:
    engine = create_engine(config.get_main_option("sqlalchemy.url") or "")

    # The driver would otherwise commit each statement of a migration on its own.
    @event.listens_for(engine, "connect")
    def _connect(connection: Any, _record: Any) -> None:
        connection.isolation_level = None

    @event.listens_for(engine, "begin")
    def _begin(connection: Connection) -> None:
        connection.exec_driver_sql("BEGIN IMMEDIATE")

    with engine.connect() as connection:
        context.configure(connection=connection, target_metadata=Row.metadata, render_as_batch=True)
        with context.begin_transaction():
            context.run_migrations()
    engine.dispose()


run()
