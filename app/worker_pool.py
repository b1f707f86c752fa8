"""Processes that compute beside this one, for trainings and simulations.

They are forked from a server of their own that has loaded the libraries once: each is ready in
milliseconds, and no thread or lock of this process is copied into them.
"""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable
from typing import Any

import torch
from pebble import ProcessPool

_METHOD = "forkserver"


def new_pool(
    workers: int, preload: str, prepare: Callable[..., None], *arguments: Any
) -> ProcessPool:
    """A pool that starts its processes when it gets its first task.

    Args:
        workers: How many processes.
        preload: The module whose functions they will run; loaded once for all.
        prepare: Called first in each; it should begin with :func:`settle`.
        arguments: Of ``prepare``.
    """
    context = multiprocessing.get_context(_METHOD)
    context.set_forkserver_preload([preload])
    return ProcessPool(
        max_workers=workers, context=context, initializer=prepare, initargs=arguments
    )


def settle() -> None:
    """Make a fresh process one of a pool: of one thread, deaf to Ctrl-C, gone with its parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_die_with_parent, daemon=True).start()
    torch.set_num_threads(1)


def _die_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
