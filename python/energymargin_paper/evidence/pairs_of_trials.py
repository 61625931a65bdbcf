"""What pairs of trials say about a change."""

from __future__ import annotations

import numpy as np

__all__ = ["paired"]

Z95 = 1.959964


def paired(gained: int, lost: int, pairs_of: int) -> tuple[float, float, float, float]:
    """What a change of some pairs says: the difference of the shares, the ends of its 95 % interval
    (Bonett and Price 2012), and the p-value of McNemar's test, exact and two-sided."""
    from scipy.stats import binomtest

    changed = gained + lost
    p = float(binomtest(gained, changed, 0.5).pvalue) if changed else 1.0
    up, down = (gained + 1) / (pairs_of + 2), (lost + 1) / (pairs_of + 2)
    error = Z95 * np.sqrt((up + down - (up - down) ** 2) / (pairs_of + 2))
    middle = up - down
    return (
        (gained - lost) / pairs_of,
        float(max(middle - error, -1.0)),
        float(min(middle + error, 1.0)),
        p,
    )
