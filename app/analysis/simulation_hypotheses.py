"""The page's verdicts on what the paper claims: H1, H2, H3 and the sentences around them."""

from collections.abc import Sequence

from app import texts
from app.analysis import simulation_tables as md
from app.analysis.simulation_claims import (
    ACCURATE,
    BASELINES,
    SIGNIFICANT,
    SIMILAR,
    SINGLE_PRIORS,
    WITH_PRIORS,
    Comparison,
    Count,
    comparisons,
    count,
    deviation,
    lowest,
    mean,
    noises,
    ratio,
    tasks,
)
from app.analysis.simulation_rows import distinct, select
from models.experiment import Row


def hypotheses(rows: Sequence[Row]) -> tuple[str, dict[str, Count]]:
    """The section on H1, H2 and H3, and in how many cases each of them holds."""
    parts = [_h1(rows), _h2(rows), _h3(rows)]
    text = "\n\n".join([_how(rows), *(part for part, _ in parts)])
    return text, {f"H{place}": verdict for place, (_, verdict) in enumerate(parts, start=1)}


def _how(rows: Sequence[Row]) -> str:
    seeds = len(distinct(rows, "seed"))
    text = f"""## What the paper claims

"Outperforms" is a word for a test. The seeds are paired: the same person, moves and noise for both
methods. p says how likely so clear a lead would be if the two were equal (Wilcoxon's signed ranks
on the alignment errors, one-sided). It is corrected for the number of comparisons (Holm), and a
lead counts if p < {SIGNIFICANT:g}. Tables give one method's mean error over another's."""
    # With every seed in favour, p is one over the number of ways in which signs can fall.
    if 0.5**seeds > SIGNIFICANT:
        text += f" **{seeds} seeds are too few for any lead to count.**"
    return text


def _h1(rows: Sequence[Row]) -> tuple[str, Count]:
    noise = noises(rows)[0]
    tests = comparisons(rows, ["ideal-align"], BASELINES, [noise])
    lines, outcomes = [], []
    for task in tasks(rows):
        found = mean(rows, "position_error", task=task, noise=noise, method="ideal-align")
        against = [test for test in tests if test.task == task]
        holds = found <= ACCURATE and all(test.outperforms for test in against)
        outcomes.append(holds)
        lines.append([_title(task), md.error(found), *map(_compared, against), _yes(holds)])
    verdict = count(outcomes)
    head = ["task", "position error of `ideal-align`", *(f"÷ `{b}`" for b in BASELINES), "holds"]
    text = f"""### H1: {verdict.verdict}

> With abundant labeled data, the alignment model will accurately learn the human's preferences.

`ideal-align` is given an exact answer for every unlabelled move. We call it accurate if the hand
ends within {ACCURATE:g} of the move's length, and ask that it beats both baselines that learn
nothing.

{md.table(head, lines)}"""
    return text, verdict


def _h2(rows: Sequence[Row]) -> tuple[str, Count]:
    tests = comparisons(rows, ["all-priors"], ["no-priors"], noises(rows))
    lines, outcomes, unlike = [], [], []
    for test in tests:
        cell = select(rows, task=test.task, noise=test.noise)
        to_ideal = ratio(select(cell, method="all-priors"), select(cell, method="ideal-align"))
        is_similar = to_ideal <= SIMILAR
        outcomes.append(is_similar and test.outperforms)
        unlike += [] if is_similar else [f"*{_title(test.task)}* at noise {test.noise:g}"]
        lines.append(
            [
                _title(test.task),
                f"{test.noise:g}",
                _compared(test),
                _yes(test.outperforms),
                md.ratio(to_ideal),
                _yes(is_similar),
            ]
        )
    verdict = count(outcomes)
    better = count([test.outperforms for test in tests])
    head = ["task", "noise", "÷ `no-priors`", "better", "÷ `ideal-align`", "similar"]
    text = f"""### H2: {verdict.verdict}

> Compared to the fully-supervised baseline, our semi-supervised alignment models that leverage
> intuitive priors will achieve similar performance with far less human data.

`all-priors` has K answers, `ideal-align` an answer for every move. We call them similar if the
error is at most {SIMILAR:g} times as large. From the same K answers, `all-priors` is to beat
`no-priors`, which it does in {better.held} of {better.cases} cases.

{md.table(head, lines, texts=2)}"""
    if unlike:
        text += f"""

Not similar: {md.listed(unlike)}. The comparison is uneven where there is noise: the answers of
`ideal-align` are exact at every noise level, while those of `all-priors` are not. Priors say what
all people have in common; they cannot say which way a noisy answer was
meant.{_task_space(rows)}"""
    return text, verdict


def _h3(rows: Sequence[Row]) -> tuple[str, Count]:
    tests = comparisons(rows, ["all-priors"], SINGLE_PRIORS, noises(rows))
    verdict = count([test.outperforms for test in tests])
    lines = [
        [
            _title(task),
            f"{noise:g}",
            *(_marked(test) for test in tests if (test.task, test.noise) == (task, noise)),
        ]
        for task in tasks(rows)
        for noise in noises(rows)
    ]
    unclear = [test for test in tests if not test.outperforms]
    behind = [test for test in unclear if test.ratio >= 1.0]
    text = f"""### H3: {verdict.verdict}

> Semi-supervised training with proportional, reversible, and consistent priors will outperform
> alignment models trained with only one of these priors.

The error of `all-priors` over that of each single prior:

{md.table(["task", "noise", *(f"÷ `{prior}`" for prior in SINGLE_PRIORS)], lines, texts=2)}"""
    if unclear:
        text += f"""

A ✗ marks the {len(unclear)} of {len(tests)} cases in which there is no clear lead. """
        text += (
            f"In {len(behind)} of them the mean of `all-priors` is not the lower one."
            if behind
            else "In all of them the mean of `all-priors` is the lower one, but from so few seeds "
            "that may be chance."
        )
    return text, verdict


def other_claims(rows: Sequence[Row], turned_error: float | None) -> str:
    """The section on what else the paper says of its results.

    Args:
        rows: The paper's grid.
        turned_error: Position error of ``manual-align`` on the warped controller, if known.
    """
    cells = [select(rows, task=task, noise=noise) for task in tasks(rows) for noise in noises(rows)]
    cases = {
        (method, baseline, place): ratio(select(cell, method=method), select(cell, method=baseline))
        for place, cell in enumerate(cells)
        for method in WITH_PRIORS
        for baseline in (*BASELINES, "no-priors")
    }

    def share(baselines: Sequence[str], limit: float) -> Count:
        return count([found <= limit for key, found in cases.items() if key[1] in baselines])

    harder = count(
        [_help(rows, tasks(rows)[-1], noise) > _help(rows, tasks(rows)[0], noise)
         for noise in noises(rows)]
    )  # fmt: skip
    a_model, a_setting = "a model, task and noise", "a task and noise"
    claims = (
        ("Models with priors have lower errors than `no-align`", a_model, share(["no-align"], 1.0)),
        ("… and than `manual-align`", a_model, share(["manual-align"], 1.0)),
        (
            "Models with at least one prior perform twice as well as `no-priors`",
            a_model,
            share(["no-priors"], 0.5),
        ),
        (
            "`all-priors` has the lowest mean error of all that learn from K answers",
            a_setting,
            lowest(rows, lambda cell: mean(cell, "alignment_error")),
        ),
        (
            "… and the lowest standard deviation",
            a_setting,
            lowest(rows, lambda cell: deviation(cell, "alignment_error")),
        ),
        (
            f"Priors matter more in *{_title(tasks(rows)[-1])}* than in *{_title(tasks(rows)[0])}* "
            "(`no-priors` ÷ `all-priors`)",
            "a noise",
            harder,
        ),
    )
    lines = [[claim, case, verdict.verdict] for claim, case, verdict in claims]
    text = f"""## What else the paper says

{md.table(["what the paper says", "a case is", "verdict"], lines, texts=3)}"""
    manual = share(["manual-align"], 1.0)
    if manual.held < manual.cases:
        text += f"""

`manual-align` is a stronger baseline than its name suggests: it is fitted to exact answers for
every move, so noise does not touch it. Where the controller's latent actions hardly turn with
the state, one affine map is nearly right.{_turned(turned_error)}"""
    return text


def _turned(found: float | None) -> str:
    if found is None:
        return ""
    return (
        " Where they do turn, it fails: on the warped controller its position error is "
        f"{md.error(found)}."
    )


def _help(rows: Sequence[Row], task: str, noise: float) -> float:
    cell = select(rows, task=task, noise=noise)
    return mean(cell, "alignment_error", method="no-priors") / mean(
        cell, "alignment_error", method="all-priors"
    )


def _task_space(rows: Sequence[Row]) -> str:
    noise = noises(rows)[-1]
    if not select(rows, noise=noise, method="task-space"):
        return ""
    errors = [
        f"{md.error(mean(rows, 'position_error', task=task, noise=noise, method='task-space'))}"
        f" (*{_title(task)}*)"
        for task in tasks(rows)
    ]
    return (
        f" `task-space`, which has less to learn, reaches {md.listed(errors)} at noise {noise:g}."
    )


def _title(task: str) -> str:
    return texts.title_of(task)


def _compared(test: Comparison) -> str:
    return f"{md.ratio(test.ratio)} ({md.probability(test.p)})"


def _marked(test: Comparison) -> str:
    return f"{_compared(test)}{'' if test.outperforms else ' ✗'}"


def _yes(is_so: bool) -> str:
    return "yes" if is_so else "**no**"
