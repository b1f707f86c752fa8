"""A setting that is wrong, or is none, is said at the start, in one sentence with its name."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from app.cli import main
from models.panda_pack import default_folder

WRONG = [
    ("LABELS_WANTED", "3", "write a number of at least 5 (not 3)"),
    ("LABELS_WANTED", "101", "write a number of at most 100 (not 101)"),
    ("LABELS_WANTED", "seven", "write a whole number"),
    ("PRACTICE_S", "9999", "write a number of at most 3600 (not 9999)"),
    ("UNLABELLED_STATES", "50", "write a number of at least 100 (not 50)"),
    ("ENOUGH_ERROR", "20", "write a number of at most 10 (not 20)"),
    ("DRIVE_WAITS_S", "5000", "write a number of at most 3600 (not 5000)"),
    ("DRIVE_LIMIT_S", "5000", "write a number of at most 3600 (not 5000)"),
    ("SILENCE_S", "inf", "write a number"),
    ("SILENCE_S", "1e9", "write a number of at most 10 (not '1e9')"),
    ("TELEOP_RATE_HZ", "inf", "write a number"),
    ("TELEOP_RATE_HZ", "nan", "write a number"),
    ("SPEED", "0", "write a number of at least 0.1 (not '0')"),
    ("PORT", "99999", "write a number of at most 65535 (not '99999')"),
    ("ARROWS", "sometimes", "write one of 'off', 'on'"),
    ("TASK", "fly", "there is no task 'fly'"),
    ("SAME_STRATEGY", "magic", "There is no strategy 'magic'"),
    ("PORTT", "1", "there is no such setting; did you mean JOYMAP_PORT?"),
    ("NONSENSE", "1", "there is no such setting."),
]


@pytest.mark.parametrize(("name", "value", "said"), WRONG)
def test_a_wrong_setting_is_said_with_its_name(
    name: str,
    value: str,
    said: str,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("JOYMAP_DATA_DIR", str(tmp_path / "data"))
    monkeypatch.setenv("JOYMAP_PANDA_DIR", str(default_folder()))
    monkeypatch.setenv(f"JOYMAP_{name}", value)
    assert main(["serve", "--port", "0"] if name != "PORT" else ["serve"]) == 2
    heard = capsys.readouterr().err
    assert heard.startswith(f"JOYMAP_{name}: ")
    assert said in heard
    assert heard.count("\n") == 1
    assert not (tmp_path / "data").exists(), "nothing was begun"


def test_a_good_setting_at_its_bound_is_taken(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """As far as a port that is taken, which comes after the settings."""
    environment = os.environ | {
        "JOYMAP_DATA_DIR": str(tmp_path),
        "JOYMAP_PANDA_DIR": str(tmp_path / "nothing"),
        "JOYMAP_LABELS_WANTED": "5",
        "JOYMAP_PRACTICE_S": "3600",
    }
    ran = subprocess.run(
        [sys.executable, "-m", "app.cli", "serve"],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 2
    assert "pack" in ran.stderr
    assert ran.stderr.count("\n") == 1
