"""Are the declared deviations far larger than what the readings scatter by.

Residuals alone may not show it. Where sigma is so large that the priors hold the parameters back, the residuals are as
large as the robot's own errors. So the deviation is sought with which a fit agrees with itself: its residuals, per
degree of freedom, are as large as it was told. Near the solution a fit is linear, and in the directions of the singular
value decomposition of its Jacobian per prior each parameter is found alone, so no fit is repeated.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from truearm.identification.judging.left_over import LeftOver
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
    sigma = np.array([s for b in blocks if b.declared and b.observation.unit == "m" for s in b.sigma.tolist()])
    size = f" ({np.sqrt(np.mean(sigma**2)) * 1e3:.3g} mm)" if len(sigma) else ""
    times = 1.0 / max(found, _SMALLEST_RATIO)
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


def _rounded(value: float) -> str:
    """Return a number with two digits, without an exponent."""
    return f"{float(f'{value:.2g}'):.10g}"
