"""A robot: its chain, its parameters, and the frames before and behind it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeVar

import numpy as np

from truearm.errors import InputError, nearest_names
from truearm.modeling.chain import Array, Chain, Element, ForwardKinematics, across, turn_about
from truearm.modeling.controller import AS_THE_MODEL, Controller
from truearm.modeling.conventions import Convention, convention
from truearm.modeling.effects import EFFECTS, Effect, Layout
from truearm.modeling.equilibrium import postures_in_equilibrium, readings_in_equilibrium
from truearm.modeling.fixtures import Fixture, FixtureKind
from truearm.modeling.loads import joint_loads
from truearm.modeling.parameters import Group, Parameter, Unit, parameter
from truearm.modeling.parts import GRAVITY, NO_PAYLOAD, SLIDES, TURNS, Joint, LinkMass, Payload, Target, Tool, Truth
from truearm.modeling.postures import Postures
from truearm.modeling.transform import IDENTITY, Transform, fixed_rotation

Values = Mapping[str, float | Array]
Part = TypeVar("Part", Target, Fixture)


@dataclass(frozen=True)
class Robot:
    """A serial robot, nominal or calibrated.

    Joint positions are ``(n, joints)`` in rad (m for prismatic joints); everything is in SI units. The base frame
    stands in the world at ``base_x``, ``base_y``, ``base_z``, turned by `base_quaternion` and then by the small
    ``base_rx``, ``base_ry``, ``base_rz`` (Nubiola, equation I.2, with the reference orientation split off so
    that no installation meets a singular angle). The world is the instrument's frame.

    Attributes
    ----------
    name, title, source
        Short name, full name, and where the numbers come from.
    convention_name
        Name of the kinematic convention of the joints' rows.
    joints
        From base to flange.
    flange
        From the last link's frame to the flange.
    masses
        Link masses, where published.
    payload
        What hangs on the flange.
    gravity
        Acceleration of free fall in the base frame [m/s^2].
    base_quaternion
        Reference orientation of the base in the world.
    targets
        What the instrument sees.
    fixtures
        What stands beside the robot and targets are measured against.
    effect_names
        Joint effects that are part of the model.
    known
        Parameters that differ from the plain nominal ones.
    priors
        The file's own standard deviations of nominal values, by SI unit.
    controller
        How the robot's controller counts the joints, and where it has its frames.
    tools, truths
        For simulation.
    history
        One line for each thing done to the robot.
    """

    name: str
    title: str
    source: str
    convention_name: str
    joints: tuple[Joint, ...]
    flange: Transform = IDENTITY
    masses: tuple[LinkMass, ...] = ()
    payload: Payload = NO_PAYLOAD
    gravity: tuple[float, float, float] = GRAVITY
    base_quaternion: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    targets: tuple[Target, ...] = ()
    fixtures: tuple[Fixture, ...] = ()
    effect_names: tuple[str, ...] = ()
    known: Mapping[str, Parameter] = field(default_factory=dict)
    priors: Mapping[str, float] = field(default_factory=dict)
    controller: Controller = AS_THE_MODEL
    tools: Mapping[str, Tool] = field(default_factory=dict)
    truths: Mapping[str, Truth] = field(default_factory=dict)
    history: tuple[str, ...] = ()

    @property
    def convention(self) -> Convention:
        """The kinematic convention."""
        return convention(self.convention_name)

    @cached_property
    def base_elements(self) -> tuple[Element, ...]:
        """The way from the world to the base frame."""
        return (
            *(Element(motion, parameter=f"base_{axis}") for axis, motion in SLIDES),
            *fixed_rotation(self.base_quaternion),
            *(Element(motion, parameter=f"base_{axis}") for axis, motion in TURNS),
        )

    @cached_property
    def link_elements(self) -> tuple[tuple[Element, ...], ...]:
        """The way along each link, from base to flange; the link's frame is at its end."""
        return tuple(
            self.convention.elements(number, joint.row, joint.kind) for number, joint in enumerate(self.joints, 1)
        )

    @cached_property
    def flange_elements(self) -> tuple[Element, ...]:
        """The way from the last link's frame to the flange."""
        slides = zip(SLIDES, self.flange.translation, strict=True)
        return (
            *(Element(motion, value=value) for (_, motion), value in slides if value),
            *fixed_rotation(self.flange.quaternion),
        )

    @cached_property
    def trunk(self) -> Chain:
        """The chain from the world to the flange, with what joint effects tilt and stretch."""
        links = (element for link in self.moved_links for element in link)
        return Chain((*self.base_elements, *links, *self.flange_elements))

    @cached_property
    def rigid(self) -> Robot:
        """The robot without its joint effects: every joint turns by its reading."""
        return replace(self, effect_names=())

    @cached_property
    def moved_links(self) -> tuple[tuple[Element, ...], ...]:
        """The way along each link, as :attr:`link_elements`, with what joint effects tilt and stretch."""
        tilts = any(effect.tilts for effect in self.effects)
        stretches = any(effect.stretches for effect in self.effects)
        slides = iter(range(len(self.layout.lengths)))

        def moved(joint: int, element: Element) -> tuple[Element, ...]:
            if stretches and _has_length(element):
                return (replace(element, variable=self.layout.length(next(slides))),)
            if tilts and element.variable is not None:
                across_it = zip(across(element), self.layout.tilt(joint), strict=True)
                return (element, *(turn_about(axis, variable) for axis, variable in across_it))
            return (element,)

        return tuple(
            tuple(part for element in link for part in moved(joint, element))
            for joint, link in enumerate(self.link_elements)
        )

    @cached_property
    def layout(self) -> Layout:
        """The variables of the trunk."""
        lengths = [(i, e.value) for i, link in enumerate(self.link_elements) for e in link if _has_length(e)]
        return Layout(
            tuple(joint.kind for joint in self.joints),
            tuple(lengths),
            tuple(joint.transmission_periods for joint in self.joints),
        )

    @cached_property
    def effects(self) -> tuple[Effect, ...]:
        """The joint effects of the model."""
        return tuple(effect(self.layout) for effect in EFFECTS if effect.name in self.effect_names)

    @cached_property
    def parameters(self) -> Mapping[str, Parameter]:
        """All parameters by name: base, joints, effects, targets, fixtures."""
        zeros = {f"{self.convention.zero(j.kind)}_{i}" for i, j in enumerate(self.joints, 1)}
        found: dict[str, Parameter] = {}

        def add(name: str, unit: Unit, group: Group, nominal: float) -> None:
            if name in found:
                raise InputError(
                    "two parameters of the robot would have the same name",
                    where=name,
                    cure="Rename the target or fixture.",
                )
            found[name] = self.known.get(name) or parameter(name, unit, group, nominal, self.priors)

        for element in self.trunk.elements:
            if element.parameter is not None:
                name = element.parameter
                group: Group = "joint zero" if name in zeros else "geometry"
                add(name, _unit(element), "base" if name.startswith("base_") else group, element.value)
        for effect in self.effects:
            for plain in effect.parameters:
                if plain.name in found:
                    raise InputError(
                        "two joint effects of the robot have the same parameter",
                        where=f"{self.name}, {plain.name}",
                        came=", ".join(e.name for e in self.effects if plain.name in [p.name for p in e.parameters]),
                        cure="They are forms of one effect: take one of them.",
                    )
                found[plain.name] = self.known.get(plain.name, plain)
        beside: tuple[tuple[Group, Sequence[Target | Fixture]], ...] = (
            ("target", self.targets),
            ("fixture", self.fixtures),
        )
        for group_of, parts in beside:
            for element in (element for part in parts for element in part.chain.elements):
                if element.parameter is not None:
                    add(element.parameter, _unit(element), group_of, element.value)
        return found

    @cached_property
    def values(self) -> Mapping[str, float]:
        """Current value of every parameter [SI]."""
        return {name: p.value for name, p in self.parameters.items()}

    @property
    def base(self) -> Transform:
        """Where the base frame stands in the world."""
        kinematics = Chain(self.base_elements).forward_kinematics(np.zeros((0, 1)), self.values)
        return Transform.from_matrix(kinematics.matrix()[0], kinematics.position[:, 0])

    def target(self, name: str) -> Target:
        """Return the target called `name`."""
        return self._named(name, "target", self.targets)

    def fixture(self, name: str) -> Fixture:
        """Return the fixture called `name`."""
        return self._named(name, "fixture", self.fixtures)

    def _named(self, name: str, kind: str, parts: Sequence[Part]) -> Part:
        for part in parts:
            if part.name == name:
                return part
        known = [part.name for part in parts]
        near = nearest_names(name, known)
        raise InputError(
            f"the robot has no {kind} of this name",
            where=self.name,
            came=name,
            allowed=", ".join(known) or f"none: the robot has no {kind}s",
            cure=f"Did you mean {' or '.join(near)}?" if near else None,
        )

    # -- changed copies ------------------------------------------------------------------------------------

    def with_parameters(self, parameters: Iterable[Parameter]) -> Robot:
        """Return the robot with some parameters replaced."""
        changed = {p.name: p for p in parameters}
        unknown = sorted(set(changed) - set(self.parameters))
        if unknown:
            raise InputError("the robot has no such parameter", where=self.name, came=unknown[0])
        return replace(self, known={**self.known, **changed})

    def with_values(self, values: Mapping[str, float]) -> Robot:
        """Return the robot with some parameter values replaced [SI]."""
        for name in values:
            if name not in self.parameters:
                near = nearest_names(name, self.parameters)
                cure = f"Did you mean {' or '.join(near)}?" if near else None
                raise InputError("the robot has no such parameter", where=self.name, came=name, cure=cure)
        return self.with_parameters(replace(self.parameters[n], value=float(v)) for n, v in values.items())

    def with_payload(self, payload: Payload | None = None, gravity: tuple[float, float, float] | None = None) -> Robot:
        """Return the robot with another payload, or mounted another way; None leaves what it has.

        Raises
        ------
        InputError
            If the mass is negative, or the gravity is none.
        """
        if payload is not None and payload.mass < 0.0:
            raise InputError("a mass cannot be negative", where="payload", came=f"{payload.mass:g} kg")
        if gravity is not None and not 0.1 <= math.hypot(*gravity) <= 100.0:
            raise InputError(
                "this is no acceleration of free fall",
                where="gravity",
                came=f"{math.hypot(*gravity):g} m/s^2",
                allowed="about 9.81 m/s^2 on Earth, 0.1 to 100",
                cure="Give x, y and z in the robot's base frame: 0,0,-9.81 stands, 0,0,9.81 hangs.",
            )
        return replace(
            self,
            payload=self.payload if payload is None else payload,
            gravity=self.gravity if gravity is None else gravity,
        )

    def with_effects(self, names: Sequence[str]) -> Robot:
        """Return the robot with these joint effects added."""
        return replace(self, effect_names=tuple(dict.fromkeys((*self.effect_names, *names))))

    def with_frames(self, base: Transform, targets: Mapping[str, Transform | Sequence[float]]) -> Robot:
        """Return the robot at another place with other targets, both as nominal values.

        Parameters
        ----------
        base
            ``T_world_base``.
        targets
            For each target its place on the flange: a transform, or a position [m] for a point.
        """
        kept = {n: p for n, p in self.known.items() if p.group not in ("base", "target")}
        made, places = [], dict(zip(("base_x", "base_y", "base_z"), base.translation, strict=True))
        for name, place in targets.items():
            frame = place if isinstance(place, Transform) else None
            target = Target(name, frame.quaternion if frame else None)
            position = frame.translation if frame else place
            places |= {target.parameter(a): float(v) for a, v in zip("xyz", position, strict=True)}  # type: ignore[arg-type]
            made.append(target)
        moved = replace(self, base_quaternion=base.quaternion, targets=tuple(made), known=kept)
        return moved.with_parameters(moved.parameters[n].restarted(v) for n, v in places.items())

    def with_fixtures(self, places: Mapping[str, tuple[FixtureKind, Transform]]) -> Robot:
        """Return the robot with other fixtures beside it, as nominal values.

        Parameters
        ----------
        places
            What each fixture is and where it stands in the world, see :meth:`Fixture.values_at`.
        """
        kept = {n: p for n, p in self.known.items() if p.group != "fixture"}
        made = tuple(Fixture(name, kind, place.quaternion) for name, (kind, place) in places.items())
        beside = replace(self, fixtures=made, known=kept)
        values = {
            n: v for f, (_, place) in zip(made, places.values(), strict=True) for n, v in f.values_at(place).items()
        }
        return beside.with_parameters(beside.parameters[n].restarted(v) for n, v in values.items())

    # -- kinematics ----------------------------------------------------------------------------------------

    def loaded(self, q: Array | Postures) -> Postures:
        """Return postures with the loads at every joint, if the robot has effects that depend on them.

        The loads are those of the arm at rest in its own deflections, with the robot's own parameter values: what a
        solver tries meanwhile moves them by less than a hundredth, and it asks again where it has come to.
        """
        at = Postures.of(q)
        if at.joints.ndim != 2 or at.joints.shape[1] != len(self.joints):
            raise InputError(
                "wrong number of joint positions",
                where=self.name,
                came=f"an array of shape {at.joints.shape}",
                allowed=f"(n, {len(self.joints)})",
            )
        if at.loads is not None or not any(effect.loaded for effect in self.effects):
            return at
        return postures_in_equilibrium(self, at)

    def variables(self, q: Array | Postures, values: Values) -> Array:
        """Return the variables ``(joints or more, ..., n)`` of the trunk behind the readings `q`.

        Those of the joints come first; the rest of :attr:`layout` is there if some effect tilts or stretches.
        """
        at = self.loaded(q)
        readings = np.ascontiguousarray(at.joints.T)
        moved: dict[int, Array] = {}
        for effect in self.effects:
            for variable, part in effect.deflection(at, values).items():
                moved[variable] = moved[variable] + part if variable in moved else part
        if not moved and len(self.moving) == len(readings):
            return readings
        shape = np.broadcast_shapes(readings.shape[1:], *(part.shape for part in moved.values()))
        variables = np.zeros((len(self.moving), *shape))
        variables[: len(readings)] = readings if len(shape) == 1 else readings[:, None, :]
        for variable, part in moved.items():
            variables[variable] += part
        return variables

    def readings(self, variables: Array) -> Array:
        """Return the readings ``(n, joints)`` behind variables ``(joints or more, n)``: the inverse of `variables`.

        They are those of the arm at rest, where nothing but the readings is known, with its own parameter values. The
        loads of an arm that has bent are known, so that there is one answer even where two ends of a joint's play are
        in equilibrium.
        """
        if variables.ndim != 2 or len(variables) != len(self.moving):
            raise InputError(
                "wrong number of variables",
                where=self.name,
                came=f"an array of shape {variables.shape}",
                allowed=f"({len(self.moving)}, n)",
            )
        return np.ascontiguousarray(readings_in_equilibrium(self, variables).T)

    def without_deflections(self, joints: Array) -> Array:
        """Return the variables ``(joints or more, n)`` of joints ``(joints, n)`` that turn and do nothing else."""
        return np.concatenate([joints, np.zeros((len(self.moving) - len(joints), *joints.shape[1:]))])

    def tilted(self, variables: Array) -> Array:
        """Return variables ``(joints or more, n)`` with the tilts that the loads of the arm make as it stands there.

        What was tilted before counts for the loads alone; asked again for what came out, they are a thousandth nearer
        to equilibrium.
        """
        tilting = [effect for effect in self.effects if effect.tilts]
        if not tilting:
            return variables
        joints = variables[: len(self.joints)]
        tilted, at = self.without_deflections(joints), Postures(joints.T, loads=joint_loads(self, variables))
        for effect in tilting:
            for variable, part in effect.deflection(at, self.values).items():
                tilted[variable] += part
        return tilted

    def forward_kinematics(
        self, q: Array | Postures, target: str | None = None, values: Values | None = None
    ) -> ForwardKinematics:
        """Run through the chain to the flange, or to a target.

        Parameters
        ----------
        q
            Joint readings ``(n, joints)``, or postures.
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

    def world_poses(self, q: Array | Postures, target: str | None = None) -> tuple[Array, Array]:
        """Return positions ``(n, 3)`` [m] and rotations ``(n, 3, 3)`` of the flange or a target in the world."""
        kinematics = self.forward_kinematics(q, target)
        return np.ascontiguousarray(kinematics.position.T), np.ascontiguousarray(kinematics.matrix())

    def joint_jacobian(self, q: Array | Postures, target: str | None = None) -> Array:
        """Return the geometric Jacobian ``(n, 6, joints)`` in the world, linear rows first [m, rad per rad or m].

        Rates are those of the true joint variables.
        """
        kinematics = self.forward_kinematics(q, target)
        return np.moveaxis(
            np.concatenate(kinematics.jacobians(self.moving[: len(self.joints)]), axis=1), (0, 1), (2, 1)
        )

    def position_jacobian(
        self, kinematics: ForwardKinematics, q: Array | Postures, names: Sequence[str], values: Values | None = None
    ) -> Array:
        """Return the velocity of the tip of a sweep by the parameters `names` [m per unit of the parameter].

        Parameters
        ----------
        sweep
            From :meth:`forward_kinematics` with the same `q` and `values`.

        Returns
        -------
        linear
            ``(len(names), 3, ..., n)`` in the world; zero for parameters of other targets.
        """
        return self._by_parameters(kinematics, kinematics.position_jacobian, q, names, values)

    def orientation_jacobian(
        self, kinematics: ForwardKinematics, q: Array | Postures, names: Sequence[str], values: Values | None = None
    ) -> Array:
        """Return the angular velocity of the tip of a sweep by the parameters `names` [rad per unit of the parameter].

        Parameters and the shape of what is returned are as for :meth:`position_jacobian`.
        """
        return self._by_parameters(kinematics, kinematics.orientation_jacobian, q, names, values)

    def jacobians(
        self, kinematics: ForwardKinematics, q: Array | Postures, names: Sequence[str], values: Values | None = None
    ) -> tuple[Array, Array]:
        """Return :meth:`position_jacobian` and :meth:`orientation_jacobian`."""
        return self.position_jacobian(kinematics, q, names, values), self.orientation_jacobian(
            kinematics, q, names, values
        )

    def _by_parameters(
        self,
        kinematics: ForwardKinematics,
        by_elements: Callable[[Sequence[int | None]], Array],
        q: Array | Postures,
        names: Sequence[str],
        values: Values | None,
    ) -> Array:
        places = [kinematics.places.get(name) for name in names]
        derivative = by_elements(places)
        if self.effects and None in places:
            at = self.loaded(q)
            values = self.values if values is None else values
            rates = {n: r for effect in self.effects for n, r in effect.derivative(at, values).items() if n in names}
            needed = sorted({variable for rate in rates.values() for variable in rate})
            by_variable = dict(zip(needed, by_elements([self.moving[v] for v in needed]), strict=True))
            for i, name in enumerate(names):
                for variable, rate in rates.get(name, {}).items():
                    derivative[i] += rate * by_variable[variable]
        return derivative

    @cached_property
    def moving(self) -> list[int]:
        """Index of the element that each variable of the trunk moves, joints first."""
        places = {e.variable: i for i, e in enumerate(self.trunk.elements) if e.variable is not None}
        count = self.layout.variables if len(places) > len(self.joints) else len(self.joints)
        return [places.get(i, -1) for i in range(count)]

    def random_configurations(self, count: int, rng: np.random.Generator) -> Array:
        """Return joint readings ``(count, joints)`` drawn evenly within the limits (or a turn, or 1 m)."""
        default = {"revolute": (-np.pi, np.pi), "prismatic": (-0.5, 0.5)}
        low, high = np.array([j.limits or default[j.kind] for j in self.joints]).T
        return rng.uniform(low, high, (count, len(self.joints)))


def _unit(element: Element) -> Unit:
    return "rad" if element.turns else "m"


def _has_length(element: Element) -> bool:
    return not element.turns and element.variable is None and element.value != 0.0
