"""How uncertain the parameters are, as configurations that the fit has not seen show it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.diagnose.position_errors import PositionErrors, as_residuals_allow
from truearm.engine.fit.fit import Fit
from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects import EFFECTS
from truearm.engine.robot.effects.compliance import Compliance
from truearm.engine.robot.effects.warm_up import LEFT

# Where every effect is in the model, how large effects are is found from the same readings as the parameters, and few
# readings leave that open. All errors of the parameters are then larger or smaller by one level. It is believed to be
# near one; the degrees of freedom of the covariance say how near. Unseen readings tell it, by the median of their
# errors, which a few wrong readings do not move.
#
#: Errors that are drawn, and configurations that are looked at.
_DRAWS: Final = 400
_CONFIGURATIONS: Final = 200
#: Least share of the squared errors that what the parameters do counts for, and least variance that is theirs.
_LEAST_SHARE: Final = 0.02
_LEAST_LEVEL: Final = 0.01
#: By how much the error over the workspace may differ from that at unseen configurations, a deviation of logarithms.
_ELSEWHERE: Final = 0.07
#: What readings of the campaign know and programs do not: how far the arm has warmed up.
_KNOWN: Final = (LEFT,)
#: Effects whose size the readings tell.
_SIZED: Final = frozenset(effect.name for effect in EFFECTS) - {Compliance.name}
#: Median length of three normal numbers of deviation one.
_MEDIAN_LENGTH: Final = 1.5382


@dataclass(frozen=True, eq=False)
class Unseen:
    """Readings that a fit was not trained on, and how large its errors are there."""

    data: Dataset
    joint_error: Array  #: Of the fit, as far as the training readings allow it [rad or m], ``(joints,)``.
    median: float  #: Of the errors [m].
    noise: float  #: Deviation of a coordinate of a reading [m].

    @classmethod
    def of(cls, fit: Fit, data: Dataset, training: Dataset) -> Self | None:
        """Return what they say of a fit of every effect whose readings locate the robot; None of any other.

        Wrong readings make residuals larger than the noise is. It is no larger than the median of the residuals says.
        """
        data = data.of_configurations(np.arange(min(data.configurations, _CONFIGURATIONS)))
        if not fit.model.weighed or fit.gauge_freedoms or not data.has_position.any():
            return None
        off, left = (float(np.median(errors_of(fit.robot, part).position_norms)) for part in (data, training))
        unspent = max(1.0 - fit.spent / fit.numbers, _LEAST_SHARE)
        noise = min(fit.excess * fit.sigma["position"], left / (_MEDIAN_LENGTH * math.sqrt(unspent)))
        return cls(data, as_residuals_allow(fit, training).joint_error, off, noise) if off > 0.0 else None

    def as_shown(self, fit: Fit) -> Fit:
        """Return the fit with parameters that are as uncertain as these readings show."""
        of_one_size = replace(
            fit,
            covariance_parts=tuple(replace(part, freedom=math.inf) for part in fit.covariance_parts),
            joint_error=self.joint_error,
            joint_freedom=np.full(len(self.joint_error), np.inf),
        )
        by_parameters = PositionErrors(replace(of_one_size, joint_error=np.zeros(len(self.joint_error))), _DRAWS)
        lengths = self.seen(PositionErrors(of_one_size, _DRAWS))
        medians = np.log(np.median(lengths, axis=1))
        share = float(np.mean(self.moved(by_parameters) ** 2)) / float(np.mean(lengths**2))
        share = min(max(share, _LEAST_SHARE), 1.0)
        square = (self.median / math.exp(float(medians.mean()))) ** 2
        level = max((square - 1.0 + share) / share, _LEAST_LEVEL)
        share = max(share, 1.0 - (1.0 - share) / square)
        believed, told = 0.5 / fit.covariance_parts[-1].freedom, float(medians.var()) / share**2
        level **= believed / (believed + told)
        return _enlarged(fit, level)

    def agreeing(self, errors: PositionErrors) -> NDArray[np.intp]:
        """Return indices of as many draws, each as often as its errors agree with these readings, ``(draws,)``.

        They are weighed by a normal density of the logarithm of the median error (importance resampling).
        """
        medians = np.log(np.median(self.seen(errors), axis=1))
        apart = ((medians - math.log(self.median)) / _ELSEWHERE) ** 2
        weight = np.cumsum(np.exp(-0.5 * (apart - apart.min())))
        evenly = (np.arange(errors.draws) + 0.5) / errors.draws
        return np.asarray(np.searchsorted(weight, evenly * weight[-1]), dtype=np.intp)

    def moved(self, errors: PositionErrors) -> Array:
        """Return how far errors move the targets of the readings, ``(draws, readings)`` [m]."""
        names = [target.name for target in errors.fit.robot.targets]
        target = np.array([names.index(name) for name in self.data.targets])[self.data.target]
        at = errors.at(self.data.joints, _KNOWN)[:, target, self.data.configuration]
        return np.asarray(at[:, self.data.has_position])

    def seen(self, errors: PositionErrors) -> Array:
        """Return the same as an instrument would see it, with its noise."""
        moved = self.moved(errors)
        noise = self.noise * np.random.default_rng((errors.seed, 4)).standard_normal((*moved.shape, 3))
        noise[..., 0] += moved
        return np.asarray(np.linalg.norm(noise, axis=2))


def _enlarged(fit: Fit, level: float) -> Fit:
    """Return a fit whose parameters have a variance so many times as large, as far as readings told them.

    What is known of a direction beforehand stays so. Of effects the readings told what is expected of their sizes.
    """
    found = [fit.robot.parameters[name] for name in (*fit.free.names, *fit.unfitted)]
    whole = np.sum([part.covariance for part in fit.covariance_parts], axis=0)
    size = np.array([p.prior for p in found])
    size = np.where([p.group in _SIZED for p in found], 1e3 * np.maximum(size, np.sqrt(np.diag(whole))), size)
    size = np.where([p.name in _KNOWN for p in found], np.sqrt(np.maximum(np.diag(whole), 1e-24)), size)
    left, directions = np.linalg.eigh(whole / np.outer(size, size))
    times = directions * level ** (0.5 * (1.0 - np.clip(left, 0.0, 1.0))) @ directions.T
    times = size[:, None] * times / size
    parts = tuple(replace(part, covariance=times @ part.covariance @ times.T) for part in fit.covariance_parts)
    whole, free = np.sum([part.covariance for part in parts], axis=0), len(fit.free.names)
    deviations = zip(found, np.sqrt(np.diag(whole)).tolist(), strict=True)
    return replace(
        fit,
        robot=fit.robot.with_parameters(replace(p, deviation=d) for p, d in deviations if p.deviation is not None),
        covariance=whole[:free, :free],
        covariance_parts=parts,
    )
