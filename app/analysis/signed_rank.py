"""Wilcoxon's signed-rank test, exact however many differences tie or are none, and at once.

The number of sign patterns with each sum of ranks is counted rank by rank (the shift algorithm:
Streitberg and Röhmel, "Exact distributions for permutation and rank tests", Statistical Software
Newsletter 1986), with mid-ranks for ties and Pratt's way with zeros: they are ranked, then left
out. It is the test of :func:`app.analysis.comparisons.p_of`, which draws patterns where there are
too many to list.
"""

import numpy as np
from scipy import stats


def signed_rank(differences: np.ndarray) -> tuple[float, float]:
    """Which sign prevails, and how likely that much of it is if neither is favoured.

    Args:
        differences: ``(n,)``.

    Returns:
        The sum of the ranks of positive differences less that of negative ones, and p, two-sided;
        1 if nothing differs.
    """
    counted = differences != 0.0
    # Twice the rank is whole, ties or not.
    ranks = np.rint(2.0 * stats.rankdata(np.abs(differences)))[counted].astype(int)
    above = int(ranks[differences[counted] > 0.0].sum())
    below = int(ranks.sum()) - above
    share = np.zeros(above + below + 1)  # of the patterns, by what their positive ranks sum to
    share[0] = 1.0
    for rank in ranks:
        share[rank:] += share[: len(share) - rank].copy()
        share /= 2.0
    tail = float(share[: min(above, below) + 1].sum())
    return (above - below) / 2.0, min(1.0, 2.0 * tail)
