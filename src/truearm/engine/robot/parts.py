"""What a robot is made of, what it carries and what an instrument sees of it; and fixtures beside it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from numbers import Integral
from typing import Final, Literal

from truearm.engine.base.arrays import finite_number, number_array
from truearm.engine.base.errors import InputError, wrong_kind
from truearm.engine.base.units import quantity_si
from truearm.engine.robot.chain import Chain, Element, Motion
from truearm.engine.robot.conventions.convention import JointKind
from truearm.engine.robot.transform import Transform, fixed_rotation

#: Standard gravity, with the base's z upwards [m/s^2].
GRAVITY: Final = (0.0, 0.0, -9.80665)
Inertia = tuple[float, float, float, float, float, float]
ReachPoint = Literal["wrist-centre", "flange"]
POINT_MASS: Final[Inertia] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
SLIDES: Final[tuple[tuple[str, Motion], ...]] = (("x", "Tx"), ("y", "Ty"), ("z", "Tz"))
TURNS: Final[tuple[tuple[str, Motion], ...]] = (("rx", "Rx"), ("ry", "Ry"), ("rz", "Rz"))
#: At 100 % no joint of an arm is slower or faster [rad/s, m/s].
JOINT_SPEEDS: Final[Mapping[JointKind, tuple[float, float]]] = {
    "revolute": (math.radians(10.0), math.radians(10_000.0)),
    "prismatic": (0.01, 20.0),
}
#: How often a gear errs in a turn of its joint: at least, at most, and so many different numbers a joint.
_FEWEST_PERIODS, _MOST_PERIODS, _MOST_LINES = 1, 10_000, 20


def gear_periods(given: object) -> tuple[int, ...]:
    """Return how often a gear errs in a turn: of None nothing, of a whole number that one, of a list all of them.

    Raises
    ------
    InputError
        If there are others than whole numbers from 1 to 10 000, one of them twice, or more than 20.
    """
    periods: list[int] = []
    for n in [] if given is None else given if isinstance(given, list | tuple) else [given]:
        whole = int(n) if isinstance(n, Integral) and not isinstance(n, bool) else 0
        if not _FEWEST_PERIODS <= whole <= _MOST_PERIODS or whole in periods or len(periods) == _MOST_LINES:
            raise InputError(
                "how often a gear errs in a turn belongs here, each number once",
                parameter="transmission_periods",
                came=n if isinstance(n, str | int | float) else None,
                allowed=f"a whole number from {_FEWEST_PERIODS} to {_MOST_PERIODS}, or a list of up to {_MOST_LINES} "
                "different ones",
            )
        periods.append(whole)
    return tuple(periods)


@dataclass(frozen=True)
class Joint:
    """One joint as the robot file describes it."""

    name: str  #: The maker's name.
    kind: JointKind  #: ``revolute`` or ``prismatic``.
    row: Mapping[str, float]  #: Nominal value of each column of the convention [m and rad].
    limits: tuple[float, float] | None = None  #: Lowest and highest joint position [rad or m], where known.
    #: How often the joint's gear errs in a turn of the joint, where known: for a strain wave gear twice the turns of
    #: its wave generator. A gear that errs at several numbers has several. Kept as a tuple, see :attr:`periods`.
    transmission_periods: int | Sequence[int] | None = None
    #: How far along the joint's axis its bearing lies [m], from the joint's origin at nominal values (the origin of the
    #: frame right behind the joint's turn); None if that is not known, and zero is assumed. Joints that slide have
    #: none.
    bearing: float | None = None
    max_speed: float | None = None  #: How fast it goes at 100 % [rad/s or m/s], where known.

    def __post_init__(self) -> None:
        """Refuse numbers of periods that no gear has; keep them as a tuple, whatever was given."""
        object.__setattr__(self, "transmission_periods", gear_periods(self.transmission_periods))

    @property
    def periods(self) -> tuple[int, ...]:
        """Each number of times that its gear errs in a turn, as they were given; empty where none is known."""
        return gear_periods(self.transmission_periods)

    @property
    def periods_entry(self) -> int | list[int] | None:
        """What a file says of :attr:`periods`: one number, a list of several, None where none is known."""
        return self.periods[0] if len(self.periods) == 1 else list(self.periods) or None

    @property
    def range(self) -> tuple[float, float]:
        """Where it can be [rad or m]: within its limits, or a turn, or 1 m."""
        return self.limits or ((-math.pi, math.pi) if self.kind == "revolute" else (-0.5, 0.5))


@dataclass(frozen=True)
class Reach:
    """How far an arm reaches, as its maker says."""

    distance: float  #: [m].
    #: The joint, from 1, from the line of whose axis it is measured; None if it is of no such line and point.
    axis: int | None = None
    #: Up to where: ``flange``, or ``wrist-centre``, the point of the last axis that is nearest to the axis before it.
    #: None with `axis`.
    point: ReachPoint | None = None

    @property
    def text(self) -> str:
        """In words, in mm."""
        words = f"{self.distance * 1e3:.6g} mm"
        if self.point is None:
            return words
        return f"{words} from axis {self.axis} to the {self.point.replace('-', ' ')}"


@dataclass(frozen=True)
class LinkMass:
    """Mass of the link behind a joint."""

    joint: int  #: Number of the joint, from 1.
    mass: float  #: [kg].
    cog: tuple[float, float, float]  #: Centre of gravity in the link's frame [m].
    #: Entries xx, yy, zz, xy, xz, yz of the inertia tensor about the centre of gravity, in the axes of the link's frame
    #: [kg m^2], so that xy is minus the integral of x y; zero is a point mass.
    inertia: Inertia = POINT_MASS


@dataclass(frozen=True)
class Payload:
    """What hangs on the flange."""

    mass: float = 0.0  #: [kg].
    cog: tuple[float, float, float] = (0.0, 0.0, 0.0)  #: Centre of gravity in the flange frame [m].

    def __post_init__(self) -> None:
        """Refuse a mass below zero, and what is no number; keep plain numbers, which can be compared."""
        object.__setattr__(self, "mass", finite_number(self.mass, "mass", lowest=0.0))
        object.__setattr__(self, "cog", tuple(number_array(self.cog, "cog", (3,)).tolist()))

    @property
    def text(self) -> str:
        """As :meth:`of_text` reads it."""
        return ",".join([f"{self.mass:.15g}kg", *(f"{v * 1e3:.15g}mm" for v in self.cog)])

    @classmethod
    def of(cls, payload: object, parameter: str = "payload") -> Payload:
        """Return the payload that was given, or that a text names, see :meth:`of_text`."""
        if isinstance(payload, Payload):
            return payload
        if isinstance(payload, str):
            return cls.of_text(payload, parameter)
        allowed = "a Payload, or a text: 2.7kg,50mm,25mm,100mm"
        raise wrong_kind("a payload belongs here", payload, parameter, allowed)

    @classmethod
    def of_text(cls, text: str, parameter: str = "payload") -> Payload:
        """Return the payload that a text such as ``2.7kg,50mm,25mm,100mm`` names, units always given.

        Raises
        ------
        InputError
            If a part is missing or has no unit, or the mass is negative.
        """
        parts = text.split(",")
        if len(parts) != 4:
            raise InputError(
                "a mass and the three coordinates of its centre of gravity belong here",
                parameter=parameter,
                came=text,
                allowed=_WHOLE,
            )
        mass, x, y, z = (
            quantity_si(part, units, parameter, "2.7" if units is _MASSES else "50", _WHOLE)
            for part, units in zip(parts, (_MASSES, _LENGTHS, _LENGTHS, _LENGTHS), strict=True)
        )
        if mass < 0.0:
            raise InputError("a mass cannot be negative", parameter=parameter, came=parts[0])
        return cls(mass, (x, y, z))


_MASSES: Final = ("kg", "g")
_LENGTHS: Final = ("mm", "m")
_WHOLE: Final = "2.7kg,50mm,25mm,100mm"


NO_PAYLOAD: Final = Payload()


def checked_gravity(gravity: object, parameter: str = "gravity") -> tuple[float, float, float]:
    """Return an acceleration of free fall in the base frame [m/s^2], refusing what cannot be one."""
    x, y, z = number_array(gravity, parameter, (3,)).tolist()
    if not 0.1 <= math.hypot(x, y, z) <= 100.0:
        raise InputError(
            "this cannot be the acceleration of free fall",
            parameter=parameter,
            came=f"{math.hypot(x, y, z):g} m/s^2",
            allowed="about 9.81 m/s^2 on Earth, 0.1 to 100",
            cure="Give x, y and z in the robot's base frame: 0,0,-9.81 stands, 0,0,9.81 hangs.",
        )
    return x, y, z


@dataclass(frozen=True)
class Target:
    """A point, or a frame, fixed to the flange, that an instrument sees.

    Its position is three parameters; its orientation is `quaternion` followed by three small rotations that are
    parameters too.
    """

    name: str  #: As the data call it.
    #: Reference orientation in the flange frame, None for a point.
    quaternion: tuple[float, float, float, float] | None = None

    def parameter(self, axis: str) -> str:
        """Return the name of the parameter for ``x``, ``y``, ``z``, ``rx``, ``ry`` or ``rz``."""
        prefix = self.name if self.name.startswith("target") else f"target_{self.name}"
        return f"{prefix}_{axis}"

    @cached_property
    def chain(self) -> Chain:
        """The way from the flange to the target."""
        elements = tuple(Element(motion, parameter=self.parameter(axis)) for axis, motion in SLIDES)
        if self.quaternion is not None:
            elements += fixed_rotation(self.quaternion)
            elements += tuple(Element(motion, parameter=self.parameter(axis)) for axis, motion in TURNS)
        return Chain(elements)


@dataclass(frozen=True)
class Truth:
    """Published or chosen parameter values, for simulation."""

    source: str  #: Where they come from.
    values: Mapping[str, float]  #: Parameter values [m, rad]; what is not named is nominal.
    #: Deflection of a joint per moment about its axis [rad/(N m)], by joint number; only the twin knows it.
    compliance: Mapping[int, float] = field(default_factory=dict)
    #: backlash, clearance: whole play of a joint, and how far its shaft tilts from the middle [rad], likewise.
    backlash: Mapping[int, float] = field(default_factory=dict)
    clearance: Mapping[int, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Tool:
    """An end-effector with targets, for simulation."""

    targets: Mapping[str, tuple[float, float, float]]  #: Position of each target in the flange frame [m].
    mass: float = 0.0  #: mass, cog: [kg] and [m] in the flange frame, where known.
    cog: tuple[float, float, float] = (0.0, 0.0, 0.0)


FixtureKind = Literal["point", "plane", "frame"]


@dataclass(frozen=True)
class Fixture:
    """A point, a plane or a frame that stands still in the world.

    A point is three coordinates. A frame is three coordinates and three small rotations behind `quaternion`. A plane
    is two small rotations behind `quaternion` and its distance from the origin along the normal, which is z of what
    comes out: Hesse's normal form.
    """

    name: str  #: As the data call it.
    kind: FixtureKind  #: ``point``, ``plane`` or ``frame``.
    #: Reference orientation in the world; a point needs none.
    quaternion: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)

    def parameter(self, axis: str) -> str:
        """Return the name of the parameter for ``x``, ``y``, ``z``, ``rx``, ``ry`` or ``rz``."""
        prefix = self.name if self.name.startswith("fixture") else f"fixture_{self.name}"
        return f"{prefix}_{axis}"

    @cached_property
    def chain(self) -> Chain:
        """The way from the world to the fixture."""
        slides = tuple(Element(motion, parameter=self.parameter(axis)) for axis, motion in SLIDES)
        turns = tuple(Element(motion, parameter=self.parameter(axis)) for axis, motion in TURNS)
        if self.kind == "point":
            return Chain(slides)
        if self.kind == "plane":
            return Chain((*fixed_rotation(self.quaternion), *turns[:2], slides[2]))
        return Chain((*slides, *fixed_rotation(self.quaternion), *turns))

    def values_at(self, place: Transform) -> dict[str, float]:
        """Return the parameter values of a fixture at a place that is turned as `quaternion` says.

        Args:
            place: A point's or frame's; for a plane a frame with its origin in the plane and its z along the normal.
        """
        if self.kind == "plane":
            height = float(place.rotation[:, 2] @ place.translation)
            return {self.parameter("z"): height}
        return {self.parameter(axis): value for axis, value in zip("xyz", place.translation, strict=True)}
