"""What every joint carries, and equilibrium: an arm bends under loads, and the loads are those of the bent arm."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import accumulate
from typing import TYPE_CHECKING, Final, cast

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError
from truearm.engine.robot.balancers import Wrench, balancer_wrenches
from truearm.engine.robot.chain import (
    Array,
    Axes,
    Coordinates,
    Direction,
    Element,
    Move,
    Number,
    across,
    axis_of,
    cross,
    in_frame_before,
    in_frame_behind,
)
from truearm.engine.robot.parts import POINT_MASS, Inertia
from truearm.engine.robot.postures import Postures, pairs
from truearm.engine.robot.wrench import wrench_on_flange

if TYPE_CHECKING:
    from truearm.engine.robot.robot import Robot


# What every joint carries: weight and inertia of all that lies beyond it, and what pulls at the flange.
#
# There is one sign: the wrench is the load's, weight and the inertial forces that oppose acceleration (d'Alembert), so
# a positive moment about a joint's axis turns the joint forward and a compliant joint sags that way (Nubiola, equation
# I.10, ``(c x f)_z``). The reaction that holds the load, which textbooks and RNEA codes return (Craig, "Introduction to
# Robotics", equations 6.51 and 6.52), is its opposite.
#
# It is the recursive Newton-Euler method (Luh, Walker and Paul 1980, "On-line computational scheme for mechanical
# manipulators"), element by element of the chain and for all configurations together. Forward goes what each frame
# feels: free fall, which is gravity less the acceleration of the frame's origin, and in motion its angular velocity and
# acceleration; they give each body's wrench. Backward go force and moment, summed, about the origin and in the axes of
# the frame at hand. At rest that is one vector forward and two backward.
_ZERO: Final[Coordinates] = (0.0, 0.0, 0.0)


def has_weight(robot: Robot) -> bool:
    """Return whether anything loads a robot's joints: a mass of its own or that it carries, or a balancer."""
    return robot.payload.mass > 0.0 or bool(robot.balancers) or any(link.mass > 0.0 for link in robot.masses)


def joint_loads(
    robot: Robot,
    variables: Array,
    *,
    velocity: Array | None = None,
    acceleration: Array | None = None,
    wrench: Array | None = None,
) -> Array:
    """Return force [N] and moment [N m] of the load at every joint, about its bearing and in its own axes.

    A joint's own axes are those of :func:`truearm.engine.robot.chain.across` and its axis as z. Its bearing lies on the
    axis, see :mod:`truearm.engine.robot.bearings`; of a prismatic joint it is the origin of the frame behind the slide.
    The place of the base in the world does not matter, because gravity is given in the base frame.

    Args:
        variables: Variables of the trunk [rad or m], ``(joints or more, n)``; those beyond the joints are at rest.
        velocity, acceleration: Of the joints, ``(joints, n)`` [rad/s and rad/s^2, or m/s and m/s^2]; zero if None.
        wrench: External force [N], then moment [N m], on the flange at its origin, in the axes of the base, ``(6, n)``.
            What acts on the robot's tool comes on top.

    Returns:
        loads: ``(joints, 6, n)``, force first. A positive moment about z turns the joint forward.

    Raises:
        InputError: If an array has another shape.
    """
    count, size = len(robot.joints), np.shape(variables)[-1]
    _refuse_other_shapes(robot, size, velocity, acceleration, wrench)
    elements = robot.arm.elements
    arm = robot.arm.forward_kinematics(variables, robot.values)
    moves = arm.moves
    if robot.wrench is not None:
        at_tool = wrench_on_flange(robot, robot.wrench, arm)
        wrench = at_tool if wrench is None else wrench + at_tool
    ends = [0, *accumulate(len(link) for link in robot.moved_links)]
    bodies = _bodies(robot, ends)
    moving = velocity is not None or acceleration is not None
    zeros = np.zeros((count, 1))
    qd = zeros if velocity is None else velocity
    qdd = zeros if acceleration is None else acceleration

    fall: Coordinates = robot.gravity
    omega = alpha = force = moment = _ZERO
    if wrench is not None:
        force, moment = (wrench[0], wrench[1], wrench[2]), (wrench[3], wrench[4], wrench[5])
    applied: dict[int, list[Wrench]] = {}
    for place, (element, move) in enumerate(zip(elements, moves, strict=True), 1):
        if move and element.turns:
            fall = in_frame_behind(fall, element, move)
            if moving:
                omega, alpha = in_frame_behind(omega, element, move), in_frame_behind(alpha, element, move)
            if wrench is not None:
                force, moment = in_frame_behind(force, element, move), in_frame_behind(moment, element, move)
        elif move and moving:
            fall = _less(fall, _swing(omega, alpha, _scaled(axis_of(element), move[0])))
        if moving and element.variable is not None and element.variable < count:
            rate = _scaled(axis_of(element), qd[element.variable])
            surge = _scaled(axis_of(element), qdd[element.variable])
            turned = cross(omega, rate)  # by Coriolis once for a turn, twice for a slide
            if element.turns:
                alpha, omega = _plus(_plus(alpha, turned), surge), _plus(omega, rate)
            else:
                fall = _less(fall, _plus(_plus(turned, turned), surge))
        for end, mass, cog, inertia in bodies:
            if end == place:
                apparent = _less(fall, _swing(omega, alpha, cog)) if moving else fall
                pull = _scaled(apparent, mass)
                turn = cross(cog, pull)
                if moving and any(inertia):
                    turn = _less(turn, _plus(_times(inertia, alpha), cross(omega, _times(inertia, omega))))
                applied.setdefault(place, []).append((pull, turn))

    for number, balancer in enumerate(robot.balancers, 1):
        factor = robot.values.get(f"balancer_{number}", 1.0)
        for place, (pull, turn) in balancer_wrenches(robot, balancer, elements, moves, ends, robot.values):
            applied.setdefault(place, []).append((_scaled(pull, factor), _scaled(turn, factor)))
    return _carried(robot, elements, moves, applied, (force, moment), size)


def free_fall(robot: Robot, variables: Array) -> Array:
    """Return the direction g in which gravity falls, as :attr:`Postures.fall` holds it, ``(joints + pairs, 3, n)``.

    It is that of an arm at rest: a unit vector, or zero where there is no gravity. A link with the first moment e turns
    a joint with the axis z by ``(e x g) z = e (g x z)``: the rows of pairs are ``g x z``. `variables` are those of
    :func:`joint_loads`.
    """
    count = len(robot.joints)
    rows = {pair: count + place for place, pair in enumerate(pairs(count))}
    found = np.zeros((count + len(rows), 3, np.shape(variables)[-1]))
    pulls: dict[int, Coordinates] = {}
    size = math.hypot(*robot.gravity)
    fall: Coordinates = _scaled(robot.gravity, 1.0 / size) if size else _ZERO
    moves = robot.arm.forward_kinematics(variables, robot.values).moves
    for element, move in zip(robot.arm.elements, moves, strict=True):
        if move and element.turns:
            fall = in_frame_behind(fall, element, move)
            pulls = {i: in_frame_behind(pull, element, move) for i, pull in pulls.items()}
        k = element.variable
        if k is not None and k < count:
            for place, vector in ((k, fall), *((rows[i, k], pull) for i, pull in pulls.items())):
                for row, axis in zip(found[place], (*across(element), axis_of(element)), strict=True):
                    row[:] = _along(axis, vector)
            if element.turns:
                pulls[k] = cross(fall, axis_of(element))
    return found


def _refuse_other_shapes(
    robot: Robot, size: int, velocity: Array | None, acceleration: Array | None, wrench: Array | None
) -> None:
    count = len(robot.joints)
    for name, values, rows in (
        ("velocity", velocity, count),
        ("acceleration", acceleration, count),
        ("wrench", wrench, 6),
    ):
        if values is not None and np.shape(values) != (rows, size):
            raise InputError(
                f"the {name} has another shape than it should",
                where=robot.name,
                came=f"an array of shape {np.shape(values)}",
                allowed=f"({rows}, {size}): one column for each configuration",
            )


def _bodies(robot: Robot, ends: Sequence[int]) -> list[tuple[int, float, Coordinates, Inertia]]:
    """Return what loads an arm: behind which element it is, its mass, centre of gravity and moments of inertia."""
    stayed = robot.axial_slides.stayed
    bodies: list[tuple[int, float, Coordinates, Inertia]] = [
        (ends[link.joint], link.mass, stayed(link.joint, link.cog, robot.values), link.inertia) for link in robot.masses
    ]
    bodies.append((len(robot.arm.elements), robot.payload.mass, robot.payload.cog, POINT_MASS))
    return [body for body in bodies if body[1] or any(body[3])]


def relief(robot: Robot, variables: Array) -> Array:
    """Return what each balancer, at the factor 1, contributes to :func:`joint_loads`, ``(balancers, joints, 6, n)``."""
    elements = robot.arm.elements
    moves = robot.arm.forward_kinematics(variables, robot.values).moves
    ends = [0, *accumulate(len(link) for link in robot.moved_links)]
    columns = []
    for balancer in robot.balancers:
        applied = {p: [w] for p, w in balancer_wrenches(robot, balancer, elements, moves, ends, robot.values)}
        columns.append(_carried(robot, elements, moves, applied, (_ZERO, _ZERO), np.shape(variables)[-1]))
    return np.array(columns)


def _carried(
    robot: Robot,
    elements: Sequence[Element],
    moves: Sequence[Move],
    applied: Mapping[int, Sequence[Wrench]],
    flange: Wrench,
    size: int,
) -> Array:
    """Return the loads ``(joints, 6, size)`` of what is applied behind elements, and on the flange."""
    count = len(robot.joints)
    # x, y and z of force and moment, ``(2, size)`` each: both go through the same turns
    x, y, z = (np.array([np.broadcast_to(part, size) for part in pair]) for pair in zip(*flange, strict=True))
    carried: Axes = x, y, z
    loads = np.empty((count, 6, size))
    bearings = robot.bearings
    for place in range(len(elements), 0, -1):
        element, move = elements[place - 1], moves[place - 1]
        for wrench in applied.get(place, ()):
            for both, *pair in zip(carried, *wrench, strict=True):
                both[0] += pair[0]
                both[1] += pair[1]
        if element.variable is not None and element.variable < count:
            for k, axis in enumerate((*across(element), axis_of(element))):
                loads[element.variable, k::3] = _along(axis, carried)
            away = bearings[element.variable]
            if away:
                loads[element.variable, 3] += away * loads[element.variable, 1]
                loads[element.variable, 4] -= away * loads[element.variable, 0]
        if move and element.turns:
            carried = cast("Axes", in_frame_before(carried, element, move))  # of arrays it makes arrays
        elif move:
            force = carried[0][0], carried[1][0], carried[2][0]
            for both, moment in zip(carried, cross(_scaled(axis_of(element), move[0]), force), strict=True):
                both[1] += moment
    return loads


# -- vectors whose entries are numbers or arrays -----------------------------------------------------------


def _swing(omega: Coordinates, alpha: Coordinates, arm: Coordinates) -> Coordinates:
    """Return the acceleration of the end of an arm that turns about its other end [m/s^2]."""
    return _plus(cross(alpha, arm), cross(omega, cross(omega, arm)))


def _times(inertia: Inertia, vector: Coordinates) -> Coordinates:
    xx, yy, zz, xy, xz, yz = inertia
    x, y, z = vector
    return xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z


def _scaled(vector: Coordinates, size: Number) -> Coordinates:
    return vector[0] * size, vector[1] * size, vector[2] * size


def _plus(a: Coordinates, b: Coordinates) -> Coordinates:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _less(a: Coordinates, b: Coordinates) -> Coordinates:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _along(axis: Direction, vector: Coordinates) -> Number:
    if axis.count(0.0) == 2 and 1.0 in axis:
        return vector[axis.index(1.0)]
    return axis[0] * vector[0] + axis[1] * vector[1] + axis[2] * vector[2]


_WHOLE_ROUNDS: Final = 20
_MOST_ROUNDS: Final = 100
#: A posture that moves by less in a round [rad, m] is settled: what is left is a fraction of that.
_SETTLED: Final = 1e-12


# Bending and loads are found from each other in turns. A round leaves a hundredth of what was missing, or half where a
# joint with play is all but balanced; only postures that are not yet settled go through the next one. The few that
# swing to and fro take half of each way later on. A shaft that would have to stand in the middle of its clearance never
# settles.
def settled(following: Callable[[NDArray[np.intp], Array], Array], start: Array) -> Array:
    """Return where rounds from `start` ``(variables, n)`` settle to 1e-12 rad or m.

    Args:
        following: Returns what follows on some columns, given their places and what they are now.
    """
    solution = np.array(start, float)
    left = np.arange(solution.shape[1])
    for number in range(_MOST_ROUNDS):
        if not len(left):
            break
        before = solution[:, left]
        way = following(left, before) - before
        solution[:, left] = before + (way if number < _WHOLE_ROUNDS else 0.5 * way)
        left = left[np.abs(way).max(axis=0) > _SETTLED]
    return solution


def postures_in_equilibrium(robot: Robot, at: Postures) -> Postures:
    """Return postures with the loads of the arm as it has bent under them."""

    def deflected(rows: NDArray[np.intp], variables: Array) -> Array:
        part = at.at(rows)
        return robot.variables(carrying(robot, part, variables), robot.values)

    straight = robot.without_deflections(at.joints.T)
    start = robot.variables(carrying(robot, at, straight), robot.values)
    variables = settled(deflected, start)
    loaded = carrying(robot, at, variables)
    factors = [f"balancer_{number}" for number in range(1, len(robot.balancers) + 1)]
    if not factors or factors[0] not in robot.parameters:
        return loaded
    return replace(loaded, relief=(relief(robot, variables), tuple(robot.values[name] for name in factors)))


def joint_efforts(robot: Robot, q: Array | Postures) -> Array:
    """Return the load about each turning joint's axis [N m], or along a sliding one's [N], ``(n, joints)``.

    It is that of the arm as it has bent; of a model without elastic joints, of the rigid arm.
    """
    at = robot.loaded(q)
    loads = at.loads if at.loads is not None else _loads(robot, at, robot.variables(at, robot.values))
    rows = [loads[i, 5 if joint.kind == "revolute" else 2] for i, joint in enumerate(robot.joints)]
    return np.ascontiguousarray(np.array(rows).T)


def postures_behind(robot: Robot, variables: Array) -> Postures:
    """Return the postures that lead to variables ``(joints or more, n)``, whose loads are known from the start."""
    turned = variables[: len(robot.joints)]
    there = carrying(robot, Postures(turned.T), variables) if robot.bends else Postures(turned.T)

    def corrected(rows: NDArray[np.intp], joints: Array) -> Array:
        loads, fall = (None if part is None else part[:, :, rows] for part in (there.loads, there.fall))
        at = Postures(joints.T, loads=loads, fall=fall)
        missing = turned[:, rows] - robot.variables(at, robot.values)[: len(joints)]
        return np.asarray(joints + missing)

    return replace(there, joints=np.ascontiguousarray(settled(corrected, turned).T))


def carrying(robot: Robot, at: Postures, variables: Array) -> Postures:
    """Return postures with what the joints of the arm carry that stands at some variables."""
    fall = free_fall(robot, variables) if any(effect.falls for effect in robot.effects) else None
    return replace(at, loads=_loads(robot, at, variables), fall=fall)


def _loads(robot: Robot, at: Postures, variables: Array) -> Array:
    rates = {"velocity": at.velocity, "acceleration": at.acceleration, "wrench": at.wrench}
    return joint_loads(robot, variables, **{name: None if rate is None else rate.T for name, rate in rates.items()})
