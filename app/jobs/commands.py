"""``joymap``'s own commands in a process of their own: the control loop must not wait for them."""

import asyncio
import os
import sys
from asyncio.subprocess import Process
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

from app.settings import Settings

_NICE = 10


def joymap() -> tuple[str, ...]:
    """What a command begins with."""
    return sys.executable, "-m", "app.cli"


async def start(command: Sequence[str], settings: Settings, **pipes: Any) -> Process:
    """Start a command on the server's own data; whoever waits for the robot comes first.

    Args:
        command: Its words, without ``joymap``.
        settings: The server's.
        pipes: For ``asyncio.create_subprocess_exec``.
    """
    own = {
        "JOYMAP_DATA_DIR": str(settings.data_dir),
        "JOYMAP_TELEOP_RATE_HZ": str(settings.teleop_rate_hz),
    }
    process = await asyncio.create_subprocess_exec(
        *joymap(), *command, env=os.environ | own, **pipes
    )
    with suppress(ProcessLookupError):  # over already
        os.setpriority(os.PRIO_PROCESS, process.pid, _NICE)
    return process


async def end(process: Process) -> None:
    """Wait for a process that is over, or kill it."""
    with suppress(ProcessLookupError):
        process.kill()
    await process.wait()
