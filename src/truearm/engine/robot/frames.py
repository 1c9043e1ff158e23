"""Poses and Jacobians in a frame by name, and a robot at another place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from truearm.engine.base.arrays import axes, number_array
from truearm.engine.base.errors import InputError, did_you_mean, wrong_kind
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import AS_THE_MODEL
from truearm.engine.robot.parts import Fixture, FixtureKind, Target
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot_data import ARM, STRUCTURE
from truearm.engine.robot.transform import IDENTITY, Transform

if TYPE_CHECKING:
    from truearm.engine.robot.robot import Robot


#: ``base``, the robot's base frame as it was identified; ``world``, the instrument's frame; ``controller``, the base
#: frame of its controller.
Frame = Literal["base", "world", "controller"]
FRAMES: Final[tuple[str, ...]] = ("base", "world", "controller")
#: By which joints are moved to find how deflections follow them [rad, m].
_DIFFERENCE: Final = 1e-5


def checked_frame(frame: object) -> None:
    """Refuse what is no name of a frame."""
    if isinstance(frame, str) and frame in FRAMES:
        return
    raise InputError(
        "there is no frame of this name",
        parameter="frame",
        came=frame,
        allowed=", ".join(FRAMES),
        cure=did_you_mean(frame, FRAMES) if isinstance(frame, str) else None,
    )


def frame_and_tip(robot: Robot, frame: Frame, target: str | None) -> tuple[Transform, Transform]:
    """Return a frame in the world, and what goes to poses in it behind the model's flange, or behind the target.

    In the controller's frame the flange is the controller's, too: where a tool is that is all zeros.

    Raises:
        InputError: If there is no such frame, or it is the controller's and nothing is said of that.
    """
    checked_frame(frame)
    if frame == "world":
        return IDENTITY, IDENTITY
    if frame == "base":
        return robot.base, IDENTITY
    controller = robot.controller
    if controller == AS_THE_MODEL:
        raise InputError(
            f"it is not known where the controller of {robot.name} has its frames",
            parameter="frame",
            allowed="a robot file with the entry controller",
            cure="Say under controller where its base and flange are, or give the source that says they are the "
            "model's.",
        )
    base = robot.base.matrix @ controller.base.matrix
    return Transform.from_matrix(base[:3, :3], base[:3, 3]), controller.flange if target is None else IDENTITY


def checked_joints(robot: Robot, joints: ArrayLike, parameter: str = "joints") -> Array:
    """Return joint positions ``(n, joints)``, also of one configuration ``(joints,)``."""
    return number_array([joints] if axes(joints) == 1 else joints, parameter, ("n", len(robot.joints)))


def forward(robot: Robot, joints: ArrayLike | Postures, frame: Frame, target: str | None) -> tuple[Array, Array]:
    """Return poses as :meth:`truearm.Robot.forward` does."""
    base, tip = frame_and_tip(robot, frame, target)
    position, rotation = robot.world_poses(_postures(robot, joints), target)
    if frame == "world":
        return position, rotation
    if tip != IDENTITY:
        position, rotation = position + rotation @ np.array(tip.translation), rotation @ tip.rotation
    return (position - np.array(base.translation)) @ base.rotation, base.rotation.T @ rotation


def jacobian(robot: Robot, joints: ArrayLike | Postures, frame: Frame, target: str | None) -> Array:
    """Return Jacobians as :meth:`truearm.Robot.jacobian` does."""
    base, tip = frame_and_tip(robot, frame, target)
    at = robot.loaded(_postures(robot, joints))
    kinematics = robot.forward_kinematics(at, target)
    if not robot.effects:
        derivative = robot.joint_jacobian(at, target)
    else:
        rates = _rates(robot, at)
        moved = np.flatnonzero(rates.any(axis=(1, 2)))
        by_variable = np.concatenate(kinematics.jacobians([robot.moving[i] for i in moved]), axis=1)
        derivative = np.einsum("vcn,vjn->ncj", by_variable, rates[moved])
    if frame == "world":
        return derivative
    if tip != IDENTITY:  # a point that is carried along moves by the turn across its distance, too
        ahead = robot.world_poses(at, target)[1] @ np.array(tip.translation)
        derivative = derivative.copy()
        derivative[:, :3] += np.cross(derivative[:, 3:].swapaxes(1, 2), ahead[:, None]).swapaxes(1, 2)
    turned = base.rotation.T @ derivative.reshape(len(derivative), 2, 3, derivative.shape[2])
    return turned.reshape(derivative.shape)


def _postures(robot: Robot, joints: ArrayLike | Postures) -> Postures:
    if isinstance(joints, Postures):
        return replace(joints, joints=checked_joints(robot, joints.joints))
    return Postures(checked_joints(robot, joints))


def _rates(robot: Robot, at: Postures) -> Array:
    """Return how the variables of the trunk follow the joint positions, ``(variables, joints, n)``, loads included."""
    n, count = at.joints.shape
    rates = np.zeros((len(robot.moving), count, n))
    for joint in range(count):
        ahead, behind = (
            robot.variables(replace(at, joints=at.joints + way, loads=None), robot.values)
            for way in _DIFFERENCE * np.array([[1.0], [-1.0]]) * np.eye(count)[joint]
        )
        rates[:, joint] = (ahead - behind) / (2 * _DIFFERENCE)
    return rates


#: Where a target is on the flange.
_PLACE: Final = "a Transform, or three coordinates in m"


def placed(robot: Robot, base: Transform, targets: Mapping[str, Transform | Sequence[float]]) -> Robot:
    """Return a robot at another place with other targets, as :meth:`truearm.Robot.with_frames` does."""
    _refuse_other(base, Transform, "base", "a Transform")
    _refuse_other(targets, Mapping, "targets", "a mapping from names to places")
    known = {n: p for n, p in robot.known.items() if p.group not in ("base", "target")}
    placed_targets, places = [], dict(zip(("base_x", "base_y", "base_z"), base.translation, strict=True))
    for name, place in targets.items():
        _refuse_other(name, str, "targets", "a name for each place")
        frame = place if isinstance(place, Transform) else None
        position = number_array(frame.translation if frame else place, "targets", (3,), allowed=_PLACE).tolist()
        target = Target(name, frame.quaternion if frame else None)
        places |= {target.parameter(a): v for a, v in zip("xyz", position, strict=True)}
        placed_targets.append(target)
    moved = replace(robot, base_quaternion=base.quaternion, targets=tuple(placed_targets), known=known)
    robot.share(moved, ARM)
    return moved.with_parameters(moved.parameters[n].restarted(v) for n, v in places.items())


def fixtures_placed(robot: Robot, places: Mapping[str, tuple[FixtureKind, Transform]]) -> Robot:
    """Return a robot with other fixtures beside it, as :meth:`truearm.Robot.with_fixtures` does."""
    _refuse_other(places, Mapping, "places", "a mapping from names to kinds and transforms")
    for name, entry in places.items():
        _refuse_other(name, str, "places", "a name for each fixture")
        fits = isinstance(entry, tuple) and len(entry) == 2 and isinstance(entry[1], Transform)
        if not fits or not isinstance(entry[0], str) or entry[0] not in get_args(FixtureKind):
            allowed = f"a kind ({', '.join(get_args(FixtureKind))}) and a Transform"
            raise wrong_kind("this says nothing of a fixture", entry, "places", allowed, where=name)
    known = {n: p for n, p in robot.known.items() if p.group != "fixture"}
    fixtures = tuple(Fixture(name, kind, place.quaternion) for name, (kind, place) in places.items())
    beside = replace(robot, fixtures=fixtures, known=known)
    robot.share(beside, STRUCTURE)
    values = {
        n: v for f, (_, place) in zip(fixtures, places.values(), strict=True) for n, v in f.values_at(place).items()
    }
    return beside.with_parameters(beside.parameters[n].restarted(v) for n, v in values.items())


def _refuse_other(value: object, kind: type, parameter: str, allowed: str) -> None:
    if not isinstance(value, kind):
        raise wrong_kind("an object of another kind belongs here", value, parameter, allowed)
