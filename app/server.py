"""uvicorn with the settings this service needs, and the links it prints when it is ready."""

import os
import socket
from collections.abc import Callable

import uvicorn
from fastapi import FastAPI

from app.services import accounts, enrolment
from app.settings import Settings
from app.storage.database import Database


class Server(uvicorn.Server):
    """Calls ``on_ready`` once the service answers."""

    def __init__(
        self, app: FastAPI, settings: Settings, on_ready: Callable[[FastAPI, Settings], None]
    ) -> None:
        """Prepare; ``run`` begins."""
        super().__init__(
            uvicorn.Config(
                app,
                ws_max_size=settings.max_message_bytes,
                ws_per_message_deflate=False,  # poses are many, small and already compressed
                access_log=False,  # addresses hold participants' keys
                server_header=False,
                log_level="warning",
                timeout_graceful_shutdown=3,
            )
        )
        self._app = app
        self._settings = settings
        self._on_ready = on_ready

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start, and say so."""
        await super().startup(sockets)
        if self.started:
            self._on_ready(self._app, self._settings)


def print_links(app: FastAPI, settings: Settings) -> None:
    """Print the links of this start: a participant's, and the experimenter's."""
    database: Database = app.state.service.database
    with database.write() as db:
        participant = enrolment.startup_link(db, settings)
        setup = accounts.new_setup_link(db)
    lines = [
        "",
        f"Joymap is ready on {settings.base_url}",
        "",
        f"  participant   {settings.base_url}/p/{participant}",
        f"  experimenter  {settings.base_url}/setup/{setup}   (works once)",
        "",
        "Stop it with Ctrl+C.",
        "",
    ]
    os.write(1, ("\n".join(lines)).encode())
