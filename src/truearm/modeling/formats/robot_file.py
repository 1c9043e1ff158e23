"""Robot files: one YAML file is one robot, nominal or calibrated.

Lengths are written in the file's own units and kept in SI inside. Reading a file and writing it again gives the
same file from the second time on.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, StringConstraints, model_validator

from truearm.errors import InputError, nearest_names
from truearm.files import is_one_line, read_yaml
from truearm.modeling.controller import AS_THE_MODEL
from truearm.modeling.conventions import convention
from truearm.modeling.effects import EFFECTS
from truearm.modeling.fixtures import Fixture, FixtureKind
from truearm.modeling.formats.controller_entry import ControllerEntry, controller_entry
from truearm.modeling.formats.entries import (
    NAME,
    STRICT,
    Name,
    NotNegative,
    Number,
    Place,
    Positive,
    Quaternion,
    Triple,
    place_entry,
)
from truearm.modeling.parameters import Parameter
from truearm.modeling.parts import (
    GRAVITY,
    NO_PAYLOAD,
    POINT_MASS,
    Inertia,
    Joint,
    LinkMass,
    Payload,
    Target,
    Tool,
    Truth,
)
from truearm.modeling.robot import Robot
from truearm.modeling.transform import Transform
from truearm.units import SHOWN_AS, sized_si, to_si, written

SCHEMA = "truearm-robot/1"
#: Groups of parameters that cannot be negative. An identified value may come out so, and the next calibration starts
#: from it; what somebody states may not, and a file that somebody wrote has no history.
_POSITIVE: Final = ("compliance", "bearing-compliance", "backlash", "clearance", "clearance-linear-contact")


def _of_a_body(inertia: Inertia) -> Inertia:
    """Refuse moments that no mass distribution has: the largest principal one exceeds the sum of the others."""
    xx, yy, zz, xy, xz, yz = inertia
    small, middle, large = (float(v) for v in np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    if small + middle < large * (1.0 - 1e-6):  # small < 0 included; files round a flat or thin body
        raise ValueError(
            f"no body has these moments of inertia (xx, yy, zz, xy, xz, yz): the principal ones are {small:.6g}, "
            f"{middle:.6g} and {large:.6g} kg m^2, but none can be negative or exceed the sum of the two others"
        )
    return inertia


Moments = Annotated[tuple[Number, Number, Number, Number, Number, Number], AfterValidator(_of_a_body)]


def _one_line(name: str) -> str:
    if not is_one_line(name):
        raise ValueError("a name belongs here: one line of text, not empty, without control characters")
    return name


#: Targets are called what the data call them.
TargetName = Annotated[str, StringConstraints(strict=True), AfterValidator(_one_line)]


class _Entry(BaseModel):
    model_config = STRICT


class _Units(_Entry):
    length: Literal["mm", "m", "um", "in"]
    angle: Literal["deg", "rad"]


class _Joint(BaseModel):
    """A row of the table: the columns depend on the convention and are checked with it."""

    model_config = ConfigDict(extra="allow", frozen=True)
    name: Name | None = None
    type: Literal["revolute", "prismatic"] = "revolute"
    limits: tuple[Number, Number] | None = None
    transmission_periods: Annotated[int, Field(strict=True, ge=1, le=10_000)] | None = None


class _Mass(_Entry):
    link: Annotated[int, Field(strict=True)]
    mass: NotNegative
    cog: Triple
    inertia: Moments = POINT_MASS


class _Tool(_Entry):
    targets: dict[TargetName, Triple]
    mass: NotNegative = 0.0
    cog: Triple = (0.0, 0.0, 0.0)


class _Payload(_Entry):
    mass: NotNegative
    cog: Triple = (0.0, 0.0, 0.0)


def _falls(gravity: tuple[float, float, float]) -> tuple[float, float, float]:
    if not 0.1 <= math.hypot(*gravity) <= 100.0:
        raise ValueError(f"free fall of 0.1 to 100 m/s^2 belongs here, this one has {math.hypot(*gravity):.6g}")
    return gravity


class _Truth(_Entry):
    source: str
    values: dict[str, Number]
    compliance: dict[Annotated[int, Field(strict=True)], NotNegative] = {}


class _Target(_Entry):
    name: TargetName
    quaternion: Quaternion | None = None


class _Fixture(_Entry):
    name: TargetName
    kind: FixtureKind
    quaternion: Quaternion | None = None


class _Parameter(_Entry):
    nominal: Number
    value: Number
    prior: Positive
    unit: str
    deviation: Number | None = None
    informed: Number | None = None


class _Priors(_Entry):
    length: Positive | None = None
    angle: Positive | None = None


class RobotFile(_Entry):
    """Schema ``truearm-robot/1``."""

    truearm: Literal["truearm-robot/1"]
    name: Name
    title: str = ""
    source: str = ""
    units: _Units
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
    joints: list[_Joint] = Field(min_length=1)
    flange: Place = Place()
    controller: ControllerEntry = ControllerEntry()
    masses: list[_Mass] = []
    payload: _Payload | None = None
    gravity: Annotated[Triple, AfterValidator(_falls)] = GRAVITY
    tools: dict[Name, _Tool] = {}
    truths: dict[Name, _Truth] = {}
    priors: _Priors = _Priors()
    effects: list[str] = []
    base_quaternion: Quaternion = (1.0, 0.0, 0.0, 0.0)
    targets: list[_Target] = []
    fixtures: list[_Fixture] = []
    parameters: dict[str, _Parameter] = {}
    history: list[str] = []

    @model_validator(mode="after")
    def _effects_known(self) -> RobotFile:
        known = [effect.name for effect in EFFECTS]
        for name in self.effects:
            if name not in known:
                near = nearest_names(name, known)
                cure = f"; did you mean {' or '.join(near)}?" if near else ""
                raise ValueError(f"there is no joint effect {name!r}; allowed: {', '.join(known)}{cure}")
        return self


def read_robot(path: Path) -> Robot:
    """Read a robot file."""
    return robot_from_file(read_yaml(path, RobotFile), str(path))


def robot_from_file(content: RobotFile, where: str) -> Robot:
    """Build the robot that a checked file describes; `where` names the file in messages."""
    length, angle = content.units.length, content.units.angle

    def si(value: float, unit: str, entry: str, *, deviation: bool = False) -> float:
        return sized_si(value, unit, f"{where}, {entry}", deviation=deviation)

    def metres(values: tuple[float, float, float], entry: str) -> tuple[float, float, float]:
        x, y, z = (si(v, length, entry) for v in values)
        return x, y, z

    joints = tuple(
        _joint(content, number, entry, f"{where}, joints[{number}]") for number, entry in enumerate(content.joints, 1)
    )
    names = [joint.name for joint in joints]
    for number, name in enumerate(names, 1):
        if name in names[: number - 1]:
            raise InputError(
                "two joints have the same name",
                where=f"{where}, joints[{number}]",
                came=name,
                cure=f"joints[{names.index(name) + 1}] has it too: rename one of them.",
            )
    numbered = [("link", "masses", mass.link) for mass in content.masses]
    for name, truth in content.truths.items():
        numbered += [("joint", f"truths.{name}.compliance", joint) for joint in truth.compliance]
    for kind, part, number in numbered:
        if not 1 <= number <= len(joints):
            raise InputError(
                f"there is no such {kind}", where=f"{where}, {part}", came=number, allowed=f"1 to {len(joints)}"
            )
    robot = Robot(
        name=content.name,
        title=content.title or content.name,
        source=content.source,
        convention_name=content.convention,
        joints=joints,
        flange=content.flange.transform(length, f"{where}, flange"),
        controller=content.controller.controller(joints, length, angle, f"{where}, controller"),
        masses=tuple(
            LinkMass(
                m.link,
                si(m.mass, "1", f"masses[{i}].mass"),
                metres(m.cog, f"masses[{i}].cog"),
                _inertia(m.inertia, f"{where}, masses[{i}].inertia"),
            )
            for i, m in enumerate(content.masses, 1)
        ),
        payload=NO_PAYLOAD
        if content.payload is None
        else Payload(si(content.payload.mass, "1", "payload.mass"), metres(content.payload.cog, "payload.cog")),
        gravity=content.gravity,
        base_quaternion=content.base_quaternion,
        targets=tuple(Target(t.name, t.quaternion) for t in content.targets),
        fixtures=tuple(Fixture(f.name, f.kind, f.quaternion or (1.0, 0.0, 0.0, 0.0)) for f in content.fixtures),
        effect_names=tuple(content.effects),
        priors={
            unit: si(value, file_unit, f"priors.{entry}", deviation=True)
            for unit, entry, value, file_unit in (
                ("m", "length", content.priors.length, length),
                ("rad", "angle", content.priors.angle, angle),
            )
            if value is not None
        },
        tools={
            name: Tool(
                {t: metres(p, f"tools.{name}.targets.{t}") for t, p in tool.targets.items()},
                si(tool.mass, "1", f"tools.{name}.mass"),
                metres(tool.cog, f"tools.{name}.cog"),
            )
            for name, tool in content.tools.items()
        },
        history=tuple(content.history),
    )
    shown = {**SHOWN_AS, "m": length, "rad": angle}

    def known(name: str, entry: str) -> Parameter:
        if name in robot.parameters:
            return robot.parameters[name]
        near = nearest_names(name, robot.parameters)
        cure = f"Did you mean {' or '.join(near)}?" if near else None
        for effect in EFFECTS:
            if name in [p.name for p in effect(robot.layout).parameters]:
                cure = f"It belongs to the joint effect {effect.name}: add that to the entry effects."
        raise InputError("the robot has no such parameter", where=f"{where}, {entry}", came=name, cure=cure)

    truths = {
        truth_name: Truth(
            truth.source,
            {
                n: si(v, shown[known(n, f"truths.{truth_name}").unit], f"truths.{truth_name}.values.{n}")
                for n, v in truth.values.items()
            },
            {n: si(v, "1", f"truths.{truth_name}.compliance.{n}") for n, v in truth.compliance.items()},
        )
        for truth_name, truth in content.truths.items()
    }
    parameters = []
    for name, entry in content.parameters.items():
        place = f"parameters.{name}"
        plain = known(name, "parameters")
        unit = shown[plain.unit]
        for key, stated in (("nominal", entry.nominal), ("value", entry.value)):
            if plain.group in _POSITIVE and stated < 0.0 and not content.history:
                raise InputError(
                    "no joint has a negative one",
                    where=f"{where}, {place}.{key}",
                    came=f"{stated:g} {unit}",
                    allowed="0 or more",
                )
        if entry.unit != unit:
            raise InputError(
                "the unit differs from the file's", where=f"{where}, {place}", came=entry.unit, allowed=unit
            )
        parameters.append(
            Parameter(
                name,
                plain.unit,
                plain.group,
                nominal=si(entry.nominal, unit, f"{place}.nominal"),
                value=si(entry.value, unit, f"{place}.value"),
                prior=si(entry.prior, unit, f"{place}.prior", deviation=True),
                deviation=None if entry.deviation is None else to_si(entry.deviation, unit),
                informed=entry.informed,
            )
        )
    return replace(robot, truths=truths, known={p.name: p for p in parameters})


def _joint(content: RobotFile, number: int, entry: _Joint, where: str) -> Joint:
    table = convention(content.convention)
    units = table.row_units(entry.type)
    shown = {"m": content.units.length, "rad": content.units.angle, "1": "1"}
    vectors = [name for name in table.vectors if f"{name}_x" in units]
    allowed = [*(c for c in units if c.rpartition("_")[0] not in vectors), *vectors]
    row: dict[str, float] = {}
    for column, value in (entry.model_extra or {}).items():
        if column in vectors:
            unit = units[f"{column}_x"]
            row |= _vector(column, value, shown[unit], f"{where}.{column}", direction=unit == "1")
            continue
        if column not in allowed:
            near = nearest_names(column, allowed)
            raise InputError(
                f"a joint of convention {content.convention} has no such entry",
                where=where,
                came=column,
                allowed=", ".join(["name", "type", "limits", "transmission_periods", *allowed]),
                cure=f"Did you mean {' or '.join(near)}?" if near else None,
            )
        row[column] = sized_si(_number(value, f"{where}.{column}"), shown[units[column]], f"{where}.{column}")
    fault = table.fault(row, entry.type)
    if fault:
        raise InputError(fault, where=where)
    unit = content.units.angle if entry.type == "revolute" else content.units.length
    limits = None
    if entry.limits is not None:
        low, high = entry.limits
        if not low < high:
            raise InputError("the lower limit must be below the upper one", where=f"{where}.limits", came=[low, high])
        limits = (sized_si(low, unit, f"{where}.limits"), sized_si(high, unit, f"{where}.limits"))
    elif entry.type == "prismatic":
        raise InputError(
            "a prismatic joint must have limits",
            where=where,
            allowed=f"limits: [LOWEST, HIGHEST] in {unit}",
            cure="Give what the controller allows.",
        )
    return Joint(entry.name or f"joint_{number}", entry.type, row, limits, entry.transmission_periods)


def _vector(name: str, value: object, unit: str, where: str, *, direction: bool) -> dict[str, float]:
    if not isinstance(value, list) or len(value) != 3:
        raise InputError("three numbers belong here", where=where, came=_scalar(value), allowed="[x, y, z]")
    numbers = [_number(v, where) for v in value]
    if direction and abs(math.hypot(*numbers) - 1.0) > 1e-6:
        raise InputError("a direction must have length 1", where=where, came=value)
    return {f"{name}_{a}": sized_si(v, unit, where) for a, v in zip("xyz", numbers, strict=True)}


def _inertia(moments: Inertia, where: str) -> Inertia:
    xx, yy, zz, xy, xz, yz = (sized_si(v, "1", where) for v in moments)
    return xx, yy, zz, xy, xz, yz


def _number(value: object, where: str) -> float:
    try:
        if not isinstance(value, bool) and isinstance(value, int | float) and math.isfinite(value):
            return float(value)
    except OverflowError:  # a whole number that no float can hold
        pass
    raise InputError("a number belongs here", where=where, came=_scalar(value))


def _scalar(value: object) -> object:
    """Return a value as a message shows it: of a list or a mapping only that it is one."""
    return value if isinstance(value, str | int | float | None) else type(value).__name__


# -- writing ---------------------------------------------------------------------------------------------------


def robot_text(robot: Robot) -> str:
    """Return the robot as the text of a robot file, in mm and degrees."""
    from ruamel.yaml import YAML
    from ruamel.yaml.comments import CommentedMap, CommentedSeq
    from ruamel.yaml.scalarstring import DoubleQuotedScalarString

    def flow(content: Mapping[str, Any]) -> CommentedMap:
        made = CommentedMap(content)
        made.fa.set_flow_style()
        return made

    def listed(content: list[Any]) -> CommentedSeq:
        made = CommentedSeq(content)
        made.fa.set_flow_style()
        return made

    def flowing(content: Any) -> Any:
        """Return an entry with its lists of numbers, and the rows of its tables, on one line each."""
        if isinstance(content, dict):
            return {key: flowing(part) for key, part in content.items()}
        if isinstance(content, list):
            return [flow(row) for row in content] if isinstance(content[0], dict) else listed(content)
        return content

    def mm(values: tuple[float, float, float]) -> CommentedSeq:
        return listed([written(v, "mm") for v in values])

    def text(words: str) -> str:  # the writer leaves some texts without the quotes that its reader needs
        return words if re.fullmatch(NAME, words) else DoubleQuotedScalarString(words)

    shown = SHOWN_AS

    def joint(j: Joint) -> CommentedMap:
        row: dict[str, Any] = {"name": j.name, "type": j.kind}
        units = robot.convention.row_units(j.kind)
        vectors = [name for name in robot.convention.vectors if f"{name}_x" in j.row]
        entries = {c: written(v, shown[units[c]]) for c, v in j.row.items()}
        row |= {name: listed([entries.pop(f"{name}_{a}") for a in "xyz"]) for name in vectors} | entries
        if j.limits:
            row["limits"] = listed([written(v, "deg" if j.kind == "revolute" else "mm") for v in j.limits])
        if j.transmission_periods:
            row["transmission_periods"] = j.transmission_periods
        return flow(row)

    content: dict[str, Any] = {
        "truearm": SCHEMA,
        "name": robot.name,
        "title": robot.title,
        "source": robot.source,
        "units": flow({"length": "mm", "angle": "deg"}),
        "convention": robot.convention_name,
        "joints": [joint(j) for j in robot.joints],
    }
    if robot.flange != Transform():
        content["flange"] = flowing(place_entry(robot.flange))
    if robot.controller != AS_THE_MODEL:
        content["controller"] = flowing(controller_entry(robot.controller, robot.joints))
    if robot.masses:
        content["masses"] = [
            flow(
                {"link": m.joint, "mass": m.mass, "cog": mm(m.cog)}
                | ({"inertia": listed(list(m.inertia))} if any(m.inertia) else {})
            )
            for m in robot.masses
        ]
    if robot.payload != NO_PAYLOAD:
        content["payload"] = flow({"mass": robot.payload.mass, "cog": mm(robot.payload.cog)})
    if robot.gravity != GRAVITY:
        content["gravity"] = listed(list(robot.gravity))
    if robot.tools:
        content["tools"] = {
            name: {"targets": {text(t): mm(p) for t, p in tool.targets.items()}, "mass": tool.mass, "cog": mm(tool.cog)}
            for name, tool in robot.tools.items()
        }
    if robot.truths:
        content["truths"] = {
            name: {
                "source": truth.source,
                "values": {n: written(v, shown[robot.parameters[n].unit]) for n, v in truth.values.items()},
                "compliance": dict(truth.compliance),
            }
            for name, truth in robot.truths.items()
        }
    if robot.priors:
        names = {"m": "length", "rad": "angle"}
        content["priors"] = {names[u]: written(v, shown[u]) for u, v in robot.priors.items()}
    if robot.effect_names:
        content["effects"] = list(robot.effect_names)
    if robot.base_quaternion != (1.0, 0.0, 0.0, 0.0):
        content["base_quaternion"] = listed(list(robot.base_quaternion))
    if robot.targets:
        content["targets"] = [
            flow({"name": text(t.name)} | ({"quaternion": listed(list(t.quaternion))} if t.quaternion else {}))
            for t in robot.targets
        ]
    if robot.fixtures:
        content["fixtures"] = [
            flow(
                {"name": text(f.name), "kind": f.kind}
                | ({} if f.kind == "point" else {"quaternion": listed(list(f.quaternion))})
            )
            for f in robot.fixtures
        ]
    if robot.known:
        content["parameters"] = {
            text(name): flow(_parameter(robot.known[name], shown)) for name in robot.parameters if name in robot.known
        }
    if robot.history:
        content["history"] = list(robot.history)
    yaml = YAML()
    yaml.width = 4096
    yaml.indent(mapping=2, sequence=4, offset=2)
    stream = io.StringIO()
    yaml.dump(content, stream)
    return stream.getvalue()


def _parameter(p: Parameter, shown: Mapping[str, str]) -> dict[str, Any]:
    unit = shown[p.unit]
    made: dict[str, Any] = {
        "unit": unit,
        "nominal": written(p.nominal, unit),
        "value": written(p.value, unit),
        "prior": written(p.prior, unit),
    }
    if p.deviation is not None:
        made["deviation"] = written(p.deviation, unit)
    if p.informed is not None:
        made["informed"] = p.informed
    return made
