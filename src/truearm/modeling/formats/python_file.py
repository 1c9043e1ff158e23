"""A robot as a Python file of its own that needs only NumPy.

The file is :mod:`truearm.modeling.formats.python_template` with the constants of the robot in place of its own. Joint
effects that are exportable, those that depend on readings and weights alone, are in it; the template computes each.
"""

from __future__ import annotations

import ast
from collections.abc import Sequence
from dataclasses import replace
from importlib import resources
from textwrap import wrap
from typing import Final

import numpy as np

from truearm.modeling.chain import Array, across, axis_of
from truearm.modeling.effects.joint_curve import curve_names
from truearm.modeling.effects.linear_contact import LinearContactClearance
from truearm.modeling.formats.collapsed import collapsed
from truearm.modeling.formats.urdf_tree import roll_pitch_yaw
from truearm.modeling.robot import Robot

_WIDTH: Final = 118
#: Stored poses for the file's own test.
_STORED: Final = 3

Row = tuple[float, ...]


def python_text(robot: Robot, comments: Sequence[str]) -> str:
    """Return a Python module with ``forward`` and ``inverse`` of a robot whose world is its base frame.

    Args:
        comments: What the module says of itself, one line each.
    """
    source = resources.files("truearm.modeling.formats").joinpath("python_template.py").read_text("utf-8")
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
    said = [line for comment in comments for line in (*wrap(comment, _WIDTH), "")]
    text = "\n".join(said).replace("\\", "\\\\").replace('"', '\\"')
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
    gear = zip(*(by_joint(f"transmission_{part}") for part in ("sin", "cos")), strict=True)
    periods = [
        (joint.transmission_periods or 0) if f"transmission_sin_{i}" in values else 0
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
        "TRANSMISSION": _rows([(n, *parts) for n, parts in zip(periods, gear, strict=True)], names),
        "CURVES": _series([_curve(robot, i) for i in numbers], names),
        "COMPLIANCE": _rows(by_joint("compliance"), names),
        "COMPLIANCE_QUADRATIC": _rows(by_joint("compliance_quadratic"), names),
        "COMPLIANCE_CUBIC": _rows(by_joint("compliance_cubic"), names),
        "BACKLASH": _rows(by_joint("backlash"), names),
        "BEARING_COMPLIANCE": _rows(by_joint("bearing_compliance"), names),
        "CLEARANCE": _rows(by_joint("clearance"), names),
        "LINEAR_CONTACT": repr(any(isinstance(effect, LinearContactClearance) for effect in effects)),
        "READINGS": _rows(_tuples(q)),
        "POSITIONS": _rows(_tuples(position)),
        "ROTATIONS": _rows([_tuples(R) for R in rotation]),
    }


def _bodies(
    robot: Robot,
) -> tuple[list[tuple[Row, Row]], list[tuple[int, float, Row]], list[tuple[object, ...]]]:
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
        there = robot.axial_slides.stayed(link, (point[0], point[1], point[2]), robot.values)
        return _tidy((inverses[link - 1] @ behind[link - 1] @ [*there, 1.0])[:3])

    masses = [(mass.joint - 1, mass.mass, seen(mass.joint, mass.cog)) for mass in robot.masses if mass.mass]
    balancers: list[tuple[object, ...]] = []
    for number, b in enumerate(robot.balancers, 1):
        factor = robot.values.get(f"balancer_{number}", 1.0)
        ends = tuple((end.link, seen(end.link, end.point)) for end in (b.fixed, b.moving))
        balancers.append((*ends, factor * b.force, b.length, factor * b.stiffness))
    return places, masses, balancers


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
