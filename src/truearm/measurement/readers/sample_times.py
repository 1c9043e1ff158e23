"""Times of samples that cannot be used: out of order, written twice, or rounded until many are the same."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError
from truearm.modeling.chain import Array

#: If more samples than this share have the time of the one before, times are rounded, and nothing is written twice.
_TWICE: Final = 0.02


def refuse_out_of_order(
    source: str, time: Array, code: NDArray[np.intp], order: NDArray[np.intp], lines: NDArray[np.intp]
) -> None:
    """Refuse samples of one cycle, or of one stream, of which a later one has no later time.

    Args:
        source: The file.
        time: Of each sample [s], ``(n,)``.
        code: Whose cycle or stream it is, ``(n,)``.
        order: Samples of one code together, each in the order of the file, ``(n,)``.
        lines: In the file, ``(n,)``.

    Raises:
        InputError: That names the two samples.
    """
    step = np.diff(time[order])
    wrong = np.flatnonzero((np.diff(code[order]) == 0) & (step <= 0.0))
    if not len(wrong):
        return
    before, after = order[wrong[0]], order[wrong[0] + 1]
    twice = time[before] == time[after]
    if twice and len(wrong) > max(_TWICE * len(time), 1) and (step[wrong] == 0.0).all():
        raise InputError(
            "times are rounded so coarsely that samples of a cycle have the same",
            where=f"{source}, lines {lines[before]} and {lines[after]}",
            came=f"{time[before]:.9g} s twice, and so on {len(wrong)} times",
            allowed="times that increase within a cycle, and within a stream without cycles",
            cure="Write the times with more decimals.",
        )
    raise InputError(
        "two samples of a cycle have the same time" if twice else "samples of a cycle are out of order",
        where=f"{source}, lines {lines[before]} and {lines[after]}",
        came=f"{time[before]:.9g} s, then {time[after]:.9g} s",
        allowed="times that increase within a cycle, and within a stream without cycles",
        cure="Remove the sample that was written twice."
        if twice
        else "Sort the rows by time, or give another cycle another number.",
    )
