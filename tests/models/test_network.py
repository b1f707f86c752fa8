import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from models.errors import ShapeError
from models.network import Mlp, silu


def random_mlp(activation, seed=0):
    rng = np.random.default_rng(seed)
    sizes = [(9, 16), (16, 16), (16, 2)]
    return Mlp(tuple((rng.normal(size=s), rng.normal(size=s[1])) for s in sizes), activation)


@pytest.mark.parametrize(
    ("activation", "function"), [("tanh", torch.tanh), ("silu", torch.nn.functional.silu)]
)
def test_the_forward_pass_is_that_of_torch(activation, function, rng):
    mlp = random_mlp(activation)
    x = rng.normal(size=(5, 9))
    y = torch.from_numpy(x)
    for index, (weight, bias) in enumerate(mlp.layers):
        y = y @ torch.from_numpy(weight) + torch.from_numpy(bias)
        y = function(y) if index < 2 else y
    assert_allclose(mlp(x), y.numpy(), atol=1e-12)


def test_a_batch_is_its_rows_and_the_input_stays_as_it_was(rng):
    mlp = random_mlp("silu")
    x = rng.normal(size=(3, 4, 9))
    kept = x.copy()
    y = mlp(x)
    assert_allclose(y[1, 2], mlp(x[1, 2]), atol=1e-12)
    assert_array_equal(x, kept)


@given(st.floats(-1e6, 1e6))
def test_silu_never_overflows(x):
    with np.errstate(all="raise", under="ignore"):
        y = silu(np.array([x]))
    assert min(x, 0.0) - 0.3 <= y[0] <= max(x, 0.0)


def test_weights_survive_being_named():
    mlp = random_mlp("tanh")
    again = Mlp.from_arrays(mlp.to_arrays("f"), "f", "tanh")
    for (weight, bias), (weight_again, bias_again) in zip(mlp.layers, again.layers, strict=True):
        assert_array_equal(weight, weight_again)
        assert_array_equal(bias, bias_again)


def test_layers_that_do_not_fit_are_refused():
    first, _, last = random_mlp("tanh").layers
    with pytest.raises(ShapeError, match="cannot follow"):
        Mlp((first, (last[0][:5], last[1])), "tanh")


def test_a_network_that_is_not_there_is_named():
    with pytest.raises(ShapeError, match="'g'"):
        Mlp.from_arrays(random_mlp("tanh").to_arrays("f"), "g", "tanh")
    arrays = random_mlp("tanh").to_arrays("f")
    del arrays["f.1.bias"]
    with pytest.raises(ShapeError, match=r"f\.1\.bias"):
        Mlp.from_arrays(arrays, "f", "tanh")
