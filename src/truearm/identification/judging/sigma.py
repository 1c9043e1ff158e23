"""Are the declared deviations far larger than what the readings scatter by.

Residuals alone may not show it. Where sigma is so large that the priors hold the parameters back, the residuals are as
large as the robot's own errors. So the deviation is sought with which a fit agrees with itself: its residuals, per
degree of freedom, are as large as it was told. Near the solution a fit is linear, and in the directions of the singular
value decomposition of its Jacobian per prior each parameter is found alone, so no fit is repeated.

Where joints err at every arrival the residuals are large for that reason, and a sigma that is too large takes a part of
it for noise. So the likelihood with that sigma is compared with the one in which the noise is free.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from truearm.identification.judging.arrival_likelihood import ArrivalLikelihood
from truearm.identification.judging.left_over import LeftOver
from truearm.identification.solving.rounds import DECLARED
from truearm.notices import Notice

#: Declared deviations are called too large if a fit agrees with itself at less than half of them, by more than chance:
#: instruments are stated with some reserve, never with that much.
_LARGEST_RATIO: Final = 0.5
#: The priors hold the parameters back if the declared deviations leave so many times more than those that agree.
_PRIORS_WIN: Final = 1.5
#: Equations beyond the parameters without which nothing is said.
_LEAST_FREEDOM: Final = 10.0
#: Lower quantile of the normal distribution of 1 in 1000, as in the judgement of residuals that are too large.
_QUANTILE: Final = 3.09
_ROUNDS: Final = 30
#: Where joints err too: largest share of the declared deviations that the noise is, and twice the gain in likelihood by
#: that noise, which chance exceeds in 1 of 1000 cases at most.
_LARGEST_SHARE: Final = 1.0 / 1.5
_LEAST_GAIN: Final = 10.83
#: Errors of the joints must move readings by this part of the declared deviations, or the first judgement holds.
_LEAST_MOVED: Final = 0.1
#: One target hardly tells noise from errors of the joints: beyond so many times no number is given.
_MOST_TOLD: Final = 10.0
_SMALLEST_RATIO: Final = 1e-7


def check_sigma(left: LeftOver) -> list[Notice]:
    """Return a notice if the declared deviations of the readings are far too large."""
    fit = left.fit
    blocks = left.problem.blocks
    if fit.excess > 1.0 or not any(block.declared for block in blocks):
        return []
    prior = left.turns @ ((np.array([fit.robot.values[n] for n in fit.free.names]) - fit.free.nominal) / fit.free.prior)
    along = left.basis.T @ left.residual
    beyond = max(float(left.residual @ left.residual - along @ along), 0.0)

    def ratio(told: float) -> tuple[float, float]:
        """Return residuals over declared deviations, and degrees of freedom, of a fit told so small a part of these."""
        pull = 1.0 / told**2
        step = -(pull * left.strength * along + prior) / (pull * left.strength**2 + 1.0)
        squares = beyond + float(np.sum((left.strength * step + along) ** 2))
        freedom = len(left.residual) - float(np.sum(pull * left.strength**2 / (pull * left.strength**2 + 1.0)))
        return float(np.sqrt(squares / max(freedom, 1.0))), freedom

    found, freedom = ratio(1.0)
    declared = float(np.sqrt(left.residual @ left.residual / max(freedom, 1.0)))
    for _ in range(_ROUNDS):
        before = found
        found, freedom = ratio(max(min(found, 1.0), _SMALLEST_RATIO))
        if abs(found - before) < 1e-3 * before:
            break
    k = 2.0 / (9.0 * max(freedom, 1.0))
    chance = max(1.0 - k - _QUANTILE * np.sqrt(k), 0.0) ** 1.5
    if freedom < _LEAST_FREEDOM or found >= _LARGEST_RATIO * chance:
        return []
    times = 1.0 / max(found, _SMALLEST_RATIO)
    size = _size(left)
    words = f"The declared deviations{size} are about {_rounded(times)} times larger than what the readings scatter by"
    if declared > _PRIORS_WIN * found:
        return [
            Notice(
                "sigma-too-large",
                f"{words}. So the priors hold the robot near its nominal values, and it is "
                f"{_rounded(declared / found)} times farther from the readings than it need be. Mend sigma or its "
                "unit, or leave it out: the noise is then estimated.",
                "error",
            )
        ]
    return [
        Notice(
            "sigma-too-large",
            f"{words}. The deviations of the parameters are too large by about as much. Mend sigma or its unit, or "
            "leave it out: the noise is then estimated.",
        )
    ]


def check_sigma_beside_joints(left: LeftOver) -> list[Notice]:
    """Return a notice if the noise beside errors of the joints is far below the declared deviations."""
    if left.fit.excess > 1.0 or not any(block.declared for block in left.problem.blocks):
        return []
    if len(left.residual) - float(np.sum(left.strength**2 / (left.strength**2 + 1.0))) < _LEAST_FREEDOM:
        return []
    readings = ArrivalLikelihood.of(left)
    free, gained = readings.largest()
    kept, before = readings.largest((DECLARED,))
    share = float(np.sqrt(free.factors[readings.factors.index(DECLARED)]))
    if 2.0 * (gained - before) < _LEAST_GAIN or share > _LARGEST_SHARE:
        return []
    if readings.share_of_joints(free) * share**2 < _LEAST_MOVED:
        return []
    smaller = min(float(np.sqrt(kept.joints.sum() / free.joints.sum())), 1.0)
    part = f"{_rounded(100.0 * smaller)} %" if smaller > 0.0 else "none"
    times = f"about {_rounded(1.0 / share)}" if share > 1.0 / _MOST_TOLD else f"more than {_MOST_TOLD:g}"
    return [
        Notice(
            "sigma-too-large",
            f"The declared deviations{_size(left)} are {times} times larger than the noise that the readings show "
            f"beside errors of the joints. So the fit takes errors of the joints for noise: it finds {part} of them, "
            "and the expected error and the intervals may be too small. Declare one standard deviation "
            "of a coordinate, not a maximum permissible error or two deviations; or leave sigma out: the noise is then "
            "estimated.",
        )
    ]


def _size(left: LeftOver) -> str:
    """Return the declared deviations of lengths in words, empty if there are none."""
    blocks = left.problem.blocks
    sigma = np.array([s for b in blocks if b.declared and b.observation.unit == "m" for s in b.sigma.tolist()])
    return f" ({np.sqrt(np.mean(sigma**2)) * 1e3:.3g} mm)" if len(sigma) else ""


def _rounded(value: float) -> str:
    """Return a number with two digits, without an exponent."""
    return f"{float(f'{value:.2g}'):.10g}"
