"""Notice readings that are hardly more numbers than the parameters of a model take up."""

from __future__ import annotations

import math
from typing import Final

from truearm.identification.solving.fit import Fit
from truearm.identification.solving.losses import ABSOLUTE
from truearm.measurement.observations import OBSERVATIONS
from truearm.notices import Notice
from truearm.shown import counted
from truearm.units import from_si

FEW_READINGS: Final = "few-readings"
#: Numbers left by the parameters from which the noise is at most 1.6 times what they tell, 19 times in 20.
_ENOUGH: Final = 10.0
#: Share of the numbers that parameters must leave for losses that may meet as many readings exactly, and doubt others.
_LEAST_SHARE: Final = 2.0 / 3.0
_MEETING: Final = ("cauchy", *ABSOLUTE)
#: Numbers for each free parameter from which a robust fit tells which reading is wrong.
_FEWEST_TO_DOUBT: Final = 1.5
#: How often the noise is larger than is said that it may be.
_RARELY: Final = 0.05
#: What more there must be to judge a fit.
CURE: Final = "Measure more configurations, or read more targets at each."
_UNIT: Final = {observation.name: "mm" if observation.unit == "m" else "mrad" for observation in OBSERVATIONS}


def check_few_readings(fit: Fit) -> list[Notice]:
    """Say if a fit leaves next to nothing of its readings, whatever their noise.

    It is an error for losses other than the linear one, whose deviations follow from what is left.
    """
    left = max(fit.numbers - fit.spent, 0.0)
    enough = max(_ENOUGH, _LEAST_SHARE * fit.numbers) if fit.loss in _MEETING else _ENOUGH
    if left >= enough and not fit.assumed:
        return []
    words = (
        f"The training readings are {counted(fit.numbers, 'number')}. The {counted(len(fit.free.names), 'parameter')} "
        f"take up {fit.spent:.1f} of them, so {left:.1f} are left to judge the fit by. A wrong reading cannot be told "
        "from a right one. "
    )
    if fit.assumed:
        taken = ", ".join(f"{from_si(fit.sigma[name], _UNIT[name]):.3g} {_UNIT[name]} ({name})" for name in fit.assumed)
        words += (
            f"Nor do the readings tell how large their noise is, and no deviation is declared: it is assumed, {taken}. "
            "The deviations of the parameters and the expected error are right if it is. "
        )
    elif not fit.declared:
        words += (
            f"The noise may be {_may_be(max(left, 1.0)):.2g} times as large as is estimated from so few, and with it "
            "the deviations of the parameters and the expected error. "
        )
    if fit.loss != "linear":
        words += (
            "Of the deviations of the parameters and of the expected error nothing can be said, with this loss: "
            "they follow from what is left. Use the linear loss. "
        )
    declare = "" if fit.declared else " Declare the instrument's deviation in a column sigma."
    return [Notice(FEW_READINGS, f"{words}{CURE}{declare}", "warning" if fit.loss == "linear" else "error")]


def _may_be(freedom: float) -> float:
    """Return how many times its estimate a deviation is at most, but for one time in twenty: by chi squared."""
    from scipy.special import gammaincinv

    return math.sqrt(freedom / (2.0 * float(gammaincinv(freedom / 2.0, _RARELY))))


def check_few_to_doubt(fit: Fit) -> list[Notice]:
    """Say if the readings are hardly more numbers than a robust fit of them has free parameters.

    It may then leave a good reading far off: others that are as good agree without it.
    """
    parameters = len(fit.free.names)
    if fit.numbers >= _FEWEST_TO_DOUBT * parameters:
        return []
    return [
        Notice(
            FEW_READINGS,
            f"The readings are {counted(fit.numbers, 'number')}, for {counted(parameters, 'parameter')} of the "
            f"{fit.model.name} model. With fewer than {_FEWEST_TO_DOUBT:g} for each, a wrong reading cannot be told "
            f"from a right one. {CURE}",
        )
    ]
