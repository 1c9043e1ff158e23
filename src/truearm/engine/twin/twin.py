"""The digital twin: a robot whose truth is known, seen only through its readings.

It follows a path of its own: frames, motions and masses are 4x4 matrices, and the arm is let sag until moments and
deflections agree. Nothing here calls the chain, the loads or the joint effects of the models, so a mistake there cannot
hide by appearing on both sides.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final, TypedDict, Unpack

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset, IntArray
from truearm.engine.robot.chain import Array, Element
from truearm.engine.robot.parts import LinkMass
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.wrench import Wrench
from truearm.engine.twin.twin_joint import PERFECT, Contact, JointTruth

# Where the parts of the digital twin are and what each joint carries, by 4x4 matrices alone.
#
# A frame is a matrix T, and its motion is T with its first and second derivatives by time: the product rule along the
# chain gives velocity and acceleration of every point of a link without a recursion over angular velocities. A body is
# the matrix of its second moments ``J = sum of m x x^T`` over its points x = (x, y, z, 1), so that with gravity G in
# the last column the sum of ``p f^T`` over its points p and the forces f on them is ``T J (G - T'')^T``: its last row
# is the force, its antisymmetric part the moment (Uicker 1965, "On the dynamic analysis of spatial linkages using 4x4
# matrices", the same in Paul 1981, "Robot Manipulators", chapter 6).

#: Frames with their first and second derivative by time, (3, n, 4, 4); of arms at rest the frames alone, (1, n, 4, 4).
Moving = Array
_IDENTITY: Final = np.eye(4)


@dataclass(frozen=True, eq=False)
class Link:
    """One link: the way to its joint, the joint, the way on to the link's frame.

    Where the arm is warmer at one configuration than at another, `before`, `after` and `zero` have a row for each.
    """

    before: Array  #: before, after: matrices that no joint changes ``(4, 4)`` or ``(n, 4, 4)``.
    generator: Array  #: Derivative of the joint's matrix by its variable at zero ``(4, 4)``.
    square: Array  #: That derivative times itself ``(4, 4)``.
    turns: bool  #: Whether the joint turns.
    zero: float | Array  #: Value of the joint's own element [rad or m], or ``(n,)`` of them.
    axes: Array  #: The joint's axes in the frame behind its element, z along the joint, at its bearing ``(4, 4)``.
    after: Array
    body: Array  #: Second moments of the link's masses in the link's frame ``(4, 4)``.

    @classmethod
    def made_of(
        cls,
        elements: Sequence[Element],
        values: Mapping[str, float],
        growth: float,
        masses: Sequence[LinkMass],
        bearing: float,
    ) -> Link:
        """Return the link of some elements, one of which is its joint, each nominal length longer by `growth`.

        The joint's bearing lies `bearing` [m] along its axis from the origin behind its element.
        """
        place = next(i for i, element in enumerate(elements) if element.variable is not None)
        joint = elements[place]
        S = generator(joint)
        return cls(
            before=product(elements[:place], values, growth),
            generator=S,
            square=S @ S,
            turns=joint.turns,
            zero=amount(joint, values, growth),
            axes=_joint_axes(joint, bearing),
            after=product(elements[place + 1 :], values, growth),
            body=sum((second_moments(mass.mass, mass.cog, mass.inertia) for mass in masses), np.zeros((4, 4))),
        )

    def of_rows(self, rows: IntArray) -> Link:
        """Return the link at some of its configurations."""
        if self.before.ndim == 2:
            return self
        zero = np.asarray(self.zero)
        return replace(self, before=self.before[rows], after=self.after[rows], zero=zero[rows])


def stacked(links: Sequence[Link], indices: IntArray) -> Link:
    """Return one link that is at each configuration the one of those links that `indices` names."""
    before, after = (np.array([getattr(link, side) for link in links])[indices] for side in ("before", "after"))
    return replace(links[0], before=before, after=after, zero=np.array([link.zero for link in links])[indices])


def product(elements: Sequence[Element], values: Mapping[str, float], growth: float = 0.0) -> Array:
    """Return the matrix of some elements with no joint among them."""
    T = np.eye(4)
    for element in elements:
        T = T @ exponential(generator(element), amount(element, values, growth), element.turns)
    return T


def amount(element: Element, values: Mapping[str, float], growth: float) -> float:
    """Return how far an element turns or slides at joint position zero [rad or m]."""
    own = element.value if element.parameter is None else values[element.parameter]
    return own if element.turns else own + growth * element.value


def generator(element: Element) -> Array:
    """Return the derivative of an element's matrix by its amount, at zero."""
    x, y, z = _axis(element)
    S = np.zeros((4, 4))
    if element.turns:
        S[:3, :3] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
    else:
        S[:3, 3] = x, y, z
    return S


def exponential(S: Array, amount: float | Array, turns: bool, square: Array | None = None) -> Array:
    """Return the matrix of a turn or a slide by its generator, whose square may be at hand.

    Of ``(n,)`` amounts it returns ``(n, 4, 4)``.
    """
    by = np.asarray(amount)[..., None, None]
    if turns:
        return np.asarray(_IDENTITY + np.sin(by) * S + (1 - np.cos(by)) * (S @ S if square is None else square))
    return np.asarray(_IDENTITY + by * S)


def second_moments(
    mass: float, cog: tuple[float, float, float], inertia: tuple[float, float, float, float, float, float] = (0.0,) * 6
) -> Array:
    """Return the sum of ``m x x^T`` over the points of a body, from its inertia about the centre of gravity."""
    xx, yy, zz, xy, xz, yz = inertia
    about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    J = np.zeros((4, 4))
    J[:3, :3] = np.trace(about) / 2 * np.eye(3) - about
    centre = np.array([*cog, 1.0])
    return J + mass * np.outer(centre, centre)


def moved(T: Moving, link: Link, variable: Array, velocity: Array, acceleration: Array) -> Moving:
    """Return the frames right behind a link's joint, whose variable and derivatives are ``(n,)``."""
    S = link.generator
    A = exponential(S, link.zero + variable, link.turns, link.square)
    if len(T) == 1:
        return np.asarray(T @ link.before @ A)
    rate_of, change_of = velocity[:, None, None], acceleration[:, None, None]
    A1 = rate_of * A @ S
    A2 = change_of * A @ S + rate_of * A1 @ S
    at, rate, change = T @ link.before
    return np.stack([at @ A, rate @ A + at @ A1, change @ A + 2 * rate @ A1 + at @ A2])


def weight(bodies: Array, T: Moving, gravity: Array) -> Array:
    """Return weight and inertial forces on bodies: the sum of ``p f^T`` over the points of each ``(n, bodies, 4, 4)``.

    Args:
        bodies: Second moments ``(bodies, 4, 4)``.
        T: Their frames with first and second derivative, ``(3, n, bodies, 4, 4)``, or alone, ``(1, n, bodies, 4, 4)``.
    """
    pull = -T[2] if len(T) > 1 else np.zeros(T.shape[1:])
    pull[..., :3, 3] += gravity
    return np.asarray(T[0] @ bodies @ np.swapaxes(pull, -1, -2))


def wrench_at(carried: Array, frame: Array) -> Array:
    """Return force and moment ``(..., 6)`` of the forces behind sums of ``p f^T``, about and in the axes of frames."""
    force = carried[..., 3, :3]
    p = carried[..., :3, :3] - frame[..., :3, 3, None] * force[..., None, :]
    moment = (p - np.swapaxes(p, -1, -2))[..., [1, 2, 0], [2, 0, 1]]
    return np.asarray((np.stack([force, moment], axis=-2) @ frame[..., :3, :3]).reshape(*force.shape[:-1], 6))


def forces_of(wrench: Array, point: Array) -> Array:
    """Return sums of ``p f^T`` ``(n, 4, 4)`` that act as forces and moments ``(n, 6)`` about points ``(n, 3)`` do."""
    force, (x, y, z) = wrench[:, :3], wrench[:, 3:].T / 2
    carried = np.zeros((len(wrench), 4, 4))
    carried[:, 3, :3] = force
    carried[:, :3, :3] = point[:, :, None] * force[:, None, :]
    for row, column, half in ((0, 1, z), (1, 2, x), (2, 0, y)):
        carried[:, row, column] += half
        carried[:, column, row] -= half
    return carried


def forces_on_tool(wrench: Wrench, flange: Array, turned: Array) -> Array:
    """Return the sum of ``p f^T`` of what acts on a tool ``(4, 4)``.

    A force at a point is ``x f^T`` of that point; a moment is half a couple ``d f^T - f d^T`` of unit arms d across it.

    Args:
        flange: Frame of the flange ``(4, 4)``.
        turned: Axes that force and moment are given in, ``(3, 3)``; for those of the tool they are turned with it.
    """
    place = flange @ wrench.tool.matrix
    axes = place[:3, :3] if wrench.frame == "tool" else turned
    carried = np.outer(place[:, 3], [*(axes @ np.array(wrench.force)), 0.0])
    for along, size in zip(axes.T, wrench.moment, strict=True):
        d = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
        d = d / np.linalg.norm(d)
        f = size * np.cross(along, d)
        carried[:3, :3] += (np.outer(d, f) - np.outer(f, d)) / 2
    return carried


def _slid(aside: Array) -> Array:
    """Return slides by ``(n, 3)`` [m] as ``(n, 4, 4)``."""
    T = np.tile(_IDENTITY, (len(aside), 1, 1))
    T[:, :3, 3] = aside
    return T


def _direction(gravity: Array) -> Array:
    """Return the unit vector along gravity, zero without any."""
    size = float(np.linalg.norm(gravity))
    return gravity / size if size else gravity


def tilt(alpha: Array, beta: Array) -> Array:
    """Return ``Rx(alpha) Ry(beta)`` ``(n, 4, 4)``."""
    about_x, about_y = generator(Element("Rx")), generator(Element("Ry"))
    return exponential(about_x, alpha, turns=True) @ exponential(about_y, beta, turns=True)


def _axis(element: Element) -> Array:
    return np.array(element.axis) if element.axis else np.eye(3)["xyz".index(element.motion[1])]


def _joint_axes(element: Element, bearing: float) -> Array:
    """Return axes with z along the joint: those of the frame itself for a joint about z, else some across it."""
    z = _axis(element)
    least = np.eye(3)[np.argmin(np.abs(z))]
    y = np.cross(z, least) / np.linalg.norm(np.cross(z, least))
    axes = np.eye(4)
    if z[2] != 1.0:
        axes[:3, :3] = np.column_stack([np.cross(y, z), y, z])
    axes[:3, 3] = bearing * z
    return axes


# How far identified slides have carried a place of the digital twin along an axis, by walking from it both ways.
#
# A slide between axes that are parallel to it may be exchanged for another one without a change of any pose. What the
# file says of bearings and centres of gravity is about the nominal slides, so it is counted back by what they differ.
_ALIKE: Final = 1.0 - 1e-12


def carried(elements: Sequence[Element], place: int, direction: Array, values: Mapping[str, float]) -> float:
    """Return how far a place was carried along a direction [m].

    Args:
        elements: Of all links, one behind the other.
        place: Between the elements before this number and those from it on.
        direction: Unit vector ``(3,)`` in the frame there, along the axis of a joint.
        values: What the parameters are.
    """
    ahead = [e for e, along in _reached(elements, place, direction, forward=True) if abs(along) > _ALIKE]
    if not ahead:
        return 0.0  # the last of them moves everything beyond, wherever it stands
    behind = _reached(elements, place, direction, forward=False)
    return sum(along * (values[str(e.parameter)] - e.value) for e, along in behind if abs(along) > _ALIKE)


def directions_at(elements: Sequence[Element], place: int) -> list[Array]:
    """Return the axes of the turning joints before and behind a place, in the frame there; parallel ones once."""
    axes = [axis for forward in (False, True) for axis in _next_axis(elements, place, forward=forward)]
    if len(axes) == 2 and abs(float(axes[0] @ axes[1])) > _ALIKE:
        return axes[:1]
    return axes


def _reached(
    elements: Sequence[Element], place: int, direction: Array, *, forward: bool
) -> Iterator[tuple[Element, float]]:
    """Give the slides with a parameter on the way to the next joint about another axis, with cosines to a direction."""
    v = direction
    for element in _way(elements, place, forward=forward):
        along = float(v @ _axis_twin_slides(element))
        if element.turns:
            if element.variable is not None and abs(along) < _ALIKE:
                return
            v = _seen(v, element, forward=forward)
        elif element.parameter is not None:
            yield element, along


def _next_axis(elements: Sequence[Element], place: int, *, forward: bool) -> Iterator[Array]:
    passed = np.eye(3)
    for element in _way(elements, place, forward=forward):
        if element.turns and element.variable is not None:
            yield passed @ _axis_twin_slides(element)
            return
        if element.turns:
            R = _turn(element)
            passed = passed @ (R if forward else R.T)


def _way(elements: Sequence[Element], place: int, *, forward: bool) -> Sequence[Element]:
    return elements[place:] if forward else elements[:place][::-1]


def _seen(v: Array, element: Element, *, forward: bool) -> Array:
    R = _turn(element)
    return np.asarray(R.T @ v if forward else R @ v)


def _turn(element: Element) -> Array:
    return exponential(generator(element), element.value, turns=True)[:3, :3]


def _axis_twin_slides(element: Element) -> Array:
    return np.array(element.axis) if element.axis else np.eye(3)["xyz".index(element.motion[1])]


#: Where every length is what its parameter says [degC].
REFERENCE_TEMPERATURE: Final = 20.0
_ROUNDS: Final = 50
_SETTLED: Final = 1e-13
#: No arm begins this many powers of e away from where it ends.
_LARGEST_POWER: Final = 30.0
#: Configurations that are followed at a time; more of them gain nothing and fill the memory.
_BLOCK: Final = 512


class Conditions(TypedDict, total=False):
    """Under what `n` configurations are held; what is left out is at rest, unloaded, warmed up and at 20 degC.

    approach
        Direction of the last move of each joint, +1, -1 or 0 for unknown, ``(n, joints)``; if left out, it follows
        from the order of the configurations.
    number
        How many configurations the arm was brought to before, ``(n,)``: it warms up on the way.
    temperature
        Of the arm [degC], ``(n,)``.
    wrench
        Force [N] and moment about the flange's origin [N m] on the flange, in base axes, ``(n, 6)``.
    velocity, acceleration
        Of the joints [rad/s and rad/s^2; m for prismatic joints], ``(n, joints)``; where one is left out it is zero.
    """

    approach: Array
    number: Array
    temperature: Array
    wrench: Array
    velocity: Array
    acceleration: Array


@dataclass(frozen=True, eq=False)
class Posture:
    """Where a twin truly stands."""

    links: Array  #: Frame of each link behind the tilt of its joint, in the base ``(joints, 4, 4)``.
    targets: Mapping[str, Array]  #: ``T_world_target`` ``(4, 4)`` of every target.
    #: Force [N] and moment [N m] ``(joints, 6)`` that everything beyond a joint puts on it: weight, inertia and the
    #: wrench on the flange. Its sign is the load's: a compliant joint gives way in its direction. It is taken about the
    #: joint's bearing in the joint's axes: z along the joint, x and y of the frame right behind its own element (of
    #: Rz(theta) for DH), before the tilt; joints that are not about their frame's z have some x and y across it.
    loads: Array
    #: What each joint leans about x and y and turns about, or slides along, z beyond its joint position ``(joints,
    #: 3)``.
    deflection: Array
    fall: Array  #: Unit vectors ``(joints, 3)`` in which gravity falls, in the axes of the loads; zero without gravity.
    #: What turns a joint (first) per first moment of a link, in the axes of the joint before it (second), ``(joints,
    #: joints, 3)``: gravity's direction times the axis of the first.
    pulls: Array
    #: External force [N] and moment about the flange's origin [N m] on the flange, in base axes, ``(6,)``.
    wrench: Array

    def of_row(self, row: int) -> Posture:
        """Return one of the configurations that all arrays of this posture have a row for."""
        return Posture(
            links=self.links[row],
            targets={name: at[row] for name, at in self.targets.items()},
            loads=self.loads[row],
            deflection=self.deflection[row],
            fall=self.fall[row],
            pulls=self.pulls[row],
            wrench=self.wrench[row],
        )


@dataclass(frozen=True)
class Twin:
    """A true robot."""

    robot: Robot  #: True parameter values, true base, true targets, masses, payload and gravity.
    #: The truth about joints and links, by joint number; a joint that is left out is perfect.
    joints: Mapping[int, JointTruth] = field(default_factory=dict)
    contact: Contact = "exact"  #: How clearance tilt follows from the moments.

    def __post_init__(self) -> None:
        count = len(self.robot.joints)
        for number, truth in self.joints.items():
            where = f"joint {number} of the twin of {self.robot.name}"
            if not 1 <= number <= count:
                raise InputError("the robot has no such joint", where=where, allowed=f"1 to {count}")
            link = self._plain[number - 1]
            aside = truth.clearance or truth.bearing or truth.bending or truth.run_out
            if aside and not (link.turns and link.generator[1, 0] == 1.0):
                raise InputError("only a joint that turns about its frame's z can tilt", where=where)

    def target_frames(self, joints: Array) -> Mapping[str, Array]:
        """Return ``T_world_target`` ``(4, 4)`` of every target for one joint position ``(joints,)``, at rest."""
        return self.postures(np.asarray(joints)[None])[0].targets

    def frames(self, joints: Array, **conditions: Unpack[Conditions]) -> Mapping[str, Array]:
        """Return ``T_world_target`` ``(n, 4, 4)`` of every target at joint positions ``(n, joints)``."""
        postures = [posture.targets for posture in self.postures(joints, **conditions)]
        return {target.name: np.array([at[target.name] for at in postures]) for target in self.robot.targets}

    def postures(self, joints: Array, **conditions: Unpack[Conditions]) -> tuple[Posture, ...]:
        """Return where the twin stands at joint positions ``(n, joints)``.

        A joint turns by gain times joint position plus what its :class:`JointTruth` adds, and leans right behind that
        turn by ``Rx Ry``. Moments are those of the arm as it has given way: deflections are found again until none
        changes by more than 1e-13 rad. A backlash may not come to rest, then the 50th round stays.

        Raises:
            InputError: If joints or conditions have another shape.
        """
        n, count = len(joints), len(self.robot.joints)
        zeros = np.zeros((n, count))
        joints = _shaped("joint positions", joints, (n, count))
        approach = _shaped("approach", conditions.get("approach", directions(joints)), (n, count))
        number = None if "number" not in conditions else _shaped("number", conditions["number"], (n,))
        cold = np.zeros(n) if number is None else self._cold_share(number)
        temperature = _shaped("temperature", conditions.get("temperature", np.full(n, REFERENCE_TEMPERATURE)), (n,))
        wrench = _shaped("wrench", conditions.get("wrench", np.zeros((n, 6))), (n, 6))
        velocity = _shaped("velocity", conditions.get("velocity", zeros), (n, count))
        acceleration = _shaped("acceleration", conditions.get("acceleration", zeros), (n, count))
        inputs = (joints, approach, temperature - REFERENCE_TEMPERATURE, cold, wrench, velocity, acceleration)
        blocks = (slice(first, first + _BLOCK) for first in range(0, n, _BLOCK))
        return tuple(posture for block in blocks for posture in self._settled(*(values[block] for values in inputs)))

    def _cold_share(self, number: Array) -> Array:
        """Return how much of the growth is still to come behind some configurations: ``exp(-rate number)``, bounded."""
        rate = self.robot.values.get("warm_up_rate", 0.0)
        return np.array([math.exp(min(-rate * before, _LARGEST_POWER)) for before in number])

    def _settled(
        self,
        joints: Array,
        approach: Array,
        warmer: Array,
        cold: Array,
        wrench: Array,
        velocity: Array,
        acceleration: Array,
    ) -> list[Posture]:
        """Return the postures of some configurations, each in the round in which it comes to rest."""
        links = self._links(warmer, cold)
        truths = [self.joints.get(number, PERFECT) for number in range(1, len(links) + 1)]
        geared = joints * [self.robot.values.get(f"gain_{number}", 1.0) for number in range(1, len(links) + 1)]

        aside = np.stack([truth.carried_aside(joints[:, j]) for j, truth in enumerate(truths)], axis=1)

        def deflections(rows: IntArray, loads: Array, fall: Array, pulls: Array) -> Array:
            deflected = np.zeros((len(rows), len(links), 3))
            for j, (truth, link) in enumerate(zip(truths, links, strict=True)):
                if truth is not PERFECT:
                    deflected[:, j, :2] = np.transpose(truth.tilt(loads[:, j, 3], loads[:, j, 4], self.contact))
                    along = loads[:, j, 5 if link.turns else 2]
                    deflected[:, j, 2] = truth.turn(joints[rows, j], approach[rows, j], along)
                    deflected[:, j] += truth.bent(fall[:, j])
                    deflected[:, j, 2] += truth.hung(pulls[:, j])
            return deflected

        left = np.arange(len(joints))
        nothing = np.zeros((len(left), len(links), 6))
        still = np.zeros((len(left), len(links), len(links), 3))
        settled, settled_postures = deflections(left, nothing, nothing[:, :, :3], still), dict[int, Posture]()
        for last in (*[False] * (_ROUNDS - 1), True):
            deflection, own = settled, tuple(link.of_rows(left) for link in links)
            given = (aside[left], wrench[left], velocity[left], acceleration[left])
            standing = self._standing(own, geared[left], deflection, *given)
            settled = deflections(left, standing.loads, standing.fall, standing.pulls)
            rests = (np.abs(settled - deflection).max(axis=(1, 2)) < _SETTLED) | last
            settled_postures |= {int(left[row]): standing.of_row(row) for row in np.flatnonzero(rests).tolist()}
            left, settled = left[~rests], settled[~rests]
            if len(left) == 0:
                break
        return [settled_postures[row] for row in range(len(joints))]

    def _standing(
        self,
        links: tuple[Link, ...],
        geared: Array,
        deflection: Array,
        aside: Array,
        wrench: Array,
        velocity: Array,
        acceleration: Array,
    ) -> Posture:
        """Return where the arm stands at `n` configurations, one row of every array for each."""
        gravity, n = np.array(self.robot.gravity), len(geared)
        T = np.zeros((3 if velocity.any() or acceleration.any() else 1, n, 4, 4))
        T[0] = np.eye(4)
        axes, frames, ways = [], [], []
        for j, link in enumerate(links):
            if aside[:, j].any():
                link = replace(link, before=link.before @ _slid(aside[:, j]))
            T = moved(T, link, geared[:, j] + deflection[:, j, 2], velocity[:, j], acceleration[:, j])
            axes.append(T[0] @ link.axes)
            if deflection[:, j, :2].any():
                T = T @ (link.axes @ tilt(deflection[:, j, 0], deflection[:, j, 1]) @ np.linalg.inv(link.axes))
            T = T @ link.after
            frames.append(T[0])
            ways.append(T)
        flange = T @ self._flange
        bodies = np.array([*(link.body for link in links), self._payload])
        weights = weight(bodies, np.stack([*ways, flange], axis=2), gravity)
        for (lower, upper), pulls in self._balanced(frames):
            if lower:
                weights[:, lower - 1] += pulls[0]
            weights[:, upper - 1] += pulls[1]
        pushed = forces_of(wrench, flange[0, :, :3, 3])
        if self.robot.wrench is not None:
            pushed = pushed + [forces_on_tool(self.robot.wrench, at, self._wrench_axes) for at in flange[0]]
        weights[:, -1] += pushed
        carried = np.cumsum(weights[:, ::-1], axis=1)[:, ::-1][:, :-1]  # by a joint: its own link and all behind it
        world, at_flange = self._base @ flange[0], np.tile(np.eye(4), (n, 1, 1))
        at_flange[:, :3, 3] = flange[0, :, :3, 3]
        own, down = np.stack(axes, axis=1)[..., :3, :3], _direction(gravity)
        return Posture(
            links=np.stack(frames, axis=1),
            targets={name: world @ place for name, place in self._targets.items()},
            loads=wrench_at(carried, np.stack(axes, axis=1)),
            deflection=deflection,
            fall=down @ own,
            pulls=np.einsum("nix,nkxa->nika", np.cross(down, own[..., 2]), own),
            wrench=wrench_at(pushed, at_flange),
        )

    def _balanced(self, frames: Sequence[Array]) -> Iterator[tuple[tuple[int, int], tuple[Array, Array]]]:
        """Give the links of each balancer, and what it does to both as sums of ``p f^T`` ``(n, 4, 4)``."""
        every = [np.broadcast_to(np.eye(4), frames[0].shape), *frames]
        for number, balancer in enumerate(self.robot.balancers, 1):
            ends = (balancer.fixed, balancer.moving)
            first, other = ((every[end.link] @ [*self._stayed(end.link, end.point), 1.0])[:, :3] for end in ends)
            length = np.linalg.norm(first - other, axis=1)[:, None]
            pull = balancer.force + balancer.stiffness * (length - balancer.length)
            pull = pull * self.robot.values.get(f"balancer_{number}", 1.0)
            towards = np.concatenate([pull / length * (first - other), np.zeros(first.shape)], axis=1)
            yield (ends[0].link, ends[1].link), (forces_of(-towards, first), forces_of(towards, other))

    def _links(self, warmer: Array, cold: Array) -> tuple[Link, ...]:
        """Return the links of an arm some kelvin warmer than the reference, a share of whose warming up is to come."""
        links = list(self._plain)
        for number, truth in self.joints.items():
            growths, indices = np.unique(truth.growth * warmer - truth.warm_up * cold, return_inverse=True)
            if growths.any():
                links[number - 1] = stacked([self._link(number, growth) for growth in growths.tolist()], indices)
        return tuple(links)

    def _link(self, number: int, growth: float) -> Link:
        bearing, masses = self._places[number - 1]
        return Link.made_of(self.robot.link_elements[number - 1], self.robot.values, growth, masses, bearing)

    @cached_property
    def _places(self) -> tuple[tuple[float, tuple[LinkMass, ...]], ...]:
        """How far along its axis each joint's bearing lies, and the masses of its link with nominal slides."""
        links, places = self.robot.link_elements, []
        every = [element for link in links for element in link]
        for number, link in enumerate(links, 1):
            own = next(i for i, element in enumerate(link) if element.variable is not None)
            joint, bearing = link[own], 0.0
            if joint.turns:
                along = np.array(joint.axis) if joint.axis else np.eye(3)["xyz".index(joint.motion[1])]
                passed = carried(every, sum(map(len, links[: number - 1])) + own, along, self.robot.values)
                bearing = (self.robot.joints[number - 1].bearing or 0.0) - passed
            masses = (replace(m, cog=self._stayed(number, m.cog)) for m in self.robot.masses if m.joint == number)
            places.append((bearing, tuple(masses)))
        return tuple(places)

    def _stayed(self, number: int, point: tuple[float, float, float]) -> tuple[float, float, float]:
        """Return a point of a link given with nominal slides, in the link's frame."""
        links = self.robot.link_elements
        every, end = [element for link in links for element in link], sum(len(link) for link in links[:number])
        place = np.array(point)
        for along in directions_at(every, end):
            place = place - carried(every, end, along, self.robot.values) * along
        x, y, z = (float(v) for v in place)
        return x, y, z

    @cached_property
    def _plain(self) -> tuple[Link, ...]:
        return tuple(self._link(number, 0.0) for number in range(1, len(self.robot.joints) + 1))

    @cached_property
    def _base(self) -> Array:
        return product(self.robot.base_elements, self.robot.values)

    @cached_property
    def _flange(self) -> Array:
        return product(self.robot.flange_elements, self.robot.values)

    @cached_property
    def _wrench_axes(self) -> Array:
        """Axes in the base that a wrench is given in that does not turn with the tool, ``(3, 3)``."""
        if self.robot.wrench is not None and self.robot.wrench.frame == "world":
            return np.asarray(self._base[:3, :3].T)
        controller = self.robot.wrench is not None and self.robot.wrench.frame == "controller"
        return self.robot.controller.base.matrix[:3, :3] if controller else np.eye(3)

    @cached_property
    def _payload(self) -> Array:
        return second_moments(self.robot.payload.mass, self.robot.payload.cog)

    @cached_property
    def _targets(self) -> Mapping[str, Array]:
        return {t.name: product(t.chain.elements, self.robot.values) for t in self.robot.targets}


def directions(joints: Array) -> Array:
    """Return the direction of the last move of each joint, +1 or -1, by the order of its positions ``(n, joints)``.

    It is 0 as long as the joint has not moved.
    """
    moves = np.zeros(np.shape(joints))
    for row in range(1, len(moves)):
        moves[row] = np.sign(joints[row] - joints[row - 1])
        moves[row] = np.where(moves[row] == 0.0, moves[row - 1], moves[row])
    return moves


def measure(
    twin: Twin,
    joints: Array,
    noise: float,
    rng: np.random.Generator,
    source: str = "twin",
    **conditions: Unpack[Conditions],
) -> Dataset:
    """Return what an instrument reads of the twin at joint positions ``(n, joints)``.

    Parameters
    ----------
    noise
        Standard deviation of each coordinate [m]; declared in the data unless it is zero.
    conditions
        See :class:`Conditions`. Where the number is left out, the configurations are measured in their order.
    """
    robot = twin.robot
    conditions.setdefault("number", np.arange(float(len(joints))))
    names = tuple(target.name for target in robot.targets)
    frames = twin.frames(joints, **conditions)
    position = np.stack([frames[name][:, :3, 3] for name in names], axis=1).reshape(-1, 3)
    position = position + rng.normal(0.0, 1.0, position.shape) * noise
    n = len(joints)
    return Dataset(
        source=source,
        labels=tuple(str(i + 1) for i in range(n)),
        joints=np.asarray(joints, float),
        joint_kinds=tuple(joint.kind for joint in robot.joints),
        targets=names,
        configuration=np.repeat(np.arange(n), len(names)),
        target=np.tile(np.arange(len(names)), n),
        position=position,
        sigma=np.full(n * len(names), noise) if noise > 0 else None,
        approach=conditions.get("approach", directions(joints)),
        number=conditions["number"],
        temperature=conditions.get("temperature"),
        wrench=conditions.get("wrench"),
        simulated=True,
    )


def with_wrench_read(twin: Twin, data: Dataset) -> Dataset:
    """Return readings of a twin with what acted on its flange at each configuration, as a force sensor there says."""
    columns = {"approach": data.approach, "number": data.number, "temperature": data.temperature}
    conditions: Conditions = {name: values for name, values in columns.items() if values is not None}  # type: ignore[assignment]
    return replace(data, wrench=np.array([at.wrench for at in twin.postures(data.joints, **conditions)]))


def _shaped(name: str, values: Array, shape: tuple[int, ...]) -> Array:
    if np.shape(values) != shape:
        raise InputError(
            f"wrong number of values: {name}", came=f"an array of shape {np.shape(values)}", allowed=str(shape)
        )
    return np.asarray(values, float)
