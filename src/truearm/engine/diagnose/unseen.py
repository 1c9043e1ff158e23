"""How uncertain the parameters are, as configurations that the fit has not seen show it."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.diagnose.expected_error import PositionErrors
from truearm.engine.fit.fit import Fit

#: Errors that are drawn.
_DRAWS: Final = 400
#: Configurations that are looked at.
_CONFIGURATIONS: Final = 100
#: Variance of the logarithm of the level that always remains: where it is asked for other errors count more.
_REMAINS: Final = 0.01
#: Least share of the squared errors that what the parameters do counts for.
_LEAST_SHARE: Final = 0.02


def as_unseen_shows(fit: Fit, unseen: Dataset) -> Fit:
    """Return a fit whose parameters are as uncertain as its errors at configurations that it has not seen show.

    Where every effect is in the model, how large effects are is found from the same readings as the parameters, and
    few readings leave that open. All errors of the parameters are then larger or smaller by one level, which is
    believed to be near one (the degrees of freedom of the covariance say how near), and which unseen readings tell:
    by the median of their errors, which a few wrong readings do not move.

    Args:
        unseen: Readings of the same campaign that the fit was not trained on.
    """
    names = [target.name for target in fit.robot.targets]
    if not fit.model.weighed or fit.gauge_freedoms or not set(unseen.targets).issubset(names):
        return fit
    off = errors_of(fit.robot, unseen).position_norms
    if not len(off) or not float(np.median(off)) > 0.0:
        return fit
    some = unseen.of_configurations(np.arange(min(unseen.configurations, _CONFIGURATIONS)))
    read = (slice(None), np.array([names.index(name) for name in some.targets])[some.target], some.configuration)
    known = replace(
        fit,
        covariance_parts=tuple(replace(part, freedom=math.inf) for part in fit.covariance_parts),
        joint_freedom=np.full(len(fit.joint_error), np.inf),
    )
    by_parameters = PositionErrors(replace(known, joint_error=np.zeros(len(fit.joint_error))), _DRAWS)
    noise = fit.excess * fit.sigma["position"] * np.random.default_rng(0).standard_normal((_DRAWS, len(some.target), 3))
    noise[..., 0] += PositionErrors(known, _DRAWS).at(some.joints)[read]
    lengths = np.linalg.norm(noise, axis=2)
    medians = np.log(np.median(lengths, axis=1))
    share = float(np.mean(by_parameters.at(some.joints)[read] ** 2)) / float(np.mean(lengths**2))
    share = min(max(share, _LEAST_SHARE), 1.0)
    square = (float(np.median(off)) / math.exp(float(medians.mean()))) ** 2
    level = max((square - 1.0 + share) / share, _REMAINS)
    share = max(share, 1.0 - (1.0 - share) / max(square, 1e-300))
    believed = 1.0 / (2.0 * fit.covariance_parts[-1].freedom)
    told = float(medians.var()) / share**2
    level **= believed / (believed + told)
    freedom = 0.5 / max(believed * told / (believed + told), _REMAINS)
    robot, root = fit.robot, math.sqrt(level)
    deviations = {n: robot.parameters[n].deviation for n in (*fit.free.names, *fit.unfitted)}
    return replace(
        fit,
        robot=robot.with_parameters(
            replace(robot.parameters[n], deviation=root * d) for n, d in deviations.items() if d is not None
        ),
        covariance=level * fit.covariance,
        covariance_parts=tuple(
            replace(part, covariance=level * part.covariance, freedom=max(part.freedom, freedom))
            for part in fit.covariance_parts
        ),
    )
