"""What every test may ask for. Shapes are checked while the tests run."""

import os

# Before any numeric library is loaded: two cores are shared by everything the tests start.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

from jaxtyping import install_import_hook

install_import_hook("models", "beartype.beartype")

import numpy as np
import pytest
import torch
from xdist.remote import Producer
from xdist.scheduler import LoadFileScheduling

from models.panda_pack import PandaPack, default_folder, open_pack

torch.set_num_threads(1)


# What goes on in real time. Without a graphics card a 3-D picture fills both cores, and two at
# once, or one beside a person who drives, would starve.
TAKE_TURNS = (
    "tests/browser/",
    "tests/app/test_bots.py",
    "tests/app/test_driven_through_the_server.py",
    "tests/app/test_running_server.py",
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What takes turns takes longest, and comes first."""
    items.sort(key=lambda item: not item.nodeid.startswith(TAKE_TURNS))


class Scheduling(LoadFileScheduling):  # type: ignore[misc]
    """Side by side (``-n 2``), a file's tests share a worker; so do all that take turns."""

    def _split_scope(self, nodeid: str) -> str:
        return "turns" if nodeid.startswith(TAKE_TURNS) else super()._split_scope(nodeid)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Producer) -> Scheduling:
    config.option.loadscopereorder = False  # the order is that of the hook above
    return Scheduling(config, log)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20261123)


@pytest.fixture(scope="session")
def pack() -> PandaPack:
    return open_pack(default_folder())
