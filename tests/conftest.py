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

from models.panda_pack import PandaPack, default_folder, open_pack

torch.set_num_threads(1)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20261123)


@pytest.fixture(scope="session")
def pack() -> PandaPack:
    return open_pack(default_folder())
