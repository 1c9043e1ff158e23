"""To which step numbers of a column were rounded when they were written."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.modeling.chain import Array

#: Decimals that are looked for; numbers with more are not rounded by anything that matters.
_DECIMALS: Final = 7
#: So many rows tell which decimals there are, and all rows are asked whether they have no more.
_FIRST: Final = 200
#: So many differences between rows tell the step; of fewer it is that of the decimals.
_LEAST: Final = 6


def resolution_of(numbers: Array, group: NDArray[np.intp]) -> float:
    """Return the step of which all differences within groups are multiples; 0 where there is none, or nothing differs.

    Args:
        numbers: As written, in the unit of the file, ``(n, d)``: all columns are those of one instrument.
        group: Rows of one group differ by scatter alone, ``(n,)``; of rows over time all are one group.
    """
    order = np.argsort(group, kind="stable")
    same = np.diff(group[order]) == 0
    for decimals in range(_DECIMALS + 1):
        power = 10.0**decimals
        if not (_whole(numbers[:_FIRST] * power) and _whole(numbers * power)):
            continue
        steps = np.abs(np.diff(np.round(numbers[order] * power).astype(np.int64), axis=0)[same]).ravel()
        steps = steps[steps > 0]
        if not len(steps):
            return 0.0
        return float(np.gcd.reduce(steps) if len(steps) >= _LEAST else 1) / power
    return 0.0


def _whole(scaled: Array) -> bool:
    return bool((np.abs(scaled - np.round(scaled)) < 1e-6 + 1e-13 * np.abs(scaled)).all())
