"""The schema of robot files: which entries there are, and what each may be."""

from __future__ import annotations

import math
from typing import Annotated, Final, Literal

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, PlainValidator, StringConstraints

from truearm.engine.base.errors import InputError, did_you_mean, is_one_line
from truearm.engine.robot.effects import EFFECTS
from truearm.engine.robot.parts import GRAVITY, POINT_MASS, FixtureKind, Inertia, gear_periods
from truearm.engine.robot.robot_file.curve_entry import CurveEntry
from truearm.engine.robot.robot_file.entries import (
    STRICT,
    BalancerEntry,
    ControllerEntry,
    Name,
    NotNegative,
    Number,
    Place,
    Positive,
    Quaternion,
    ReachEntry,
    Share,
    Triple,
)

SCHEMA: Final = "truearm-robot/1"


def _of_a_body(inertia: Inertia) -> Inertia:
    """Refuse moments that no mass distribution has: the largest principal one exceeds the sum of the others."""
    xx, yy, zz, xy, xz, yz = inertia
    small, middle, large = (float(v) for v in np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    if small + middle < large * (1.0 - 1e-6):  # small < 0 included; files round a flat or thin body
        raise ValueError(
            f"no body has these moments of inertia (xx, yy, zz, xy, xz, yz): the principal ones are {small:.6g}, "
            f"{middle:.6g} and {large:.6g} kg m^2, and none may be negative or exceed the sum of the two others"
        )
    return inertia


Moments = Annotated[tuple[Number, Number, Number, Number, Number, Number], AfterValidator(_of_a_body)]


def _one_line(name: str) -> str:
    if not is_one_line(name):
        raise InputError("a name belongs here", came=name, allowed="one line of text without control characters")
    return name


#: Targets are called what the data call them.
TargetName = Annotated[str, StringConstraints(strict=True), AfterValidator(_one_line)]


def _known_effect(name: str) -> str:
    known = [effect.name for effect in EFFECTS]
    if name not in known:
        raise InputError(
            "there is no joint effect of this name", came=name, allowed=", ".join(known), cure=did_you_mean(name, known)
        )
    return name


EffectName = Annotated[str, AfterValidator(_known_effect)]


class _Entry(BaseModel):
    model_config = STRICT


class UnitsEntry(_Entry):
    """What lengths and angles of the file are written in."""

    length: Literal["mm", "m", "um", "in"]
    angle: Literal["deg", "rad"]


class JointEntry(BaseModel):
    """A row of the table: the columns depend on the convention and are checked with it."""

    model_config = ConfigDict(extra="allow", frozen=True)
    name: Name | None = None
    type: Literal["revolute", "prismatic"] = "revolute"
    limits: tuple[Number, Number] | None = None
    transmission_periods: Annotated[tuple[int, ...], PlainValidator(gear_periods)] = ()
    bearing: Number | None = None
    max_speed: Number | None = None


class MassEntry(_Entry):
    """The mass of a link."""

    link: Annotated[int, Field(strict=True)]
    mass: NotNegative
    cog: Triple
    inertia: Moments = POINT_MASS


class ToolEntry(_Entry):
    """A tool for simulation."""

    targets: dict[TargetName, Triple]
    mass: NotNegative = 0.0
    cog: Triple = (0.0, 0.0, 0.0)


class PayloadEntry(_Entry):
    """What hangs on the flange."""

    mass: NotNegative
    cog: Triple = (0.0, 0.0, 0.0)


def _falls(gravity: tuple[float, float, float]) -> tuple[float, float, float]:
    if not 0.1 <= math.hypot(*gravity) <= 100.0:
        raise InputError(
            f"free fall must be 0.1 to 100 m/s^2, this one is {math.hypot(*gravity):.6g}", came=list(gravity)
        )
    return gravity


class TruthEntry(_Entry):
    """A real robot for simulation."""

    source: str
    values: dict[str, Number]
    compliance: dict[Annotated[int, Field(strict=True)], NotNegative] = {}
    backlash: dict[Annotated[int, Field(strict=True)], NotNegative] = {}
    clearance: dict[Annotated[int, Field(strict=True)], NotNegative] = {}


class TargetEntry(_Entry):
    """What the instrument sees."""

    name: TargetName
    quaternion: Quaternion | None = None


class FixtureEntry(_Entry):
    """What stands beside the robot."""

    name: TargetName
    kind: FixtureKind
    quaternion: Quaternion | None = None


class ParameterEntry(_Entry):
    """A parameter that is not at its plain nominal value."""

    nominal: Number
    value: Number
    prior: Positive
    unit: str
    deviation: NotNegative | None = None
    informed: Share | None = None


class PriorsEntry(_Entry):
    """What the nominal values are good for."""

    length: Positive | None = None
    angle: Positive | None = None


class NoticeEntry(_Entry):
    """A notice of the level error, or a note."""

    code: Name
    message: str


class ProofEntry(_Entry):
    """What the calibration knew about its result; `correlations` are the rows of a lower triangular factor.

    `measured` are joint positions in deg and mm, whatever the units of the file.
    """

    status: Literal["converged", "at-bound", "rank-loss", "not-converged", "implausible"]
    errors: list[NoticeEntry] = []
    warnings: list[NoticeEntry] = []
    lower_bound: Annotated[bool, Field(strict=True)] = False
    region: list[tuple[Number, Number]] = []
    joint_error: list[NotNegative] = []
    held: list[TargetName] = []
    loads: list[tuple[Number, Number]] = []
    deviations: dict[str, NotNegative] = {}
    correlations: (
        list[Annotated[str, StringConstraints(strict=True)]] | Annotated[str, StringConstraints(strict=True)]
    ) = []
    measured: list[Annotated[str, StringConstraints(strict=True)]] = []
    sha256: Annotated[str, StringConstraints(strict=True, pattern="^[0-9a-f]{64}$")]


class RobotFile(_Entry):
    """Schema ``truearm-robot/1``."""

    truearm: Literal["truearm-robot/1"]
    name: Name
    title: str = ""
    maker: str = ""
    source: str = ""
    units: UnitsEntry
    convention: Literal[
        "standard-dh",
        "modified-dh",
        "hayati",
        "modified-hayati",
        "s-model",
        "cpc",
        "mcpc",
        "zero-reference",
        "product-of-exponentials",
        "translations",
        "joint-errors",
        "urdf",
    ]
    joints: list[JointEntry] = Field(min_length=1)
    flange: Place = Place()
    controller: ControllerEntry = ControllerEntry()
    masses: list[MassEntry] = []
    balancers: list[BalancerEntry] = Field([], max_length=20)
    payload: PayloadEntry | None = None
    rated_load: Positive | None = None
    reach: ReachEntry | None = None
    gravity: Annotated[Triple, AfterValidator(_falls)] = GRAVITY
    tools: dict[Name, ToolEntry] = {}
    truths: dict[Name, TruthEntry] = {}
    priors: PriorsEntry = PriorsEntry()
    effects: list[EffectName] = []
    base_quaternion: Quaternion = (1.0, 0.0, 0.0, 0.0)
    targets: list[TargetEntry] = []
    fixtures: list[FixtureEntry] = []
    parameters: dict[str, ParameterEntry] = {}
    joint_curves: list[CurveEntry] = []
    proof: ProofEntry | None = None
    simulated: Annotated[bool, Field(strict=True)] = False
    history: list[str] = []
