"""What a robot is: its parts, the chain that follows from them, and its parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import chain
from typing import Final, Self, TypeVar

import numpy as np

from truearm.engine.base.errors import InputError, as_html, counted, did_you_mean, listed, short_text
from truearm.engine.base.units import Marked, mark_lines
from truearm.engine.robot.balancers import Balancer
from truearm.engine.robot.bearings import AxialSlides, bearing_elements, carried_by
from truearm.engine.robot.chain import Chain, Element, Offset, across, axis_of, slide_along, turn_about
from truearm.engine.robot.controller import AS_THE_MODEL, Controller
from truearm.engine.robot.conventions import convention
from truearm.engine.robot.conventions.convention import Convention
from truearm.engine.robot.effects import EFFECTS
from truearm.engine.robot.effects.effect import Effect, Layout
from truearm.engine.robot.parameters import Parameter, all_parameters
from truearm.engine.robot.parts import (
    GRAVITY,
    NO_PAYLOAD,
    SLIDES,
    TURNS,
    Fixture,
    Joint,
    LinkMass,
    Payload,
    Reach,
    Target,
    Tool,
    Truth,
)
from truearm.engine.robot.proof import Proof
from truearm.engine.robot.transform import IDENTITY, Transform, fixed_rotation
from truearm.engine.robot.wrench import Wrench

Part = TypeVar("Part", Target, Fixture)

#: What is cached of a robot and does not depend on where it stands, its targets and the values of its parameters.
ARM: Final = ("link_elements", "axial_slides", "flange_elements", "moved_links", "arm", "layout", "effects")
#: What does not depend on the values of its parameters.
STRUCTURE: Final = (*ARM, "base_elements", "trunk", "moving", "offset_elements")


@dataclass(frozen=True, repr=False)
class RobotData:
    """A serial robot as data: what it is made of, the chain that follows from it, and its parameters.

    Joint positions are ``(n, joints)`` in rad (m for prismatic joints); everything is in SI units. The base frame
    stands in the world at ``base_x``, ``base_y``, ``base_z``, turned by `base_quaternion` and then by the small
    ``base_rx``, ``base_ry``, ``base_rz`` (Nubiola, equation I.2, with the reference orientation split off so
    that no installation meets a singular angle). The world is the instrument's frame.
    """

    name: str  #: name, title, source: short name, full name, and where the numbers come from.
    title: str
    source: str
    convention_name: str  #: Name of the kinematic convention of the joints' rows.
    joints: tuple[Joint, ...]  #: From base to flange.
    flange: Transform = IDENTITY  #: From the last link's frame to the flange.
    masses: tuple[LinkMass, ...] = ()  #: Link masses, where published.
    payload: Payload = NO_PAYLOAD  #: What hangs on the flange.
    gravity: tuple[float, float, float] = GRAVITY  #: Acceleration of free fall in the base frame [m/s^2].
    wrench: Wrench | None = None  #: What acts on its tool besides weight; None of nothing. Robot files do not hold it.
    rated_load: float | None = None  #: Mass that its maker rates it for [kg]; None if that is not known.
    #: Reference orientation of the base in the world.
    base_quaternion: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    targets: tuple[Target, ...] = ()  #: What the instrument sees.
    fixtures: tuple[Fixture, ...] = ()  #: What stands beside the robot and targets are measured against.
    effect_names: tuple[str, ...] = ()  #: Joint effects that are part of the model.
    known: Mapping[str, Parameter] = field(default_factory=dict)  #: Parameters that differ from the plain nominal ones.
    #: The file's own standard deviations of nominal values, by SI unit.
    priors: Mapping[str, float] = field(default_factory=dict)
    controller: Controller = AS_THE_MODEL  #: How the robot's controller counts the joints, and where it has its frames.
    tools: Mapping[str, Tool] = field(default_factory=dict)  #: tools, truths: for simulation.
    truths: Mapping[str, Truth] = field(default_factory=dict)
    maker: str = ""  #: Who made it; empty if that is not known.
    history: tuple[str, ...] = ()  #: One line for each thing done to the robot.
    #: What its calibration knew about it; None if it was not calibrated, or by an older version.
    proof: Proof | None = None
    balancers: tuple[Balancer, ...] = ()  #: Springs and gas cylinders that relieve joints.
    reach: Reach | None = None  #: How far it reaches, as its maker says; None if that is not known.
    simulated: bool = False  #: Whether anything of it was identified from readings of a virtual instrument.

    def __repr__(self) -> str:
        changed = sum(p.value != p.nominal for p in self.parameters.values())
        lines = [
            *mark_lines(self.simulated_from),
            f"{self.name}: {self.title}",
            f"{counted(len(self.joints), 'joint')} ({self.convention_name}), "
            f"{changed} of {counted(len(self.parameters), 'parameter')} not at the nominal value",
            f"joint effects: {listed(self.effect_names) or 'none'}",
            f"targets: {listed([target.name for target in self.targets]) or 'none'}",
        ]
        lines += [f"fixtures: {listed([fixture.name for fixture in self.fixtures])}"] if self.fixtures else []
        lines += [f"payload: {self.payload.text}"] if self.payload.mass else []
        lines += [f"wrench at the tool: {self.wrench.text}, {self.wrench.frame}"] if self.wrench else []
        return short_text(lines)

    def _repr_html_(self) -> str:
        return as_html(repr(self))

    def share(self, other: RobotData, names: Sequence[str]) -> None:
        """Let another robot have what is cached of this one under some names, such as :data:`ARM`."""
        other.__dict__.update({name: getattr(self, name) for name in names})

    @property
    def simulated_from(self) -> tuple[Marked, ...]:
        """``robot``, if anything of it was identified from readings of a virtual instrument."""
        return ("robot",) if self.simulated else ()

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
        return Chain((*self.base_elements, *self.arm.elements))

    @cached_property
    def arm(self) -> Chain:
        """The chain from the base to the flange, as :attr:`trunk`."""
        return Chain((*chain.from_iterable(self.moved_links), *self.flange_elements))

    @cached_property
    def rigid(self) -> Self:
        """The robot without its joint effects: every joint turns by its joint position."""
        return replace(self, effect_names=())

    @cached_property
    def moved_links(self) -> tuple[tuple[Element, ...], ...]:
        """The way along each link, as :attr:`link_elements`, with what joint effects tilt, stretch and shift."""
        tilts = any(effect.tilts for effect in self.effects)
        stretches = any(effect.stretches for effect in self.effects)
        shifts = any(effect.shifts for effect in self.effects)
        slides = iter(range(len(self.layout.lengths)))

        def moved(joint: int, element: Element) -> tuple[Element, ...]:
            if stretches and _has_length(element):
                return (replace(element, variable=self.layout.length(next(slides))),)
            if element.variable is None:
                return (element,)
            parts: tuple[Element, ...] = (element,)
            if shifts:
                own = zip((*across(element), axis_of(element)), self.layout.shift(joint), strict=True)
                parts = (*(slide_along(axis, variable) for axis, variable in own), *parts)
            if tilts:
                across_it = zip(across(element), self.layout.tilt(joint), strict=True)
                turns = tuple(turn_about(axis, variable) for axis, variable in across_it)
                parts = (*parts, *_about_bearing(turns, bearing_elements(element, *self._bearing(joint))))
            return parts

        return tuple(
            tuple(part for element in link for part in moved(joint, element))
            for joint, link in enumerate(self.link_elements)
        )

    @cached_property
    def axial_slides(self) -> AxialSlides:
        """How identified slides carry joints and links along the axes."""
        return AxialSlides.of(self.link_elements)

    def _bearing(self, joint: int) -> tuple[float, tuple[Offset, ...]]:
        """Return where a joint's bearing (from 0) lies beyond its nominal origin [m], and what carries the origin."""
        part = self.joints[joint]
        return (part.bearing or 0.0, self.axial_slides.joints[joint]) if part.kind == "revolute" else (0.0, ())

    @property
    def bearings(self) -> tuple[float, ...]:
        """How far along its axis each joint's bearing lies from the joint's origin as it is now [m]."""
        generator = (self._bearing(joint) for joint in range(len(self.joints)))
        return tuple(bearing - carried_by(offsets, self.values) for bearing, offsets in generator)

    @cached_property
    def offset_elements(self) -> Mapping[str, tuple[tuple[int, float], ...]]:
        """The elements of the trunk that follow a parameter of another one, by its name, with their factors."""
        elements: dict[str, tuple[tuple[int, float], ...]] = {}
        for place, element in enumerate(self.trunk.elements):
            for name, factor, _ in element.offsets:
                elements[name] = (*elements.get(name, ()), (place, factor))
        return elements

    @cached_property
    def layout(self) -> Layout:
        """The variables of the trunk."""
        lengths = [(i, e.value) for i, link in enumerate(self.link_elements) for e in link if _has_length(e)]
        return Layout(
            tuple(joint.kind for joint in self.joints),
            tuple(lengths),
            tuple(joint.periods for joint in self.joints),
            len(self.balancers),
        )

    @cached_property
    def effects(self) -> tuple[Effect, ...]:
        """The joint effects of the model."""
        return tuple(effect(self.layout) for effect in EFFECTS if effect.name in self.effect_names)

    @property
    def bends(self) -> bool:
        """Whether joint effects depend on the loads, or on the direction of gravity: postures then need both."""
        return any(effect.loaded or effect.falls for effect in self.effects)

    @cached_property
    def parameters(self) -> Mapping[str, Parameter]:
        """All parameters by name: base, joints, effects, targets, fixtures."""
        return all_parameters(self)

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
            if isinstance(name, str) and part.name == name:
                return part
        known = [part.name for part in parts]
        raise InputError(
            f"the robot has no {kind} of this name",
            parameter=kind,
            where=self.name,
            came=name,
            allowed=", ".join(known) or f"none: the robot has no {kind}s",
            cure=did_you_mean(name, known) if isinstance(name, str) else None,
        )

    @cached_property
    def moving(self) -> list[int]:
        """Index of the element that each variable of the trunk moves, joints first."""
        places = {e.variable: i for i, e in enumerate(self.trunk.elements) if e.variable is not None}
        return [places.get(i, -1) for i in range(max(places, default=-1) + 1)]


def _about_bearing(turns: tuple[Element, ...], slides: tuple[Element, Element] | None) -> tuple[Element, ...]:
    """Return turns about a joint's origin as turns about its bearing."""
    return turns if slides is None else (slides[0], *turns, slides[1])


def _has_length(element: Element) -> bool:
    return not element.turns and element.variable is None and element.value != 0.0
