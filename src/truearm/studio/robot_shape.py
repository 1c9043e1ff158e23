"""A robot without meshes as smooth links and joint drums, and where they are at joint positions.

How thick an arm is stands in no kinematic table. Arms of all makers are much alike, so it follows from the length of
the arm along its links: a drum has 5.8 % of it as radius at the base and 3.4 % at the flange, evenly less between, and
a link 82 % of the drum at its end. The shape is for looking at. It follows the nominal geometry, so that the same
meshes serve a nominal and a calibrated robot, which differ by less than can be seen.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from truearm.engine.robot.chain import Array
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import quaternion_from_rotation
from truearm.studio.joint_layout import LINK_SHARE, Layout, layout
from truearm.studio.solids import Mesh, ball, box, drum, frame_about, together, tube

#: Of a hinge's drum: how far it stands out beyond its links, and its radius; of a collar the same, by its radius.
_HINGE, _COLLAR = 0.95, 0.42
#: Radius of the flange disc by that of the last drum, its thickness, and that of the base plate by the first drum.
_FLANGE, _FLANGE_THICK, _PLATE, _PLATE_THICK = 0.8, 0.3, 1.75, 0.22
#: Of a rail: half its width by the radius of a drum; of its carriage.
_RAIL, _CARRIAGE = 0.45, 0.9
#: Radius of rods that hold targets, and of targets, by the length of the arm; no more than a reflector of 1.5 inches.
_ROD, _TARGET, _LARGEST_TARGET = 0.006, 0.012, 0.01905


@dataclass(frozen=True, eq=False)
class LinkShape:
    """What is drawn of a link, in its own frame."""

    name: str  #: ``base``, ``link_1`` and so on, ``flange`` or ``tool``.
    bodies: Mesh  #: What is light: the link itself.
    joints: Mesh  #: What is dark: drums, rails, plate and flange disc.


@dataclass(frozen=True, eq=False)
class RobotShape:
    """All that is drawn of a robot."""

    #: Base, the links in their order, flange, and the tool if there are targets. Their places are :func:`link_poses`.
    links: tuple[LinkShape, ...]
    layout: Layout  #: The lines that they are drawn along.


def robot_shape(robot: Robot, meshes: Mapping[str, Mesh] | None = None) -> RobotShape:
    """Return what is drawn of a robot.

    Args:
        robot: Its nominal geometry gives links and joints, its targets the tool.
        meshes: What links look like, by name, in their own frames; None where that is not known. Links that are not
            named are then not drawn.
    """
    plan = layout(robot)
    count = len(plan.joints)
    if meshes:
        names = ["base", *(f"link_{number}" for number in range(1, count + 1)), "flange"]
        given = [LinkShape(name, meshes.get(name, _NOTHING), _NOTHING) for name in names]
        tool = [_tool(robot, plan)] if robot.targets else []
        foot = float(meshes["base"].vertices[:, 2].min()) if "base" in meshes else 0.0
        return RobotShape((*given, *tool), replace(plan, pedestal=max(0.0, -foot)))
    links = [_base(plan)]
    links += [_link(plan, number) for number in range(1, count + 1)]
    radius = plan.joints[-1].radius
    thick = _FLANGE_THICK * radius
    disc = drum(np.array([0.0, 0.0, -thick]), np.zeros(3), _FLANGE * radius)
    links.append(LinkShape("flange", _NOTHING, disc))
    if robot.targets:
        links.append(_tool(robot, plan))
    return RobotShape(tuple(links), plan)


def link_poses(robot: Robot, joints: Array | Postures) -> tuple[Array, Array]:
    """Return where the links of a robot are in the world: base, links, flange, and again for the tool.

    With joint effects in the model they are where those have moved them: bent by loads, tilted, grown warm.

    Args:
        joints: Joint positions ``(n, joints)`` [rad or m], or postures.

    Returns:
        positions, quaternions: ``(n, links, 3)`` [m] and ``(n, links, 4)``, scalar first.
    """
    kinematics = robot.forward_kinematics(joints)
    places = [len(robot.base_elements)]
    passed = places[0]
    for link, moved in zip(robot.link_elements, robot.moved_links, strict=True):
        turning = next(k for k, element in enumerate(link) if element.variable is not None)
        passed += len(moved)
        places.append(passed - (len(link) - 1 - turning))
    places += [len(robot.trunk.elements)] * (2 if robot.targets else 1)
    positions = np.stack([kinematics.origin(place).T for place in places], axis=1)
    rotations = np.stack([np.broadcast_to(kinematics.matrix(p), (len(positions), 3, 3)) for p in places], axis=1)
    return positions, quaternion_from_rotation(rotations)


_NOTHING: Final = together(())


def _base(plan: Layout) -> LinkShape:
    line, joint = plan.lines[0], plan.joints[0]
    assert line.next_axis is not None
    foot = np.array([0.0, 0.0, -plan.pedestal])
    plate = drum(foot, foot + np.array([0.0, 0.0, _PLATE_THICK * joint.radius]), _PLATE * joint.radius)
    end = line.origin + joint.before * line.next_axis
    bodies: list[Mesh] = []
    if not joint.slides:
        corner = line.origin + plan.feet[0][1] * line.next_axis
        bodies.append(tube([end, corner, foot], (0.9 * joint.radius, 1.2 * joint.radius), flat_end=True))
    return LinkShape("base", together(bodies), together([plate, *_rail(plan, 0)]))


def _link(plan: Layout, number: int) -> LinkShape:
    """Return a link with the drum or carriage at its start, and the rail at its end if the next joint slides."""
    line, joint = plan.lines[number], plan.joints[number - 1]
    assert line.axis is not None
    start = joint.behind * line.axis
    corners = [start, plan.feet[number][0] * line.axis]
    thick = LINK_SHARE * joint.radius
    joints = [_carriage(plan, number) if joint.slides else _drum(plan, number)]
    if line.next_axis is None:
        end = line.origin
        radii, flat = (thick, 0.9 * _FLANGE * joint.radius), True
    else:
        following = plan.joints[number]
        end = line.origin + following.before * line.next_axis
        corners.append(line.origin + plan.feet[number][1] * line.next_axis)
        radii, flat = (thick, LINK_SHARE * following.radius), False
        joints += _rail(plan, number)
    if flat and np.linalg.norm(end - start) < 1e-3:
        return LinkShape(f"link_{number}", ball(start, thick), together(joints))
    body = tube([*corners, end], radii, flat_end=flat)
    return LinkShape(f"link_{number}", body, together(joints))


def _drum(plan: Layout, number: int) -> Mesh:
    joint, axis = plan.joints[number - 1], plan.lines[number].axis
    assert axis is not None
    # From the link's side; the link before ends at `before`, counted from the same origin on the same axis.
    low, high = sorted((joint.before, joint.behind))
    beyond = (_COLLAR if joint.turns_link else _HINGE) * joint.radius
    return drum((low - beyond) * axis, (high + beyond) * axis, joint.radius)


def _rail(plan: Layout, number: int) -> list[Mesh]:
    """Return the rail that a link carries for the next joint, none if that turns."""
    line = plan.lines[number]
    if line.next_axis is None or not plan.joints[number].slides:
        return []
    joint = plan.joints[number]
    low, high = joint.reach
    half = (high - low) / 2.0 + joint.radius
    axes = frame_about(line.next_axis)
    width = _RAIL * joint.radius
    middle = line.origin + (low + high) / 2.0 * line.next_axis
    return [box(middle, axes, (width, width, half))]


def _carriage(plan: Layout, number: int) -> Mesh:
    joint, axis = plan.joints[number - 1], plan.lines[number].axis
    assert axis is not None
    return box(np.zeros(3), frame_about(axis), [_CARRIAGE * joint.radius] * 3)


def _tool(robot: Robot, plan: Layout) -> LinkShape:
    rod, size = _ROD * plan.length, min(_TARGET * plan.length, _LARGEST_TARGET)
    places = [np.array(robot.tool_place(target.name).translation) for target in robot.targets]
    rods = [tube([np.zeros(3), place], (rod, 0.7 * rod)) for place in places if float(np.linalg.norm(place)) > rod]
    return LinkShape("tool", together(rods), together(ball(place, size) for place in places))
