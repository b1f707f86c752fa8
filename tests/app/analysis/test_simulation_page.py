import re
from pathlib import Path

import pytest

from app.analysis.simulation_output import Run
from app.analysis.simulation_page import Runs, joined, page_text, write_page
from app.analysis.simulation_rows import SimulationError
from models.experiment import Row
from tests.app.analysis.experiments import (
    GOOD,
    controllers_rows,
    labels_rows,
    make_row,
    paper_rows,
    people_rows,
)


def make_run(rows: list[Row], name: str = "run", origin: str = "abc") -> Run:
    return Run(Path(name), rows, 10.0, origin, 90.0)


def page_of(paper: list[Row], **others: list[Row]) -> str:
    return page_text(runs_of(paper, **others), "images")


def runs_of(paper: list[Row], **others: list[Row]) -> Runs:
    rows = {"labels": labels_rows()} | others
    return Runs(
        (make_run(paper, "paper"),), **{name: (make_run(found),) for name, found in rows.items()}
    )


def section(page: str, title: str) -> str:
    start = page.index(title)
    end = re.search(r"\n##+ ", page[start + len(title) :])
    return page[start : start + len(title) + end.start() if end else None]


def test_where_all_is_well_the_page_says_so() -> None:
    page = page_of(paper_rows(), people=people_rows(), controllers=controllers_rows())
    for heading in ("### H1: held\n", "### H2: held\n", "### H3: held\n"):
        assert heading in page
    assert "not held" not in page
    assert "Everything that was claimed and asked for held" in section(page, "## What falls short")
    assert "nan" not in page


def test_h1_falls_when_exact_answers_do_not_suffice() -> None:
    page = page_of(paper_rows(GOOD | {"ideal-align": 0.15}))
    assert "### H1: not held" in page
    assert "### H3: held" in page
    assert "* H1 not held." in section(page, "## What falls short")


def test_h1_falls_when_a_baseline_is_as_good() -> None:
    page = page_of(paper_rows(GOOD | {"manual-align": 0.018}))
    assert "### H1: not held" in page


def test_h2_falls_when_priors_are_far_from_ideal_and_says_where() -> None:
    page = page_of(paper_rows(GOOD | {"ideal-align": 0.005}))
    assert "### H2: not held" in page
    h2 = " ".join(section(page, "### H2").split())
    assert "Not similar: *Move in a plane* at noise 0," in h2
    assert "which it does in 9 of 9 cases" in h2


def test_h2_falls_when_priors_do_not_help() -> None:
    page = page_of(paper_rows(GOOD | {"no-priors": 0.01}))
    assert "### H2: not held" in page
    assert "which it does in 0 of 9 cases" in " ".join(section(page, "### H2").split())


def test_h3_falls_where_one_prior_is_better_alone() -> None:
    rows = paper_rows(tasks=["plane", "pour"])
    rows += paper_rows(GOOD | {"consistency": 0.01}, tasks=["reach-and-pour"])
    page = page_of(rows)
    assert "### H3: held in 24 of 27 cases" in page
    h3 = section(page, "### H3")
    assert h3.count("✗") == 3 + 1
    assert "In 3 of them the mean of `all-priors` is not the lower one" in " ".join(h3.split())
    assert "`all-priors` has the lowest mean error" in page
    assert re.search(r"lowest mean error .*held in 6 of 9 cases", page)


def test_a_lead_from_few_seeds_does_not_count() -> None:
    page = page_of(paper_rows(seeds=3))
    assert "### H3: not held" in page
    assert "3 seeds are too few" in " ".join(page.split())


def test_a_bar_that_is_missed_is_marked_and_listed() -> None:
    page = page_of(paper_rows(GOOD | {"task-space": 0.03}))
    asked = section(page, "## What we asked of it")
    assert "| task-space, position error, noise 0 | **0.031 (≤ 0.01) not held** |" in asked
    assert "* task-space, position error, noise 0, *Pour*: 0.031, asked for at most 0.01." in page


def test_numbers_stand_in_the_tables_as_mean_and_deviation() -> None:
    page = page_of(paper_rows())
    assert "| Move in a plane | `no-align` | 1.463 ± 0.042 |" in section(page, "### Position error")
    assert "| Pour | `no-align` | 14.6 ± 0.4 |" in section(page, "### Rotation error")
    assert "| Pour | `task-space` | 1.00 ± 0.00 |" in section(page, "### Motion gain")


def test_people_who_are_served_worse_are_named() -> None:
    page = page_of(paper_rows(), people=people_rows(task_space=0.03))
    people = section(page, "## Other people")
    assert "| task-space ÷ all-priors, polar, noise 0 | Pour | 1.50 | ≤ 0.5 |" in people
    assert "| `axes` | 0.020 → 0.030 |" in people
    # The paper's people stand beside the others, under the same conditions.
    assert "| `random` | 0.021 → 0.005 |" in people


def test_wrong_answers_are_compared_with_the_same_people() -> None:
    page = page_of(paper_rows(), people=people_rows())
    wrong = section(page, "### People who answer wrongly")
    assert "| task | method | 0% wrong | 20% wrong |" in wrong
    assert "| Pour | `all-priors` | 0.020 ± 0.000 | 0.024 ± 0.000 |" in wrong


@pytest.mark.parametrize(
    ("error", "words"), [(0.9, "one map for all states does not do there"), (0.05, "does better")]
)
def test_the_warped_controller_is_judged_by_its_rows(error: float, words: str) -> None:
    page = page_of(paper_rows(), controllers=controllers_rows(error))
    said = " ".join(section(page, "## Other controllers").split())
    assert words in said
    assert f"`manual-align` has {error:.3f} on the warped controller" in said


def test_sections_without_runs_are_left_out() -> None:
    page = page_of(paper_rows())
    assert "## Other people" not in page
    assert "## Other controllers" not in page


def test_the_pages_pictures_are_there(tmp_path: Path) -> None:
    write_page(runs_of(paper_rows(seeds=2)), tmp_path / "page.md", tmp_path / "pictures")
    pictures = re.findall(r"!\[.*\]\((.*)\)", (tmp_path / "page.md").read_text())
    assert pictures == ["pictures/simulation.png", "pictures/simulation-labels.png"]
    for picture in pictures:
        assert (tmp_path / picture).read_bytes().startswith(b"\x89PNG")


def test_runs_of_different_code_are_pointed_out() -> None:
    runs = Runs((make_run(paper_rows()),), (make_run(labels_rows(), origin="other"),))
    page = " ".join(page_text(runs, "images").split())
    assert "These runs were not all made by the same." in page


def test_the_same_rows_give_the_same_page() -> None:
    assert page_of(paper_rows()) == page_of(paper_rows())


def test_a_run_that_is_not_the_papers_is_refused() -> None:
    twice = [*paper_rows(), make_row(preference="polar")]
    some = [row for row in paper_rows() if row.method != "reversibility"]
    for rows in (twice, some):
        with pytest.raises(SimulationError, match="--paper needs"):
            page_of(rows)
    with pytest.raises(SimulationError, match="--labels needs"):
        page_of(paper_rows(), labels=paper_rows(tasks=["plane"]))


def test_a_cell_in_two_runs_counts_once() -> None:
    rows = people_rows()
    assert joined([make_run(rows), make_run(rows)]) == rows
