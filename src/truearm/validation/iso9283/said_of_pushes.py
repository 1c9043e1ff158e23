"""What is to be said of the forces by which the tip was pushed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from truearm.modeling.chain import Array
from truearm.notices import Notice
from truearm.planning.iso9283.planned import PerformancePlan
from truearm.shown import listed
from truearm.validation.iso9283.compliance import GRAVITY, PushLine
from truearm.validation.iso9283.values import Instrument

#: The largest force of a direction is low below this share of the rated load's weight.
_LOW: Final = 0.85
#: Forces are kilograms if the largest is the rated load within this share.
_ROUNDED: Final = 0.06
#: A slope is more than noise above so many standard errors.
_ABOVE_NOISE: Final = 6.0


def said_of_pushes(plan: PerformancePlan, pushes: Sequence[PushLine], instrument: Instrument) -> tuple[Notice, ...]:
    """Return what is to be said of pushes: forces far below the rated ones, and directions that cannot be right."""
    found = (_low(plan, pushes), _sideways(pushes, instrument))
    return tuple(notice for notice in found if notice is not None)


def _low(plan: PerformancePlan, pushes: Sequence[PushLine]) -> Notice | None:
    test = plan.test("compliance")
    if test is None or not plan.rated_load > 0:
        return None
    most = GRAVITY * plan.rated_load * max(test.loads)
    largest: dict[str, float] = {}
    for one in pushes:
        largest[one.direction] = max(largest.get(one.direction, 0.0), float(one.force.max()))
    low = [direction for direction, force in largest.items() if force < _LOW * most]
    if not low:
        return None
    kilograms = all(abs(largest[name] * GRAVITY / most - 1.0) < _ROUNDED for name in low)
    asked = (
        f" Their largest number is that of the load in kg: are these kg? Then compliance is {GRAVITY:.2f} times too "
        "large; multiply them by that."
        if kilograms
        else " Push up to the rated load, or check the unit."
    )
    told = ", ".join(f"{name} {largest[name]:.4g} N" for name in low)
    return Notice(
        "low-forces",
        f"The largest forces are well below the weight of the rated load, {most:.4g} N: {told}.{asked}",
    )


def _sideways(pushes: Sequence[PushLine], instrument: Instrument) -> Notice | None:
    """Return directions along which the tip moves less than at right angles, where no arm can do so.

    An arm at rest gives way by a symmetric matrix without negative eigenvalues, and may well move more at right angles
    to a force than along it. Forces under the names of other axes change columns of that matrix: then it has a negative
    one. Where not all axes were pushed along, the matrix is not known.
    """
    names = tuple(dict.fromkeys(one.direction for one in pushes))
    error = {name: _standard_error(pushes, name, instrument) for name in names}
    slope = {name: np.mean([one.slopes for one in pushes if one.direction == name], axis=0) for name in names}
    by_axis = {
        axis: [(1.0 if name[0] == "+" else -1.0) * slope[name] for name in names if name[1] == axis] for axis in "xyz"
    }
    if all(by_axis.values()):
        matrix = np.stack([np.mean(by_axis[axis], axis=0) for axis in "xyz"], axis=1)
        least = float(np.linalg.eigvalsh((matrix + matrix.T) / 2)[0])
        if least > -_ABOVE_NOISE * max(error.values()):
            return None
    told = []
    for name in names:
        k = "xyz".index(name[1])
        along, across = float(abs(slope[name][k])), np.delete(slope[name], k)
        sideways = float(np.linalg.norm(across))
        if sideways - along > _ABOVE_NOISE * error[name]:
            most = [axis for axis in "xyz" if axis != name[1]][int(np.abs(across).argmax())]
            told.append(f"{name} ({1e3 * sideways:.3g} mm/N, most along {most}; along it {1e3 * along:.3g})")
    if not told:
        return None
    return Notice(
        "sideways-push",
        f"The tip moves more at right angles to the force than along it: {listed(told)}. Check that the directions "
        "are axes of the robot's base, not of the instrument, and that none are exchanged.",
    )


def _standard_error(pushes: Sequence[PushLine], name: str, instrument: Instrument) -> float:
    squares: list[float] = []
    for one in pushes:
        if one.direction == name:
            about: Array = one.force - one.force.mean()
            squares.append(float(about @ about))
    return instrument.sigma / float(np.sqrt(sum(squares)))
