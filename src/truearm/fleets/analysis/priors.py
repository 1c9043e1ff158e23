"""A robot with the priors that a series proposes, as its file and an experiment take them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from truearm.fleets.analysis.spread import ParameterSpread
from truearm.modeling.robot import Robot
from truearm.shown import counted
from truearm.units import SHOWN_AS, from_si, to_si


def with_proposed(robot: Robot, spreads: Sequence[ParameterSpread]) -> tuple[Robot, tuple[str, ...]]:
    """Return a nominal robot with proposed priors, and the names of the parameters that have them.

    Nominal values are shifted where the whole series lies beside them. Parameters that only a model adds, as
    compliances, are left out: a nominal robot does not have them.
    """
    known = robot.parameters
    proposed = {
        one.parameter: replace(known[one.parameter].restarted(one.centre if one.beside else None), prior=one.proposed)
        for one in spreads
        if one.proposed is not None and one.parameter in known
    }
    if not proposed:
        return robot, ()
    robots = max(one.robots for one in spreads)
    words = f"priors of {counted(len(proposed), 'parameter')} from the spread of {counted(robots, 'robot')}"
    source = "; ".join(part for part in (robot.source, words) if part)
    return replace(robot.with_parameters(proposed.values()), source=source), tuple(proposed)


def _rounded(value: float, unit: str) -> float:
    """Return a deviation [SI] with three digits in the unit of files: more of them mean nothing."""
    shown = SHOWN_AS[unit]
    return to_si(float(f"{from_si(value, shown):.3g}"), shown)
