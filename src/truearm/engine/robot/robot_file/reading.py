"""From a robot file to a robot."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from truearm.engine.base.errors import InputError, Notice, counted, did_you_mean, listed, name_place
from truearm.engine.base.files import read_yaml
from truearm.engine.base.schemas import shown_entry
from truearm.engine.base.units import SHOWN_AS, as_number, from_si, sized_si, to_si
from truearm.engine.robot.conventions import convention
from truearm.engine.robot.conventions.convention import JointKind
from truearm.engine.robot.effects import EFFECTS, NON_NEGATIVE
from truearm.engine.robot.effects.joint_curve import JointCurve
from truearm.engine.robot.parameters import SCALE, SCALE_GROUP, Parameter
from truearm.engine.robot.parts import (
    JOINT_SPEEDS,
    NO_PAYLOAD,
    Fixture,
    Inertia,
    Joint,
    LinkMass,
    Payload,
    Target,
    Tool,
    Truth,
)
from truearm.engine.robot.proof import HELD, Proof
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.curve_entry import coefficient_si, curve_parameters, factor_from
from truearm.engine.robot.robot_file.entries import STATED, check_anchors
from truearm.engine.robot.robot_file.schema import JointEntry, ProofEntry, RobotFile


def read_robot(path: Path) -> Robot:
    """Read a robot file."""
    return robot_from_file(read_yaml(path, RobotFile), str(path))


def robot_from_file(content: RobotFile, where: str) -> Robot:
    """Build the robot that a checked file describes; `where` names the file in messages."""
    try:
        return _robot(content, where)
    except InputError as error:  # of the robot's parts, which know nothing of the file
        if not (error.where or "").startswith(where):
            name_place(error, f"{where}, {error.where}" if error.where else where)
        raise


def _robot(content: RobotFile, where: str) -> Robot:
    length, angle = content.units.length, content.units.angle

    def si(value: float, unit: str, entry: str, *, deviation: bool = False) -> float:
        return sized_si(value, unit, f"{where}, {entry}", deviation=deviation)

    def metres(values: tuple[float, float, float], entry: str) -> tuple[float, float, float]:
        x, y, z = (si(v, length, entry) for v in values)
        return x, y, z

    joints = tuple(
        _joint(content, number, entry, f"{where}, joints[{number}]") for number, entry in enumerate(content.joints, 1)
    )
    _refuse_unsound(content, joints, where)
    robot = Robot(
        name=content.name,
        title=content.title or content.name,
        maker=content.maker,
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
        balancers=tuple(
            b.balancer(i, len(joints), length, f"{where}, balancers[{i}]") for i, b in enumerate(content.balancers, 1)
        ),
        payload=NO_PAYLOAD
        if content.payload is None
        else Payload(si(content.payload.mass, "1", "payload.mass"), metres(content.payload.cog, "payload.cog")),
        rated_load=None if content.rated_load is None else si(content.rated_load, "1", "rated_load"),
        reach=None if content.reach is None else content.reach.reach(len(joints), length, f"{where}, reach"),
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
        simulated=content.simulated,
    )
    check_anchors(robot, where)
    return _with_values(_with_controller(robot, content, where), content, where)


def _refuse_unsound(content: RobotFile, joints: Sequence[Joint], where: str) -> None:
    """Refuse names that are there twice, and numbers of joints that the robot has not."""
    otherwise = ", and both would pull: rename one of them, or take it out if it is the same one."
    for part, names, cure in (
        ("joints", [joint.name for joint in joints], ": rename one of them."),
        ("balancers", [balancer.name for balancer in content.balancers], otherwise),
    ):
        for number, name in enumerate(names, 1):
            if name is not None and name in names[: number - 1]:
                raise InputError(
                    f"two {part} have the same name",
                    where=f"{where}, {part}[{number}]",
                    came=name,
                    cure=f"{part}[{names.index(name) + 1}] has it too{cure}",
                )
    numbered = [("link", "masses", mass.link) for mass in content.masses]
    for name, truth in content.truths.items():
        for kind in ("compliance", "backlash", "clearance"):
            numbered += [("joint", f"truths.{name}.{kind}", joint) for joint in getattr(truth, kind)]
    for kind, part, number in numbered:
        if not 1 <= number <= len(joints):
            raise InputError(
                f"there is no such {kind}", where=f"{where}, {part}", came=number, allowed=f"1 to {len(joints)}"
            )


def _with_controller(robot: Robot, content: RobotFile, where: str) -> Robot:
    """Return a robot with what its controller computes with, which the file has in rows or names another file for."""
    entry, location = content.controller.kinematics, f"{where}, controller.kinematics"
    if entry in STATED if isinstance(entry, str) else not entry.joints:
        return robot
    from truearm.engine.robot.controller_kinematics import refuse_rows_of_another_type, with_controller_kinematics

    if not isinstance(entry, str):
        refuse_rows_of_another_type(robot, location)
        return robot
    try:
        return with_controller_kinematics(robot, entry, Path(where).parent)
    except InputError as error:
        name_place(error, f"{location}: {error.where}")
        raise


def _with_values(robot: Robot, content: RobotFile, where: str) -> Robot:
    """Return a robot with the values of parameters and truths that its file states."""
    shown = {**SHOWN_AS, "m": content.units.length, "rad": content.units.angle}

    def si(value: float, unit: str, entry: str, *, deviation: bool = False) -> float:
        return sized_si(value, unit, f"{where}, {entry}", deviation=deviation)

    def known(name: str, entry: str) -> Parameter:
        if name in robot.parameters:
            return robot.parameters[name]
        if name == SCALE:
            return Parameter.plain(SCALE, "1", SCALE_GROUP, 0.0, 1.0)
        cure = did_you_mean(name, robot.parameters)
        for effect in EFFECTS:
            if name in [p.name for p in effect(robot.layout).parameters]:
                cure = f"It belongs to the joint effect {effect.name}: add that to the entry effects."
        raise InputError(
            "the robot has no such parameter",
            where=f"{where}, {entry}",
            came=name,
            allowed=listed(list(robot.parameters)),
            cure=cure,
        )

    truths = {
        truth_name: Truth(
            truth.source,
            {
                n: si(v, shown[known(n, f"truths.{truth_name}").unit], f"truths.{truth_name}.values.{n}")
                for n, v in truth.values.items()
            },
            {n: si(v, "1", f"truths.{truth_name}.compliance.{n}") for n, v in truth.compliance.items()},
            {n: si(v, shown["rad"], f"truths.{truth_name}.backlash.{n}") for n, v in truth.backlash.items()},
            {n: si(v, shown["rad"], f"truths.{truth_name}.clearance.{n}") for n, v in truth.clearance.items()},
        )
        for truth_name, truth in content.truths.items()
    }
    parameters = []
    for name, entry in content.parameters.items():
        place = f"parameters.{name}"
        plain = known(name, "parameters")
        unit = shown[plain.unit]
        for key, stated in (("nominal", entry.nominal), ("value", entry.value)):
            if plain.group in NON_NEGATIVE and stated < 0.0 and not content.history:
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
        if plain.group == JointCurve.name:
            for key in ("nominal", "value", "prior"):
                coefficient_si(getattr(entry, key), unit, f"{where}, {place}.{key}", deviation=key == "prior")
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
    effect = next((effect for effect in robot.effects if isinstance(effect, JointCurve)), None)
    curves = curve_parameters(content.joint_curves, effect, content.units.angle, where)
    twice = next((p.name for p in parameters if p.name in curves), None)
    if twice is not None:
        raise InputError("the parameter stands in joint_curves too", where=f"{where}, parameters", came=twice)
    robot = replace(robot, truths=truths, known={p.name: p for p in parameters} | curves)
    return robot if content.proof is None else replace(robot, proof=_proof(robot, content.proof, shown, where))


def _proof(robot: Robot, entry: ProofEntry, shown: Mapping[str, str], where: str) -> Proof:
    """Return what a calibration knew about its result, in SI units."""
    cure = "Leave the entry proof as calibration wrote it, or take it out: the robot is then unproven."
    joints = [shown["rad" if joint.kind == "revolute" else "m"] for joint in robot.joints]
    measured = bool(entry.region or entry.joint_error or entry.deviations)
    for name, rows in (("region", entry.region), ("joint_error", entry.joint_error), ("loads", entry.loads)):
        left_out = name == "loads" and not rows  # by older versions
        if measured and not left_out and len(rows) != len(joints):
            raise InputError(
                "one entry belongs here for each joint",
                where=f"{where}, proof.{name}",
                came=counted(len(rows), "entry"),
                allowed=str(len(joints)),
                cure=cure,
            )
    unknown = next((name for name in entry.deviations if name not in robot.parameters), None)
    if unknown is not None:
        raise InputError("the robot has no such parameter", where=f"{where}, proof.deviations", came=unknown, cure=cure)
    strange = next((name for name in entry.held if name not in (*HELD, *robot.parameters)), None)
    if strange is not None:
        raise InputError(
            "nothing of this name can be held",
            where=f"{where}, proof.held",
            came=strange,
            allowed=f"{', '.join(HELD)}, or parameters of targets",
            cure=cure,
        )
    return Proof(
        status=entry.status,
        errors=tuple(Notice(error.code, error.message, "error") for error in entry.errors),
        region=tuple((to_si(low, u), to_si(high, u)) for (low, high), u in zip(entry.region, joints, strict=False)),
        joint_error=tuple(to_si(value, u) for value, u in zip(entry.joint_error, joints, strict=False)),
        names=tuple(entry.deviations),
        deviations=tuple(to_si(v, shown[robot.parameters[n].unit]) for n, v in entry.deviations.items()),
        factor=factor_from(entry.correlations, len(entry.deviations), f"{where}, proof.correlations", cure),
        lower_bound=entry.lower_bound,
        warnings=tuple(Notice(warning.code, warning.message, "note") for warning in entry.warnings),
        held=tuple(entry.held),
        digest=entry.sha256,
        measured=tuple(
            _position(row, robot, f"{where}, proof.measured[{number}]", cure)
            for number, row in enumerate(entry.measured, 1)
        ),
        loads=tuple(entry.loads),
    )


def _position(text: str, robot: Robot, where: str, cure: str) -> tuple[float, ...]:
    """Return joint positions of a measured configuration in SI units."""
    numbers = [as_number(word) for word in text.split()]
    known = tuple(number for number in numbers if number is not None and math.isfinite(number))
    if len(known) != len(robot.joints) or len(numbers) != len(known):
        raise InputError(
            "one number belongs here for each joint, in deg or mm",
            where=where,
            came=text,
            allowed=counted(len(robot.joints), "number"),
            cure=cure,
        )
    units = ["deg" if joint.kind == "revolute" else "mm" for joint in robot.joints]
    return tuple(to_si(value, unit) for value, unit in zip(known, units, strict=True))


#: No joint's bearing is farther from the joint's origin [m].
_FARTHEST_BEARING: Final = 10.0
#: Entries of a joint in every convention.
_OF_ANY_JOINT: Final = ("name", "type", "limits", "transmission_periods", "bearing", "max_speed")


def _joint(content: RobotFile, number: int, entry: JointEntry, where: str) -> Joint:
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
            raise InputError(
                f"a joint of convention {content.convention} has no such entry",
                where=where,
                came=column,
                allowed=", ".join([*_OF_ANY_JOINT, *allowed]),
                cure=did_you_mean(column, [*_OF_ANY_JOINT, *allowed]),
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
    bearing = None
    if entry.bearing is not None:
        if entry.type == "prismatic":
            raise InputError(
                "a joint that slides has no bearing on its axis",
                where=f"{where}.bearing",
                came=entry.bearing,
                cure="Take the entry out: moments across a slide are taken where it stands.",
            )
        bearing = sized_si(entry.bearing, content.units.length, f"{where}.bearing")
        if abs(bearing) > _FARTHEST_BEARING:
            raise InputError(
                "the bearing lies farther along its axis than any arm is large",
                where=f"{where}.bearing",
                came=f"{bearing:g} m",
                allowed=f"up to {_FARTHEST_BEARING:g} m either way",
                cure="Give the distance from the joint's origin in the file's unit of length.",
            )
    speed = None if entry.max_speed is None else _max_speed(entry.max_speed, entry.type, unit, f"{where}.max_speed")
    return Joint(entry.name or f"joint_{number}", entry.type, row, limits, entry.transmission_periods, bearing, speed)


def _max_speed(value: float, kind: JointKind, unit: str, where: str) -> float:
    """Return how fast a joint goes at 100 % [rad/s or m/s]; `unit` is the file's, a second."""
    slowest, fastest = JOINT_SPEEDS[kind]
    speed = to_si(value, unit)
    if not slowest * (1.0 - 1e-9) <= speed <= fastest * (1.0 + 1e-9):
        raise InputError(
            "no joint is so slow or so fast at 100 %",
            where=where,
            came=f"{value:g} {unit}/s",
            allowed=f"{from_si(slowest, unit):g} to {from_si(fastest, unit):g} {unit}/s",
            cure=f"Give it in {unit}/s, the file's unit, or take the entry out if it is not known.",
        )
    return speed


def _vector(name: str, value: object, unit: str, where: str, *, direction: bool) -> dict[str, float]:
    if not isinstance(value, list) or len(value) != 3:
        raise InputError("three numbers belong here", where=where, came=shown_entry(value), allowed="[x, y, z]")
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
    raise InputError("a number belongs here", where=where, came=shown_entry(value), allowed="a finite number")
