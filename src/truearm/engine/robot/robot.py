"""A robot as it moves: forward and inverse kinematics, Jacobians, and copies with other values."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from numbers import Integral
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import ArrayLike

from truearm.engine.base.arrays import finite_numbers
from truearm.engine.base.errors import InputError, did_you_mean, wrong_kind
from truearm.engine.robot.chain import Array, ForwardKinematics
from truearm.engine.robot.effects import checked_effects
from truearm.engine.robot.frames import Frame, fixtures_placed, forward, jacobian, placed
from truearm.engine.robot.loads import carrying, postures_behind, postures_in_equilibrium
from truearm.engine.robot.parameters import SCALE, SCALE_GROUP, Parameter, by_parameters, effect_rates
from truearm.engine.robot.parts import FixtureKind, Payload, checked_gravity
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot_data import STRUCTURE, RobotData
from truearm.engine.robot.transform import IDENTITY, Transform
from truearm.engine.robot.wrench import STANDARD_GRAVITY, Wrench, in_base

if TYPE_CHECKING:
    from truearm.engine.robot.inverse.pose_solver import JointSolutions, Orientation


Values = Mapping[str, float | Array]

#: How many postures' loads a robot keeps for whoever asks next: so many times, of so many configurations at most.
_KEPT: Final = 4
_KEPT_POSTURES: Final = 2000


@dataclass(frozen=True, repr=False)
class Robot(RobotData):
    """A serial robot, nominal or calibrated.

    Its data are those of :class:`~truearm.engine.robot.robot_data.RobotData`. Poses are asked for with
    :meth:`forward`, joint positions with :meth:`inverse`, derivatives with :meth:`jacobian`.
    """

    # -- changed copies ------------------------------------------------------------------------------------

    def with_parameters(self, parameters: Iterable[Parameter]) -> Robot:
        """Return the robot with some parameters replaced."""
        allowed = "a sequence of Parameters"
        if not isinstance(parameters, Iterable):
            raise wrong_kind("parameters belong here", parameters, "parameters", allowed)
        listed = [*parameters]
        for parameter in listed:
            if not isinstance(parameter, Parameter):
                raise wrong_kind("a parameter belongs here", parameter, "parameters", allowed)
        changed = {p.name: p for p in listed}
        self._refuse_unknown(changed, "parameters")
        other = replace(self, known={**self.known, **changed})
        # A solver asks for hundreds of such copies: they share what does not depend on values.
        self.share(other, STRUCTURE)
        other.__dict__["parameters"] = {**self.parameters, **changed}
        return other

    def with_values(self, values: Mapping[str, float]) -> Robot:
        """Return the robot with some parameter values replaced [SI].

        Raises
        ------
        InputError
            If the robot has no parameter of a name, or a value is not finite.
        """
        numbers = finite_numbers(values, "values", allowed="a mapping from parameter names to values in SI units")
        self._refuse_unknown(numbers, "values")
        return self.with_parameters(replace(self.parameters[n], value=v) for n, v in numbers.items())

    def _refuse_unknown(self, names: Iterable[str], parameter: str) -> None:
        for name in names:
            if name not in self.parameters:
                raise InputError(
                    "the robot has no such parameter",
                    parameter=parameter,
                    where=self.name,
                    came=name,
                    cure=did_you_mean(name, self.parameters) if isinstance(name, str) else None,
                )

    def with_payload(
        self, payload: Payload | str | None = None, gravity: tuple[float, float, float] | None = None
    ) -> Robot:
        """Return the robot with another payload, or mounted another way; None leaves what it has.

        What is known of its calibration is about the arm and holds as before.

        Parameters
        ----------
        payload
            What hangs on the flange; also as a text such as ``2.7kg,50mm,25mm,100mm``.
        gravity
            Acceleration of free fall in the base frame [m/s^2].

        Raises
        ------
        InputError
            If the payload is none, or the gravity.
        """
        other = replace(
            self,
            payload=self.payload if payload is None else Payload.of(payload),
            gravity=self.gravity if gravity is None else checked_gravity(gravity),
        )
        if self.proof is None or (other.payload, other.gravity) == (self.payload, self.gravity):
            return other
        from truearm.engine.robot.robot_file.seal import is_intact, sealed

        return sealed(other, self.proof) if is_intact(self) else other

    def with_wrench(self, wrench: Wrench | None, tool: Transform | str | None = None) -> Robot:
        """Return the robot with another external force and moment at its tool; None takes them away.

        What is known of its calibration is about the arm and holds as before. No file holds a wrench.

        Parameters
        ----------
        wrench
            What acts on the tool.
        tool
            The tool on the flange, or the name of a target; None for where the wrench says it is.

        Raises
        ------
        InputError
            If there is no such target, the wrench is larger than the robot is rated for, or is given in axes of the
            controller that are not known.
        """
        if not isinstance(wrench, Wrench | None):
            raise wrong_kind("a wrench belongs here", wrench, "wrench", "a Wrench, or None")
        if wrench is None or not wrench.acts:
            return replace(self, wrench=None)
        if tool is not None:
            wrench = wrench.at(self.tool_place(tool) if isinstance(tool, str) else tool)
        if wrench.frame != "tool":
            in_base(self, wrench)
        _refuse_above_rating(self, wrench)
        return replace(self, wrench=wrench)

    def marked(self, simulated: bool) -> Robot:
        """Return the robot with the mark of a virtual instrument, if what it is identified from has that."""
        return replace(self, simulated=True) if simulated and not self.simulated else self

    def tool_place(self, target: str | None) -> Transform:
        """Return where a target is on the flange; the flange itself for None."""
        if target is None:
            return IDENTITY
        kinematics = self.target(target).chain.forward_kinematics(np.zeros((0, 1)), self.values)
        return Transform.from_matrix(kinematics.matrix()[0], kinematics.position[:, 0])

    def with_effects(self, names: Sequence[str]) -> Robot:
        """Return the robot with these joint effects added.

        Raises
        ------
        InputError
            If there is no effect of a name.
        """
        return replace(self, effect_names=tuple(dict.fromkeys((*self.effect_names, *checked_effects(names)))))

    def with_frames(self, base: Transform, targets: Mapping[str, Transform | Sequence[float]]) -> Robot:
        """Return the robot at another place with other targets, both as nominal values.

        Parameters
        ----------
        base
            ``T_world_base``.
        targets
            For each target its place on the flange: a transform, or a position [m] for a point.
        """
        return placed(self, base, targets)

    def with_fixtures(self, places: Mapping[str, tuple[FixtureKind, Transform]]) -> Robot:
        """Return the robot with other fixtures beside it, as nominal values.

        Parameters
        ----------
        places
            What each fixture is and where it stands in the world, see :meth:`Fixture.values_at`.
        """
        return fixtures_placed(self, places)

    def with_scale(self, deviation: float | None) -> Robot:
        """Return the robot with the scale of an instrument beside it, or without any if that is exact.

        Parameters
        ----------
        deviation
            Standard deviation of how much longer than it reads the instrument's unit of length is; None for exact.
        """
        if deviation is None and SCALE not in self.known:
            return self
        known = {name: p for name, p in self.known.items() if name != SCALE}
        if deviation is not None:
            known[SCALE] = Parameter.plain(SCALE, "1", SCALE_GROUP, 0.0, deviation)
        other = replace(self, known=known)
        self.share(other, STRUCTURE)
        return other

    # -- kinematics ----------------------------------------------------------------------------------------

    def loaded(self, q: Array | Postures) -> Postures:
        """Return postures with loads and direction of gravity at every joint, if the robot has effects that need them.

        The loads are those of the arm at rest in its own deflections, with the robot's own parameter values: what a
        solver tries meanwhile moves them by less than a hundredth, and it asks again where it has come to.
        """
        at = Postures.of(q)
        if at.joints.ndim != 2 or at.joints.shape[1] != len(self.joints):
            raise InputError(
                "wrong number of joint positions",
                parameter="joints",
                where=self.name,
                came=f"an array of shape {at.joints.shape}",
                allowed=f"(n, {len(self.joints)})",
            )
        fallen = at.fall is not None or not any(effect.falls for effect in self.effects)
        if (at.loads is not None and fallen) or not self.bends:
            return at
        if len(at.joints) > _KEPT_POSTURES:
            return postures_in_equilibrium(self, at)
        key, kept = at.circumstances(), self._in_equilibrium
        if key not in kept:
            if len(kept) >= _KEPT:
                del kept[next(iter(kept))]
            kept[key] = postures_in_equilibrium(self, at)
        return replace(at, loads=kept[key].loads, fall=kept[key].fall, relief=kept[key].relief)

    @cached_property
    def _in_equilibrium(self) -> dict[tuple[bytes | None, ...], Postures]:
        """Postures that loads were asked for last: in one calibration it is a dozen times for the same."""
        return {}

    def variables(self, q: Array | Postures, values: Values) -> Array:
        """Return the variables ``(joints or more, ..., n)`` of the trunk behind the joint positions `q`.

        Those of the joints come first; the rest of :attr:`layout` is there if some effect tilts, stretches or shifts.
        """
        at = self.loaded(q).relieved(values)
        joints = np.ascontiguousarray(at.joints.T)
        moved: dict[int, Array] = {}
        for effect in self.effects:
            for variable, part in effect.deflection(at, values).items():
                moved[variable] = moved[variable] + part if variable in moved else part
        if not moved and len(self.moving) == len(joints):
            return joints
        shape = np.broadcast_shapes(joints.shape[1:], *(part.shape for part in moved.values()))
        variables = np.zeros((len(self.moving), *shape))
        variables[: len(joints)] = joints if len(shape) == 1 else joints[:, None, :]
        for variable, part in moved.items():
            variables[variable] += part
        return variables

    def joints_of(self, variables: Array) -> Array:
        """Return the joints ``(n, joints)`` behind variables ``(joints or more, n)``: the inverse of `variables`.

        They are those of the arm at rest, where nothing but the joint positions is known, with its own parameter
        values. The loads of an arm that has bent are known, so that there is one answer even where two ends of a
        joint's play are in equilibrium.
        """
        if variables.ndim != 2 or len(variables) != len(self.moving):
            raise InputError(
                "wrong number of variables",
                where=self.name,
                came=f"an array of shape {variables.shape}",
                allowed=f"({len(self.moving)}, n)",
            )
        return postures_behind(self, variables).joints

    def without_deflections(self, joints: Array) -> Array:
        """Return the variables ``(joints or more, n)`` of joints ``(joints, n)`` that turn and do nothing else."""
        return np.concatenate([joints, np.zeros((len(self.moving) - len(joints), *joints.shape[1:]))])

    @property
    def tilts(self) -> bool:
        """Whether some effect tilts joints, changes lengths or moves axes."""
        return any(effect.tilts or effect.stretches or effect.shifts for effect in self.effects)

    def tilted(self, variables: Array, joints: Array) -> tuple[Array, Array]:
        """Return variables ``(joints or more, n)`` with the tilts of the arm as it stands there, and the joints behind.

        So with what lengths have grown and axes have moved where nothing but the joint positions is known. What was
        tilted before counts for the loads alone, and the joint positions ``(joints, n)`` are those known so far; asked
        again for what came out, both are a hundredth or less as far from equilibrium.
        """
        turned = variables[: len(self.joints)]
        found = self.variables(carrying(self, Postures(joints.T), variables), self.values)
        return np.concatenate([turned, found[len(turned) :]]), joints + turned - found[: len(turned)]

    def forward_kinematics(
        self, q: Array | Postures, target: str | None = None, values: Values | None = None
    ) -> ForwardKinematics:
        """Run through the chain to the flange, or to a target.

        Parameters
        ----------
        q
            Joint positions ``(n, joints)``, or postures.
        target
            Name of a target; the flange if None.
        values
            All parameter values, instead of the robot's own; each a number or ``(trials, 1)``.
        """
        values = self.values if values is None else values
        return self.forward_kinematics_of(self.variables(q, values), target, values)

    def forward_kinematics_of(
        self, variables: Array, target: str | None = None, values: Values | None = None
    ) -> ForwardKinematics:
        """Run through the chain as :meth:`forward_kinematics`, with variables ``(joints or more, ..., n)`` given."""
        values = self.values if values is None else values
        trunk = self.trunk.forward_kinematics(variables, values)
        return trunk if target is None else self.target(target).chain.forward_kinematics(variables, values, trunk)

    def fixture_kinematics(self, name: str, values: Values | None = None) -> ForwardKinematics:
        """Run through the chain to a fixture: one configuration; `values` as for :meth:`forward_kinematics`."""
        return self.fixture(name).chain.forward_kinematics(np.zeros((0, 1)), self.values if values is None else values)

    def forward(
        self, joints: ArrayLike | Postures, *, frame: Frame = "base", target: str | None = None
    ) -> tuple[Array, Array]:
        """Return where the flange, or a target, is at joint positions: forward kinematics.

        Parameters
        ----------
        joints
            Joint positions ``(n, joints)``, or ``(joints,)`` of one configuration [rad; m for prismatic joints]. The
            arm is at rest under its own weight and its payload, and what depends on the order of measurement or the
            temperature is in its middle; postures say more (``data.postures``).
        frame
            What the poses are given in: ``base``, the robot's base frame; ``world``, the instrument's frame; or
            ``controller``, the base frame of its controller, in which the flange is the controller's, too.
        target
            Name of a target; the flange if None. A target without orientation has the flange's.

        Returns
        -------
        positions, rotations
            ``(n, 3)`` [m] and ``(n, 3, 3)``.

        Raises
        ------
        InputError
            If the joints have the wrong shape or are not finite, or there is no such frame or target.
        """
        return forward(self, joints, frame, target)

    def inverse(
        self,
        positions: ArrayLike,
        rotations: ArrayLike | None = None,
        *,
        frame: Frame = "base",
        seed: ArrayLike | None = None,
        target: str | None = None,
        orientation: Orientation = "full",
    ) -> JointSolutions:
        """Return joint positions that bring the flange, or a target, to poses: inverse kinematics.

        Away from singular postures, ``robot.inverse(*robot.forward(q), seed=q).joints`` is `q`.

        Parameters
        ----------
        positions
            [m], ``(n, 3)``, or ``(3,)`` of one pose.
        rotations
            Rotation matrices ``(n, 3, 3)``; None with ``orientation="free"``.
        frame
            What the poses are given in: ``base``, the robot's base frame; ``world``, the instrument's frame; or
            ``controller``, the base frame of its controller, in which the flange is the controller's, too.
        seed
            Joint positions ``(joints,)`` or ``(n, joints)`` near which the answer shall lie; zero if None.
        target
            Name of the target that shall be there; the flange if None.
        orientation
            ``full``; ``axis`` if only the direction of the z axis counts; ``free`` if only the position does.

        Returns
        -------
        solutions
            One row a pose: `joints` ``(n, joints)``, NaN where the pose is out of reach, and `status`.

        Raises
        ------
        InputError
            If an array has the wrong shape or is not finite, a matrix is no rotation, or there is no such frame or
            target.
        """
        from truearm.engine.robot.inverse.kinematics import inverse

        joint_solutions = inverse(
            self, positions, rotations, frame=frame, seed=seed, target=target, orientation=orientation
        )
        return joint_solutions.without_unreached()

    def jacobian(self, joints: ArrayLike | Postures, *, frame: Frame = "base", target: str | None = None) -> Array:
        """Return how the pose of the flange, or a target, follows the joint positions: the geometric Jacobian.

        It is the derivative by the commanded joint positions, as :meth:`forward` takes them: with joint effects in the
        model their changes are in it (a gain, or a deflection that grows with the load). Without them it is the
        Jacobian of the rigid arm.

        Parameters
        ----------
        joints, target
            As for :meth:`forward`.
        frame
            Whose axes velocities are given in.

        Returns
        -------
        jacobian
            ``(n, 6, joints)``: velocity of the point [m per rad or m], then angular velocity [rad per rad or m].
        """
        return jacobian(self, joints, frame, target)

    def world_poses(self, q: Array | Postures, target: str | None = None) -> tuple[Array, Array]:
        """Return what :meth:`forward` does in the world, of joint positions that are known to be sound."""
        kinematics = self.forward_kinematics(q, target)
        return np.ascontiguousarray(kinematics.position.T), np.ascontiguousarray(kinematics.matrix())

    def joint_jacobian(self, q: Array | Postures, target: str | None = None) -> Array:
        """Return the geometric Jacobian ``(n, 6, joints)`` in the world, linear rows first [m, rad per rad or m].

        Rates are those of the true joint variables: of what the joints turn by, with tilts and lengths held.
        """
        kinematics = self.forward_kinematics(q, target)
        return np.moveaxis(
            np.concatenate(kinematics.jacobians(self.moving[: len(self.joints)]), axis=1), (0, 1), (2, 1)
        )

    def moved_point(self, q: Array | Postures, target: str | None = None) -> tuple[Array, Array]:
        """Return where the tip is in the world ``(n, 3)`` [m], and the linear rows of :meth:`joint_jacobian`."""
        kinematics = self.forward_kinematics(q, target)
        linear = kinematics.position_jacobian(self.moving[: len(self.joints)])
        return np.ascontiguousarray(kinematics.position.T), np.moveaxis(linear, (0, 1), (2, 1))

    def position_jacobian(
        self, kinematics: ForwardKinematics, q: Array | Postures, names: Sequence[str], values: Values | None = None
    ) -> Array:
        """Return the velocity of the tip by the parameters `names` [m per unit of the parameter].

        Parameters
        ----------
        kinematics
            From :meth:`forward_kinematics` with the same `q` and `values`.

        Returns
        -------
        linear
            ``(len(names), 3, ..., n)`` in the world; zero for parameters of other targets.
        """
        values = self.values if values is None else values
        rates = effect_rates(self, q, names, values)
        return by_parameters(self, kinematics, kinematics.position_jacobian, names, rates)

    def orientation_jacobian(
        self, kinematics: ForwardKinematics, q: Array | Postures, names: Sequence[str], values: Values | None = None
    ) -> Array:
        """Return the angular velocity of the tip by the parameters `names` [rad per unit of the parameter].

        Parameters and the shape of what is returned are as for :meth:`position_jacobian`.
        """
        values = self.values if values is None else values
        rates = effect_rates(self, q, names, values)
        return by_parameters(self, kinematics, kinematics.orientation_jacobian, names, rates)

    def jacobians(
        self, kinematics: ForwardKinematics, q: Array | Postures, names: Sequence[str], values: Values | None = None
    ) -> tuple[Array, Array]:
        """Return :meth:`position_jacobian` and :meth:`orientation_jacobian`."""
        rates = effect_rates(self, q, names, self.values if values is None else values)
        return (
            by_parameters(self, kinematics, kinematics.position_jacobian, names, rates),
            by_parameters(self, kinematics, kinematics.orientation_jacobian, names, rates),
        )

    def random_configurations(self, count: int, rng: np.random.Generator) -> Array:
        """Return joint positions ``(count, joints)`` drawn evenly within the limits (or a turn, or 1 m)."""
        if isinstance(count, bool) or not isinstance(count, Integral) or count < 0:
            raise wrong_kind("a count belongs here", count, "count", "a whole number, 0 or more")
        if not isinstance(rng, np.random.Generator):
            raise wrong_kind("a random number generator belongs here", rng, "rng", "numpy.random.default_rng(seed)")
        low, high = np.array([joint.range for joint in self.joints]).T
        return rng.uniform(low, high, (count, len(self.joints)))


def _refuse_above_rating(robot: Robot, wrench: Wrench) -> None:
    """Refuse what acts on the tool beyond what the arm is rated for; where that is not known nothing is refused.

    Makers rate a mass on the flange. A force may be as large as its weight. Moments are rated joint by joint, which few
    data sheets print; none is allowed beyond that weight at the end of the stretched arm, which no wrist holds.

    Raises:
        InputError: If the force or the moment is larger.
    """
    if robot.rated_load is None:
        return
    from truearm.engine.robot.inverse.kinematics import reach  # it loads EAIK

    weight = robot.rated_load * STANDARD_GRAVITY
    at_reach = weight * reach(robot, None)
    cure = "Check number and unit. If the maker allows it, fix the entry rated_load of the robot file."
    for load, value, most, unit in (
        ("force", math.hypot(*wrench.force), weight, "N"),
        ("moment", math.hypot(*wrench.moment), at_reach, "N m"),
    ):
        if value > most * (1.0 + 1e-9):
            raise InputError(
                f"the {load} is larger than {robot.name} is rated for",
                parameter="wrench",
                came=f"{value:.4g} {unit}",
                allowed=f"up to {most:.4g} {unit}, of a rated load of {robot.rated_load:g} kg",
                cure=cure,
            )


#: At so many joint positions two arms are compared; drawn at random, so none is a special one.
_POSTURES: Final = 8
#: Flanges that are nearer to each other [m; of rotations: entries of the matrix] are at the same place.
_NEAR: Final = 1e-9


def fitted_from(calibrated: Robot, robot: Robot) -> bool:
    """Return whether a calibrated robot can be the fit of a robot.

    Both have the same table, and the values of the robot are those that the fit began with, or found, or those of the
    table. What counts is where the rigid arm has its flange, and how the controller counts the joints. Base, targets,
    fixtures, payload and masses do not.
    """
    if [joint.kind for joint in calibrated.joints] != [joint.kind for joint in robot.joints]:
        return False
    q = np.random.default_rng(0).uniform(-1.0, 1.0, (_POSTURES, len(robot.joints)))
    if not _near(calibrated.controller.to_model(q), robot.controller.to_model(q)):
        return False
    table = _flange(calibrated, q, {})
    if not _near(table, _flange(robot, q, {})):
        return False
    began = {name: replace(p, value=p.nominal) for name, p in calibrated.known.items()}
    current = _flange(robot, q, robot.known)
    return any(
        _near(current, reference)
        for reference in (table, _flange(calibrated, q, began), _flange(calibrated, q, calibrated.known))
    )


def _flange(robot: Robot, joints: Array, known: Mapping[str, Parameter]) -> Array:
    """Return the flange of the rigid arm with some parameters in the base frame, ``(n, 3, 4)``."""
    arm = replace(robot, effect_names=(), wrench=None, known=known)
    position, rotation = arm.forward(joints)
    return np.concatenate([rotation, position[:, :, None]], axis=2)


def _near(first: Array, other: Array) -> bool:
    return bool(np.abs(first - other).max(initial=0.0) < _NEAR)
