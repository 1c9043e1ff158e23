"""Which of many possible measurements tell most: a D-optimal choice by exchange.

The measure is the determinant of the information on the parameters of interest, with what the others take away
(the Schur complement, D_s-optimality: Atkinson, Donev and Tobias 2007, "Optimum experimental designs, with SAS",
section 10.3). Measurements are added one at a time, then each is exchanged for a better one as long as there is one
(Fedorov 1972, "Theory of optimal experiments").
"""

from __future__ import annotations

from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.modeling.chain import Array

_ROUNDS: Final = 10
_GAIN: Final = 1e-9  # of the logarithm of the determinant


def most_telling(rows: Array, count: int, known: Array, interest: int) -> list[int]:
    """Return the indices of `count` measurements that together tell most, in the order of their choice.

    Parameters
    ----------
    rows
        Derivatives of each possible measurement by the parameters, per standard deviation,
        ``(candidates, rows, parameters)``.
    count
        How many to choose.
    known
        Information that is there beforehand, ``(parameters, parameters)``, positive definite.
    interest
        How many of the parameters, the first ones, are of interest.

    Raises
    ------
    InputError
        If there are fewer candidates.
    """
    if not 0 <= count <= len(rows):
        raise InputError(
            "there are not so many measurements to choose from",
            where="number of measurements",
            came=count,
            allowed=f"0 to {len(rows)}",
        )
    information = rows.swapaxes(1, 2) @ rows
    chosen: list[int] = []
    total = np.array(known)
    for _ in range(count):
        best, _ = _best(rows, total, interest, chosen)
        chosen.append(best)
        total = total + information[best]
    for _ in range(_ROUNDS):
        exchanged = False
        for place, old in enumerate(chosen):
            without = total - information[old]
            others = chosen[:place] + chosen[place + 1 :]
            best, gains = _best(rows, without, interest, others)
            if gains[best] > gains[old] + _GAIN:
                chosen[place], total, exchanged = best, without + information[best], True
        if not exchanged:
            break
    return chosen


def _best(rows: Array, total: Array, interest: int, taken: list[int]) -> tuple[int, Array]:
    """Return the candidate that tells most beyond `total`, and what each would add."""
    gains = _added(rows, total)
    if interest < len(total):
        gains = gains - _added(rows[..., interest:], total[interest:, interest:])
    gains[taken] = -np.inf
    return int(np.argmax(gains)), gains


def _added(rows: Array, total: Array) -> Array:
    """Return what each candidate adds to the logarithm of the determinant (by the matrix determinant lemma)."""
    scale = 1.0 / np.sqrt(np.diag(total))
    scaled = rows * scale
    inverse = np.linalg.inv(total * np.outer(scale, scale))
    inner = np.eye(rows.shape[1]) + scaled @ inverse @ scaled.swapaxes(1, 2)
    return np.asarray(np.linalg.slogdet(inner)[1], dtype=np.float64)
