"""Draws studies' figures on demand, one study after the other, and keeps the last of each.

They are made as ``joymap figures`` makes them, from an export of that moment, and kept in memory
alone: what is erased must not go on in pictures.
"""

import asyncio
import json
import logging
import tempfile
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from app.jobs import commands
from app.services.figures import Version
from app.settings import Settings

_LOG = logging.getLogger(__name__)
_MOST = 8  # studies whose figures are kept


@dataclass(frozen=True)
class Drawn:
    """The figures of a study as they were at a time.

    Attributes:
        version: Of the study's data.
        drawn_at: When.
        index: What ``figures.json`` says.
        images: The pictures as SVG, by name.
    """

    version: Version
    drawn_at: datetime
    index: dict[str, Any]
    images: dict[str, bytes]


class FigureDesk:
    """Where figures are ordered and lie until they are out of date. Used on the event loop."""

    def __init__(self, settings: Settings) -> None:
        """Begin with none."""
        self._settings = settings
        self._drawn: dict[str, Drawn] = {}
        self._orders: dict[str, asyncio.Task[None]] = {}
        self._failed: set[str] = set()
        self._turn = asyncio.Lock()

    def drawn(self, study_id: str, version: Version) -> Drawn | None:
        """The newest figures; never such with people in them who have left since."""
        found = self._drawn.get(study_id)
        if found is not None and found.version.people != version.people:
            del self._drawn[study_id]
            return None
        return found

    def is_drawing(self, study_id: str) -> bool:
        """Whether new ones are being made."""
        return study_id in self._orders

    def has_failed(self, study_id: str) -> bool:
        """Whether the last try came to nothing."""
        return study_id in self._failed

    def order(self, study_id: str, version: Version) -> None:
        """Have them drawn, if they are not and are not being drawn."""
        found = self.drawn(study_id, version)
        if self.is_drawing(study_id) or (found is not None and found.version == version):
            return
        self._failed.discard(study_id)
        order = asyncio.create_task(self._draw(study_id, version), name="figures")
        self._orders[study_id] = order
        order.add_done_callback(lambda _order: self._orders.pop(study_id, None))

    async def close(self) -> None:
        """Give up what is being drawn."""
        orders = list(self._orders.values())
        for order in orders:
            order.cancel()
        await asyncio.gather(*orders, return_exceptions=True)

    async def _draw(self, study_id: str, version: Version) -> None:
        async with self._turn:
            try:
                with tempfile.TemporaryDirectory(prefix="joymap-figures-") as folder:
                    export, out = Path(folder) / "study.zip", Path(folder) / "figures"
                    await self._run("export", study_id, "--no-lerobot", "--out", str(export))
                    await self._run("figures", str(export), "--out", str(out))
                    index = json.loads((out / "figures.json").read_text())
                    images = {path.stem: path.read_bytes() for path in out.glob("*.svg")}
            except (OSError, RuntimeError):
                _LOG.exception("The figures of a study could not be drawn.")
                self._failed.add(study_id)
                return
        self._drawn.pop(study_id, None)
        self._drawn[study_id] = Drawn(version, datetime.now(UTC), index, images)
        for oldest in list(self._drawn)[:-_MOST]:
            del self._drawn[oldest]

    async def _run(self, *command: str) -> None:
        process = await commands.start(command, self._settings, stdout=asyncio.subprocess.DEVNULL)
        try:
            if await process.wait() != 0:
                raise RuntimeError(f"joymap {command[0]} ended with {process.returncode}.")
        finally:
            await commands.end(process)
