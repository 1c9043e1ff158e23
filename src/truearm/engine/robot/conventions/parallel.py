"""Parallel axes whose convention cannot tilt one against the other."""

from __future__ import annotations

import math
from collections.abc import Mapping

from truearm.engine.robot.conventions.convention import JOINT, Convention


def parallel_joints_without_beta(convention_: Convention, rows: list[Mapping[str, float]]) -> list[tuple[int, int]]:
    """Return the pairs of neighbouring joints (from 1) whose axes are parallel while their link has no beta.

    For standard forms the alpha between joints i and i + 1 stands in row i, for modified forms in row i + 1.
    """
    columns = convention_.columns
    if "alpha" not in columns or ("beta" in columns and "beta" not in convention_.optional):
        return []
    first = 0 if columns[0] == JOINT else 1
    return [
        (i + 1, i + 2)
        for i in range(len(rows) - 1)
        for row in [rows[i + first]]
        if abs(math.sin(row.get("alpha", 0.0))) < 1e-9 and "beta" not in row
    ]
