"""The order of the cycles in which drift was watched: by their times, held against the file and the cycles' numbers."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError
from truearm.measurement.performance.records import AttainedPoses

#: In a file that is in order but for a few falls of its times by more than this [s], a clock has begun anew.
_FALLS: Final = 2
_FELL: Final = 3600.0


def drift_order(readings: AttainedPoses, rows: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the order of the rows of one pose and condition: that of time, that of the file where none has a time.

    Raises:
        InputError: If some rows have no time, a clock began anew within the file, or the numbers of cycles contradict
            the times.
    """
    time = readings.time[rows]
    given = np.isfinite(time)
    if not given.any():
        return np.arange(len(rows))
    if not given.all():
        missing = rows[~given]
        raise InputError(
            f"{len(missing)} row{'s' * (len(missing) != 1)} of drift without a time beside rows with one",
            where=f"{readings.source}, line {int(readings.line[missing[0]])}, column time",
            allowed="a time in every row of dAP, or in none",
            cure="Write the time, or remove the row.",
        )
    fall = -np.diff(time)
    falls = np.flatnonzero(fall > 0)
    if 0 < len(falls) <= _FALLS and (fall[falls] > _FELL).all():
        before, after = rows[falls[0]], rows[falls[0] + 1]
        raise InputError(
            "the time of drift falls by hours in the order of the file",
            where=f"{readings.source}, lines {int(readings.line[before])} and {int(readings.line[after])}",
            came=f"{readings.time[before]:.9g} s, then {readings.time[after]:.9g} s",
            allowed="times since one begin, from cold on",
            cure="Where the clock passed midnight, add 86400 s to the rows behind it. Otherwise sort the rows by time.",
        )
    order = np.argsort(time, kind="stable")
    cycle = readings.cycle[rows][order]
    down = np.flatnonzero(cycle[1:] <= cycle[:-1])
    most = int(np.unique(cycle, return_counts=True)[1].max())
    if len(down) + 1 > most:
        one, other = (int(readings.line[rows[order[down[-1] + k]]]) for k in (0, 1))
        raise InputError(
            "the times of drift contradict the numbers of its cycles",
            where=f"{readings.source}, lines {one} and {other}",
            came=f"numbers that begin anew {len(down)} times in the order of time",
            allowed=f"{most - 1} times, as no number is there more than {most} times",
            cure="Check the times, where a clock passed midnight too, and the cycles; number each group from 1.",
        )
    return np.asarray(order)
