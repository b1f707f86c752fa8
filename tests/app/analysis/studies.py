"""Exports of small made-up studies, without files."""

from pathlib import Path
from typing import Any

import numpy as np

from app.analysis.study_export import StudyExport

STRATEGIES = ("no-align", "no-priors", "all-priors")
LIMIT_S = 90.0


def make_drive(who: str, strategy: str, task: str = "avoid", **changes: Any) -> dict[str, Any]:
    return {
        "participant": who,
        "drive": f"{who}-{task}-{strategy}",
        "task": task,
        "strategy": strategy,
        "end": "done",
        "ticks": 600,
        "is_success": True,
        "completion_time_s": 10.0,
        "path_length_m": 2.0,
        "undo_share": 0.1,
        "evenness": 0.5,
    } | changes


def make_response(who: str, strategy: str, item: str, number: int | None) -> dict[str, Any]:
    return {
        "participant": who,
        "strategy": strategy,
        "questionnaire": "steering",
        "item": item,
        "number": number,
        "chosen": None,
    }


def make_export(**tables: list[dict[str, Any]]) -> StudyExport:
    drives = tables.get("drives", [])
    people = sorted({row["participant"] for row in drives}) or ["p0"]
    names = ("queries", "answers", "alignments", "trainings", "drives", "responses")
    return StudyExport(
        Path("made-up"),
        {name: tables.get(name, []) for name in names}
        | {"participants": [{"participant": who, "protocol_version": 1} for who in people]},
        {1: {"title": "Made up", "tasks": [{"task": "avoid", "time_limit_s": LIMIT_S}]}},
        excluded=0,
    )


def make_study(people: int = 10, gain_s: float = 5.0, seed: int = 0) -> StudyExport:
    """Everybody is faster by so much, and noise, under each next strategy."""
    rng = np.random.default_rng(seed)
    drives = [
        make_drive(
            f"p{who}",
            strategy,
            completion_time_s=40.0 - place * gain_s + float(rng.normal()),
            path_length_m=2.0 + float(rng.normal(scale=0.1)),
            undo_share=0.2 - place * gain_s / 100.0 + float(rng.normal(scale=0.01)),
        )
        for who in range(people)
        for place, strategy in enumerate(STRATEGIES)
    ]
    responses = [
        make_response(f"p{who}", strategy, "easy", 2 + 2 * place)
        for who in range(people)
        for place, strategy in enumerate(STRATEGIES)
    ]
    return make_export(drives=drives, responses=responses)
