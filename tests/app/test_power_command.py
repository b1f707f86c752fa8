"""``joymap power``: what it says, what it keeps, and what it refuses."""

import csv
from pathlib import Path

import pytest

from app import cli
from app.rehearsal import participant
from models.panda_pack import default_folder
from tests.app.rehearsal.parts import refuse, take_at_once

SMALL = ("--task", "avoid", "--smallest", "4", "--studies", "30", "--workers", "1")


@pytest.fixture(autouse=True)
def environment(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a command writes there is gone after the test; nobody drives."""
    monkeypatch.setenv("JOYMAP_PANDA_DIR", str(default_folder()))
    monkeypatch.setattr(participant, "take_part", take_at_once)


def power(out: Path, *options: str) -> int:
    return cli.main(["power", *SMALL, "--out", str(out), *options])


def test_it_answers_goes_on_and_later_only_computes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "new" / "power"
    assert power(out, "--largest", "4", "--people", "8") == 0
    assert capsys.readouterr().out.startswith("No size up to 4 shows it in 80 % of studies.\n")
    kept = (out / "people.jsonl").read_bytes()
    assert len(kept.splitlines()) == 8

    assert power(out, "--largest", "6", "--people", "12") == 0
    said = capsys.readouterr()
    assert said.out.startswith("6 participants show it in 100 % of studies (89 to 100 %); of the ")
    assert "all-priors: 12 of 12 tries ended well, median completion time 10.6 s\n" in said.out
    assert "no-priors: 11 of 12 tries ended well, median completion time 21.6 s\n" in said.out
    assert "12 of 12 participants" in said.err
    people = (out / "people.jsonl").read_bytes()
    assert people.startswith(kept)
    assert len(people.splitlines()) == 12
    assert {path.name for path in out.iterdir()} == {
        "people.jsonl",
        "power.csv",
        "power.png",
        "power.svg",
    }
    with (out / "power.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(row["participants"], row["shown"]) for row in rows] == [("4", "0"), ("6", "30")]

    monkeypatch.setattr(participant, "take_part", refuse)
    before = (out / "power.png").read_bytes()
    assert power(out, "--largest", "6", "--people", "12") == 0
    assert (out / "power.png").read_bytes() == before
    # By path the first one is worse: nothing is shown of what was hoped for.
    assert power(out, "--largest", "6", "--people", "12", "--measure", "path_length_m") == 0
    assert "No size up to 6" in capsys.readouterr().out

    assert power(out, "--largest", "4", "--people", "8", "--motor-noise", "0.2") == 2
    assert "people of other habits" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--task", "plane"), "--task is one of avoid, pour-cup, fetch-and-pour"),
        (("--compare", "all-priors"), "--compare takes two of"),
        (("--compare", "all-priors,ideal-align"), "--compare takes two of"),
        (("--people", "39"), "Studies of 20 need a pool of at least 40"),
        (("--largest", "3"), "--smallest is at least 2"),
        (("--smallest", "1"), "--smallest is at least 2"),
        (("--step", "0"), "--step and --studies are at least 1"),
        (("--studies", "0"), "--step and --studies are at least 1"),
        (("--workers", "0"), "--workers is from 1"),
        (("--labels", "4"), "--labels is from 5"),
        (("--level", "0"), "--level lies between"),
        (("--wanted", "1"), "--wanted lies between"),
        (("--label-noise", "-0.1"), "cannot be negative"),
        (("--reaction-ms", "nan"), "cannot be negative"),
        (("--limit-s", "0"), "--limit-s is from 1"),
        (("--seed", "-1"), "--seed cannot be negative"),
        (("--preference", "upside-down"), "There is no preference 'upside-down'"),
    ],
)
def test_a_bad_argument_gets_one_sentence_and_nothing_is_made(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: tuple[str, ...], sentence: str
) -> None:
    assert power(tmp_path / "out", *options) == 2
    said = capsys.readouterr()
    assert sentence in said.err
    assert said.err.startswith("joymap power: ")
    assert (said.out, said.err.count("\n")) == ("", 1)
    assert not (tmp_path / "out").exists()


def test_a_file_is_no_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "out").write_text("")
    assert power(tmp_path / "out") == 2
    assert "--out is a folder" in capsys.readouterr().err


def test_a_measure_that_there_is_not_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as stopped:
        power(tmp_path, "--measure", "joy")
    assert stopped.value.code == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_who_comes_to_nothing_is_named_and_the_rest_is_kept(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(participant, "take_part", refuse)
    assert power(tmp_path, "--largest", "4", "--people", "8") == 1
    assert "8 participants failed; the same command tries them again." in capsys.readouterr().err
