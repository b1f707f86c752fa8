"""Mutation testing of the learning core: break it at random, and see whether its tests notice.

Run ``python -m tests.soak.mutants``; it prints a table and what survived, and ends with 1 if fewer
than four of five mutants of a module are killed. Mutmut makes the mutants; they are judged in
copies of the sources, each by the nearest tests alone, in a process forked from one that has the
numeric libraries loaded already. A run that was stopped goes on where it was; a mutant is judged
again only if its module or its tests have changed.
"""

import argparse
import contextlib
import difflib
import hashlib
import importlib
import json
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import libcst
from mutmut.mutation.file_mutation import create_mutations, deep_replace

ROOT = Path(__file__).resolve().parents[2]
# Each module's nearest tests, those first that are quickest.
NEAREST = {
    "models/reading.py": ("test_reading", "test_task_space"),
    "models/training.py": ("test_training",),
    "models/fast_loss.py": ("test_fast_loss", "test_training"),
    "models/task_space.py": ("test_task_space", "test_checkpoints"),
    "models/designed_queries.py": ("test_designed_queries",),
    "models/experiment.py": ("test_experiment",),
    "models/evaluation.py": ("test_evaluation",),
}
COPIED = ("models", "app", "tests", "pyproject.toml")
PRELOADED = ("torch", "mujoco", "pytorch_kinematics", "scipy.stats", "hypothesis", "pytest")
SAMPLE, SEED = 60, 20261128
FLOOR = 0.8
_POLL_S = 0.02


@dataclass(frozen=True)
class Mutant:
    """A module with one thing changed; ``key`` stands for it and for the tests that judge it."""

    key: str
    module: str
    code: str
    diff: str


@dataclass(frozen=True)
class Verdict:
    """What became of a mutant: "killed", "survived" or "timeout"."""

    key: str
    module: str
    outcome: str
    seconds: float
    diff: str


def nearest_tests(module: str) -> list[str]:
    return [f"tests/models/{name}.py" for name in NEAREST[module]]


def mutants_of(module: str, sample: int, seed: int) -> list[Mutant]:
    """So many of a module's mutants, drawn by chance and in the order of the file."""
    source = (ROOT / module).read_text()
    tests = b"".join((ROOT / path).read_bytes() for path in nearest_tests(module))
    tree, mutations, _, _ = create_mutations(module, source)
    drawn = list(range(len(mutations)))
    random.Random(f"{seed} {module}").shuffle(drawn)  # a smaller sample is part of a larger one
    mutants = []
    for index in sorted(drawn[:sample]):
        change = mutations[index]
        changed = deep_replace(tree, change.original_node, change.mutated_node)
        assert isinstance(changed, libcst.Module)
        code = changed.code
        lines = difflib.unified_diff(source.splitlines(), code.splitlines(), n=0, lineterm="")
        diff = "\n".join(line for line in lines if not line.startswith(("---", "+++")))
        key = hashlib.sha256(code.encode() + tests).hexdigest()
        mutants.append(Mutant(key, module, code, diff))
    return mutants


class Place:
    """A copy of the sources in which one mutant at a time is judged."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        for name in COPIED:
            if (ROOT / name).is_dir():
                ignored = shutil.ignore_patterns("__pycache__")
                shutil.copytree(ROOT / name, folder / name, ignore=ignored)
            else:
                shutil.copy(ROOT / name, folder / name)
        self._pid = 0

    def begin(self, module: str, code: str | None, limit_s: float) -> None:
        """Put ``code`` in the place of the module, if any, and start its tests."""
        self._module, self._limit_s, self._began_s = module, limit_s, time.monotonic()
        self._is_whole, self._whole = code is None, (self.folder / module).read_text()
        if code is not None:
            (self.folder / module).write_text(code)
        self._pid = os.fork()
        if self._pid == 0:
            os.setsid()
            self._test()

    def end(self) -> tuple[str, float] | None:
        """How it ended and after how many seconds; None while it goes on."""
        seconds = time.monotonic() - self._began_s
        pid, status = os.waitpid(self._pid, os.WNOHANG)
        if pid == 0 and seconds < self._limit_s:
            return None
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._pid, signal.SIGKILL)  # and whatever it started
        if pid == 0:
            os.waitpid(self._pid, 0)
        self._pid = 0
        (self.folder / self._module).write_text(self._whole)
        outcome = "timeout" if pid == 0 else "killed" if status else "survived"
        return outcome, seconds

    def stop(self) -> None:
        if self._pid:
            os.killpg(self._pid, signal.SIGKILL)
            os.waitpid(self._pid, 0)

    def _test(self) -> None:
        code = 70
        try:
            os.chdir(self.folder)
            sys.path[:] = [str(self.folder), *(path for path in sys.path if path != str(ROOT))]
            ours = [
                name for name in sys.modules if name.split(".")[0] in ("tests", "models", "app")
            ]
            for name in ours:
                del sys.modules[name]
            # What the unchanged sources compiled to may be kept, what a mutant does may not.
            sys.dont_write_bytecode = not self._is_whole
            log = os.open(self.folder / "log", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
            os.dup2(log, 1)
            os.dup2(log, 2)
            arguments = ["-x", "-q", "--tb=short", "-p", "no:cacheprovider", "-p", "no:randomly"]
            code = importlib.import_module("pytest").main(
                [*arguments, *nearest_tests(self._module)]
            )
            sys.stdout.flush()
        finally:
            os._exit(int(code))


def judged(
    mutants: Iterable[Mutant], limits_s: dict[str, float], places: list[Place]
) -> Iterator[Verdict]:
    """Each mutant's verdict, as many at a time as there are places."""
    waiting, free, busy = iter(mutants), list(places), {}
    while True:
        while free and (mutant := next(waiting, None)) is not None:
            free[-1].begin(mutant.module, mutant.code, limits_s[mutant.module])
            busy[free.pop()] = mutant
        if not busy:
            return
        time.sleep(_POLL_S)
        for place, mutant in list(busy.items()):
            if (ended := place.end()) is not None:
                outcome, seconds = ended
                del busy[place]
                free.append(place)
                yield Verdict(mutant.key, mutant.module, outcome, round(seconds, 1), mutant.diff)


def limit_of(module: str, place: Place) -> float:
    """How long a mutant may take, in [s]: many times what the tests take when all is well."""
    place.begin(module, None, 600.0)
    while (ended := place.end()) is None:
        time.sleep(_POLL_S)
    if ended[0] != "survived":
        raise SystemExit(
            f"The tests of {module} fail as it is:\n{(place.folder / 'log').read_text()}"
        )
    print(f"{module}: its tests take {ended[1]:.0f} s", flush=True)
    return 20.0 + 5.0 * ended[1]


def report(verdicts: list[Verdict]) -> bool:
    """Print the table and what survived; whether enough were killed of every module."""
    print("| module | mutants | killed | timeout | survived | killed or timeout |")
    print("|---|--:|--:|--:|--:|--:|")
    shares = {}
    for module in sorted({verdict.module for verdict in verdicts}):
        outcomes = [verdict.outcome for verdict in verdicts if verdict.module == module]
        killed, late, alive = map(outcomes.count, ("killed", "timeout", "survived"))
        shares[module] = 1.0 - alive / len(outcomes)
        print(
            f"| {module} | {len(outcomes)} | {killed} | {late} | {alive} | {shares[module]:.0%} |"
        )
    for verdict in verdicts:
        if verdict.outcome == "survived":
            print(f"\n{verdict.module} survived {verdict.diff}")
    return all(share >= FLOOR for share in shares.values())


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=ROOT / "data" / "mutants")
    parser.add_argument("--sample", type=int, default=SAMPLE, help="mutants a module")
    parser.add_argument("--seed", type=int, default=SEED, help="draws the sample")
    parser.add_argument("--parallel", type=int, default=2)
    parser.add_argument("modules", nargs="*", default=list(NEAREST))
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # so that what was begun is ended
    options.out.mkdir(parents=True, exist_ok=True)
    journal = options.out / "verdicts.jsonl"
    lines = journal.read_text().splitlines() if journal.exists() else []
    known = {verdict.key: verdict for verdict in (Verdict(**json.loads(line)) for line in lines)}
    mutants = [
        mutant
        for module in options.modules
        for mutant in mutants_of(module, options.sample, options.seed)
    ]
    left = [mutant for mutant in mutants if mutant.key not in known]
    os.environ.setdefault("JOYMAP_PANDA_DIR", str(ROOT / "data" / "panda"))
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = "1"
    for name in PRELOADED:
        importlib.import_module(name)
    with tempfile.TemporaryDirectory() as scratch, journal.open("a") as kept:
        places = [Place(Path(scratch) / str(index)) for index in range(options.parallel)]
        try:
            limits_s = {
                module: limit_of(module, places[0])
                for module in dict.fromkeys(mutant.module for mutant in left)
            }
            for verdict in judged(left, limits_s, places):
                print(f"{verdict.module} {verdict.outcome} {verdict.seconds} s", flush=True)
                kept.write(json.dumps(asdict(verdict)) + "\n")
                kept.flush()
                known[verdict.key] = verdict
        finally:
            for place in places:
                place.stop()
    return 0 if report([known[mutant.key] for mutant in mutants]) else 1


if __name__ == "__main__":
    sys.exit(main())
