"""The mutation testing of the soak, on a module of two lines."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.soak.mutants import NEAREST, ROOT, mutants_of, nearest_tests

SMALL = "def double(x):\n    return 2 * x\n\n\ndef untested(x):\n    return x > 5\n"
TEST = "from models.small import double\n\n\ndef test_double():\n    assert double(3) == 6\n"
RUN = """
import sys
from pathlib import Path
from tests.soak import mutants

mutants.ROOT, mutants.PRELOADED = Path(sys.argv.pop(1)), ()
mutants.NEAREST = {"models/small.py": ("test_small",)}
mutants.COPIED = ("models", "tests")
sys.exit(mutants.main())
"""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    for name in ("models", "tests", "tests/models"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").touch()
    (tmp_path / "models/small.py").write_text(SMALL)
    (tmp_path / "tests/models/test_small.py").write_text(TEST)
    return tmp_path


def run(project: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", RUN, str(project), "models/small.py"]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


def test_what_is_tested_is_killed_and_what_is_not_survives(project: Path) -> None:
    first = run(project)
    assert first.returncode == 1, first.stderr  # fewer than four of five are killed
    journal = project / "data/mutants/verdicts.jsonl"
    verdicts = [json.loads(line) for line in journal.read_text().splitlines()]
    outcomes = {verdict["diff"].splitlines()[-1]: verdict["outcome"] for verdict in verdicts}
    assert outcomes == {
        "+    return 2 / x": "killed",
        "+    return 3 * x": "killed",
        "+    return x >= 5": "survived",
        "+    return x > 6": "survived",
    }
    assert "| models/small.py | 4 | 2 | 0 | 2 | 50% |" in first.stdout
    assert (project / "models/small.py").read_text() == SMALL
    # Once more: nothing is judged again, and the same is said.
    again = run(project)
    assert journal.read_text().count("\n") == 4
    assert again.stdout == first.stdout[first.stdout.index("| module") :]
    # A better test is another judge.
    better = "\n\ndef test_untested():\n    assert [untested(x) for x in (5, 6)] == [False, True]\n"
    test = project / "tests/models/test_small.py"
    test.write_text(TEST.replace("double\n", "double, untested\n", 1) + better)
    assert run(project).returncode == 0


@pytest.mark.parametrize("module", ["models/evaluation.py"])
def test_a_sample_is_drawn_by_its_seed(module: str) -> None:
    drawn = [mutant.code for mutant in mutants_of(module, 20, seed=1)]
    assert len(set(drawn)) == 20
    assert drawn == [mutant.code for mutant in mutants_of(module, 20, seed=1)]
    assert drawn != [mutant.code for mutant in mutants_of(module, 20, seed=2)]
    assert {mutant.code for mutant in mutants_of(module, 5, seed=1)} < set(drawn)


def test_every_module_has_tests_that_are_there() -> None:
    for module in NEAREST:
        assert (ROOT / module).exists()
        assert all((ROOT / path).exists() for path in nearest_tests(module))
