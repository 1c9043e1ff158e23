"""The LR Mate of Nubiola's chapter 4 with its device: an invented truth, the document's identification, a judgement."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.identification.hexapod.campaign import touching
from truearm.identification.solving.problem import Problem
from truearm.identification.solving.solver import solve
from truearm.library import load_robot
from truearm.measurement.dataset import Dataset
from truearm.measurement.hexapod.geometry import DEVICE
from truearm.measurement.hexapod.world_frame import WorldFrame, world_frame
from truearm.modeling.chain import Array
from truearm.modeling.inverse.branches import BRANCHES, branch_rule
from truearm.modeling.parameters import FreeParameters
from truearm.modeling.postures import Postures
from truearm.modeling.robot import Robot
from truearm.modeling.transform import Transform, rotation_from_quaternion, rotation_vector
from truearm.planning.constraints.constraints import Constraints, allowed
from truearm.planning.hexapod.tool import with_cups
from truearm.simulation.twin import Twin
from truearm.simulation.twin_joint import JointTruth
from truearm.validation.pair_distances import PairDistances, pair_distances

TARGETS: Final = ("1", "2", "3")
#: The cup that touches those of the base.
TOUCHING: Final = TARGETS[0]
#: The base fixture beside the robot, leaning 17 deg on its pivot; the document does not print where it stood. Of a
#: thousand places this one has as many poses and configurations as the document's.
FIXTURE: Final = Transform.from_matrix(
    rotation_from_quaternion(np.array([0.757633, -0.113205, 0.095004, 0.635729])), np.array([0.059, 0.233, 0.246])
)
#: What the document calls front/up and back/down. Its elbow is up or down as seen from the wrist's side; in both of
#: these it is above the line from shoulder to wrist, and below it the arm would meet the table.
FRONT_UP: Final = "front-up"
BACK_DOWN: Final = "back-up"
#: 300 mm from the three base cups and above them, in the fixture's frame [m].
REFERENCE: Final = DEVICE.base * np.array([1 / 2, math.sqrt(3) / 6, math.sqrt(2 / 3)])
#: The parameters of Table 4.1 without d 3, which is redundant.
NAMES: Final = (
    *(f"{kind}_{i}" for i in range(2, 7) for kind in ("alpha", "a", "theta_offset", "d") if (kind, i) != ("d", 3)),
    *(f"compliance_{i}" for i in range(2, 7)),
)

#: Where the arm may be for validation: clear of the table and of itself.
_ALLOWED: Final = Constraints.model_validate(
    {"truearm": "truearm-constraints/1", "units": {"length": "mm", "angle": "deg"}, "floor": 50, "clearance": 100}
)
#: What no model here contains, all invented: amplitude of a sine of each gear [rad] and how often in a turn, full
#: backlash [rad], tilt of the bearings of joints 1 to 4 per moment [rad/(N m)], and the share by which a joint is
#: stiffer per square of the moment [1/(N m)^2].
_GEAR: Final = math.radians(0.007)
_SINES: Final = (1, 2)
_BACKLASH: Final = math.radians(0.004)
_BEARING: Final = 3e-6
_HARDENING: Final = 1e-4
#: Standard deviations of what is drawn for another robot: lengths [m], twists and joint zeros [rad].
_LENGTHS: Final = 0.15e-3
_TWISTS: Final = math.radians(0.011)
_ZEROS: Final = math.radians(0.09)


def nominal_robot() -> tuple[Robot, Array]:
    """Return the nominal LR Mate with its tool, and the tool's cups in the flange frame [m], ``(3, 3)``."""
    return with_cups(load_robot("lrmate200ic"))


def invented_twin(robot: Robot) -> Twin:
    """Return the twin with the truth of the robot file, and what no model contains."""
    truth = robot.truths["invented"]
    return _twin(robot.with_values(truth.values), [truth.compliance.get(i, 0.0) for i in range(1, 7)], 0)


def drawn_twin(robot: Robot, seed: int) -> Twin:
    """Return another twin of the same kind: errors of the same size, half to one and a half times as compliant."""
    rng = np.random.default_rng([2, seed])
    sizes = {"a": _LENGTHS, "d": _LENGTHS, "alpha": _TWISTS, "beta": _TWISTS, "theta_offset": _ZEROS}
    truth = robot.truths["invented"]
    values = {
        name: robot.values[name] + sizes[name.rpartition("_")[0]] * float(rng.standard_normal())
        for name in truth.values
    }
    compliance = [truth.compliance.get(i, 0.0) * float(rng.uniform(0.5, 1.5)) for i in range(1, 7)]
    return _twin(robot.with_values(values), compliance, seed + 1)


def _twin(true: Robot, compliance: list[float], seed: int) -> Twin:
    rng = np.random.default_rng([1, seed])
    joints = {
        number: JointTruth(
            compliance=of_joint,
            cubic=-_HARDENING * of_joint,
            backlash=_BACKLASH,
            bearing=_BEARING if number <= 4 else 0.0,
            gear=tuple((k, _GEAR * float(rng.normal()), float(rng.uniform(0.0, 2 * math.pi))) for k in _SINES),
        )
        for number, of_joint in enumerate(compliance, 1)
    }
    return Twin(true, joints)


def touches(robot: Robot) -> Array:
    """Return the joint readings with which the nominal robot brings a cup to those of the base, tool downwards."""
    down = FIXTURE.rotation @ np.diag([1.0, -1.0, -1.0])
    return touching(robot, TOUCHING, FIXTURE, DEVICE.base, down)


# -- the document's identification -------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Cups:
    """The base fixture as robot and ballbar know it.

    Attributes
    ----------
    touches
        Joint readings at its cups [rad], ``(3, joints)``.
    sides
        Measured distances 12, 23, 31 [m], ``(3,)``.
    corrected
        Whether the distances count, or only the points (section 4.2).
    """

    touches: Array
    sides: Array
    corrected: bool = True

    def frame_by(self, robot: Robot) -> WorldFrame:
        """Return the fixture's frame in the world of a model."""
        return world_frame(robot.world_poses(self.touches, TOUCHING)[0], self.sides)

    def placed(self, robot: Robot) -> Robot:
        """Return the robot standing in the fixture's frame, where its own model finds the cups."""
        found = self.frame_by(robot)
        return standing_in(robot, found.frame if self.corrected else found.plain)


def standing_in(robot: Robot, frame: Transform) -> Robot:
    """Return the robot with `frame`, which is given in its world, as its world."""
    R = frame.rotation.T
    base = robot.base
    there = Transform.from_matrix(R @ base.rotation, R @ (np.array(base.translation) - np.array(frame.translation)))
    places = {f"base_{axis}": value for axis, value in zip("xyz", there.translation, strict=True)}
    turns = {f"base_r{axis}": 0.0 for axis in "xyz"}
    return replace(robot, base_quaternion=there.quaternion).with_values(places | turns)


def identified_as_printed(robot: Robot, by: Robot, data: Dataset, cups: Cups) -> Robot:
    """Return the robot with the 24 parameters of Table 4.1 by least squares (4.15 to 4.17).

    Base and cups of the tool are not identified. The base stands where the model `by` finds the cups of the fixture;
    afterwards it stands where the identified model finds them.

    Parameters
    ----------
    robot
        The nominal robot, where the parameters start.
    by
        The model that is current before.
    data
        Cups of the tool in the fixture's frame.
    cups
        Of the base fixture.
    """
    elastic = robot.with_effects(("compliance",))
    base = cups.placed(by)
    places = {f"base_{axis}": base.values[f"base_{axis}"] for axis in "xyz"}
    start = replace(elastic, base_quaternion=base.base_quaternion).with_values(places)
    for _ in range(2):  # the second time with the loads of the solution of the first
        free = FreeParameters(tuple(start.parameters[name] for name in NAMES))
        found = solve(Problem(start, data, free, {"position": DEVICE.sigma}, priors=False), "linear", None)
        start = start.with_values(dict(zip(NAMES, map(float, found.vector), strict=True)))
    return cups.placed(start)


# -- validation --------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Unseen:
    """Where a twin truly is at configurations that no calibration saw, in its own world.

    Attributes
    ----------
    joints
        ``(n, joints)`` [rad].
    cup
        Which cup of the tool is looked at, a third of the configurations each, ``(n,)``.
    position
        Of that cup [m], ``(n, 3)``.
    rotation
        Of the flange, ``(n, 3, 3)``.
    front_up
        Whether the nominal arm is front/up there, ``(n,)``.
    """

    joints: Array
    cup: NDArray[np.intp]
    position: Array
    rotation: Array
    front_up: NDArray[np.bool_]

    def seen_from(self, frame: Transform) -> Unseen:
        """Return the same in another frame, which is given in the world."""
        position = (self.position - np.array(frame.translation)) @ frame.rotation
        return replace(self, position=position, rotation=frame.rotation.T @ self.rotation)

    @property
    def away(self) -> Array:
        """Distance of the cup from the reference point, for what is seen from the fixture [m], ``(n,)``."""
        return np.asarray(np.linalg.norm(self.position - REFERENCE, axis=1))


def allowed_configurations(robot: Robot, count: int, rng: np.random.Generator) -> Array:
    """Return configurations drawn within the limits, clear of the table and of the arm itself, ``(count, joints)``."""
    found: list[Array] = []
    while sum(map(len, found)) < count:
        q = robot.random_configurations(4 * count, rng)
        kept = allowed(robot, Postures(q), _ALLOWED, "validation", seen_from_the_origin=True)
        found.append(q[np.all(list(kept.values()), axis=0)])
    return np.concatenate(found)[:count]


def unseen(robot: Robot, twin: Twin, joints: Array) -> Unseen:
    """Measure a twin without noise; `robot` is the nominal one."""
    frames = np.array([[posture.targets[name] for name in TARGETS] for posture in twin.postures(joints)])
    cup: NDArray[np.intp] = np.arange(len(joints), dtype=np.intp) % 3
    rule = branch_rule(robot)
    if rule is None:
        raise ValueError("the branches of this robot have no names")
    wanted = [number for number, name in enumerate(BRANCHES) if name.startswith(FRONT_UP)]
    return Unseen(
        joints=joints,
        cup=cup,
        position=frames[np.arange(len(joints)), cup, :3, 3],
        rotation=frames[:, 0, :3, :3],
        front_up=np.isin(rule.numbers(robot.forward_kinematics(joints)), wanted),
    )


@dataclass(frozen=True, eq=False)
class Judgement:
    """Errors of a model at unseen configurations.

    Attributes
    ----------
    position
        [m], ``(n,)``.
    orientation
        [rad], ``(n,)``.
    pairs, pairs_front_up
        Of distances between any two, predicted minus true, and where both are front/up.
    """

    position: Array
    orientation: Array
    pairs: PairDistances
    pairs_front_up: PairDistances


def judged(model: Robot, truth: Unseen) -> Judgement:
    """Compare a model with what a twin does, both in the same frame."""
    at = model.loaded(truth.joints)
    predicted = _predicted(model, at, truth)
    turned = model.world_poses(at)[1] @ np.swapaxes(truth.rotation, 1, 2)
    front = truth.front_up
    return Judgement(
        position=np.linalg.norm(predicted - truth.position, axis=1),
        orientation=np.linalg.norm(rotation_vector(turned), axis=1),
        pairs=pair_distances(predicted, truth.position),
        pairs_front_up=pair_distances(predicted[front], truth.position[front]),
    )


def mean_position_error(model: Robot, truth: Unseen) -> float:
    """Return the mean position error alone [m]."""
    predicted = _predicted(model, model.loaded(truth.joints), truth)
    return float(np.linalg.norm(predicted - truth.position, axis=1).mean())


def _predicted(model: Robot, at: Postures, truth: Unseen) -> Array:
    """Return where a model says the cup that is looked at is [m], ``(n, 3)``."""
    places = np.array([model.world_poses(at, name)[0] for name in TARGETS])
    return np.asarray(places[truth.cup, np.arange(len(truth.cup))])
