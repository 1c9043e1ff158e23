"""How uncertain the parameters are, as configurations that the fit has not seen show it."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.diagnose.position_errors import PositionErrors
from truearm.engine.fit.fit import Fit
from truearm.engine.robot.chain import Array

# Where every effect is in the model, how large effects are is found from the same readings as the parameters, and few
# readings leave that open. All errors of the parameters are then larger or smaller by one level. It is believed to be
# near one; the degrees of freedom of the covariance say how near. Unseen readings tell it, by the median of their
# errors, which a few wrong readings do not move.
#
#: Errors that are drawn, and configurations that are looked at.
_DRAWS: Final = 400
_CONFIGURATIONS: Final = 100
#: Least share of the squared errors that what the parameters do counts for, and least variance that is theirs.
_LEAST_SHARE: Final = 0.02
_LEAST_LEVEL: Final = 0.01
#: By how much the error over the workspace may differ from that at unseen configurations, a deviation of logarithms.
_ELSEWHERE: Final = 0.07


def as_unseen_shows(fit: Fit, unseen: Dataset) -> Fit:
    """Return a fit whose parameters are as uncertain as its errors at configurations that it has not seen show.

    Only of a fit of every effect, whose readings locate the robot.

    Args:
        unseen: Readings of the same campaign that the fit was not trained on.
    """
    if not can_tell(fit, unseen):
        return fit
    some = unseen.of_configurations(np.arange(min(unseen.configurations, _CONFIGURATIONS)))
    of_one_size = replace(
        fit,
        covariance_parts=tuple(replace(part, freedom=math.inf) for part in fit.covariance_parts),
        joint_freedom=np.full(len(fit.joint_error), np.inf),
    )
    by_parameters = replace(of_one_size, joint_error=np.zeros(len(fit.joint_error)))
    lengths = _seen(PositionErrors(of_one_size, _DRAWS), some)
    medians = np.log(np.median(lengths, axis=1))
    share = float(np.mean(_moved(PositionErrors(by_parameters, _DRAWS), some) ** 2)) / float(np.mean(lengths**2))
    share = min(max(share, _LEAST_SHARE), 1.0)
    square = (_middle(fit, unseen) / math.exp(float(medians.mean()))) ** 2
    level = max((square - 1.0 + share) / share, _LEAST_LEVEL)
    share = max(share, 1.0 - (1.0 - share) / square)
    believed, told = 0.5 / fit.covariance_parts[-1].freedom, float(medians.var()) / share**2
    level **= believed / (believed + told)
    found = (fit.robot.parameters[name] for name in (*fit.free.names, *fit.unfitted))
    return replace(
        fit,
        robot=fit.robot.with_parameters(
            replace(p, deviation=math.sqrt(level) * p.deviation) for p in found if p.deviation is not None
        ),
        covariance=level * fit.covariance,
        covariance_parts=tuple(replace(part, covariance=level * part.covariance) for part in fit.covariance_parts),
    )


def can_tell(fit: Fit, unseen: Dataset) -> bool:
    """Return whether unseen readings tell how uncertain the parameters of a fit are."""
    of_robot = set(unseen.targets).issubset(target.name for target in fit.robot.targets)
    return fit.model.weighed and not fit.gauge_freedoms and of_robot and _middle(fit, unseen) > 0.0


def agreeing(errors: PositionErrors, unseen: Dataset) -> NDArray[np.intp]:
    """Return indices of as many draws, each as often as its errors agree with those at unseen readings, ``(draws,)``.

    They are weighed by a normal density of the logarithm of the median error (importance resampling).
    """
    medians = np.log(np.median(_seen(errors, unseen), axis=1))
    apart = ((medians - math.log(_middle(errors.fit, unseen))) / _ELSEWHERE) ** 2
    weight = np.cumsum(np.exp(-0.5 * (apart - apart.min())))
    evenly = (np.arange(errors.draws) + 0.5) / errors.draws
    return np.asarray(np.searchsorted(weight, evenly * weight[-1]), dtype=np.intp)


def _middle(fit: Fit, data: Dataset) -> float:
    """Return the median error of a fit at readings [m], 0 without any."""
    off = errors_of(fit.robot, data).position_norms
    return float(np.median(off)) if len(off) else 0.0


def _moved(errors: PositionErrors, data: Dataset) -> Array:
    """Return how far errors move the targets of readings, ``(draws, readings)`` [m]."""
    names = [target.name for target in errors.fit.robot.targets]
    target = np.array([names.index(name) for name in data.targets])[data.target]
    return np.asarray(errors.at(data.joints)[:, target, data.configuration])


def _seen(errors: PositionErrors, data: Dataset) -> Array:
    """Return the same as an instrument would see it, with its noise."""
    moved, fit = _moved(errors, data), errors.fit
    noise = np.random.default_rng((errors.seed, 4)).standard_normal((*moved.shape, 3))
    noise *= fit.excess * fit.sigma["position"]
    noise[..., 0] += moved
    return np.asarray(np.linalg.norm(noise, axis=2))
