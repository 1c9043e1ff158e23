"""Models of the LR Mate compared with what its twin does at configurations that no calibration saw."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from papers.lrmate_hexapod.robot import FRONT_UP, REFERENCE, TARGETS
from truearm.engine.motion.constraints import Constraints, allowed
from truearm.engine.robot.chain import Array
from truearm.engine.robot.inverse.branches import BRANCHES, branch_rule
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform, rotation_vector
from truearm.engine.twin.twin import Twin
from truearm.validation.distances import PairDistances, pair_distances

#: Where the arm may be for validation: clear of the table and of itself.
_ALLOWED: Final = Constraints.model_validate(
    {"truearm": "truearm-constraints/1", "units": {"length": "mm", "angle": "deg"}, "floor": 50, "clearance": 100}
)


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Where a twin is at configurations that no calibration saw, in its own world."""

    joints: Array  #: ``(n, joints)`` [rad].
    cup: NDArray[np.intp]  #: Which cup of the tool is looked at, a third of the configurations each, ``(n,)``.
    position: Array  #: Of that cup [m], ``(n, 3)``.
    rotation: Array  #: Of the flange, ``(n, 3, 3)``.
    front_up: NDArray[np.bool_]  #: Whether the nominal arm is front/up there, ``(n,)``.

    def seen_from(self, frame: Transform) -> HeldOut:
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


def held_out(robot: Robot, twin: Twin, joints: Array) -> HeldOut:
    """Measure a twin without noise; `robot` is the nominal one."""
    frames = np.array([[posture.targets[name] for name in TARGETS] for posture in twin.postures(joints)])
    cup: NDArray[np.intp] = np.arange(len(joints), dtype=np.intp) % 3
    rule = branch_rule(robot)
    if rule is None:
        raise ValueError("the branches of this robot have no names")
    wanted = [number for number, name in enumerate(BRANCHES) if name.startswith(FRONT_UP)]
    return HeldOut(
        joints=joints,
        cup=cup,
        position=frames[np.arange(len(joints)), cup, :3, 3],
        rotation=frames[:, 0, :3, :3],
        front_up=np.isin(rule.numbers(robot.forward_kinematics(joints)), wanted),
    )


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Errors of a model at unseen configurations."""

    position: Array  #: [m], ``(n,)``.
    orientation: Array  #: [rad], ``(n,)``.
    #: pairs, pairs_front_up: of distances between any two, predicted minus true, and where both are front/up.
    pairs: PairDistances
    pairs_front_up: PairDistances

    @property
    def mean(self) -> float:
        """Mean position error [m]."""
        return float(self.position.mean())


def judged(model: Robot, truth: HeldOut) -> Diagnosis:
    """Compare a model with what a twin does, both in the same frame."""
    at = model.loaded(truth.joints)
    predicted = _predicted(model, at, truth)
    turned = model.world_poses(at)[1] @ np.swapaxes(truth.rotation, 1, 2)
    front = truth.front_up
    return Diagnosis(
        position=np.linalg.norm(predicted - truth.position, axis=1),
        orientation=np.linalg.norm(rotation_vector(turned), axis=1),
        pairs=pair_distances(predicted, truth.position),
        pairs_front_up=pair_distances(predicted[front], truth.position[front]),
    )


def mean_position_error(model: Robot, truth: HeldOut) -> float:
    """Return the mean position error alone [m]."""
    predicted = _predicted(model, model.loaded(truth.joints), truth)
    return float(np.linalg.norm(predicted - truth.position, axis=1).mean())


def _predicted(model: Robot, at: Postures, truth: HeldOut) -> Array:
    """Return where a model says the cup that is looked at is [m], ``(n, 3)``."""
    places = np.array([model.world_poses(at, name)[0] for name in TARGETS])
    return np.asarray(places[truth.cup, np.arange(len(truth.cup))])
