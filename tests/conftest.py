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


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The browser's tests take longest and come first."""
    items.sort(key=lambda item: "browser" not in item.path.parts)


class Scheduling(LoadFileScheduling):
    """Side by side (``-n 2``), a file's tests share a worker, and so a module's server.

    All browser tests share one: without a graphics card two pictures at once would starve.
    """

    def _split_scope(self, nodeid: str) -> str:
        is_browser = nodeid.startswith("tests/browser/")
        return "tests/browser" if is_browser else super()._split_scope(nodeid)


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
