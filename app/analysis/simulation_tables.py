"""Tables and numbers in Markdown."""

import math
import re
import textwrap
from collections.abc import Iterable, Sequence

from app.analysis.simulation_rows import Spread

MISSING = "–"
_WIDTH = 100
_NO_PROSE = re.compile(r"[#|!<>*]|\d+\. ")


def table(head: Sequence[str], lines: Iterable[Sequence[str]], texts: int = 1) -> str:
    """A table; the first ``texts`` columns stand left, the others right."""
    rule = ["---"] * texts + ["---:"] * (len(head) - texts)
    return "\n".join(f"| {' | '.join(line)} |" for line in (head, rule, *lines))


def filled(page: str) -> str:
    """The same page with the lines of its paragraphs broken evenly."""
    return "\n\n".join(
        block
        if _NO_PROSE.match(block) and not block.startswith("**")
        else textwrap.fill(block, _WIDTH, break_long_words=False, break_on_hyphens=False)
        for block in page.split("\n\n")
    )


def error(found: float) -> str:
    """An error with three digits after the point."""
    if math.isnan(found):
        return MISSING
    return "<0.001" if 0.0 < found < 0.001 else f"{found:.3f}"


def error_spread(found: Spread | None) -> str:
    """Mean ± standard deviation of an error."""
    if found is None:
        return MISSING
    if found.mean < 0.001 or found.sd is None:
        return error(found.mean)
    return f"{found.mean:.3f} ± {found.sd:.3f}"


def milliradians(found: Spread | None) -> str:
    """Mean ± standard deviation of an angle in [rad], in thousandths."""
    if found is None:
        return MISSING
    mean = f"{1000.0 * found.mean:.1f}"
    return mean if found.sd is None else f"{mean} ± {1000.0 * found.sd:.1f}"


def gain(found: Spread | None) -> str:
    """Mean ± standard deviation of a motion gain."""
    if found is None:
        return MISSING
    return f"{found.mean:.2f}" if found.sd is None else f"{found.mean:.2f} ± {found.sd:.2f}"


def ratio(found: float) -> str:
    """A ratio, or a number that has a limit: three digits after the point below 1, else two."""
    return error(found) if found < 1.0 or math.isnan(found) else f"{found:.2f}"


def probability(p: float) -> str:
    """A p with three digits after the point."""
    return "p < 0.001" if p < 0.001 else f"p = {p:.3f}"


def seconds(found: float) -> str:
    """A duration of a fit, in ms below a second."""
    return f"{1000.0 * found:.0f} ms" if found < 1.0 else f"{found:.1f} s"


def listed(parts: Sequence[str]) -> str:
    """Parts of a sentence: "a", "a and b", "a, b and c"."""
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"
