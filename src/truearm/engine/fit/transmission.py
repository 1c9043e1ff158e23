"""Find gears that err periodically, in what a fit leaves over.

The residuals of each joint are held against sines of its positions, one number of periods in a turn after the other: a
periodogram on readings at uneven places (Lomb 1976, "Least-squares frequency analysis of unequally spaced data"). The
strongest is taken out before the next one is looked for, and all that were found are fitted anew with it (Pati,
Rezaiifar and Krishnaprasad 1993, "Orthogonal matching pursuit"). A sine is looked for only where the readings could
tell one of the size that gears have: a joint that hardly turns, or whose axis passes the only target, says nothing.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import Notice, Rule, listed
from truearm.engine.data.dataset import Dataset
from truearm.engine.fit.fit import Fit
from truearm.engine.fit.likelihood import Visits, Whitening
from truearm.engine.fit.problem import Evaluation, Problem
from truearm.engine.robot.chain import Array
from truearm.engine.robot.parameters import FreeParameters
from truearm.engine.robot.robot import Robot

#: Periods in a turn that are looked at; fewer than the first are the Fourier series' business.
FEWEST: Final = 20
_PERIODS: Final = np.arange(FEWEST, 401)
#: A periodic error is believed if chance would show one as strong in any joint less often than this.
LARGEST_CHANCE: Final = 1e-3
LEAST_CONFIGURATIONS: Final = 60  # configurations
#: Largest standard deviation of an amplitude [rad] at which the readings see a gear; good ones err by less.
_LARGEST_DEVIATION: Final = 5e-4
#: Periods that a joint must pass through, or else a sine is the same as an offset or a gain.
_LEAST_PERIODS: Final = 4.0
#: Periods in a turn that are looked at for others that would look the same.
_ALIASES: Final = np.arange(1, 1001)
#: Share of a sine that another one has to follow to look the same, and how many are named.
_SAME_WAVE: Final = 0.9
_MOST_ALIASES: Final = 3


@dataclass(frozen=True)
class PeriodicError:
    """A joint's residual that repeats."""

    joint: int  #: Number of the joint, from 1.
    periods: int  #: In a turn of the joint.
    amplitude: float  #: Of the sine [rad].
    share: float  #: Of the squared residuals that it explains.
    chance: float  #: Probability that noise alone shows one as strong anywhere.
    #: Other numbers of periods that look nearly the same at the positions that were measured, the nearest first.
    aliases: tuple[int, ...] = ()

    @property
    def words(self) -> str:
        """What it is, in words."""
        also = f" ({listed([str(n) for n in self.aliases])} would look the same)" if self.aliases else ""
        return (
            f"joint {self.joint} {self.periods} times in a turn{also}, "
            f"by {np.rad2deg(self.amplitude) * 1e3:.1f} millidegrees"
        )


@dataclass(frozen=True, eq=False)
class Pulls:
    """What residuals say of errors of the joints, summed over the readings of each configuration."""

    joints: Array  #: Positions of the joints [rad or m], ``(n, joints)``.
    #: pull, weight: j'r [m^2] and J'J [m^2], J the derivative by the joints, ``(n, joints)`` and ``(n, joints,
    #: joints)``.
    pull: Array
    weight: Array
    total: float  #: Sum of the squared residuals [m^2].
    free: int  #: Equations beyond the parameters: targets of a configuration share its errors, and count as one.


def periodic_errors(
    fit: Fit, data: Dataset, most: int = 1, chance: float = LARGEST_CHANCE
) -> tuple[PeriodicError, ...]:
    """Return the periodic errors of joints that the robot file does not describe.

    Args:
        fit: What is left over is seen from it.
        data: The readings it is held against; fewer than 60 configurations say nothing.
        most: How many a joint may have, see :func:`lines_of`.
        chance: How many as strong as the weakest chance would show, at most.
    """
    problem = Problem(fit.robot, data, FreeParameters(()), dict(fit.sigma))
    pulls = pulls_of(problem.at(np.zeros(0)), fit.joint_error, fit.spent)
    return () if pulls is None else lines_of(fit.robot, pulls, most, chance)


def pulls_of(here: Evaluation, joint_error: Array, spent: float, larger: Array | None = None) -> Pulls | None:
    """Return what the positions of a problem say of errors of the joints; None where too few were read.

    Args:
        joint_error: Deviation of the error of each joint that the readings of a visit share [rad or m], ``(joints,)``.
        spent: How many equations' worth of residual the fit used up.
        larger: By how much the deviation of each equation is larger than the one that it is divided by, ``(rows,)``.
    """
    problem, data = here.problem, here.problem.data
    compared = [
        (np.arange(place.start, place.stop), np.repeat(data.configuration[block.readings], 3))
        for block, place in problem.placed
        if block.data is data and block.observation.name == "position"
    ]
    if data.configurations < LEAST_CONFIGURATIONS or not compared:
        return None
    rows, configuration = (np.concatenate(part) for part in zip(*compared, strict=True))
    G, r = here.by_joints[rows], here.residual[rows]
    if larger is not None:
        G, r = G / larger[rows, None], r / larger[rows]
    if joint_error.any():
        visits = np.unique(problem.visits[rows], return_inverse=True)[1].reshape(-1)
        whitening = Whitening(Visits(visits), G * joint_error)
        G, r = whitening.applied(G), whitening.applied(r)
    count = G.shape[1]
    pull, weight = np.zeros((data.configurations, count)), np.zeros((data.configurations, count, count))
    np.add.at(pull, configuration, -G * r[:, None])
    np.add.at(weight, configuration, G[:, :, None] * G[:, None, :])
    return Pulls(data.joints, pull, weight, float(r @ r), max(len(r) - round(spent), 1))


def lines_of(
    robot: Robot, pulls: Pulls, most: int = 1, largest_chance: float = LARGEST_CHANCE
) -> tuple[PeriodicError, ...]:
    """Return the periodic errors of a robot's joints that it does not know, the strongest of a joint first.

    Fewer than 60 configurations say nothing.

    Args:
        most: How many a joint may have, those that the robot knows included: with 1, joints whose gear it knows are
            left alone. Of a joint that may have more, those that it knows are taken out of the pulls, and others are
            looked for where its range tells them from these.
        largest_chance: How many as strong as the weakest chance would show, at most.
    """
    if len(pulls.joints) < LEAST_CONFIGURATIONS:
        return ()
    q, weight = pulls.joints, pulls.weight
    taken = {
        i: list(joint.periods)
        for i, joint in enumerate(robot.joints)
        if joint.kind == "revolute" and len(joint.periods) < most
    }
    errors: list[PeriodicError] = []
    while open_joints := [i for i, periods in taken.items() if len(periods) < most]:
        pull, total, free = _left(pulls, taken)
        noise = total / max(free, 1)
        tried = [(*_strongest(q[:, i], pull[:, i], weight[:, i, i], noise, taken[i]), i) for i in open_joints]
        explained, periods, a, b, joint = max(tried)
        agreement = min(free * explained / total, _agreement(periods * q[:, joint], pull[:, joint]))
        chance = len(open_joints) * len(_PERIODS) * math.exp(-0.5 * agreement)
        if chance >= largest_chance:
            break
        wave = a * np.sin(periods * q[:, joint]) + b * np.cos(periods * q[:, joint])
        aliases = _aliases(q[:, joint], wave, weight[:, joint, joint], periods)
        errors.append(PeriodicError(joint + 1, periods, math.hypot(a, b), explained / total, chance, aliases))
        taken[joint].append(periods)
    return tuple(sorted(errors, key=lambda error: error.joint))


def _left(pulls: Pulls, taken: Mapping[int, Sequence[int]]) -> tuple[Array, float, int]:
    """Return what the best sines of some numbers of periods leave of pulls, of the sum and of the equations.

    Args:
        taken: Numbers of periods by joint, from 0.
    """
    lines = [(i, k) for i, periods in taken.items() for k in periods]
    if not lines:
        return pulls.pull, pulls.total, pulls.free
    joint = np.repeat([i for i, _ in lines], 2)
    angles = np.stack([k * pulls.joints[:, i] for i, k in lines])
    waves = np.stack([np.sin(angles), np.cos(angles)], axis=1).reshape(2 * len(lines), -1)
    seen = np.einsum("an,bn,nab->ab", waves, waves, pulls.weight[:, joint[:, None], joint])
    told = np.einsum("an,na->a", waves, pulls.pull[:, joint])
    amounts = np.linalg.lstsq(seen, told, rcond=1e-10)[0]
    pull = pulls.pull - np.einsum("a,an,nja->nj", amounts, waves, pulls.weight[:, :, joint])
    left = max(pulls.total - float(amounts @ told), 1e-9 * pulls.total)  # rounding must not make it negative
    return pull, left, pulls.free - len(waves)


def _strongest(
    q: Array, pull: Array, weight: Array, noise: float, taken: Sequence[int]
) -> tuple[float, int, float, float]:
    """Return what the best sine explains of the squared residuals [m^2], its periods, and its two amplitudes [rad].

    It explains nothing where the readings see none.

    Args:
        q: Positions of the joint [rad], ``(n,)``.
        pull, weight: J'r [m^2] and J'J [m^2] of the joint, ``(n,)``.
        noise: Variance of a coordinate of the residuals [m^2].
        taken: Numbers of periods that are taken out, whose neighbours say nothing new.
    """
    among = _PERIODS
    explained, a, b, least = _sines(q, pull, weight, among)
    passed = among * math.sqrt(12.0) * q.std() / (2.0 * math.pi)  # of a range that is passed through evenly
    seen = (least * _LARGEST_DEVIATION**2 > noise) & (passed > _LEAST_PERIODS)
    for periods in taken:
        seen &= np.abs(among - periods) > _near(q)
    explained = np.where(seen, explained, 0.0)
    best = int(np.argmax(explained))
    return float(explained[best]), int(among[best]), float(a[best]), float(b[best])


def _near(q: Array) -> int:
    """Return how far apart numbers of periods are, at most, that the range of a joint ``(n,)`` [rad] does not tell."""
    return math.ceil(2.0 * math.pi / max(float(np.ptp(q)), 1e-3))


def _sines(q: Array, pull: Array, weight: Array, periods: NDArray[np.intp]) -> tuple[Array, Array, Array, Array]:
    """Return what a sine of each number of periods explains [m^2], its two amplitudes [rad], and what is known of it.

    The last is that of the phase that is known least [m^2]; where it is nothing, nothing is explained.
    """
    angle = periods[:, None] * q
    s, c = np.sin(angle), np.cos(angle)
    ss, sc, cc = (s * s) @ weight, (s * c) @ weight, (c * c) @ weight
    ys, yc = s @ pull, c @ pull
    least = 0.5 * (ss + cc) - np.hypot(0.5 * (ss - cc), sc)
    known = least > 1e-9 * (ss + cc)
    safe = np.where(known, ss * cc - sc * sc, 1.0)
    a, b = (cc * ys - sc * yc) / safe, (ss * yc - sc * ys) / safe
    return np.where(known, a * ys + b * yc, 0.0), a, b, least


def _aliases(q: Array, wave: Array, weight: Array, periods: int) -> tuple[int, ...]:
    """Return other numbers of periods whose sines pass through nearly the same values at the positions measured.

    Args:
        wave: What was found, ``(n,)``.
        periods: In a turn; its neighbours, which the range of the joint does not tell from it, are not others.
    """
    explained = _sines(q, weight * wave, weight, _ALIASES)[0] / float(weight @ wave**2)
    places = np.flatnonzero((explained >= _SAME_WAVE) & (np.abs(_ALIASES - periods) > _near(q)))
    likest = np.argsort(-explained[places].round(6), kind="stable")  # of those that are the same the fewest periods
    return tuple(_ALIASES[places[likest][:_MOST_ALIASES]].tolist())


def _agreement(angle: Array, pull: Array) -> float:
    """Return how far the pulls of all configurations agree on one sine, chi squared of two degrees by chance.

    It takes the size of every pull as it is (White 1980, "A heteroskedasticity-consistent covariance matrix estimator
    and a direct test for heteroskedasticity"). What a model cannot follow, the sag of a stretched arm for example, is
    large at some configurations: a few of these agree on a sine far sooner than noise of one size does.
    """
    waves = np.stack([np.sin(angle), np.cos(angle)]) * pull
    total = waves.sum(axis=1)
    return float(total @ np.linalg.lstsq(waves @ waves.T, total, rcond=1e-10)[0])


TRANSMISSION_ERROR: Final = Rule("transmission-error", "warning", "residuals repeat with a joint's angle")


def check_transmission(fit: Fit, data: Dataset) -> list[Notice]:
    """Return a notice if some joints err periodically."""
    errors = periodic_errors(fit, data)
    if not errors:
        return []
    words = "; ".join(error.words for error in errors)
    return [
        TRANSMISSION_ERROR(
            f"What is left over repeats with the joints' angles: {words}. Strain wave gears do that, twice in a turn "
            "of their wave generator. `model=auto` takes the error out; any other model does with the effect "
            "transmission-error, and transmission_periods of these joints in the robot file."
        )
    ]
