"""Wilcoxon's signed-rank test where differences tie or are none, exact for any number of people.

scipy counts the exact distribution where nothing ties, and can else only list or draw sign
patterns, which is slow or not exact. Here the patterns with each sum of ranks are counted rank by
rank (the shift algorithm: Streitberg and Röhmel, "Exact distributions for permutation and rank
tests", Statistical Software Newsletter 1986), with mid-ranks for ties and Pratt's way with zeros:
they are ranked, then left out.
"""

import numpy as np
from scipy import stats


def signed_rank_p(differences: np.ndarray) -> float:
    """How likely differences at least so one-sided are if neither sign is favoured; two-sided.

    Args:
        differences: ``(n,)``.
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
    return min(1.0, 2.0 * tail)
