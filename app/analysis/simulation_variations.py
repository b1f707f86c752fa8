"""The page's sections on what the paper did not vary: labels, people, controllers."""

from collections.abc import Sequence

from app import texts
from app.analysis import simulation_tables as md
from app.analysis.simulation_claims import Bar, labels_bars, mean, noises, people_bars, tasks
from app.analysis.simulation_rows import Spread, distinct, select, spread, values
from models.experiment import METHODS, Row


def labels_section(rows: Sequence[Row], picture: str, shown_noise: float) -> str:
    """Errors against the number of labels, random against designed questions.

    Args:
        rows: With several numbers of labels.
        picture: Address of the picture.
        shown_noise: The noise level of the picture.
    """
    return f"""## How many answers it takes

Random questions are drawn from all moves. Designed ones are chosen, and put in an order, so
that few of them say much. The numbers are mean position errors.

![Position error against the number of labels]({picture})

The picture is for noise {shown_noise:g}.

These people's noise is in proportion to their answer, so that no move gets a surer answer than
another: once the answers cover what there is to learn, half as many of them cost a factor of √2,
however they are chosen. Choosing pays where random moves leave something out: a motion of *Reach
and pour*, or a direction among very few moves.

{bars_table(labels_bars(rows))}

{_labels_tables(rows)}"""


def people_section(rows: Sequence[Row]) -> str:
    """People whose preference is of another kind, and people who answer wrongly."""
    bars = people_bars(rows)
    missed = [bar for bar in bars if not bar.held]
    text = """## Other people

The paper's people think in the axes of the table. Others turn, mirror or swap them. Some think
of towards and around the robot (`polar`), some give small moves more or less than their share of
the stick (`expo`), some never push it to its edge (`gain`)."""
    for noise in noises(rows):
        text += f"\n\nMean position error at noise {noise:g}, `all-priors` → `task-space`:\n\n"
        text += _people_table(select(rows, noise=noise, wrong_answers=0.0))
    text += f"""

`task-space` is to be at most a tenth worse than `all-priors` for everybody, and for polar and
expo users at least twice as good where there is no noise. This holds in
{len(bars) - len(missed)} of {len(bars)} cases."""
    if missed:
        lines = [
            [bar.what, texts.title_of(bar.task), md.ratio(bar.found), f"≤ {bar.limit:g}"]
            for bar in missed
        ]
        text += "\n\nIt does not in these:\n\n"
        text += md.table(["what", "task", "found", "asked"], lines, texts=2)
    return text + _wrong_answers(rows)


def controllers_section(rows: Sequence[Row]) -> str:
    """The same methods on controllers of other kinds."""
    controllers = [str(name) for name in distinct(rows, "controller")]
    methods = [name for name in METHODS if name in distinct(rows, "method")]
    text = """## Other controllers

The paper's controller is an autoencoder. `linear` is a decoder that is linear in z, `principal`
takes the principal components of the demonstrated actions, and `warped` is the autoencoder with
a latent that turns with the state. Nothing in the methods knows which it is. Position
errors:"""
    for task in tasks(rows):
        for noise in noises(rows):
            cell = select(rows, task=task, noise=noise)
            lines = [
                [
                    f"`{method}`",
                    *(
                        md.error_spread(_position(cell, method=method, controller=name))
                        for name in controllers
                    ),
                ]
                for method in methods
            ]
            text += f"\n\n{texts.title_of(task)}, noise {noise:g}:\n\n"
            text += md.table(["method", *(f"`{name}`" for name in controllers)], lines)
    return text + _warped(rows)


def bars_table(bars: Sequence[Bar]) -> str:
    """What was asked for, a column a task, each with what was found and whether it holds."""
    columns = list(dict.fromkeys(bar.task for bar in bars))
    lines = []
    for what in dict.fromkeys(bar.what for bar in bars):
        found = {bar.task: _bar_text(bar) for bar in bars if bar.what == what}
        lines.append([what, *(found.get(task, md.MISSING) for task in columns)])
    return md.table(["found (asked)", *(texts.title_of(task) for task in columns)], lines)


def _bar_text(bar: Bar) -> str:
    text = f"{md.ratio(bar.found)} (≤ {bar.limit:.2f})"
    return f"{text} held" if bar.held else f"**{text} not held**"


def _labels_tables(rows: Sequence[Row]) -> str:
    counts = sorted({row.labels for row in rows})
    text = ""
    for noise in noises(rows):
        lines = [
            [
                texts.title_of(task),
                f"`{method}`",
                str(queries),
                *(
                    md.error(
                        mean(
                            rows, "position_error",
                            task=task, noise=noise, method=method, queries=queries, labels=k,
                        )
                    )
                    for k in counts
                ),
            ]
            for task in tasks(rows)
            for method in distinct(rows, "method")
            for queries in distinct(rows, "queries")
        ]  # fmt: skip
        text += f"Noise {noise:g}, by the number of labels:\n\n"
        head = ["task", "method", "questions", *(str(k) for k in counts)]
        text += md.table(head, lines, texts=3) + "\n\n"
    return text.rstrip()


def _people_table(rows: Sequence[Row]) -> str:
    lines = [
        [
            f"`{preference}`",
            *(
                " → ".join(
                    md.error(
                        mean(
                            rows, "position_error",
                            task=task, preference=preference, method=method,
                        )
                    )
                    for method in ("all-priors", "task-space")
                )
                for task in tasks(rows)
            ),
        ]
        for preference in distinct(rows, "preference")
    ]  # fmt: skip
    return md.table(["preference", *(texts.title_of(task) for task in tasks(rows))], lines)


def _wrong_answers(rows: Sequence[Row]) -> str:
    shares = sorted({row.wrong_answers for row in rows})
    if len(shares) < 2:
        return ""
    # Only people and noise levels for which every share was tried can be compared.
    wrong = select(rows, wrong_answers=shares[-1])
    pairs = {(row.preference, row.noise) for row in wrong}
    cell = [row for row in rows if (row.preference, row.noise) in pairs]
    levels = md.listed([f"{noise:g}" for noise in sorted({noise for _, noise in pairs})])
    methods = [name for name in METHODS if name in distinct(wrong, "method")]
    lines = [
        [
            texts.title_of(task),
            f"`{method}`",
            *(
                md.error_spread(_position(cell, task=task, method=method, wrong_answers=share))
                for share in shares
            ),
        ]
        for task in tasks(cell)
        for method in methods
    ]
    head = ["task", "method", *(f"{share:.0%} wrong" for share in shares)]
    return f"""

### People who answer wrongly

A share of the answers points somewhere else altogether (noise {levels} otherwise). Position
errors:

{md.table(head, lines, texts=2)}"""


def _warped(rows: Sequence[Row]) -> str:
    noise = noises(rows)[0]
    cell = select(rows, controller="warped", noise=noise)
    if not cell:
        return ""
    manual, learned = (
        mean(cell, "position_error", method=method) for method in ("manual-align", "all-priors")
    )
    others = mean(
        [row for row in rows if row.controller != "warped"],
        "position_error",
        method="manual-align",
        noise=noise,
    )
    said = (
        "one map for all states does not do there, and an alignment that looks at the state does"
        if manual > learned
        else "even there one affine map does better than what was learned"
    )
    return f"""

`manual-align` has {md.error(manual)} on the warped controller and {md.error(others)} on the
others; `all-priors` has {md.error(learned)} on the warped one: {said}."""


def _position(rows: Sequence[Row], **wanted: object) -> Spread | None:
    found = values(select(rows, **wanted), "position_error")
    return spread(found) if len(found) else None
