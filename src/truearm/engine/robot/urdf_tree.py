"""A URDF file as a tree of links and joints that know which bytes of the file they came from.

What is checked here holds for the whole file: it is XML, every joint has a parent and a child, and the links
form one tree. What only matters on a chain, :mod:`truearm.engine.robot.urdf` checks there.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final
from xml.parsers import expat

import numpy as np

from truearm.engine.base.errors import InputError, did_you_mean
from truearm.engine.base.limits import refuse_beyond
from truearm.engine.base.units import as_number, sized_si
from truearm.engine.robot.chain import Array, Chain, Element
from truearm.engine.robot.conventions import convention
from truearm.engine.robot.conventions.convention import JointKind

Triple = tuple[float, float, float]

ZERO: Final[Triple] = (0.0, 0.0, 0.0)
#: Kind of joint for each URDF type that moves about or along one axis.
KIND: Final[Mapping[str, JointKind]] = {"revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic"}
_TYPES: Final = (*KIND, "fixed", "floating", "planar")
#: Links that name the end of a robot, best first (ROS-Industrial's convention).
_ENDS: Final = ("tool0", "flange")


@dataclass(frozen=True, slots=True)
class Tag:
    """An XML element, with the line and the byte at which its start tag begins."""

    name: str
    attributes: Mapping[str, str]
    line: int
    start: int
    children: list[Tag] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class UrdfJoint:
    """A joint of any type; `where` names it and its line in messages."""

    name: str
    type: str
    parent: str
    child: str
    tag: Tag
    where: str


@dataclass(frozen=True)
class Tree:
    """Links and joints; every link but the root hangs on one joint."""

    where: str
    name: str
    links: Mapping[str, Tag]
    joints: Mapping[str, UrdfJoint]
    root: str

    @cached_property
    def _above(self) -> Mapping[str, UrdfJoint]:
        """The joint that each link but the root hangs on."""
        return {joint.child: joint for joint in self.joints.values()}

    @cached_property
    def _below(self) -> Mapping[str, list[UrdfJoint]]:
        """The joints that hang on each link."""
        children: dict[str, list[UrdfJoint]] = {link: [] for link in self.links}
        for joint in self.joints.values():
            children[joint.parent].append(joint)
        return children

    def joints_to(self, link: str) -> list[UrdfJoint]:
        """Return the joints from the root to a link."""
        joints: list[UrdfJoint] = []
        while (joint := self._above.get(joints[-1].parent if joints else link)) is not None:
            joints.append(joint)
        return joints[::-1]

    def children(self, link: str) -> list[str]:
        """Return the links that hang on a link."""
        return [joint.child for joint in self._below[link]]

    def fixed_behind(self, link: str) -> list[tuple[str, Array]]:
        """Return a link and all that is fixed to it further out, with their frames in it ``(4, 4)``."""
        frames = [(link, np.eye(4))]
        for name, frame in frames:
            for joint in self._below[name]:
                if joint.type == "fixed":
                    frames.append((joint.child, frame @ placement(*origin(joint.tag, joint.where))))
        return frames

    def end(self, joint: UrdfJoint) -> str:
        """Return the link that is the end of a robot whose last moving joint is `joint`."""
        behind = [link for link, _ in self.fixed_behind(joint.child)]
        return next((end for end in _ENDS if end in behind), joint.child)

    def known(self, link: str, where: str) -> str:
        """Return a link's name if there is such a link, else refuse it."""
        if link in self.links:
            return link
        raise InputError(
            "there is no link of this name",
            where=where,
            came=link,
            allowed=", ".join(self.links) or "none: the file has no links",
            cure=did_you_mean(link, self.links),
        )


def _parse(content: bytes, where: str) -> Tag:
    """Parse XML into tags that know their bytes."""
    if not content.strip():
        raise InputError("the file is empty", where=where)
    if b"\0" in content:
        raise InputError("the file is not UTF-8 text (it has zero bytes)", where=where, cure="Save it as UTF-8.")
    parser = expat.ParserCreate()
    top: list[Tag] = []
    stack: list[Tag] = []
    count = 0

    def start(name: str, attributes: dict[str, str]) -> None:
        if name.startswith("xacro:") or any("${" in value for value in attributes.values()):
            raise InputError(
                "this is a xacro file, a URDF is needed",
                where=f"{where}, line {parser.CurrentLineNumber}",
                cure="Run it through xacro first: xacro FILE.xacro > FILE.urdf",
            )
        nonlocal count
        count += 1 + len(attributes)
        refuse_beyond("entries", count, where=f"{where}, line {parser.CurrentLineNumber}")
        tag = Tag(name, attributes, parser.CurrentLineNumber, parser.CurrentByteIndex)
        (stack[-1].children if stack else top).append(tag)
        stack.append(tag)

    def doctype(*_: object) -> None:
        # Entities would make text that stands nowhere in the bytes, and could make it without end.
        raise InputError("a document type (<!DOCTYPE>) has no place in a URDF", where=where, cure="Delete it.")

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _: stack.pop()
    parser.StartDoctypeDeclHandler = doctype
    try:
        parser.Parse(content, True)
    except InputError:
        raise
    except expat.ExpatError as error:
        reason = expat.ErrorString(error.code)
        raise InputError(f"this is not valid XML ({reason})", where=f"{where}, line {error.lineno}") from error
    except (LookupError, ValueError) as error:
        raise InputError(
            f"the encoding that the file declares cannot be read ({error})", where=where, cure="Save it as UTF-8."
        ) from error
    return top[0]


def read_tree(content: bytes, where: str) -> Tree:
    """Read the content of a URDF file; `where` names it in messages."""
    robot = _parse(content, where)
    if robot.name != "robot":
        raise InputError("this is not a URDF", where=where, came=f"<{robot.name}>", allowed="<robot> around it all")
    links: dict[str, Tag] = {}
    joints: dict[str, UrdfJoint] = {}
    for tag in robot.children:
        if tag.name not in ("link", "joint"):
            continue
        name, line = tag.attributes.get("name", ""), f"{where}, line {tag.line}"
        if not name:
            raise InputError(f"a <{tag.name}> has no name", where=line)
        if name in (links if tag.name == "link" else joints):
            raise InputError(f"two {tag.name}s have the same name", where=line, came=name)
        if tag.name == "link":
            links[name] = tag
        else:
            joints[name] = _urdf_joint(tag, name, f"{line}, joint {name}")
    tree = Tree(where, robot.attributes.get("name", ""), links, joints, root="")
    for joint in joints.values():
        tree.known(joint.parent, f"{joint.where}, <parent>")
        tree.known(joint.child, f"{joint.where}, <child>")
    return replace(tree, root=_root(tree))


def _urdf_joint(tag: Tag, name: str, where: str) -> UrdfJoint:
    type_ = tag.attributes.get("type")
    if type_ not in _TYPES:
        raise InputError("a joint's type is not one of URDF's", where=where, came=type_, allowed=", ".join(_TYPES))
    ends = []
    for end in ("parent", "child"):
        end_tag = child_tag(tag, end, where)
        if end_tag is None or "link" not in end_tag.attributes:
            raise InputError(f'the joint has no <{end} link="..."/>', where=where)
        ends.append(end_tag.attributes["link"])
    return UrdfJoint(name, type_, ends[0], ends[1], tag, where)


def _root(tree: Tree) -> str:
    """Return the one link that hangs on no joint, or refuse a file that is no tree."""
    parents: dict[str, str] = {}
    for joint in tree.joints.values():
        if joint.child in parents:
            raise InputError(
                f"the links form a loop: link {joint.child} hangs on two joints",
                where=tree.where,
                came=f"{parents[joint.child]} and {joint.name}",
                cure="A serial chain is needed: delete the joint that closes the loop.",
            )
        parents[joint.child] = joint.name
    roots = [link for link in tree.links if link not in parents]
    if len(roots) > 1:
        raise InputError(
            "several links hang on no joint, a robot has one root",
            where=tree.where,
            came=", ".join(roots),
            cure="Join them with a fixed joint, or delete those that are not used.",
        )
    reached = list(roots)
    for link in reached:
        reached += tree.children(link)
    linked = set(reached)
    lost = [link for link in tree.links if link not in linked]
    if lost:
        raise InputError("the links form a loop that no root leads to", where=tree.where, came=", ".join(lost))
    if not roots:
        raise InputError("there is no <link>", where=tree.where)
    return roots[0]


def child_tag(tag: Tag, name: str, where: str) -> Tag | None:
    """Return the child of this name, None if there is none; two are refused."""
    tags = [child for child in tag.children if child.name == name]
    if len(tags) > 1:
        raise InputError(f"there is more than one <{name}>", where=where)
    return tags[0] if tags else None


def numbers(tag: Tag, attribute: str, count: int, where: str) -> tuple[float, ...] | None:
    """Return the `count` numbers of an attribute, None if it is not given."""
    text = tag.attributes.get(attribute)
    if text is None:
        return None
    words = re.findall(r"[^ \t\r\n]+", text)
    values = [value for value in map(as_number, words) if value is not None]
    if len(words) != count or len(values) != count:
        raise InputError(
            f"bad numbers in <{tag.name} {attribute}>",
            where=where,
            came=text,
            allowed="one number" if count == 1 else f"{count} numbers with spaces between",
        )
    return tuple(sized_si(value, "1", f"{where}, <{tag.name} {attribute}>", came=text) for value in values)


def triple(values: Iterable[float]) -> Triple:
    """Return three numbers as plain floats, minus zero as zero."""
    x, y, z = (float(v) + 0.0 for v in values)
    return x, y, z


def origin(tag: Tag, where: str) -> tuple[Triple, Triple]:
    """Return xyz [m] and rpy [rad] of the ``<origin>`` in a joint or an inertial."""
    entry = child_tag(tag, "origin", where)
    if entry is None:
        return ZERO, ZERO
    xyz, rpy = (numbers(entry, attribute, 3, where) or ZERO for attribute in ("xyz", "rpy"))
    return triple(xyz), triple(rpy)


def product(elements: Iterable[Element], values: Mapping[str, float] | None = None) -> Array:
    """Return the product of elements without variables, ``(4, 4)``."""
    kinematics = Chain(tuple(elements)).forward_kinematics(np.zeros((0, 1)), values)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = kinematics.matrix()[0], kinematics.position[:, 0]
    return matrix


def placement(xyz: Triple, rpy: Triple) -> Array:
    """Return the transform of an ``<origin>``, ``(4, 4)``."""
    row = dict(zip(("x", "y", "z", "roll", "pitch", "yaw"), (*xyz, *rpy), strict=True))
    return product(Element(motion, row[column]) for column, motion in convention("urdf").link)


def roll_pitch_yaw(R: Array, near: Triple = ZERO) -> Triple:
    """Return the angles [rad] of ``R = Rz(yaw) Ry(pitch) Rx(roll)``, ``(3, 3)``, those nearest `near`.

    Yaw comes first and the others from ``Rz(-yaw) R``. Where pitch is 90 deg only the sum or the difference
    of roll and yaw is defined: there yaw is taken from `near`, and roll makes up for it.
    """
    lying = math.hypot(R[0, 0], R[1, 0])
    first = math.atan2(R[1, 0], R[0, 0]) if lying > 1e-14 else near[2]
    solutions = []
    for yaw in (first, first + math.pi):
        c, s = math.cos(yaw), math.sin(yaw)
        pitch = math.atan2(-R[2, 0], c * R[0, 0] + s * R[1, 0])
        roll = math.atan2(s * R[0, 2] - c * R[1, 2], c * R[1, 1] - s * R[0, 1])
        turns = (round((a - n) / (2 * math.pi)) for a, n in zip((roll, pitch, yaw), near, strict=True))
        solutions.append(triple(a - 2 * math.pi * k for a, k in zip((roll, pitch, yaw), turns, strict=True)))
    return min(solutions, key=lambda angles: sum(abs(a - n) for a, n in zip(angles, near, strict=True)))
