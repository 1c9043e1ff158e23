"""URDF: a serial chain in, the user's own file with calibrated joint origins out.

Reading finds one chain of moving joints in the tree and folds the fixed joints between them into the next
moving joint's origin. Writing goes back into the bytes the user gave: only the ``<origin>`` of moving joints
changes, and only where its numbers do. A URDF holds every geometric parameter and every joint zero exactly,
because an origin is a full rigid transform; what it cannot hold is returned in words.

Source of the format: ROS, URDF XML specification (joint, link, inertial). Angles are roll, pitch, yaw about
fixed axes, ``Rz(yaw) Ry(pitch) Rx(roll)``; an origin that is not given is the identity, an axis that is not
given is x.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.base.files import read_bytes
from truearm.engine.base.units import ROBOT_LINE
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import AS_THE_MODEL, Controller
from truearm.engine.robot.conventions.convention import JointKind
from truearm.engine.robot.parts import JOINT_SPEEDS, Joint, LinkMass
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.entries import NAME
from truearm.engine.robot.transform import IDENTITY, Transform
from truearm.engine.robot.urdf_tree import (
    KIND,
    Tree,
    Triple,
    UrdfJoint,
    child_tag,
    numbers,
    origin,
    placement,
    product,
    read_tree,
    roll_pitch_yaw,
    triple,
)
from truearm.engine.robot.urdf_writing import left_out

#: How far the length of an axis may be from 1: files print five digits, but 0 0 2 means something else.
_AXIS_TOLERANCE: Final = 1e-3
#: How far the robot's nominal rows may be from the file's [m, rad]: more than digits, less than any change.
_SAME_FILE: Final = 1e-9


def read_urdf(path: Path, tip: str | None = None) -> Robot:
    """Read the serial chain of a URDF file.

    The base frame is the root link. A link's mass takes in the links fixed to it, on and off the chain; what
    moves off the chain, a gripper's fingers, is left out.

    Args:
        tip: Link at the end of the chain. If None, the moving joints must lie on one path, and the end is the link
            ``tool0`` or else ``flange`` fixed behind the last of them, or else that joint's own link.
    """
    content = read_bytes(path)
    tree = read_tree(content, str(path))
    end = _only_end(tree, path) if tip is None else tree.known(tip, str(path))
    route = tree.joints_to(end)
    links, tail = _links(tree.where, route)
    if not links:
        raise InputError(
            f"no joint moves between the root {tree.root} and the link {tip}",
            where=tree.where,
            cure="Name a link nearer to the end of the robot.",
        )
    masses = (_mass(tree, number, link.joint.child) for number, link in enumerate(links, 1))
    return Robot(
        name=_robot_name(tree.name, path),
        title=tree.name or path.stem,
        source=f"URDF file {path.name}",
        convention_name="urdf",
        joints=tuple(
            Joint(link.joint.name, link.kind, link.row, link.limits, max_speed=_max_speed(link.joint)) for link in links
        ),
        flange=Transform.from_matrix(tail[:3, :3], tail[:3, 3]),
        masses=tuple(mass for mass in masses if mass is not None),
        controller=_controller(tree, links[-1].joint.child, end),
        simulated=_is_marked(content),
    )


def _is_marked(content: bytes) -> bool:
    """Return whether a URDF says in a comment that its robot was calibrated with simulated measurements."""
    return f"<!-- {ROBOT_LINE} -->".encode() in content


def _controller(tree: Tree, last: str, end: str) -> Controller:
    """Return where the controller has its frames, if the file has the links that ROS-Industrial calls so.

    There ``base`` is the base frame of the controller, fixed to the root, and ``tool0`` its tool that is all zeros (ROS
    REP 199, draft). How it counts the joints is not said: FANUC's and ABB's drivers change that.

    Args:
        last: Link behind the last moving joint.
        end: Of the chain.
    """
    bases, tools = dict(tree.fixed_behind(tree.root)), dict(tree.fixed_behind(last))
    if "base" not in bases or "tool0" not in tools or end not in tools:
        return AS_THE_MODEL
    base, flange = bases["base"], np.linalg.inv(tools[end]) @ tools["tool0"]
    return Controller(
        base=Transform.from_matrix(base[:3, :3], base[:3, 3]),
        flange=Transform.from_matrix(flange[:3, :3], flange[:3, 3]) if end != "tool0" else IDENTITY,
    )


def calibrated_urdf(source: bytes, robot: Robot) -> tuple[bytes, list[str]]:
    """Return the URDF that `robot` was read from with its calibrated geometry and joint zeros.

    Args:
        source: Content of the file the robot was read from. All its bytes stay but the numbers that change.

    Returns:
        content, left_out: The new file, and in words what a URDF cannot hold.
    """
    where = "the URDF to calibrate"
    tree = read_tree(source, where)
    edits: list[tuple[int, int, bytes]] = []
    for link, own in zip(_own_links(tree, robot), robot.link_elements, strict=True):
        elements = [replace(e, variable=None) for e in own]
        changed = {e.turns for e in elements if e.parameter and robot.values[e.parameter] != e.value}
        if not changed:
            continue
        place = np.linalg.inv(link.prefix) @ product(elements, robot.values)
        xyz, rpy = triple(place[:3, 3]), roll_pitch_yaw(place[:3, :3], link.rpy)
        edits += _origin_edits(source, link.joint, xyz if False in changed else None, rpy if True in changed else None)
    for start, end, text in sorted(edits, reverse=True):
        source = source[:start] + text + source[end:]
    if robot.simulated and not _is_marked(source):
        source = source.rstrip() + f"\n<!-- {ROBOT_LINE} -->\n".encode()
    return source, left_out(robot, "A URDF")


# -- the chain ----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Link:
    """A moving joint of the chain."""

    joint: UrdfJoint
    prefix: Array  #: From the link behind the moving joint before to this joint's parent link, ``(4, 4)``.
    rpy: Triple  #: Angles of the joint's own origin [rad].
    row: Mapping[str, float]  #: Row of convention ``urdf``: prefix and origin in one.
    limits: tuple[float, float] | None

    @property
    def kind(self) -> JointKind:
        return KIND[self.joint.type]


def _links(where: str, route: Sequence[UrdfJoint]) -> tuple[list[_Link], Array]:
    """Return the moving joints on a route, and the transform from the last of them to its end ``(4, 4)``."""
    links: list[_Link] = []
    prefix = np.eye(4)
    for joint in route:
        xyz, rpy = origin(joint.tag, joint.where)
        if joint.type == "fixed":
            prefix = prefix @ placement(xyz, rpy)
            continue
        _refuse_unfit(joint)
        place = prefix @ placement(xyz, rpy)
        # The file's own angles stay where nothing turns before them: 1.5708 is then still 1.5708.
        turned = not np.array_equal(prefix[:3, :3], np.eye(3))
        angles = roll_pitch_yaw(place[:3, :3], rpy) if turned else rpy
        row = dict(zip(("x", "y", "z"), triple(place[:3, 3]), strict=True))
        row |= dict(zip(("roll", "pitch", "yaw"), angles, strict=True))
        row |= dict(zip(("axis_x", "axis_y", "axis_z"), _axis(joint), strict=True))
        links.append(_Link(joint, prefix, rpy, row, _limits(joint)))
        prefix = np.eye(4)
    return links, prefix


def _only_end(tree: Tree, path: Path) -> str:
    """Return the end of the one path on which all moving joints lie."""
    moving = [joint for joint in tree.joints.values() if joint.type != "fixed"]
    routes = [[step for step in tree.joints_to(joint.child) if step.type != "fixed"] for joint in moving]
    if not routes:
        raise InputError("there is no moving joint", where=tree.where, allowed=f"a joint of type {', '.join(KIND)}")
    passed = {joint.name for route in routes for joint in route[:-1]}
    outermost = [route for route in routes if route[-1].name not in passed]
    if len(outermost) == 1:
        return tree.end(outermost[0][-1])
    common = [steps[0] for steps in zip(*outermost, strict=False) if len({step.name for step in steps}) == 1]
    tips = [tree.end(joint) for joint in (*common[-1:], *(route[-1] for route in outermost))]
    raise InputError(
        "the moving joints branch, and one chain is needed",
        where=tree.where,
        came=f"several outermost joints: {', '.join(route[-1].name for route in outermost)}",
        allowed=f"a chain that ends at a link you name, such as {', '.join(tips)}",
        cure=f"Name the end of the chain: {path.name}#{tips[0]}",
    )


def _refuse_unfit(joint: UrdfJoint) -> None:
    if joint.type not in KIND:
        raise InputError(
            "a joint of this type cannot be in a serial chain",
            where=joint.where,
            came=joint.type,
            allowed=", ".join((*KIND, "fixed")),
        )
    if child_tag(joint.tag, "mimic", joint.where) is not None:
        raise InputError(
            "a joint that mimics another has no position of its own",
            where=joint.where,
            cure="End the chain before it, with #LINK behind the file name, or delete <mimic>.",
        )
    if not re.fullmatch(NAME, joint.name):
        raise InputError(
            "the joint's name cannot stand in a robot file",
            where=joint.where,
            came=joint.name,
            allowed="letters, digits, _ . and -, starting with a letter or digit",
            cure="Rename the joint.",
        )


def _axis(joint: UrdfJoint) -> Triple:
    tag = child_tag(joint.tag, "axis", joint.where)
    axis = triple((numbers(tag, "xyz", 3, joint.where) if tag else None) or (1.0, 0.0, 0.0))
    length = math.hypot(*axis)
    if abs(length - 1.0) > _AXIS_TOLERANCE:
        unit = " ".join(f"{a / length:.12g}" for a in axis) if length else None
        raise InputError(
            "the joint's axis is not a unit vector",
            where=joint.where,
            came=" ".join(map(repr, axis)),
            cure=f"The unit vector along it is {unit}." if unit else "Give the direction of the axis.",
        )
    return triple(a / length for a in axis)


def _limits(joint: UrdfJoint) -> tuple[float, float] | None:
    if joint.type == "continuous":
        return None
    cure = "Give the joint's limits, or make it continuous." if joint.type == "revolute" else "Give the joint's limits."
    tag = child_tag(joint.tag, "limit", joint.where)
    if tag is None:
        raise InputError(f"a {joint.type} joint must have a <limit>", where=joint.where, cure=cure)
    low, high = ((numbers(tag, side, 1, joint.where) or (0.0,))[0] for side in ("lower", "upper"))
    if not low < high:
        raise InputError(
            "the lower limit must be below the upper one",
            where=joint.where,
            came=f"lower {low!r}, upper {high!r} (0 where not given)",
            cure=cure,
        )
    return low, high


def _max_speed(joint: UrdfJoint) -> float | None:
    """Return how fast a joint goes at 100 % [rad/s or m/s]; None for 0, and for what no joint does.

    The attribute must be there, so files have 0, or some large number, where nobody knows.
    """
    tag = child_tag(joint.tag, "limit", joint.where)
    speed = (numbers(tag, "velocity", 1, joint.where) or (0.0,))[0] if tag else 0.0
    if speed < 0.0:
        raise InputError(
            "the velocity of a <limit> cannot be negative",
            where=joint.where,
            came=speed,
            cure="Give how fast the joint goes at 100 % [rad/s or m/s], or 0 if it is not known.",
        )
    slowest, fastest = JOINT_SPEEDS[KIND[joint.type]]
    return speed if slowest <= speed <= fastest else None


def _mass(tree: Tree, number: int, link: str) -> LinkMass | None:
    """Return the mass of a link with all that is fixed to it, centre of gravity in the link's frame."""
    total, moment = 0.0, np.zeros(3)
    for name, frame in tree.fixed_behind(link):
        tag = tree.links[name]
        where = f"{tree.where}, line {tag.line}, link {name}"
        inertial = child_tag(tag, "inertial", where)
        if inertial is None:
            continue
        entry = child_tag(inertial, "mass", where)
        value = None if entry is None else numbers(entry, "value", 1, where)
        if value is None:
            raise InputError('the <inertial> has no <mass value="..."/>', where=where)
        if value[0] < 0:
            raise InputError("a mass cannot be negative", where=where, came=value[0])
        total += value[0]
        moment += value[0] * (frame[:3, :3] @ origin(inertial, where)[0] + frame[:3, 3])
    return LinkMass(number, total, triple(moment / total)) if total else None


def _robot_name(name: str, path: Path) -> str:
    for candidate in (name, path.stem):
        if re.fullmatch(NAME, candidate):
            return candidate
    raise InputError(
        "neither the robot's name nor the file's can name a robot",
        where=str(path),
        came=f"{name!r} and {path.stem!r}",
        allowed="letters, digits, _ . and -, starting with a letter or digit",
        cure="Rename the file.",
    )


# -- the user's file, calibrated ----------------------------------------------------------------------------

# In well-formed XML a start tag ends at the first > outside quotes.
_START_TAG: Final = re.compile(rb"""<[^\s/>]+(?P<attributes>(?:\s+[^\s=]+\s*=\s*(?:"[^"]*"|'[^']*'))*)\s*/?>""")
_ATTRIBUTE: Final = re.compile(rb"""\s+(?P<name>[^\s=]+)\s*=\s*["'](?P<value>(?<=")[^"]*|(?<=')[^']*)["']""")


def _own_links(tree: Tree, robot: Robot) -> list[_Link]:
    """Return the chain of `robot` in the file, or refuse a file that is not the robot's own."""

    def refuse(fault: str, came: object = None, allowed: str | None = None) -> InputError:
        cure = "Give the URDF that the robot was read from; for another robot a new URDF can be written."
        return InputError(
            f"the file is not the one this robot was read from: {fault}",
            where=tree.where,
            came=came,
            allowed=allowed,
            cure=cure,
        )

    if robot.convention_name != "urdf":
        raise refuse(f"robot {robot.name} is of convention {robot.convention_name}")
    last = robot.joints[-1].name
    if last not in tree.joints:
        raise refuse(f"it has no joint {last}")
    links, _ = _links(tree.where, tree.joints_to(tree.joints[last].child))
    names = [link.joint.name for link in links]
    if names != [joint.name for joint in robot.joints]:
        raise refuse("other joints move", ", ".join(names), ", ".join(joint.name for joint in robot.joints))
    for link, joint in zip(links, robot.joints, strict=True):
        if link.kind != joint.kind:
            raise refuse(f"joint {joint.name} is {link.kind}")
        for column, value in link.row.items():
            if abs(value - joint.row.get(column, 0.0)) > _SAME_FILE:
                raise refuse(f"{column} of joint {joint.name} differs", value, repr(joint.row.get(column, 0.0)))
    return links


def _origin_edits(
    source: bytes, joint: UrdfJoint, xyz: Triple | None, rpy: Triple | None
) -> list[tuple[int, int, bytes]]:
    """Return what to put where in the bytes so that the joint has this origin; None keeps what it has."""
    new = {name: value for name, value in ((b"xyz", xyz), (b"rpy", rpy)) if value is not None}
    tag = child_tag(joint.tag, "origin", joint.where)
    match = _START_TAG.match(source, (tag or joint.tag).start)
    if match is None:
        raise ValueError("the parser found a start tag where there is none")
    if tag is None:
        return [(match.end(), match.end(), b"<origin" + _attributes(new) + b"/>")]
    edits = []
    for attribute in _ATTRIBUTE.finditer(source, *match.span("attributes")):
        value = new.pop(attribute["name"], None)
        if value is not None:
            edits.append((*attribute.span("value"), _respelled(attribute["value"], value)))
    if new:
        end = match.end("attributes")
        edits.append((end, end, _attributes(new)))
    return edits


def _attributes(values: Mapping[bytes, Triple]) -> bytes:
    return b"".join(b' %s="%s"' % (name, " ".join(map(repr, value)).encode()) for name, value in values.items())


def _respelled(old: bytes, values: Triple) -> bytes:
    """Return three numbers in the spacing of `old`; a number that is the same keeps its spelling."""
    words = [repr(value).encode() for value in values]
    if b"&" in old:  # a character reference stands for some of the spacing
        return b" ".join(words)
    same = [float(word) == value for word, value in zip(old.split(), values, strict=True)]
    following = iter(zip(same, words, strict=True))

    def respell(match: re.Match[bytes]) -> bytes:
        keep, word = next(following)
        return match[0] if keep else word

    return re.sub(rb"\S+", respell, old)
