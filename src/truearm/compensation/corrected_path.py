"""A planned path as a controller would follow it, and corrected so that the calibrated robot keeps to it.

The controller knows the nominal robot: it turns the path into joint positions with that. The calibrated robot then
goes elsewhere, by its geometry, by what its joints give way under weight, and by what motion adds. The correction is
made in as many steps, so that each part of the error shows (Patel, sections 5.3 and 5.5.1).

A path has a frame. ``base`` is the identified base of the robot, and ``world`` the instrument's frame, in which the
robot was calibrated. ``nominal`` is the base of the controller's robot. Where that is in the real robot no calibration
can know (:mod:`truearm.compensation.gauge`): it is taken to be where both robots agree best, base and flange alike.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from truearm.compensation.fake_targets import nominal_robot
from truearm.compensation.gauge import best_agreement
from truearm.compensation.trajectories import corrected
from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.modeling.loads import has_weight, joint_loads
from truearm.modeling.robot import Robot
from truearm.modeling.transform import IDENTITY, Transform
from truearm.planning.paths.joint_motion import JointMotion, joint_motion
from truearm.planning.paths.path_file import PlannedPath
from truearm.planning.paths.trajectory import Trajectory
from truearm.planning.poses.tip import Tip
from truearm.units import to_si

#: What the tip is called that follows a path.
TIP: Final = "tip"

#: What a correction knows of the robot.
Knowledge = Literal["nothing", "geometry", "deflection", "motion"]
KNOWLEDGE: Final[tuple[Knowledge, ...]] = ("nothing", "geometry", "deflection", "motion")
#: What each stage of the correction is called.
STAGES: Final[Mapping[Knowledge, str]] = {
    "nothing": "without correction",
    "geometry": "geometry corrected",
    "deflection": "and what gives way at rest",
    "motion": "and what motion adds",
}


@dataclass(frozen=True, eq=False)
class CorrectedPath:
    """A path followed by the nominal robot, and corrected for the calibrated one."""

    planned: PlannedPath  #: The path.
    motion: JointMotion  #: What the controller would command: joint positions of the nominal robot.
    #: Joint positions to command, by what the correction knows, ``(n, joints)`` [rad or m]. ``nothing`` are those of
    #: `motion`; ``geometry`` corrects the identified geometry alone, ``deflection`` also how the joints give way at
    #: rest, ``motion`` also what velocities and accelerations add to the loads. What the robot's model does not have is
    #: not there.
    joints: Mapping[Knowledge, Array]
    #: For each of them the distance from the path that the calibrated robot predicts in motion [m], ``(n,)``.
    errors: Mapping[Knowledge, Array]
    #: For each of them where the tip will be, in the frame of the path, ``(n, 3)`` [m].
    tips: Mapping[Knowledge, Array]
    #: Force and moment of the load at every joint in the corrected motion, ``(joints, 6, n)`` [N, N m], as
    #: :func:`truearm.modeling.loads.joint_loads` has them; None for a robot without masses.
    loads: Array | None
    nominal: Robot  #: The robot that the controller knows, with the tip as its target.

    @property
    def best(self) -> Knowledge:
        """What the correction knows that knows most."""
        return [name for name in KNOWLEDGE if name in self.joints][-1]

    @property
    def calibrated(self) -> bool:
        """Whether there is anything to correct."""
        return self.best != "nothing"


def correct_path(robot: Robot, planned: PlannedPath, seed: ArrayLike | None = None) -> CorrectedPath:
    """Return the joint motion along a path, and what corrects it.

    Args:
        robot: Calibrated, with what it carries and what acts on it, which then acts on the tip. For one that is nominal
            there is no correction.
        planned: The path.
        seed: Joint positions ``(joints,)`` [rad or m] near which the motion shall begin; zero if None.

    Raises:
        InputError: If the robot has no such target, cannot follow the path, goes too fast, or cannot be corrected along
            it: with the place on the path.
    """
    try:
        nominal, known = nominal_robot(robot), True
    except InputError:
        nominal, known = replace(robot, effect_names=()), False
    place = _Placed(robot, nominal, planned, known)
    wanted = place.nominal_path
    rotation = place.to_nominal[:3, :3] @ planned.rotation
    motion = joint_motion(
        place.nominal, wanted, target=TIP, orientation=planned.orientation, rotation=rotation, seed=seed
    )
    _check_speeds(robot, motion, planned)
    real = place.real
    desired = _moved(place.to_real, planned.trajectory.position)
    kept = place.to_real[:3, :3] @ planned.rotation
    joints: dict[Knowledge, Array] = {"nothing": motion.joints}
    if known:
        for name, model, moving in _models(real, motion):
            joints[name] = corrected(model, moving, desired, TIP, orientation=planned.orientation, rotation=kept).joints
    tip = Tip(real, TIP)
    found = {name: tip.positions(motion.postures(values)) for name, values in joints.items()}
    back = np.asarray(np.linalg.inv(place.to_real), float)
    best = joints[[name for name in KNOWLEDGE if name in joints][-1]]
    return CorrectedPath(
        planned,
        motion,
        joints,
        {name: np.linalg.norm(at - desired, axis=1) for name, at in found.items()},
        {name: _moved(back, at) for name, at in found.items()},
        _loads(real, motion, best),
        place.nominal,
    )


class _Placed:
    """The path and its tip in the nominal robot, and in the calibrated one."""

    def __init__(self, robot: Robot, nominal: Robot, planned: PlannedPath, known: bool) -> None:
        #: From the frame of the path to the base of the nominal robot, and to that of the calibrated one.
        self.to_nominal: Array = np.eye(4)
        self.to_real: Array = self.to_nominal
        flange: Array = np.eye(4)
        if planned.frame == "world":
            self.to_nominal = self.to_real = np.asarray(np.linalg.inv(robot.base.matrix))
        elif planned.frame == "nominal" and known:
            self.to_real, flange = best_agreement(robot)
        at = _tip(robot, planned)
        if planned.target is None:  # known on the flange of the controller's robot
            on_nominal, on_real = at, flange @ np.append(at, 1.0)
        else:
            on_nominal, on_real = np.linalg.inv(flange) @ np.append(at, 1.0), at
        turned = Transform.from_matrix(flange[:3, :3], on_real[:3])
        self.nominal = nominal.with_frames(IDENTITY, {TIP: on_nominal[:3].tolist()})
        real = robot.with_frames(robot.base, {TIP: turned})
        self.real = real if robot.wrench is None else real.with_wrench(robot.wrench, TIP)
        self.nominal_path = _trajectory(self.to_nominal, planned.trajectory)


def _tip(robot: Robot, planned: PlannedPath) -> Array:
    """Return where what follows the path is on the flange [m]: by its place, or identified."""
    if planned.target is None:
        return np.zeros(3) if planned.tip is None else np.array(planned.tip)
    target = robot.target(planned.target)
    return np.array([robot.values[target.parameter(axis)] for axis in "xyz"])


def _models(robot: Robot, motion: JointMotion) -> list[tuple[Knowledge, Robot, JointMotion]]:
    """Return models that know more and more, with the motion that each sees."""
    still = replace(motion, velocity=np.zeros_like(motion.velocity), acceleration=np.zeros_like(motion.acceleration))
    models: list[tuple[Knowledge, Robot, JointMotion]] = [("geometry", replace(robot, effect_names=()), still)]
    if robot.effects:
        models.append(("deflection", robot, still))
    if any(effect.loaded for effect in robot.effects) and has_weight(robot):  # a force alone needs no motion
        models.append(("motion", robot, motion))
    return models


def _loads(robot: Robot, motion: JointMotion, joints: Array) -> Array | None:
    if not has_weight(robot) and robot.wrench is None:
        return None
    postures = motion.postures(joints)
    return joint_loads(
        robot,
        robot.variables(postures, robot.values),
        velocity=motion.velocity.T,
        acceleration=motion.acceleration.T,
        wrench=None if postures.wrench is None else postures.wrench.T,
    )


def _check_speeds(robot: Robot, motion: JointMotion, planned: PlannedPath) -> None:
    """Refuse a motion in which a joint is faster than the file allows."""
    if planned.joint_speeds is None:
        return
    if len(planned.joint_speeds) != len(robot.joints):
        raise InputError(
            "there are not as many speeds as joints",
            where=f"{planned.source}, joint_speeds",
            came=len(planned.joint_speeds),
            allowed=f"{len(robot.joints)}, one for each joint of {robot.name}",
        )
    length, angle = planned.units
    units = [angle if joint.kind == "revolute" else length for joint in robot.joints]
    most = np.array([to_si(speed, unit) for speed, unit in zip(planned.joint_speeds, units, strict=True)])
    beyond = np.abs(motion.velocity) / most
    if beyond.max() <= 1.0:
        return
    row, joint = (int(k) for k in np.unravel_index(int(beyond.argmax()), beyond.shape))
    along = planned.trajectory.distance[row] * 1e3
    raise InputError(
        "a joint would have to be faster than the file allows",
        where=f"{planned.source}, section {planned.section[row]}, {along:.1f} mm along the path, "
        f"at {motion.time[row]:.4g} s (sample {row})",
        came=f"{robot.joints[joint].name} at {beyond[row, joint] * planned.joint_speeds[joint]:.4g} {units[joint]}/s",
        allowed=f"up to {planned.joint_speeds[joint]:g} {units[joint]}/s",
        cure="Go slower there (speed of the section), or keep away from singular postures.",
    )


def _trajectory(T: Array, path: Trajectory) -> Trajectory:
    return Trajectory(path.time, _moved(T, path.position), path.velocity @ T[:3, :3].T, path.acceleration @ T[:3, :3].T)


def _moved(T: Array, points: Array) -> Array:
    return np.asarray(points @ T[:3, :3].T + T[:3, 3])
