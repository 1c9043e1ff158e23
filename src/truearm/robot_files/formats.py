"""A robot as files that other programs read: DH tables, JSON, Python."""

from __future__ import annotations

import ast
import csv
import io
import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib import resources
from textwrap import wrap
from typing import Any, Final

import numpy as np

from truearm.engine.base.errors import InputError, did_you_mean
from truearm.engine.base.units import (
    SHOWN_AS,
    from_si,
    to_si,
    without_mark,
    written,
)
from truearm.engine.robot.balancers import Balancer
from truearm.engine.robot.chain import Array, Element, across, axis_of
from truearm.engine.robot.conventions.convention import JOINT
from truearm.engine.robot.conversion import converted
from truearm.engine.robot.dh_table import DHRow, DHTable, TableConvention
from truearm.engine.robot.effects.balancing import Balancing
from truearm.engine.robot.effects.effect import Effect
from truearm.engine.robot.effects.joint_curve import JointCurve, curve_names
from truearm.engine.robot.effects.linear_contact import LinearContactClearance
from truearm.engine.robot.effects.link_bending import bending_names, moment_names
from truearm.engine.robot.effects.run_out import run_out_names
from truearm.engine.robot.effects.transmission import transmission_names
from truearm.engine.robot.parameters import Parameter
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY
from truearm.engine.robot.ur_kinematics import KINEMATICS_FILE, kinematics_text
from truearm.engine.robot.urdf_tree import roll_pitch_yaw
from truearm.engine.robot.urdf_writing import (
    collapsed,
    comments,
    first_frame_remark,
    frames,
    left_out,
    masses_left_out,
    urdf_text,
)

# DH tables as CSV: one row a joint, in mm and degrees; base and flange below, where they are asked for.
#
# Lines that start with ``#`` are comments. A table of convention ``hayati`` has a column for beta.
_FRAMES: Final = ("frame", "x [mm]", "y [mm]", "z [mm]", "qw", "qx", "qy", "qz")


def _columns(convention_name: TableConvention) -> dict[str, str]:
    plain = {"a": "m", "alpha": "rad", "d": "m", JOINT: "rad"}
    return {**plain, "beta": "rad"} if convention_name == "hayati" else plain


def dh_csv(table: DHTable) -> str:
    """Return the rows of a table as CSV, in mm and degrees; base and flange are not part of it."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    columns = _columns(table.convention_name)
    writer.writerow(["joint", "type", *(f"{column} [{SHOWN_AS[unit]}]" for column, unit in columns.items())])
    for row in table.rows:
        shown = (written(getattr(row, column), SHOWN_AS[unit]) for column, unit in columns.items())
        writer.writerow([row.joint, row.kind, *map(repr, shown)])
    return stream.getvalue()


def complete_dh_csv(table: DHTable, comments: Sequence[str]) -> str:
    """Return a whole table as CSV: comments, the rows, then base and flange as position and quaternion."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(_FRAMES)
    for name, place in (("base", table.base), ("flange", table.flange)):
        writer.writerow([name, *(repr(written(v, "mm")) for v in place.translation), *map(repr, place.quaternion)])
    return "".join(f"# {line}\n" for line in comments) + dh_csv(table) + "\n" + stream.getvalue()


SCHEMA: Final = "truearm-model/1"


def model_json(robot: Robot, frames: str, left_out: Iterable[str]) -> str:
    """Return the JSON text of a robot.

    A frame is the product of its elements. An element turns (``R``) or slides (``T``) about or along x, y or z of the
    moving frame (``Rx`` to ``Tz``) or its own ``axis``, by ``value``, and by the position of ``joint`` (from 1) where
    it has one. Numbers are written so that they read back exactly.
    """
    content = {
        "truearm": SCHEMA,
        "name": robot.name,
        "title": robot.title,
        "source": robot.source,
        **({"simulated": True} if robot.simulated else {}),
        "units": {"length": "m", "angle": "rad", "force": "N", "mass": "kg"},
        "frames": frames,
        "left_out": list(left_out),
        "convention": robot.convention_name,
        "base": {"elements": _elements(robot, robot.base_elements)},
        "joints": [
            {
                "name": joint.name,
                "kind": joint.kind,
                "limits": None if joint.limits is None else list(joint.limits),
                "transmission_periods": joint.periods_entry,
                "bearing": joint.bearing,
                "max_speed": joint.max_speed,
                "elements": _elements(robot, link),
            }
            for joint, link in zip(robot.joints, robot.link_elements, strict=True)
        ],
        "flange": {"elements": _elements(robot, robot.flange_elements)},
        "targets": [{"name": t.name, "elements": _elements(robot, t.chain.elements)} for t in robot.targets],
        "fixtures": [
            {"name": f.name, "kind": f.kind, "elements": _elements(robot, f.chain.elements)} for f in robot.fixtures
        ],
        "effects": [{"name": e.name, "parameters": _names(e)} for e in robot.effects],
        "curves": None,
        "masses": [
            {"link": m.joint, "mass": m.mass, "cog": list(m.cog), "inertia": list(m.inertia)} for m in robot.masses
        ],
        "balancers": [_balancer(b) for b in robot.balancers],
        "payload": {"mass": robot.payload.mass, "cog": list(robot.payload.cog)},
        "gravity": list(robot.gravity),
        "parameters": [_parameter(p) for p in robot.parameters.values() if p.group != JointCurve.name],
        "history": list(robot.history),
    }
    text = json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    lines = ",\n  ".join(json.dumps(curve, allow_nan=False) for curve in _curves(robot))
    return text.replace('\n "curves": null', f'\n "curves": [\n  {lines}\n ]' if lines else '\n "curves": []', 1)


def _names(effect: Effect) -> list[str]:
    """Return the names of an effect's parameters; the hundreds of a curve stand in a place of their own."""
    return [] if effect.name == JointCurve.name else [p.name for p in effect.parameters]


def _curves(robot: Robot) -> Iterator[dict[str, Any]]:
    """Return what is known of each curve: of sine and cosine of 1, 2 .. periods in a turn, each an array."""
    for number in range(1, len(robot.joints) + 1):
        known = [robot.parameters[name] for name in curve_names(number) if name in robot.parameters]
        if known:
            yield {
                "joint": number,
                **{
                    field: {
                        "sin": [getattr(p, field) for p in known[0::2]],
                        "cos": [getattr(p, field) for p in known[1::2]],
                    }
                    for field in ("value", "prior", "deviation", "informed")
                },
            }


def _balancer(b: Balancer) -> dict[str, Any]:
    anchors = {name: {"link": a.link, "point": list(a.point)} for name, a in (("fixed", b.fixed), ("moving", b.moving))}
    return {"name": b.name, **anchors, "length": b.length, "force": b.force, "stiffness": b.stiffness}


def _elements(robot: Robot, elements: Iterable[Element]) -> list[dict[str, Any]]:
    entries = []
    for element in elements:
        value = element.value if element.parameter is None else robot.values[element.parameter]
        entry: dict[str, Any] = {"motion": element.motion, "value": value}
        if element.axis is not None:
            entry["axis"] = list(element.axis)
        if element.parameter is not None:
            entry["parameter"] = element.parameter
        if element.variable is not None:
            entry["joint"] = element.variable + 1
        entries.append(entry)
    return entries


def _parameter(p: Parameter) -> dict[str, Any]:
    return {
        "name": p.name,
        "unit": p.unit,
        "group": p.group,
        "nominal": p.nominal,
        "value": p.value,
        "prior": p.prior,
        "deviation": p.deviation,
        "informed": p.informed,
    }


_WIDTH: Final = 118
#: Stored poses for the file's own test.
_STORED: Final = 3

Row = tuple[float, ...]


# A robot as a Python file of its own that needs only NumPy.
#
# The file is :mod:`truearm.robot_files.python_template` with the constants of the robot in place of its own. Joint
# effects that are exportable, those that depend on readings and weights alone, are in it; the template computes each.
def python_text(robot: Robot, comments: Sequence[str]) -> str:
    """Return a Python module with ``forward`` and ``inverse`` of a robot whose world is its base frame.

    Args:
        comments: What the module says of itself, one line each.
    """
    source = resources.files("truearm.robot_files").joinpath("python_template.py").read_text("utf-8")
    lines = source.split("\n")
    constants = _constants(robot)
    tree = ast.parse(source)
    for node in reversed(tree.body):
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and node.end_lineno is not None:
            head = f"{node.target.id}: {ast.unparse(node.annotation)} = "
            lines[node.lineno - 1 : node.end_lineno] = [head + constants[node.target.id]]
    description = tree.body[0]
    lines[: description.end_lineno] = [_description(robot, comments)]
    return "\n".join(lines)


def _description(robot: Robot, comments: Sequence[str]) -> str:
    count = len(robot.joints)
    lines = [line for comment in comments for line in (*wrap(comment, _WIDTH), "")]
    text = "\n".join(lines).replace("\\", "\\\\").replace('"', '\\"')
    return f'''"""{text}
Only NumPy is needed, and nothing of truearm. Run as a program, the file compares itself with stored poses.

    position, rotation = forward(q)  # joint positions (n, {count}) [rad, m] -> (n, 3) [m], (n, 3, 3)
    q, within = inverse(position, rotation, seed)  # a seed ({count},) or (n, {count}) on the branch that is wanted

For another payload change PAYLOAD; the stored poses then hold no longer.
"""'''


def _constants(robot: Robot) -> dict[str, str]:
    """Return the text of every constant of the template."""
    names = [joint.name for joint in robot.joints]
    numbers = range(1, len(names) + 1)
    effects = [effect for effect in robot.effects if effect.exportable]
    values = {plain.name: robot.values[plain.name] for effect in effects for plain in effect.parameters}

    def by_joint(family: str, nothing: float = 0.0) -> tuple[float, ...]:
        return tuple(values.get(f"{family}_{i}", nothing) for i in numbers)

    series = zip(*(by_joint(f"fourier_{part}") for part in ("sin1", "cos1", "sin2", "cos2")), strict=True)
    gears = [
        tuple(
            (k, values[sine], values[cosine])
            for k, sine, cosine in transmission_names(joint.periods, i)
            if sine in values
        )
        for i, joint in enumerate(robot.joints, 1)
    ]
    places, masses, balancers = _bodies(robot)
    q = np.round(robot.random_configurations(_STORED, np.random.default_rng(0)), 4)
    written = replace(robot, effect_names=tuple(effect.name for effect in effects))
    position, rotation = written.world_poses(q)
    return {
        "JOINTS": repr(tuple(names)),
        "SLIDING": repr(tuple(joint.kind == "prismatic" for joint in robot.joints)),
        "LIMITS": _rows([joint.limits for joint in robot.joints], names),
        "PLACES": _rows(places, [*names, "flange"]),
        "GRAVITY": repr(robot.gravity),
        "MASSES": _rows(masses, [names[joint] for joint, _, _ in masses]),
        "BALANCERS": _rows(balancers, [balancer.name for balancer in robot.balancers]) if balancers else "()",
        "PAYLOAD": repr((robot.payload.mass, robot.payload.cog)),
        "GAIN": _rows(by_joint("gain", 1.0), names),
        "FOURIER": _rows(list(series), names),
        "TRANSMISSION": _rows(gears, names),
        "CURVES": _series([_curve(robot, i) for i in numbers], names),
        "COMPLIANCE": _rows(by_joint("compliance"), names),
        "COMPLIANCE_QUADRATIC": _rows(by_joint("compliance_quadratic"), names),
        "COMPLIANCE_CUBIC": _rows(by_joint("compliance_cubic"), names),
        "BACKLASH": _rows(by_joint("backlash"), names),
        "BEARING_COMPLIANCE": _rows(by_joint("bearing_compliance"), names),
        "CLEARANCE": _rows(by_joint("clearance"), names),
        "BENDING": _rows([_bending(values, i) for i in numbers], names),
        "MOMENTS": _rows([_moments(values, i, len(robot.joints)) for i in numbers], names),
        "RUN_OUT": _rows([_run_out(robot, values, i) for i in numbers], names),
        "LINEAR_CONTACT": repr(any(isinstance(effect, LinearContactClearance) for effect in effects)),
        "READINGS": _rows(_tuples(q)),
        "POSITIONS": _rows(_tuples(position)),
        "ROTATIONS": _rows([_tuples(R) for R in rotation]),
    }


def _bodies(robot: Robot) -> tuple[list[tuple[Row, Row]], list[tuple[int, float, Row]], list[tuple[object, ...]]]:
    """Return places of joints and flange, every joint along z from its bearing, and masses and balancers in them."""
    origins, behind = collapsed(robot)
    turned = []  # from the axis and its own x and y, at the bearing, to those of the convention
    for link, bearing in zip(robot.link_elements, robot.bearings, strict=True):
        moving = next(element for element in link if element.variable is not None)
        axes = np.eye(4)
        axes[:3, :3] = np.transpose([*across(moving), axis_of(moving)])
        axes[:3, 3] = bearing * np.array(axis_of(moving))
        turned.append(axes)
    inverses = [np.linalg.inv(axes) for axes in turned]
    before = [np.eye(4), *inverses]
    places = [
        _place(start @ origin @ end) for start, origin, end in zip(before, origins, [*turned, np.eye(4)], strict=True)
    ]

    def seen(link: int, point: Row) -> Row:
        """Return a point of a link in the frame behind its joint, or of the base."""
        if link == 0:
            return point
        stayed = robot.axial_slides.stayed(link, (point[0], point[1], point[2]), robot.values)
        return _tidy((inverses[link - 1] @ behind[link - 1] @ [*stayed, 1.0])[:3])

    masses = [(mass.joint - 1, mass.mass, seen(mass.joint, mass.cog)) for mass in robot.masses if mass.mass]
    balancers: list[tuple[object, ...]] = []
    for number, b in enumerate(robot.balancers, 1):
        factor = robot.values.get(f"balancer_{number}", 1.0)
        ends = tuple((end.link, seen(end.link, end.point)) for end in (b.fixed, b.moving))
        balancers.append((*ends, factor * b.force, b.length, factor * b.stiffness))
    return places, masses, balancers


def _bending(values: Mapping[str, float], number: int) -> tuple[Row, ...]:
    """Return what gravity's direction does behind a joint, empty where it does nothing."""
    found = np.array([values.get(name, 0.0) for name in bending_names(number)])
    return _tuples(found.reshape(3, 3)) if found.any() else ()


def _moments(values: Mapping[str, float], number: int, count: int) -> tuple[tuple[int, Row], ...]:
    """Return what the weight of each link further out turns a joint by; only of those that do."""
    rows = {k: tuple(values.get(name, 0.0) for name in moment_names(number, k)) for k in range(number + 1, count + 1)}
    return tuple((k - 1, row) for k, row in rows.items() if any(row))


def _run_out(robot: Robot, values: Mapping[str, float], number: int) -> tuple[Row, ...]:
    """Return sine and cosine of a joint's run-out along the axes of its place, which has its zero; empty for none."""
    found = np.array([values.get(name, 0.0) for name in run_out_names(number)]).reshape(3, 2)
    moving = next(element for element in robot.link_elements[number - 1] if element.variable is not None)
    zero = moving.value if moving.parameter is None else robot.values[moving.parameter]
    c, s = np.cos(zero), np.sin(zero)
    return _tuples(np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) @ found) if found.any() else ()


def _curve(robot: Robot, number: int) -> Row:
    """Return sine and cosine of each period of a joint's curve, up to the last that is not zero."""
    amounts = [robot.values.get(name, 0.0) for name in curve_names(number)]
    return tuple(amounts[: 2 * max((k // 2 + 1 for k, amount in enumerate(amounts) if amount), default=0)])


def _place(frame: Array) -> tuple[Row, Row]:
    return _tidy(frame[:3, 3]), _tidy(np.array(roll_pitch_yaw(frame[:3, :3])))


def _tidy(values: Array) -> Row:
    """Return plain numbers; the roundings of right angles are the zeros they stand for."""
    return tuple(0.0 if abs(v) < 1e-15 else float(v) for v in values)


def _tuples(matrix: Array) -> tuple[Row, ...]:
    return tuple(tuple(row) for row in matrix.tolist())


def _rows(rows: Sequence[object], names: Sequence[str] = ()) -> str:
    """Return a tuple as text, one entry a line with its name; short where all of them are the same."""
    if rows and names and all(row == rows[0] for row in rows):
        return f"({rows[0]!r},) * {len(rows)}"
    labels = [f"  # {name}" for name in names] or [""] * len(rows)
    return "\n".join(["(", *(f"    {row!r},{label}" for row, label in zip(rows, labels, strict=True)), ")"])


def _series(rows: Sequence[Row], names: Sequence[str]) -> str:
    """Return rows of many numbers as text, as many in a line as there is room for."""
    if not any(rows):
        return f"((),) * {len(rows)}"
    text = ["("]
    for row, name in zip(rows, names, strict=True):
        lines = wrap(", ".join(map(repr, row)), _WIDTH - 8)
        text += (
            [f"    (  # {name}", *(f"        {line}" for line in lines), "    ),"] if row else [f"    (),  # {name}"]
        )
    return "\n".join([*text, ")"])


@dataclass(frozen=True)
class Export:
    """A robot in another format."""

    text: str  #: Content of the file.
    frames: str  #: Which frames its numbers refer to.
    left_out: tuple[str, ...]  #: What it cannot hold, one sentence each.


def exported(robot: Robot, format_: str) -> Export:
    """Return a robot, nominal or calibrated, in another format.

    Args:
        format_: ``dh`` (standard DH table), ``mdh`` (modified DH table), ``hayati`` (standard DH table with beta
            between nearly parallel axes), ``urdf``, ``json`` (everything, schema ``truearm-model/1``), ``python`` (a
            module for forward and inverse kinematics that needs only NumPy) or ``ur-kinematics`` (the kinematics file
            of the ROS driver of Universal Robots).

    Raises:
        InputError: If there is no such format, or it cannot describe the robot: axes that are nearly parallel in a DH
            table, a prismatic joint without limits in a URDF.
    """
    if format_ not in FORMATS:
        raise InputError(
            "there is no such format",
            parameter="format",
            came=format_,
            allowed=", ".join(FORMATS),
            cure=did_you_mean(format_, FORMATS),
        )
    return FORMATS[format_](robot)


def _table(robot: Robot, convention_name: TableConvention) -> Export:
    in_convention = converted(_in_base(robot), convention_name)
    units = in_convention.convention.row_units("revolute")
    rows = tuple(
        DHRow(j.name, j.kind, **{c: _tidy_export(v, units[c]) for c, v in j.row.items()}) for j in in_convention.joints
    )
    table = DHTable(convention_name, rows, in_convention.base, in_convention.flange)
    name = "A table"
    limits = [f"{name} cannot hold the limits of joints."] if any(joint.limits for joint in robot.joints) else []
    left = (*left_out(robot, name), *masses_left_out(robot, name), *limits)
    frame = f"{frames(robot)} {first_frame_remark(in_convention.base)}"
    remarks = [*comments(robot, frame, left), f"convention {convention_name}: link = {_PRODUCTS[convention_name]}"]
    return Export(complete_dh_csv(table, remarks), frame, left)


def _tidy_export(value: float, unit: str) -> float:
    """Return an angle without the roundings of right angles in degrees, far below what any arm can feel."""
    return to_si(round(from_si(value, "deg"), 12) + 0.0, "deg") if unit == "rad" else value


def _urdf(robot: Robot) -> Export:
    text, left = urdf_text(robot)
    first, _, body = text.partition("\n")
    frame = f"{frames(robot)} They are the links tool0 and base_link."
    remarks = without_mark(comments(robot, frame, left))  # which the URDF has already
    remarks = [re.sub("-(?=-)", "- ", line) for line in remarks]  # XML comments hold no two hyphens
    return Export("\n".join([first, "<!--", *remarks, "-->", body]), frame, tuple(left))


def _json(robot: Robot) -> Export:
    names = [name for name, entries in (("tools", robot.tools), ("truths", robot.truths)) if entries]
    left = (f"Left out, because it is for simulation alone: {' and '.join(names)}.",) if names else ()
    return Export(model_json(robot, frames(robot), left), frames(robot), left)


def _python(robot: Robot) -> Export:
    known = [*(effect.name for effect in robot.effects if effect.exportable), Balancing.name]
    left = tuple(left_out(robot, "A Python file", known))
    return Export(python_text(_in_base(robot), comments(robot, frames(robot), left)), frames(robot), left)


def _ur_kinematics(robot: Robot) -> Export:
    text, losses = kinematics_text(_in_base(robot))
    left = (*left_out(robot, KINEMATICS_FILE), *losses)
    frame = f"{frames(robot)} They are base_link_inertia and tool0 of ur_description."
    head = "".join(f"# {line}\n" for line in comments(robot, frame, left))
    return Export(head + text, frame, left)


def _in_base(robot: Robot) -> Robot:
    """Return the robot with its base frame as the world."""
    known = {name: p for name, p in robot.known.items() if p.group != "base"}
    return replace(robot, base_quaternion=IDENTITY.quaternion, known=known)


_PRODUCTS: Final[Mapping[TableConvention, str]] = {
    "standard-dh": "Rz(theta) Tz(d) Tx(a) Rx(alpha)",
    "modified-dh": "Rx(alpha) Tx(a) Rz(theta) Tz(d)",
    "hayati": "Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta)",
}
FORMATS: Final[Mapping[str, Callable[[Robot], Export]]] = {
    "dh": partial(_table, convention_name="standard-dh"),
    "mdh": partial(_table, convention_name="modified-dh"),
    "hayati": partial(_table, convention_name="hayati"),
    "urdf": _urdf,
    "json": _json,
    "python": _python,
    "ur-kinematics": _ur_kinematics,
}
