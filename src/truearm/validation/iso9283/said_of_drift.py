"""What is to be said of the times over which drift was watched."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from truearm.notices import Notice
from truearm.planning.iso9283.planned import PerformancePlan
from truearm.validation.iso9283.drift import DriftCourse

#: From the first group to the last drift is watched for at least and at most this share of the planned time.
_SHORTEST: Final = 0.9
_LONGEST: Final = 1.25
#: Times in other units, by how many seconds they have.
_UNITS: Final = {"minutes": 60.0, "hours": 3600.0, "milliseconds": 1e-3}


def said_of_drift(plan: PerformancePlan, courses: Sequence[DriftCourse]) -> tuple[Notice, ...]:
    """Return what is to be said of courses that are one group alone, or do not last as long as planned."""
    planned = 3600.0 * plan.hours
    single, other, timeless = [], [], False
    for one in courses:
        name = (
            f"{one.pose}{f' of {one.robot}' if one.robot else ''}, {100 * one.velocity:g} %, load {100 * one.load:g} %"
        )
        if len(one.cycles) < 2:
            single.append(f"{name} ({one.cycles[0]} cycles)")
        elif not np.isfinite(one.time).all():
            timeless = True
        else:
            lasts = float(one.time[-1] - one.time[0])
            if not _fits(lasts, planned):
                units = [unit for unit, seconds in _UNITS.items() if _fits(lasts * seconds, planned)]
                asked = f" (are the times in {units[0]}?)" if units else ""
                other.append(f"{name}: {len(one.cycles)} groups over {lasts / 3600.0:.3g} h{asked}")
    made = []
    if single:
        made.append(
            Notice(
                "single-drift-group",
                f"All cycles of drift are one group at {'; '.join(single)}: there is no change to be told. A group "
                "begins where the numbers of the cycles begin anew, or after a pause.",
            )
        )
    if other or timeless:
        told = "; ".join(other) or "the rows of dAP have no times"
        made.append(
            Notice(
                "drift-time",
                f"Drift is planned over {plan.hours:g} h; measured: {told}. dAP and dRP tell the change over the time "
                "that was measured, and are not those of the plan.",
            )
        )
    return tuple(made)


def _fits(lasts: float, planned: float) -> bool:
    return _SHORTEST * planned <= lasts <= _LONGEST * planned
