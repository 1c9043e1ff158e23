"""Where the joints of an arm have their drums, and how its links run from drum to drum.

A kinematic table says where the axes of the joints are, and nothing of where on its axis a joint has its bearing: the
origins of Denavit and Hartenberg lie where the arithmetic wants them. A link is drawn as makers build it: along the
common normal of its two axes, and along an axis where two common normals meet it at different places. A joint that
turns a link about its own length sits on that way; of links that turn beside each other about parallel axes, one is
moved aside so that they can pass, as far as the table has an offset there.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from truearm.engine.robot.chain import Array, Chain, axis_of
from truearm.engine.robot.robot import Robot

#: Radius of a drum at the base and at the flange, by the length of the arm along its links.
THICKNESS: Final = (0.058, 0.034)
#: Of links, by that of the drum at their end.
LINK_SHARE: Final = 0.82
#: Axes that are less than this apart are parallel [rad]: identified ones are never so to the last digit.
_PARALLEL: Final = np.deg2rad(3.0)
#: Where a joint sits on the way along its own axis, and from how many radii on there is one.
_ON_THE_WAY: Final = 0.4
_LONG: Final = 0.5
#: A shoulder that is less than so many radii from the base frame's origin stands on a pedestal, of so many lengths of
#: the arm.
_IN_SHOULDER: Final = 0.8
_PEDESTAL: Final = 0.3
#: Radius of a wrist's drum by its distance from the flange at most, and by what it has otherwise at least.
_FREE: Final = 0.72
_LEAST: Final = 0.5


@dataclass(frozen=True, eq=False)
class LinkLine:
    """The axes at both ends of a link, in its own frame.

    The frame is right behind the joint that moves the link; for the pedestal it is the base.
    """

    axis: Array | None  #: Of the joint that moves it, through the frame's origin; None for the pedestal.
    #: origin, next_axis: a point on the next joint's axis and its direction; the flange's place, and None, for the last
    #: link.
    origin: Array
    next_axis: Array | None


@dataclass(frozen=True, eq=False)
class JointPlace:
    """Where a joint is on its axis, counted from the origin of its frame [m]."""

    slides: bool  #: Whether it is prismatic.
    before: float  #: before, behind: where the link before it ends, and the link behind it begins.
    behind: float
    turns_link: bool  #: Whether it turns the links about their own length, and does not swing them.
    radius: float  #: Of its drum [m].
    reach: tuple[float, float]  #: How far a prismatic joint goes from the origin of its frame [m]; zeros for others.


@dataclass(frozen=True, eq=False)
class Layout:
    """An arm as lines."""

    lines: tuple[LinkLine, ...]  #: Pedestal first, then the links.
    joints: tuple[JointPlace, ...]  #: From the base on.
    #: Of each link where its common normal meets the axes at its ends [m along them]; the pedestal has no first one.
    feet: tuple[tuple[float, float], ...]
    pedestal: float  #: How far below the base frame the arm stands, where its base frame is in its shoulder [m].
    length: float  #: Of the arm along its links [m].


def layout(robot: Robot) -> Layout:
    """Return where the joints of a robot with its nominal geometry are."""
    lines = _lines(robot)
    slides = [joint.kind == "prismatic" for joint in robot.joints]
    count = len(slides)
    feet, parallel = _feet(lines, slides)
    along, length = _along(lines, feet, count)
    radius = [THICKNESS[0] * length + (THICKNESS[1] - THICKNESS[0]) * s for s in along]
    pedestal = 0.0
    if not slides[0] and float(np.linalg.norm(_on_next(lines[0], feet[1][0]))) < _IN_SHOULDER * radius[0]:
        pedestal = _PEDESTAL * length
        assert lines[0].next_axis is not None
        feet[0] = (0.0, feet[0][1] - pedestal * float(np.sign(lines[0].next_axis[2])))
    _keep_flange_free(lines, feet, slides, radius)
    places: list[tuple[float, float, bool]] = []
    for joint in range(count):
        first, last = feet[joint][1], feet[joint + 1][0]
        way = last - first
        if abs(way) >= _LONG * radius[joint] and not slides[joint]:
            sits = first + _ON_THE_WAY * way
            places.append((sits, sits, True))
        else:
            places.append((first, last, False))
    for group in _groups(parallel):
        _side_by_side(group, places, lines, feet, radius)
    joints = []
    for joint, (before, behind, turns) in enumerate(places):
        low, high = 0.0, 0.0
        if slides[joint]:
            low, high = _slide(robot, joint)
            before, behind = float(np.clip(before, low, high)), 0.0
        joints.append(JointPlace(slides[joint], before, behind, turns, radius[joint], (low, high)))
    return Layout(tuple(lines), tuple(joints), tuple(feet), pedestal, length)


def _on_next(line: LinkLine, place: float) -> Array:
    """Return a point on the next joint's axis in the link's frame."""
    return line.origin if line.next_axis is None else line.origin + place * line.next_axis


def _lines(robot: Robot) -> list[LinkLine]:
    """Return the axes at the ends of the pedestal and of every link, at nominal values."""
    ways: list[list[object]] = [[]]
    link_lines: list[LinkLine] = []
    axis: Array | None = None
    for link in robot.link_elements:
        for element in link:
            if element.variable is None:
                ways[-1].append(element)
                continue
            kinematics = Chain(tuple(ways[-1])).forward_kinematics(np.zeros((0, 1)))  # type: ignore[arg-type]
            turned, place = kinematics.matrix()[0], kinematics.position[:, 0]
            link_lines.append(LinkLine(axis, place, turned @ np.array(axis_of(element))))
            axis = np.array(axis_of(element))
            ways.append([])
    last = Chain((*ways[-1], *robot.flange_elements))  # type: ignore[arg-type]
    link_lines.append(LinkLine(axis, last.forward_kinematics(np.zeros((0, 1))).position[:, 0], None))
    return link_lines


def _feet(lines: list[LinkLine], slides: list[bool]) -> tuple[list[tuple[float, float]], list[bool]]:
    """Return for each link where it leaves its axis and meets the next, and whether the two are parallel hinges."""
    feet: list[tuple[float, float]] = []
    parallel = []
    for number, line in enumerate(lines):
        p, a, b = line.origin, line.axis, line.next_axis
        beside = False
        if a is None:
            assert b is not None
            feet.append((0.0, float(-p @ b)))
        elif b is None:
            feet.append((float(p @ a), 0.0))
        elif np.linalg.norm(np.cross(a, b)) < np.sin(_PARALLEL):
            here = 0.0 if slides[number - 1] else feet[-1][1]
            feet.append((here, (here - float(p @ a)) / float(a @ b)))
            beside = not slides[number - 1] and not slides[number]
        else:
            cosine = float(a @ b)
            square = 1.0 - cosine**2
            pa, pb = float(p @ a), float(p @ b)
            feet.append(((pa - cosine * pb) / square, (cosine * pa - pb) / square))
        parallel.append(beside)
    return feet, parallel


def _along(lines: list[LinkLine], feet: list[tuple[float, float]], count: int) -> tuple[list[float], float]:
    """Return how far each joint is along the arm, and how long the arm is [m]."""
    reached, along = 0.0, []
    for number in range(count + 1):
        line = lines[number]
        start = np.zeros(3) if line.axis is None else feet[number][0] * line.axis
        reached += float(np.linalg.norm(_on_next(line, feet[number][1]) - start))
        if number < count:
            along.append(reached)
            reached += abs(feet[number + 1][0] - feet[number][1])
    return along, max(reached, 1e-3)


def _keep_flange_free(
    lines: list[LinkLine], feet: list[tuple[float, float]], slides: list[bool], radius: list[float]
) -> None:
    """Make the drums of a wrist so small that the flange stands out of them, in `radius`."""
    count = len(radius)
    distance = float(np.linalg.norm(lines[count].origin - feet[count][0] * _axis(lines[count])))
    for joint in range(count - 1, 0, -1):
        way = abs(feet[joint + 1][0] - feet[joint][1])
        if slides[joint] or distance > radius[joint] / _FREE:
            break
        if way < _LONG * radius[joint]:
            radius[joint] = max(min(radius[joint], _FREE * distance), _LEAST * radius[joint])
        if slides[joint - 1]:
            break
        line = lines[joint]
        distance += way + float(np.linalg.norm(_on_next(line, feet[joint][1]) - feet[joint][0] * _axis(line)))
    for joint in range(1, count):
        radius[joint] = min(radius[joint], radius[joint - 1])


def _axis(line: LinkLine) -> Array:
    assert line.axis is not None
    return line.axis


def _groups(parallel: list[bool]) -> list[tuple[int, int]]:
    """Return runs of joints with parallel axes, first and last of each."""
    found: list[tuple[int, int]] = []
    for number, beside in enumerate(parallel):
        if beside and found and found[-1][1] == number - 1:
            found[-1] = (found[-1][0], number)
        elif beside:
            found.append((number - 1, number))
    return found


def _side_by_side(
    group: tuple[int, int],
    places: list[tuple[float, float, bool]],
    lines: list[LinkLine],
    feet: list[tuple[float, float]],
    radius: list[float],
) -> None:
    """Put links that turn about parallel axes beside each other, in `places`.

    All are counted along the first joint's axis from its origin. The link before the first and the link behind the
    last are where the rest of the arm wants them; those between stand aside of both neighbours if the two differ.
    """
    first, last = group
    shifts, ways = [0.0], [1.0]  # of each joint's count: common = shift + way * own
    for joint in range(first, last):
        line = lines[joint + 1]
        assert line.axis is not None
        assert line.next_axis is not None
        ways.append(ways[-1] * float(np.sign(line.axis @ line.next_axis)))
        shifts.append(shifts[-1] + ways[-2] * float(line.origin @ line.axis))
    start, end = feet[first][1], shifts[-1] + ways[-1] * feet[last + 1][0]
    room = [LINK_SHARE * 2.1 * radius[joint] for joint in range(first, last + 1)]
    between = last - first
    if first == 0:  # a column carries links at the height that the table gives them
        levels = [shifts[k + 1] for k in range(between)]
        start = levels[0]
    elif abs(end - start) < 0.5 * min(room):
        levels = [start] * between
    else:
        levels = _aside(start, end, room)
    ends = [start, *levels, end]
    for k in range(between + 1):
        before, behind = ((ends[k + j] - shifts[k]) * ways[k] for j in (0, 1))
        places[first + k] = (before, behind, False)


def _aside(start: float, end: float, room: list[float]) -> list[float]:
    """Return where links between two others stand that all neighbours can pass, and stay near the others."""
    side = np.sign(end - start)
    best, levels = (np.inf, np.inf), [start] * (len(room) - 1)
    low, high = min(start, end), max(start, end)
    choices: list[list[float]] = [[]]
    for k in range(len(room) - 1):
        grown = []
        for chosen in choices:
            at = chosen[-1] if chosen else start
            grown += [[*chosen, at + side * room[k]], [*chosen, at - side * room[k]]]
            if k == len(room) - 2:
                grown += [[*chosen, end + side * room[-1]], [*chosen, end - side * room[-1]]]
        choices = grown
    for chosen in choices:
        whole = [start, *chosen, end]
        steps = [abs(b - a) for a, b in pairwise(whole)]
        outside = sum(max(low - at, at - high, 0.0) for at in chosen)
        cost = (round(outside, 9), sum(steps))
        if all(step >= 0.9 * least for step, least in zip(steps, room, strict=True)) and cost < best:
            best, levels = cost, chosen
    return levels


def _slide(robot: Robot, joint: int) -> tuple[float, float]:
    """Return where a prismatic joint's carriage can be on its axis, from the origin before it [m]."""
    element = next(e for e in robot.link_elements[joint] if e.variable is not None)
    low, high = robot.joints[joint].range
    return element.value + low, element.value + high
