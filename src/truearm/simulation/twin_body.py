"""Where the parts of the digital twin are and what each joint carries, by 4x4 matrices alone.

A frame is a matrix T, and its motion is T with its first and second derivatives by time: the product rule along the
chain gives velocity and acceleration of every point of a link without a recursion over angular velocities. A body is
the matrix of its second moments ``J = sum of m x x^T`` over its points x = (x, y, z, 1), so that with gravity G in
the last column the sum of ``p f^T`` over its points p and the forces f on them is ``T J (G - T'')^T``: its last row
is the force, its antisymmetric part the moment (Uicker 1965, "On the dynamic analysis of spatial linkages using 4x4
matrices", the same in Paul 1981, "Robot Manipulators", chapter 6).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from truearm.measurement.dataset import IntArray
from truearm.modeling.chain import Array, Element
from truearm.modeling.parts import LinkMass
from truearm.modeling.wrench import Wrench

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


def stacked(links: Sequence[Link], which: IntArray) -> Link:
    """Return one link that is at each configuration the one of those links that `which` names."""
    before, after = (np.array([getattr(link, side) for link in links])[which] for side in ("before", "after"))
    return replace(links[0], before=before, after=after, zero=np.array([link.zero for link in links])[which])


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
