"""Series of robots with a known spread, known faults and a known drift, calibrated in closed form.

A calibration is linear here: readings are the Jacobian times the true differences plus noise, and the estimate is that
of least squares with priors, base and target free. So spread, drift and covariances are exact, and a thousand robots
take no time.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from truearm.engine.fit.models import named_model
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parameters import PLACES, Parameter
from truearm.engine.twin.truths import DEFAULT_TOOL, at_station
from truearm.fleets.drift import Gathered, Kind
from truearm.fleets.series import FoundParameter, FoundParameters, Row


@dataclass(frozen=True, eq=False)
class Campaign:
    """How a robot was measured: what each parameter moves [m per SI unit], and the parameters."""

    parameters: tuple[Parameter, ...]
    jacobian: Array

    @property
    def own(self) -> list[int]:
        """Places of the arm's parameters."""
        return [i for i, p in enumerate(self.parameters) if p.group not in PLACES]

    @property
    def names(self) -> list[str]:
        return [self.parameters[i].name for i in self.own]

    @property
    def prior(self) -> Array:
        """Of the arm's parameters."""
        return np.array([self.parameters[i].prior for i in self.own])


@cache
def campaign(configurations: int = 30, seed: int = 0, robot: str = "irb120") -> Campaign:
    """Return a campaign with configurations drawn evenly."""
    arm = at_station(load_robot(robot), DEFAULT_TOOL)
    free = named_model("geometric").free(arm)
    q = arm.random_configurations(configurations, np.random.default_rng(seed))
    blocks = [
        arm.position_jacobian(arm.forward_kinematics(q, target.name), q, free.names).reshape(len(free.names), -1)
        for target in arm.targets
    ]
    return Campaign(free.parameters, np.concatenate(blocks, axis=1).T)


@dataclass(frozen=True, eq=False)
class Calibrations:
    """The estimate of a campaign with noise: what it makes of true differences, its scatter and its covariance."""

    campaign: Campaign
    resolution: Array
    scatter: Array
    covariance: Array


@cache
def calibrations(of: Campaign, noise: float = 3e-5) -> Calibrations:
    """Return what least squares with priors makes of a campaign."""
    prior = np.array([p.prior for p in of.parameters])
    weighted = of.jacobian * prior / noise
    posterior = np.linalg.inv(weighted.T @ weighted + np.eye(len(prior)))
    gain = posterior @ weighted.T  # in priors, of whitened readings
    own = of.own
    return Calibrations(of, (gain @ weighted)[np.ix_(own, own)], gain[own], posterior[np.ix_(own, own)])


def kind_of(measured: list[Row]) -> Kind:
    """Return robots of one kind as arrays."""
    gathered = Gathered(measured[0].robot)
    for row in measured:
        gathered.add(row)
    return gathered.kind


def rows(
    truth: Array,
    rng: np.random.Generator,
    calibrated: Calibrations | None = None,
    *,
    names: list[str] | None = None,
    of: str | None = None,
    date: str | None = None,
    correlated: bool = True,
) -> list[Row]:
    """Return rows of robots with true differences in priors ``(robots, parameters of the arm)``."""
    calibrated = calibrated or calibrations(campaign())
    own = [calibrated.campaign.parameters[i] for i in calibrated.campaign.own]
    estimates = (
        truth @ calibrated.resolution.T
        + rng.standard_normal((len(truth), calibrated.scatter.shape[1])) @ calibrated.scatter.T
    )
    lower = tuple(calibrated.covariance[np.tril_indices(len(own))].tolist()) if correlated else ()
    deviation = np.sqrt(np.diag(calibrated.covariance))
    return [
        Row(
            name=names[number] if names else f"robot-{number + 1}",
            status="calibrated",
            of=of,
            date=date,
            parameters=FoundParameters.of(
                {
                    p.name: FoundParameter(p.unit, p.nominal + p.prior * x, p.prior * d, p.nominal, p.prior)
                    for p, x, d in zip(own, values, deviation.tolist(), strict=True)
                }
            ),
            fit_status="converged",
            robot="irb120",
            covariance=lower,
        )
        for number, values in enumerate(estimates.tolist())
    ]
