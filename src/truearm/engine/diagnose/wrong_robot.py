"""Can what was fitted be this robot: the rules behind the status ``implausible`` and behind ``wrong-robot``.

A fit converges on anything. Readings that have nothing to do with the robot leave it at its nominal values, with
residuals as large as the arm; readings in a wrong unit bend it into another robot that agrees with them to the last
hundredth of a millimetre. So both are looked at, what is left and how far the robot moved. The limits are an order of
magnitude beyond what robots do: calibrated ones leave less than 0.1 % of their reach, and parameters drawn at three
times their priors have moved by 3 of them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError, Notice, Rule, listed
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.observations import OBSERVATIONS
from truearm.engine.data.statistics import errors_of
from truearm.engine.diagnose.unmodelled import LeftOver, chi_squared_tail
from truearm.engine.fit.fit import Fit, place
from truearm.engine.fit.frames import errors_of_placed
from truearm.engine.fit.likelihood import Visits, Whitening
from truearm.engine.fit.models import FRAMES
from truearm.engine.fit.problem import Problem
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import library, load_robot
from truearm.engine.robot.parameters import SCALE, FreeParameters, Parameter
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform, rigid_motion

#: Share of the reach that half of the readings may be off by at most.
LARGEST_SHARE_LEFT: Final = 0.01
#: Angle that half of the measured orientations may be off by at most [rad].
LARGEST_ANGLE_LEFT: Final = 0.1
#: Deviations declared of orientations that are allowed beside it: half of such angles are below 1.5.
_NOISE: Final = 2.0
#: How far the geometry may have moved, as a root mean square over its free parameters [priors].
LARGEST_MOVE: Final = 5.0
#: How far a joint zero may have moved [rad]: marks are missed by a tooth of the gear, never by a quarter of a turn.
LARGEST_ZERO: Final = math.radians(30.0)
#: Prior deviations over the one that the readings leave, of a direction that these see.
_SEEN: Final = 1.0
#: Deviations by which a parameter may be where it is without having moved.
_UNKNOWN: Final = 2.0

#: Codes of faults that make a fit implausible, the most decisive first.
CAUSES: Final = (
    "unit-length",
    "unit-angle",
    "mirrored",
    "joint-sign",
    "rows-shifted",
    "rows-unrelated",
    "orientation-order",
    "fixtures-unlikely",
    "targets-swapped",
    "target-mistaken",
    "joints-mistaken",
    "wrong-robot",
)


def implausible(fit: Fit, data: Dataset) -> str | None:
    """Return in words why a fit cannot be this robot, None if it can.

    Args:
        data: The readings it was made from.
    """
    errors, robot = errors_of(fit.robot, data), fit.robot
    left, reach = _left_of_reach(fit, data)
    if left > LARGEST_SHARE_LEFT * reach:
        return (
            f"half of the readings are off by more than {left * 1e3:.3g} mm, {left / reach:.2g} of the "
            f"{reach * 1e3:.0f} mm that the arm reaches (allowed: {LARGEST_SHARE_LEFT:g})"
        )
    turned = float(np.median(errors.orientation_norms)) if len(errors.orientation_norms) else 0.0
    allowed = LARGEST_ANGLE_LEFT
    if data.sigma_rot is not None and np.isfinite(data.sigma_rot[data.has_orientation]).any():
        allowed += _NOISE * float(np.nanmedian(data.sigma_rot[data.has_orientation]))
    if turned > allowed:
        return (
            f"half of the orientations are off by more than {math.degrees(turned):.3g} deg (allowed: "
            f"{math.degrees(allowed):.2g})"
        )
    size = _geometry_moved(fit, data)
    if size > LARGEST_MOVE:
        return (
            f"its geometry moved by {size:.2g} standard deviations of its priors, as a root mean square (allowed: "
            f"{LARGEST_MOVE:g})"
        )
    zeros = {}
    for name in fit.free.names:
        p = robot.parameters[name]
        if p.group == "joint zero" and p.unit == "rad":
            zeros[name] = abs(p.value - p.nominal) - _UNKNOWN * (p.deviation or 0.0)
    farthest = max(zeros, key=lambda name: zeros[name], default=None)
    if farthest is not None and zeros[farthest] > LARGEST_ZERO:
        return (
            f"{farthest} moved by {math.degrees(zeros[farthest]):.3g} deg (allowed: {math.degrees(LARGEST_ZERO):.2g})"
        )
    return None


def _left_of_reach(fit: Fit, data: Dataset) -> tuple[float, float]:
    """Return by how much half of the readings are off at least, and how far the arm reaches there [m]."""
    errors = errors_of(fit.robot, data)
    lengths = np.concatenate([errors.position_norms, errors.length_norms])
    flange = fit.start.with_frames(Transform(), {}).world_poses(data.postures)[0]
    return float(np.median(lengths)) if len(lengths) else 0.0, float(np.linalg.norm(flange, axis=1).max(initial=0.0))


def _geometry_moved(fit: Fit, data: Dataset) -> float:
    """Return how far the geometry moved, as a root mean square over its free parameters [priors].

    Of all robots that the readings cannot tell from the one found, that one counts whose geometry moved least: what
    moves along a direction that they do not see costs nothing, nor do base, targets and joint zeros. An arm that was
    never mastered has its zeros in a twist as well, if its convention lets them be there.
    """
    own = np.array([p.group == "geometry" for p in fit.free.parameters], dtype=bool)
    if not own.any():
        return 0.0
    values = np.array([fit.robot.values[name] for name in fit.free.names])
    moves = (values - fit.free.nominal) / fit.free.prior
    if np.sqrt(np.mean(moves[own] ** 2)) <= LARGEST_MOVE:
        return 0.0
    left = LeftOver.of(fit, data)
    seen = left.turns[left.strength > _SEEN]
    unseen = np.linalg.svd(seen, full_matrices=True)[2][len(seen) :].T
    least = moves[own] - unseen[own] @ np.linalg.lstsq(unseen[own], moves[own], rcond=1e-10)[0]
    return float(np.sqrt(np.mean(least**2)))


IMPLAUSIBLE: Final = Rule(
    "implausible", "error", "a robust fit that [cannot be this robot](results.md#status-and-warnings)"
)


def check_plausible(fit: Fit, data: Dataset, others: Iterable[str] = ()) -> list[Notice]:
    """Return a notice if a fit cannot be this robot.

    Args:
        others: Codes of what else was noticed: the cause is looked for there.
    """
    why = implausible(fit, data)
    if why is None:
        return []
    codes = {*others}
    cause = next((code for code in CAUSES if code in codes), None)
    cure = (
        "Check that it is this robot, and units, joint order, signs, zeros and targets of the data."
        if cause is None
        else f"The cause is most likely what {cause} says; fix that and calibrate again."
    )
    return [IMPLAUSIBLE(f"What was fitted cannot be this robot: {why}. {cure}")]


# Are the lengths that a fit found those of this robot: the rule behind `wrong-robot`.
#
# Robots of one make look alike and fit each other's readings after a calibration. What gives them away is how far the
# lengths had to go. Where parallel axes follow each other only the sum of their distances is determined, and each of
# them goes but a part of the way, within its own prior. So the combinations that the readings determine are judged:
# under the priors the squares of their deviations are chi squared.
#
# Angles are left out of account, for a robot that was mastered badly is a degree off and the same robot. Their priors
# are taken ten times as wide, so that what they do cannot pass for lengths.

WRONG_ROBOT: Final = Rule(
    "wrong-robot",
    "error",
    "lengths that [are another robot's](results.md#is-it-this-robot), or a robot of the library that fits where a "
    "data-entry error would explain it too",
)
LENGTHS_SCALED: Final = Rule(
    "lengths-scaled",
    "error",
    "all lengths of the robot came out too long, or too short, by one factor, four times farther than its priors let "
    "expect: a length in the measurement is wrong (the instrument's scale, the distance between sockets or spheres, "
    "the squares of a board)",
)
#: Deviations from which all lengths have grown together, and share of their growth that readings must see.
_GROWN: Final = 4.0
_LEAST_SEEN: Final = 0.25
#: Share of the prior variance that the readings must remove from a combination of lengths for it to count.
_LEAST_INFORMED: Final = 0.9
#: How much wider than they are the priors of all but lengths are taken.
_WIDER: Final = 10.0
#: Groups whose nominal values are in the table of the robot file.
_TABLE: Final = ("joint zero", "geometry")
#: Chance for a robot as good as its priors to be doubted.
_SIGNIFICANT: Final = 1e-4
#: Deviations of a combination from which it is named, after the first, and how many are.
_NAMED: Final = 3.0
_MOST_NAMED: Final = 3
#: Share of a length in what is determined of it below which that says nothing of it, and of the largest coefficient
#: below which a length is not named.
_LEAST_SHARE: Final = 0.1
#: Cosine between combinations from which they are the same.
_SAME: Final = 0.8
#: Configurations that robots of the library are compared on, and how many times better one must fit to be named.
_COMPARED: Final = 60
_SEVERAL_TIMES: Final = 2.0
#: Robots of the library that are compared on readings that say nothing of where the robot stands.
_MOST_COMPARED: Final = 10


@dataclass(frozen=True, eq=False)
class Lengths:
    """How far the lengths of a robot moved along the combinations that readings determine."""

    parameters: tuple[Parameter, ...]  #: The lengths.
    directions: Array  #: Orthonormal combinations in priors, ``(combinations, lengths)``.
    moved: Array  #: How far along each [priors], ``(combinations,)``.

    @classmethod
    def of(cls, fit: Fit, data: Dataset) -> Lengths:
        """Find them for a fit and the readings it was made from.

        The fit is taken one linear step further, to where the priors of all but lengths are wider. Parameters that it
        held for being redundant are free again, those at a bound stay. Readings of a visit share errors of the joints.
        """
        robot = fit.robot
        names = [n for n in (*fit.free.names, *(r.dropped for r in fit.redundancies)) if n not in fit.at_bound]
        order = [*robot.parameters]
        names.sort(key=lambda name: (_is_length(robot.parameters[name]), order.index(name)))
        free = FreeParameters(tuple(robot.parameters[name] for name in names))
        lengths = tuple(p for p in free.parameters if _is_length(p))
        if not lengths:
            return cls((), np.zeros((0, 0)), np.zeros(0))
        noise = {observation.name: fit.sigma.get(observation.name, 1.0) for observation in OBSERVATIONS}
        problem = Problem(robot, data, free, noise)
        weight = np.sqrt(np.concatenate([_weights(fit, problem, i) for i in range(len(problem.blocks))])) / fit.excess
        count = len(lengths)
        # What is known of an instrument's scale is known of lengths.
        wider = [not _is_length(p) and p.name != SCALE for p in free.parameters]
        prior = free.prior * np.where(wider, _WIDER, 1.0)
        # The controller computes with the table of the robot file, whatever earlier calibrations have found.
        table = replace(robot, known={}).parameters
        centre = [table[p.name].nominal if p.group in _TABLE else p.value for p in free.parameters]
        triangle = np.column_stack([np.eye(len(names)), np.zeros(len(names))])
        evaluation = problem.at(free.start)
        shared = evaluation.by_joints * (weight[:, None] * fit.joint_error)
        whitening = Whitening(Visits(problem.visits), shared)
        for rows, part in evaluation.portions():
            J = part.jacobian * (weight[rows, None] * prior)
            wanted = J @ ((free.start - centre) / prior) - part.residual * weight[rows]
            J, wanted = (whitening.of(rows).applied(each) for each in (J, wanted))
            triangle = np.asarray(np.linalg.qr(np.block([[J, wanted[:, None]], [triangle]]), mode="r"))
        own = slice(len(names) - count, len(names))
        U, s, Vt = np.linalg.svd(triangle[own, own])
        known = 1.0 - 1.0 / s**2 >= _LEAST_INFORMED
        return cls(lengths, Vt[known], (U.T @ triangle[own, len(names)])[known] / s[known])

    @property
    def chi_squared(self) -> float:
        """Sum of the squared deviations."""
        return float(self.moved @ self.moved)

    @property
    def chance(self) -> float:
        """How often the lengths of a robot as good as its priors move as far."""
        return chi_squared_tail(self.chi_squared, len(self.moved)) if len(self.moved) else 1.0

    @property
    def growth(self) -> tuple[float, float]:
        """By what factor less one all lengths grew together, and how many of its deviations that is; 0 if unseen."""
        nominal = np.array([p.nominal / p.prior for p in self.parameters])
        seen = self.directions @ nominal if len(self.moved) else np.zeros(0)
        size = float(seen @ seen)
        if size < _LEAST_SEEN * max(float(nominal @ nominal), 1e-300):
            return 0.0, 0.0
        along = float(seen @ self.moved)
        return along / size, along / math.sqrt(size)

    def named(self) -> list[str]:
        """Return the combinations that moved farthest, in words, with how far.

        Of all that is determined, what lies nearest to each single length is looked at: the length itself, or the sum
        that it is known in.
        """
        if not len(self.moved):
            return []
        together = self.directions.T @ self.directions
        share = np.sqrt(np.diag(together))
        own = together / np.where(share > 0.0, share, 1.0)
        along = np.where(share**2 >= _LEAST_SHARE, self.moved @ self.directions @ own, 0.0)
        named: list[int] = []
        for i in np.argsort(-np.abs(along), kind="stable").tolist():
            if named and (abs(along[i]) < _NAMED or len(named) == _MOST_NAMED):
                break
            if all(abs(own[:, i] @ own[:, k]) < _SAME for k in named):
                named.append(i)
        return [self._in_words(own[:, i], float(along[i])) for i in named]

    def _in_words(self, direction: Array, along: float) -> str:
        """Name a combination of unit length in priors and how far it moved, counted in its largest member."""
        prior = np.array([p.prior for p in self.parameters])
        shares = np.round(np.abs(direction) / np.abs(direction).max(), 2)
        order = np.argsort(-shares, kind="stable").tolist()
        largest, words = order[0], ""
        factors = direction / direction[largest] * prior[largest] / prior
        for i in order:
            if shares[i] < _LEAST_SHARE:
                break
            size = "" if abs(abs(factors[i]) - 1.0) < 0.02 else f"{abs(factors[i]):.2g}·"
            sign = "-" if factors[i] < 0.0 else "+"
            words += f" {sign} {size}{self.parameters[i].name}" if words else f"{size}{self.parameters[i].name}"
        return f"{words} by {along * prior[largest] / direction[largest] * 1e3:+.3g} mm"


def _is_length(p: Parameter) -> bool:
    return p.group == "geometry" and p.unit == "m"


def _weights(fit: Fit, problem: Problem, number: int) -> Array:
    """Return what the loss left of each equation of a block."""
    block = problem.blocks[number]
    of = fit.weight[block.readings] if block.data is problem.data else np.ones(len(block.readings))
    return np.repeat(np.nan_to_num(of), block.observation.components)


def judges_lengths(fit: Fit) -> bool:
    """Return whether a fit had the lengths of the robot to choose."""
    return any(_is_length(p) for p in fit.free.parameters)


def check_robot(fit: Fit, data: Dataset) -> list[Notice]:
    """Return a notice if the lengths that a fit found are not this robot's.

    Args:
        data: The readings it was made from.
    """
    left, reach = _left_of_reach(fit, data)
    if left > LARGEST_SHARE_LEFT * reach:  # lengths of a robot that does not fit are nobody's
        return other_robot(fit.robot, data)
    lengths = Lengths.of(fit, data)
    if lengths.chance >= _SIGNIFICANT:
        return _check_growth(fit.robot, lengths)
    better = _Better.of(fit.robot, data)
    cure = "Take the file of the robot that was measured."
    if implausible(fit, data) is None:
        cure += (
            " If this is the one, enter the lengths that its controller computes with, or wider priors: corrections of "
            "programs are wrong by what the lengths differ."
        )
    growth, deviations = lengths.growth
    if chi_squared_tail(lengths.chi_squared - deviations**2, len(lengths.moved) - 1) >= _SIGNIFICANT:
        cure += (
            f" All its lengths come out {1.0 + growth:.3g} times as long, by one factor: a wrong length in the "
            "measurement does that, too (the scale of the instrument, the distance between sockets or spheres, the "
            "squares of a board)."
        )
    return [
        WRONG_ROBOT(
            f"The readings are not of {fit.robot.name}, by its lengths: {listed(lengths.named())} off nominal. A robot "
            f"as good as its priors is so far off with a probability of {max(lengths.chance, 1e-16):.0e}."
            f"{'' if better is None else better.text} {cure}",
            "error",
        )
    ]


def _check_growth(robot: Robot, lengths: Lengths) -> list[Notice]:
    """Return a notice if all lengths grew by one factor, which a wrong length in the measurement does."""
    growth, deviations = lengths.growth
    if abs(deviations) < _GROWN:
        return []
    way = f"{abs(growth) * 100:.2g} % too {'long' if growth > 0.0 else 'short'}"
    return [
        LENGTHS_SCALED(
            f"All lengths of {robot.name} come out {way}, by one factor: {abs(deviations):.1f} times what its priors "
            "let expect. That is what a wrong length in the measurement does: the scale of the instrument, the "
            "distance between sockets or spheres, the squares of a board, units. Measure that again. What is expected "
            "of the robot takes it as right.",
            "error",
        )
    ]


def other_robot(robot: Robot, data: Dataset) -> list[Notice]:
    """Return a notice if a robot of the library fits readings that are nothing like this one's.

    What looks like another unit or sign may be another robot: a smaller arm of the same make reads as this one in
    another unit.
    """
    better = _Better.of(robot, data)
    if better is None:
        return []
    return [
        WRONG_ROBOT(
            f"The readings are not of {robot.name}.{better.text} Take the file of the robot that was measured.", "error"
        )
    ]


@dataclass(frozen=True)
class _Better:
    """A robot of the library that fits readings, several times better than the one given, neither calibrated.

    Errors are root mean squares [m], `given` that of the robot given.
    """

    name: str
    left: float
    own_error: float

    @classmethod
    def of(cls, robot: Robot, data: Dataset) -> _Better | None:
        """Compare the robots of the library with as many joints, of the same kinds, on some of the readings."""
        few = data
        if data.configurations > _COMPARED:
            few = data.of_configurations(np.linspace(0, data.configurations - 1, _COMPARED).astype(np.intp))
        own_error = _uncalibrated_error(replace(robot, known={}, effect_names=(), proof=None), few)
        kinds = [joint.kind for joint in robot.joints]
        robots = {name: load_robot(name) for name in library()}
        alike = {name: other for name, other in robots.items() if [joint.kind for joint in other.joints] == kinds}
        if not few.anchored:
            alike = _nearest(robot, alike, few.joints)
        elif few.fixture is None:
            alike = _best_placed(alike, few)
        errors = {name: _uncalibrated_error(other, few) for name, other in alike.items()}
        best = min(errors, key=lambda name: errors[name], default=None)
        if best is None or not errors[best] * _SEVERAL_TIMES <= own_error < math.inf:
            return None
        reach = float(np.linalg.norm(alike[best].forward(few.joints)[0], axis=1).max())
        return cls(best, errors[best], own_error) if errors[best] <= LARGEST_SHARE_LEFT * reach else None

    @property
    def text(self) -> str:
        """Say it, as a sentence that goes on."""
        return (
            f" {self.name} of the library fits them {self.own_error / self.left:.2g} times better without calibration: "
            f"{self.left * 1e3:.3g} mm beside {self.own_error * 1e3:.3g} mm (root mean square)."
        )


def _nearest(robot: Robot, others: dict[str, Robot], joints: Array) -> dict[str, Robot]:
    """Return the robots whose flanges go the ways most like those of `robot`, wherever they stand.

    Readings that say nothing of where a robot stands take a second or so for each that is nothing like it.
    """
    places = robot.forward(joints)[0]
    away = {}
    for name, other in others.items():
        points = other.forward(joints)[0]
        rotation, translation = rigid_motion(points, places)
        away[name] = float(np.linalg.norm(points @ rotation.T + translation - places))
    return {name: others[name] for name in sorted(away, key=lambda name: away[name])[:_MOST_COMPARED]}


def _best_placed(others: dict[str, Robot], data: Dataset) -> dict[str, Robot]:
    """Return the robots that leave least where they are placed in closed form, which takes a small part of a fit.

    One that fits several times better than another is never behind ten of those.
    """
    placed = [FRAMES.prepared(other).with_frames(Transform(), {}) for other in others.values()]
    try:
        errors = errors_of_placed(placed, data)
    except InputError:  # frames cannot be found from these readings
        return {}
    left = {name: float(np.linalg.norm(error)) for name, error in zip(others, errors, strict=True)}
    return {name: others[name] for name in sorted(left, key=lambda name: left[name])[:_MOST_COMPARED]}


def _uncalibrated_error(robot: Robot, data: Dataset) -> float:
    """Return the root mean square error of a robot of which base, targets and fixtures alone are fitted [m]."""
    try:
        errors = errors_of(place(robot, data), data)
    except InputError:  # its frames cannot be found from these readings
        return math.inf
    spread = errors.position or errors.length
    return math.inf if spread is None else spread.rms
