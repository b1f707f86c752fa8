"""What a simulated person says in a questionnaire: what they felt while they drove, and no more."""

from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Felt:
    """How driving under one way of steering was.

    Attributes:
        surprise: How differently the hand moved from what was meant: 0 to 1.
        failed: The share of attempts that came to nothing.
    """

    surprise: float
    failed: float

    @property
    def good(self) -> float:
        """From 0, dreadful, to 1."""
        return float(np.clip(1.0 - 2.0 * self.surprise, 0.0, 1.0)) * (1.0 - 0.5 * self.failed)


def respond(
    item: dict[str, Any], felt: Felt, ways: list[Felt], rng: np.random.Generator
) -> int | str | None:
    """The response to an item of a questionnaire, as the page shows it.

    Scales whose high end is the bad one are recognised by their words.
    """
    match item["kind"]:
        case "scale":
            good = felt.good if not _is_bad(item) else 1.0 - felt.good
            steps = (item["high"] - item["low"]) // item["step"]
            place = round(good * steps + 0.08 * steps * rng.standard_normal())
            return int(item["low"] + item["step"] * np.clip(place, 0, steps))
        case "choice":
            return str(rng.choice(item["choices"]))
        case "strategy":
            return 1 + int(np.argmax([way.good for way in ways])) if ways else None
        case _:
            return None


def _is_bad(item: dict[str, Any]) -> bool:
    words = f"{item['text']} {item['high_label']}".lower()
    bad = (
        "demand",
        "hurried",
        "effort",
        "hard did you",
        "frustrat",
        "insecure",
        "complex",
        "inconsisten",
        "cumbersome",
        "support of a technical",
        "learn a lot",
        "failure",
    )
    return any(word in words for word in bad)
