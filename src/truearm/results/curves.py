"""Curves of joints as JSON and the command show them: millidegrees, degrees, periods in a turn."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from truearm.identification.judging.found_curves import FoundCurve


def curves_summary(curves: Sequence[FoundCurve]) -> list[dict[str, Any]]:
    """Return size, strongest periods and measured ranges of each curve, as JSON holds them."""
    return [
        {
            "joint": curve.number,
            "rms_mdeg": mdeg(curve.rms),
            "rms_deviation_mdeg": mdeg(curve.rms_deviation),
            "strongest": [
                {"periods": [one.lowest, one.highest], "amplitude_mdeg": mdeg(one.amplitude)} for one in curve.strongest
            ],
            "measured_deg": [[math.degrees(low), math.degrees(high)] for low, high in curve.measured],
        }
        for curve in curves
    ]


def curve_lines(curves: Sequence[FoundCurve]) -> list[str]:
    """Return a line for each curve, with the periods whose amplitude is at least half of the strongest."""
    lines = []
    for curve in curves:
        strong = [one for one in curve.strongest if 2.0 * one.amplitude >= curve.strongest[0].amplitude]
        *others, last = [one.range for one in strong]
        periods = f"{', '.join(others)} and {last}" if others else last
        lines.append(
            f"Joint {curve.number}: curve of {math.degrees(curve.rms):#.2g} +- "
            f"{math.degrees(curve.rms_deviation):.1g} deg rms, strongest at {periods} "
            f"{'period' if periods == '1' else 'periods'} a turn"
        )
    return lines


def mdeg(angle: float) -> float:
    """Return an angle [rad] in millidegrees."""
    return 1e3 * math.degrees(angle)
