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
from importlib.metadata import entry_points, version
from pathlib import Path
from typing import Any, cast

import numpy as np
from safetensors import SafetensorError
from safetensors.numpy import load as arrays_from_bytes
from safetensors.numpy import save as arrays_to_bytes

from .alignment import Alignment, array_of
from .controller import (
    AutoencoderController,
    LatentController,
    LinearController,
    WarpedController,
)
from .errors import CheckpointError, InputError, ShapeError
from .fitting import AlignmentContext
from .network import Mlp
from .panda import N_JOINTS
from .strategies import ENTRY_POINTS, get_strategy

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
    stem = folder / controller_stem(task, form)
    checkpoint, arrays = _load(stem, "controller")
    try:
        controller = _controller(form, arrays)
    except ShapeError as error:
        raise _unfit(stem, error) from error
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
    strategy: str,
    seed: int,
    data_hash: str,
    settings: Mapping[str, Any],
    facts: Mapping[str, Any] | None = None,
) -> Checkpoint:
    """Write an alignment that was learned by a strategy; the files appear whole or not at all."""
    about = {
        "strategy": strategy,
        "controller_hash": alignment.controller_hash,
        **(facts or {}),
    }
    return _save(stem, "alignment", alignment.to_arrays(), seed, data_hash, settings, about)


def load_alignment(stem: Path, context: AlignmentContext) -> Alignment:
    """An alignment.

    Args:
        stem: Of its files.
        context: What it is for.

    Raises:
        CheckpointError: If it is missing, unfinished, damaged, of another kind or for another
            controller.
        InputError: If the strategy that it was learned by is not installed.
    """
    checkpoint, arrays = _load(stem, "alignment")
    if checkpoint.facts["controller_hash"] != context.controller.content_hash:
        raise CheckpointError(f"'{stem.name}' was learned for another controller.")
    strategy = get_strategy(str(checkpoint.facts["strategy"]))
    try:
        return strategy.method.from_arrays(arrays, context)
    except ShapeError as error:
        raise _unfit(stem, error) from error


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
    """Versions of the libraries that decide what a training gives, with those of strategies."""
    brought = [entry.dist for entry in entry_points(group=ENTRY_POINTS) if entry.dist is not None]
    return {
        **{name: version(name) for name in _LIBRARIES},
        **{distribution.name: distribution.version for distribution in brought},
    }


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


def _controller(form: str, arrays: Mapping[str, np.ndarray]) -> LatentController:
    s_mean = array_of(arrays, "s_mean", (N_JOINTS,))
    s_scale = array_of(arrays, "s_scale", (N_JOINTS,))
    z_scale = array_of(arrays, "z_scale", (2,))
    a_scale = float(array_of(arrays, "a_scale", (1,))[0])
    if form in LINEAR:
        matrix = Mlp.from_arrays(arrays, "matrix", "tanh")
        return LinearController(matrix, s_mean, s_scale, z_scale, a_scale, form)
    decoder = Mlp.from_arrays(arrays, "decoder", "tanh")
    controller = AutoencoderController(decoder, s_mean, s_scale, z_scale, a_scale)
    if form == "warped":
        return WarpedController(controller, array_of(arrays, "warp.turns", (N_JOINTS,)))
    return controller


def _unfit(stem: Path, error: ShapeError) -> CheckpointError:
    return CheckpointError(f"The numbers of '{stem.name}' do not fit together: {error}")


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
