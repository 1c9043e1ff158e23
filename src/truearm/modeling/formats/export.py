"""A robot as files that other programs read; each says what it cannot hold and which frames it refers to."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

from truearm.errors import InputError, did_you_mean
from truearm.modeling.conversion import converted
from truearm.modeling.effects.balancing import Balancing
from truearm.modeling.formats.dh_csv import complete_dh_csv
from truearm.modeling.formats.dh_table import DHRow, DHTable, TableConvention
from truearm.modeling.formats.model_json import model_json
from truearm.modeling.formats.python_file import python_text
from truearm.modeling.formats.remarks import comments, first_frame_remark, frames, left_out, masses_left_out
from truearm.modeling.formats.ur_kinematics import KINEMATICS_FILE, kinematics_text
from truearm.modeling.formats.urdf_writing import urdf_text
from truearm.modeling.robot import Robot
from truearm.modeling.transform import IDENTITY
from truearm.simulated import without_mark
from truearm.units import from_si, to_si


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
    made = converted(_in_base(robot), convention_name)
    units = made.convention.row_units("revolute")
    rows = tuple(DHRow(j.name, j.kind, **{c: _tidy(v, units[c]) for c, v in j.row.items()}) for j in made.joints)
    table = DHTable(convention_name, rows, made.base, made.flange)
    name = "A table"
    limits = [f"{name} cannot hold the limits of joints."] if any(joint.limits for joint in robot.joints) else []
    left = (*left_out(robot, name), *masses_left_out(robot, name), *limits)
    frame = f"{frames(robot)} {first_frame_remark(made.base)}"
    said = [*comments(robot, frame, left), f"convention {convention_name}: link = {_PRODUCTS[convention_name]}"]
    return Export(complete_dh_csv(table, said), frame, left)


def _tidy(value: float, unit: str) -> float:
    """Return an angle without the roundings of right angles in degrees, far below what any arm can feel."""
    return to_si(round(from_si(value, "deg"), 12) + 0.0, "deg") if unit == "rad" else value


def _urdf(robot: Robot) -> Export:
    text, left = urdf_text(robot)
    first, _, rest = text.partition("\n")
    frame = f"{frames(robot)} They are the links tool0 and base_link."
    said = without_mark(comments(robot, frame, left))  # which the URDF has already
    said = [re.sub("-(?=-)", "- ", line) for line in said]  # XML comments hold no two hyphens
    return Export("\n".join([first, "<!--", *said, "-->", rest]), frame, tuple(left))


def _json(robot: Robot) -> Export:
    names = [name for name, entries in (("tools", robot.tools), ("truths", robot.truths)) if entries]
    left = (f"Left out, because it is for simulation alone: {' and '.join(names)}.",) if names else ()
    return Export(model_json(robot, frames(robot), left), frames(robot), left)


def _python(robot: Robot) -> Export:
    held = [*(effect.name for effect in robot.effects if effect.exportable), Balancing.name]
    left = tuple(left_out(robot, "A Python file", held))
    return Export(python_text(_in_base(robot), comments(robot, frames(robot), left)), frames(robot), left)


def _ur_kinematics(robot: Robot) -> Export:
    text, said = kinematics_text(_in_base(robot))
    left = (*left_out(robot, KINEMATICS_FILE), *said)
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
