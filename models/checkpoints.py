"""Files of weights: ``STEM.safetensors`` with the numbers, ``STEM.json`` with all about them.

The JSON is written last and holds the hash of the numbers: a checkpoint that was not finished, or
was changed since, cannot be loaded. No file holds code.
"""

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, cast

import numpy as np
from safetensors import SafetensorError
from safetensors.numpy import load as arrays_from_bytes
from safetensors.numpy import save as arrays_to_bytes

from .alignment import AffineAlignment, Alignment, NetworkAlignment, get_strategy
from .controller import (
    AutoencoderController,
    LatentController,
    LinearController,
    WarpedController,
)
from .errors import CheckpointError, InputError, ShapeError
from .kinematics import Kinematics
from .network import Activation, Mlp
from .panda import N_JOINTS
from .task_space import TaskSpaceAlignment
from .tasks import Task

FORMAT = 1
# What a controller may be made of.
LINEAR = ("linear", "principal")
CONTROLLERS = ("autoencoder", *LINEAR, "warped")
PRETRAINED = Path(__file__).resolve().parent / "pretrained"
_LIBRARIES = ("numpy", "torch", "pytorch-kinematics", "scipy")


@dataclass(frozen=True)
class Checkpoint:
    """What is known of a file of weights.

    Attributes:
        kind: "controller" or "alignment".
        weights_sha256: Of the file with the numbers.
        seed: All chance of the training.
        data_hash: Of what it was trained on.
        settings: How it was trained.
        facts: What else there is to say (quality, strategy, ...).
        libraries: Versions.
        code_version: Hash of the learning core's source that made it.
    """

    kind: str
    weights_sha256: str
    seed: int
    data_hash: str
    settings: dict[str, Any]
    facts: dict[str, Any]
    libraries: dict[str, str]
    code_version: str
    format: int = FORMAT


def save_controller(
    stem: Path,
    controller: LatentController,
    *,
    seed: int,
    data_hash: str,
    settings: Mapping[str, Any],
    facts: Mapping[str, Any],
) -> Checkpoint:
    """Write a controller; the files appear whole or not at all."""
    about = {"controller_hash": controller.content_hash, **facts}
    return _save(stem, "controller", controller.to_arrays(), seed, data_hash, settings, about)


def load_controller(
    task: str, form: str = "autoencoder", folder: Path = PRETRAINED
) -> LatentController:
    """The task's controller, of one of the :data:`CONTROLLERS`.

    Raises:
        InputError: If there is no such form.
        CheckpointError: If it is missing, unfinished, damaged or of another kind.
    """
    if form not in CONTROLLERS:
        offered = ", ".join(CONTROLLERS)
        raise InputError(f"There is no controller '{form}'; choose one of: {offered}.")
    checkpoint, arrays = _load(folder / controller_stem(task, form), "controller")
    s_mean = _array(arrays, "s_mean", (N_JOINTS,))
    s_scale = _array(arrays, "s_scale", (N_JOINTS,))
    z_scale = _array(arrays, "z_scale", (2,))
    a_scale = float(_array(arrays, "a_scale", (1,))[0])
    controller: LatentController
    if form in LINEAR:
        matrix = _network(arrays, "matrix", "tanh")
        controller = LinearController(matrix, s_mean, s_scale, z_scale, a_scale, form)
    else:
        decoder = _network(arrays, "decoder", "tanh")
        controller = AutoencoderController(decoder, s_mean, s_scale, z_scale, a_scale)
        if form == "warped":
            controller = WarpedController(controller, _array(arrays, "warp.turns", (N_JOINTS,)))
    if controller.content_hash != checkpoint.facts.get("controller_hash"):
        raise CheckpointError(f"The controller of '{task}' is not what its description says.")
    return controller


def controller_stem(task: str, form: str) -> str:
    """What the files of a controller are called, without their ending."""
    return task if form == "autoencoder" else f"{task}-{form}"


def save_alignment(
    stem: Path,
    alignment: Alignment,
    *,
    seed: int,
    data_hash: str,
    settings: Mapping[str, Any],
    facts: Mapping[str, Any] | None = None,
) -> Checkpoint:
    """Write an alignment; the files appear whole or not at all."""
    about = {
        "strategy": alignment.strategy,
        "controller_hash": alignment.controller_hash,
        **(facts or {}),
    }
    return _save(stem, "alignment", alignment.to_arrays(), seed, data_hash, settings, about)


def load_alignment(
    stem: Path, task: Task, kinematics: Kinematics, controller: LatentController
) -> Alignment:
    """An alignment.

    Args:
        stem: Of its files.
        task: What it steers.
        kinematics: The arm.
        controller: What it is for.

    Raises:
        CheckpointError: If it is missing, unfinished, damaged, of another kind or for another
            controller.
    """
    checkpoint, arrays = _load(stem, "alignment")
    controller_hash = str(checkpoint.facts["controller_hash"])
    if controller_hash != controller.content_hash:
        raise CheckpointError(f"'{stem.name}' was learned for another controller.")
    strategy = get_strategy(str(checkpoint.facts["strategy"]))
    if strategy.kind == "task-space":
        try:
            return TaskSpaceAlignment.from_arrays(
                arrays, strategy.name, task, kinematics, controller
            )
        except ShapeError as error:
            raise CheckpointError(f"The numbers of '{stem.name}' do not fit together.") from error
    if strategy.kind == "affine":
        matrix, offset = _array(arrays, "matrix", (2, 2)), _array(arrays, "offset", (2,))
        return AffineAlignment(strategy.name, matrix, offset, controller_hash)
    return NetworkAlignment(
        strategy=strategy.name,
        mlp=_network(arrays, "mlp", "silu"),
        s_mean=_array(arrays, "s_mean", (N_JOINTS,)),
        s_scale=_array(arrays, "s_scale", (N_JOINTS,)),
        controller_hash=controller_hash,
    )


def read_checkpoint(stem: Path) -> Checkpoint:
    """What a checkpoint says of itself.

    Raises:
        CheckpointError: If there is none, or it cannot be read.
    """
    path = _beside(stem, "json")
    try:
        checkpoint = Checkpoint(**json.loads(path.read_text()))
    except OSError as error:
        raise CheckpointError(f"There is no finished checkpoint '{stem.name}'.") from error
    except (ValueError, TypeError) as error:
        raise CheckpointError(f"{path.name} does not describe a checkpoint.") from error
    if checkpoint.format != FORMAT:
        raise CheckpointError(f"{path.name} is of format {checkpoint.format}, not {FORMAT}.")
    return checkpoint


def library_versions() -> dict[str, str]:
    """Versions of the libraries that decide what a training gives."""
    return {name: version(name) for name in _LIBRARIES}


@cache
def code_version() -> str:
    """SHA-256, twelve digits of it, of the learning core's source."""
    digest = hashlib.sha256()
    root = Path(__file__).resolve().parent
    for path in sorted(root.rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def _save(
    stem: Path,
    kind: str,
    arrays: Mapping[str, np.ndarray],
    seed: int,
    data_hash: str,
    settings: Mapping[str, Any],
    facts: Mapping[str, Any],
) -> Checkpoint:
    weights = arrays_to_bytes({name: np.ascontiguousarray(a) for name, a in arrays.items()})
    checkpoint = Checkpoint(
        kind=kind,
        weights_sha256=hashlib.sha256(weights).hexdigest(),
        seed=seed,
        data_hash=data_hash,
        settings=dict(settings),
        facts=dict(facts),
        libraries=library_versions(),
        code_version=code_version(),
    )
    description = json.dumps(asdict(checkpoint), indent=1, allow_nan=False) + "\n"
    stem.parent.mkdir(parents=True, exist_ok=True)
    # An older description must not stand beside newer numbers, not even for a moment.
    _beside(stem, "json").unlink(missing_ok=True)
    _write(_beside(stem, "safetensors"), weights)
    _write(_beside(stem, "json"), description.encode())
    return checkpoint


def _load(stem: Path, kind: str) -> tuple[Checkpoint, dict[str, np.ndarray]]:
    checkpoint = read_checkpoint(stem)
    if checkpoint.kind != kind:
        raise CheckpointError(f"'{stem.name}' holds the weights of a different kind than {kind}.")
    path = _beside(stem, "safetensors")
    try:
        weights = path.read_bytes()
    except OSError as error:
        raise CheckpointError(f"The weights of '{stem.name}' are missing.") from error
    if hashlib.sha256(weights).hexdigest() != checkpoint.weights_sha256:
        raise CheckpointError(f"{path.name} is damaged: its hash is not the one it was saved with.")
    try:
        arrays = cast(dict[str, np.ndarray], arrays_from_bytes(weights))
    except SafetensorError as error:
        raise CheckpointError(f"{path.name} is not a file of weights.") from error
    if not all(np.isfinite(array).all() for array in arrays.values()):
        raise CheckpointError(f"{path.name} holds values that are not numbers.")
    return checkpoint, arrays


def _network(arrays: Mapping[str, np.ndarray], prefix: str, activation: Activation) -> Mlp:
    try:
        return Mlp.from_arrays(arrays, prefix, activation)
    except ShapeError as error:
        raise CheckpointError(f"The network '{prefix}' does not fit together.") from error


def _array(arrays: Mapping[str, np.ndarray], name: str, shape: tuple[int, ...]) -> np.ndarray:
    if name not in arrays or arrays[name].shape != shape:
        raise CheckpointError(f"The file of weights lacks '{name}' of shape {shape}.")
    return arrays[name]


def _beside(stem: Path, ending: str) -> Path:
    return stem.parent / f"{stem.name}.{ending}"


def _write(path: Path, content: bytes) -> None:
    """Write a file that is either there and whole, or not there."""
    scratch = path.with_name(f"{path.name}.{os.getpid()}.part")
    try:
        with scratch.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        scratch.replace(path)
    finally:
        scratch.unlink(missing_ok=True)
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)
