"""The chain of elementary transforms that every kinematic convention is a special case of.

A chain is a product of rotations and translations along fixed axes. Every element has a value; some add a
joint variable to it, and some values are named parameters that identification may change. Forward kinematics goes over
the elements twice, all configurations together. Backward, from the tip to the world, it carries one point: where the
tip is, seen from each element. Forward, from the world to the tip, it carries the axes of each element's frame.
That is also all a derivative needs, because turning about an axis moves the tip by ``axis x (tip - origin)`` and
sliding along it moves the tip by ``axis`` (Whitney 1972, "The mathematics of coordinated control of prosthetic
arms"): with the tip at (x, y, z) in the element's own frame, turning about its z moves it by ``x Y - y X``.

Each pass runs when it is first asked for, so positions alone cost the backward pass, which touches numbers where
the forward pass touches vectors. Chains that share a trunk share its forward pass. Points that are fixed behind the
last element, such as the targets on a tool, are carried through both passes together.

Arrays are kept configuration-last: an axis of a frame is ``(3, n)``, so that a rotation touches two axes with a
few multiply-adds and no matrix product. What no joint has moved yet, from either end, stays a plain number or a
``(3, 1)`` array. A leading trial axis of the values, ``(trials, 1)`` against ``(n,)`` configurations, broadcasts
through: axes are then ``(3, trials, n)``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Motion = Literal["Rx", "Ry", "Rz", "Tx", "Ty", "Tz", "R", "T"]

#: The same at all configurations, or one each.
Number = float | Array
#: A parameter, a factor and the parameter's nominal value: factor times what its value differs from the nominal one.
Offset = tuple[str, float, float]
#: Of a point in a frame, or of the frame itself in the world.
Coordinates = tuple[Number, Number, Number]
Axes = tuple[Array, Array, Array]
Direction = tuple[float, float, float]
N = TypeVar("N", float, Array, Number)
#: What an element does: () if nothing, a slide's distance [m], a turn's cosine and sine, or, about an axis of any
#: direction, the nine entries of its rotation matrix row by row.
Move = tuple[Number, ...]

_AXIS: Final = {"x": 0, "y": 1, "z": 2}


@dataclass(frozen=True, slots=True)
class Element:
    """One elementary transform.

    Args:
        motion: ``Rx``, ``Ry``, ``Rz`` turn about and ``Tx``, ``Ty``, ``Tz`` slide along an axis of the moving frame;
            ``R`` and ``T`` do so along `axis`.
        value: Nominal value [rad or m].
        parameter: Name of the parameter that replaces `value`, if it has one.
        variable: Index of the joint variable that is added to the value, if there is one.
        axis: Unit vector in the moving frame, for ``R`` and ``T``.
        offsets: What parameters of other elements add to the value.
    """

    motion: Motion
    value: float = 0.0
    parameter: str | None = None
    variable: int | None = None
    axis: Direction | None = None
    offsets: tuple[Offset, ...] = ()
    turns: bool = field(init=False, repr=False, compare=False)  #: Whether the element is a rotation.
    #: Which axis of the moving frame it moves about or along, 0 to 2, unless it has an `axis` of its own.
    along: int = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "turns", self.motion[0] == "R")
        object.__setattr__(self, "along", _AXIS.get(self.motion[1:], -1))


@dataclass(frozen=True, eq=False)
class ForwardKinematics:
    """A chain run through for all configurations."""

    elements: tuple[Element, ...]  #: The elements passed, in order.
    moves: tuple[Move, ...]  #: What each of them does.
    shape: tuple[int, ...]  #: ``(n,)``, or ``(trials, n)`` with trial values; of several points, ``(points, ..., n)``.
    #: The forward kinematics that this goes on from, whose elements are its first.
    start: ForwardKinematics | None = None
    #: Where the tip is, seen from the frame behind the last element; of several points, each coordinate has them as its
    #: first axis.
    tip: Coordinates = (0.0, 0.0, 0.0)

    @cached_property
    def position(self) -> Array:
        """Origin of the tip frame in the world [m], ``(3, ..., n)``."""
        return self._filled(self._tips[0])

    @cached_property
    def rotation(self) -> Axes:
        """Axes of the tip frame in the world, each ``(3, ..., n)``."""
        x, y, z = (self._filled(axis) for axis in self._frames[-1])
        return x, y, z

    def matrix(self, index: int = -1) -> Array:
        """Return the rotation of the tip frame, or of the frame before element `index`, ``(..., n, 3, 3)``."""
        axes = np.empty((3, 3, *self.shape))  # (axis, row, ..., n)
        for k, axis in enumerate(self._frames[index]):
            axes[k] = axis
        return np.moveaxis(axes, (1, 0), (-2, -1))

    @cached_property
    def places(self) -> Mapping[str, int]:
        """Index of the element whose value is each parameter."""
        return {e.parameter: i for i, e in enumerate(self.elements) if e.parameter is not None}

    def axis(self, index: int) -> Array:
        """Return the axis that element `index` moves about or along, in the world, ``(3, ..., n)``."""
        return self._filled(_axis(self.elements[index], self._frames[index]))

    def origin(self, index: int) -> Array:
        """Return the origin of the frame that element `index` moves, in the world [m], ``(3, ..., n)``."""
        arm = _combined(self._tip(index), self._frames[index])
        return self.position - self._filled(arm)

    def position_jacobian(self, indices: Sequence[int | None]) -> Array:
        """Return the velocity of the tip's origin by the values of the elements `indices` [m per unit].

        Returns:
            linear: In the world, ``(len(indices), 3, ..., n)``; zero where an index is None.
        """
        linear = np.empty((len(indices), 3, *self.shape))
        other = np.empty((3, *self.shape))
        for row, index in zip(linear, indices, strict=True):
            if index is None:
                row[...] = 0.0
                continue
            element, axes = self.elements[index], self._frames[index]
            if not element.turns:
                row[...] = _axis(element, axes)
            elif element.axis is not None:
                row[...] = _combined(cross(element.axis, self._tip(index)), axes)
            else:
                i, j = _TURNED[element.along]
                tip = self._tip(index)
                np.multiply(axes[j], tip[i], out=row)
                np.multiply(axes[i], tip[j], out=other)
                np.subtract(row, other, out=row)
        return linear

    def orientation_jacobian(self, indices: Sequence[int | None]) -> Array:
        """Return the angular velocity of the tip frame by the values of the elements `indices` [rad per unit].

        Returns:
            angular: In the world, ``(len(indices), 3, ..., n)``; zero where an index is None.
        """
        angular = np.zeros((len(indices), 3, *self.shape))
        for row, index in zip(angular, indices, strict=True):
            if index is not None and self.elements[index].turns:
                row[...] = _axis(self.elements[index], self._frames[index])
        return angular

    def jacobians(self, indices: Sequence[int | None]) -> tuple[Array, Array]:
        """Return :meth:`position_jacobian` and :meth:`orientation_jacobian`."""
        return self.position_jacobian(indices), self.orientation_jacobian(indices)

    @cached_property
    def _frames(self) -> list[Axes]:
        """Axes, in the world, of the frame before each element and of the tip frame, each ``(3, ..., 1 or n)``."""
        if self.start is None:
            x, y, z = np.eye(3).reshape(3, 3, *(1 for _ in self.shape))
            frames: list[Axes] = [(x, y, z)]
        elif len(self.start.shape) < len(self.shape):  # of several points, which see the same axes
            frames = [(x[:, None], y[:, None], z[:, None]) for x, y, z in self.start._frames]
        else:
            frames = self.start._frames.copy()
        passed = len(frames) - 1
        axes = frames[-1]
        for element, move in zip(self.elements[passed:], self.moves[passed:], strict=True):
            if element.turns and move:
                axes = _turned(axes, element, move)
            frames.append(axes)
        return frames

    @cached_property
    def _passed(self) -> int:
        """How many of the elements are those of the start."""
        return 0 if self.start is None else len(self.start.elements)

    @cached_property
    def _own_tips(self) -> list[Coordinates]:
        """The tip seen from the frame before each element behind the start, and from the frame behind the last."""
        return _seen_before(self.tip, self.elements[self._passed :], self.moves[self._passed :])

    @cached_property
    def _tips(self) -> list[Coordinates]:
        """The tip seen from the frame before each element, and from the frame behind the last."""
        own = self._own_tips
        return _seen_before(own[0], self.elements[: self._passed], self.moves[: self._passed])[:-1] + own

    def _tip(self, index: int) -> Coordinates:
        """Return the tip seen from the frame before an element; behind the start that costs no pass through it."""
        own = index - self._passed if index >= 0 else index
        return self._own_tips[own] if index < 0 or own >= 0 else self._tips[index]

    def _filled(self, vector: Coordinates | Array) -> Array:
        full = np.empty((3, *self.shape))
        for row, part in zip(full, vector, strict=True):
            row[...] = part
        return full


@dataclass(frozen=True)
class Chain:
    """A product of elementary transforms.

    Args:
        elements: The transforms from base to tip. A parameter name may occur once.
    """

    elements: tuple[Element, ...]
    _index: Mapping[str, int] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        index: dict[str, int] = {}
        for position, element in enumerate(self.elements):
            if element.parameter is not None:
                if element.parameter in index:
                    raise ValueError(f"parameter {element.parameter!r} occurs twice in the chain")
                index[element.parameter] = position
        object.__setattr__(self, "_index", index)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters, from base to tip."""
        return tuple(self._index)

    def index(self, parameter: str) -> int:
        """Return the position of the element whose value is `parameter`."""
        return self._index[parameter]

    def forward_kinematics(
        self,
        variables: Array,
        values: Mapping[str, float | Array] | None = None,
        start: ForwardKinematics | None = None,
    ) -> ForwardKinematics:
        """Run through the chain for all configurations.

        Args:
            variables: Joint variables [rad or m], ``(variables, n)``, or ``(variables, trials, n)`` with trial values.
            values: Parameter values that replace nominal ones, each a number or ``(trials, 1)`` [rad or m].
            start: Forward kinematics to go on from, with the same `variables` and `values`.
        """
        assigned = values or {}
        moves: list[Move] = []
        for element in self.elements:
            amount: Number = element.value
            if element.parameter is not None:
                amount = assigned.get(element.parameter, amount)
            if element.variable is not None:
                amount = amount + variables[element.variable]
            for name, factor, nominal in element.offsets:
                amount = amount + factor * (assigned.get(name, nominal) - nominal)
            moves.append(_move(element, amount))
        if start is not None:
            return ForwardKinematics((*start.elements, *self.elements), (*start.moves, *moves), start.shape, start)
        shape = variables.shape[1:]
        trials = next((value.shape for value in assigned.values() if isinstance(value, np.ndarray)), ())
        return ForwardKinematics(self.elements, tuple(moves), np.broadcast_shapes(shape, trials) if trials else shape)


def together(ends: Sequence[ForwardKinematics]) -> ForwardKinematics:
    """Run through the start of several chains once for all their tips.

    Args:
        ends: Chains that go on from one start. Their positions are known afterwards.

    Returns:
        The elements of the start, of shape ``(ends, ..., n)``.
    """
    start = ends[0].start
    if start is None or any(end.start is not start for end in ends):
        raise ValueError("the chains do not go on from one start")
    x, y, z = (_beside(parts, len(start.shape)) for parts in zip(*(end._own_tips[0] for end in ends), strict=True))
    whole = ForwardKinematics(start.elements, start.moves, (len(ends), *start.shape), start, (x, y, z))
    for k, end in enumerate(ends):
        end.__dict__["position"] = whole.position[:, k]
    return whole


def _beside(parts: Sequence[Number], axes: int) -> Array:
    """Return coordinates of several points, each a number or an array of so many axes, with the points in front."""
    if all(isinstance(part, float) for part in parts):
        return np.array(parts).reshape(-1, *(1,) * axes)
    shape = np.broadcast_shapes((1,) * axes, *(np.shape(part) for part in parts))
    return np.stack([np.broadcast_to(part, shape) for part in parts])


# -- one element -----------------------------------------------------------------------------------------

#: The two axes that a turn about axis k turns, the first towards the second.
_TURNED: Final = ((1, 2), (2, 0), (0, 1))
_TURNS: Final[tuple[Motion, Motion, Motion]] = ("Rx", "Ry", "Rz")
_SLIDES: Final[tuple[Motion, Motion, Motion]] = ("Tx", "Ty", "Tz")
_UNITS: Final[tuple[Direction, Direction, Direction]] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def _move(element: Element, amount: Number) -> Move:
    """Prepare what both passes need of an element whose value, with its variable, is `amount` [rad or m]."""
    c: Number
    s: Number
    if isinstance(amount, np.ndarray):
        if not element.turns:
            return (amount,)
        half = np.tan(0.5 * amount)  # one function instead of two, and NumPy's tan is vectorised where its sin is not
        share = 2.0 / (1.0 + half * half)
        c, s = share - 1.0, half * share
    elif amount == 0.0:
        return ()
    elif not element.turns:
        return (amount,)
    else:
        c, s = math.cos(amount), math.sin(amount)
    if element.axis is None:
        return c, s
    x, y, z = element.axis  # Rodrigues: c I + s [axis]x + (1 - c) axis axis^T
    v = 1.0 - c
    return (
        *(c + v * (x * x), v * (x * y) - s * z, v * (x * z) + s * y),
        *(v * (y * x) + s * z, c + v * (y * y), v * (y * z) - s * x),
        *(v * (z * x) - s * y, v * (z * y) + s * x, c + v * (z * z)),
    )


def _turned(axes: Axes, element: Element, move: Move) -> Axes:
    """Return the axes of the frame behind a turn, from those before it."""
    if element.axis is not None:
        x, y, z = (_combined(move[k::3], axes) for k in range(3))
        return x, y, z
    i, j = _TURNED[element.along]
    c, s = move
    turned = list(axes)
    turned[i] = c * axes[i] + s * axes[j]
    turned[j] = c * axes[j] - s * axes[i]
    return turned[0], turned[1], turned[2]


def in_frame_before(point: Coordinates, element: Element, move: Move) -> Coordinates:
    """Return a point seen from the frame before an element, from how it is seen from the frame behind."""
    if element.axis is not None:
        if element.turns:
            return _combined(move[:3], point), _combined(move[3:6], point), _combined(move[6:], point)
        x, y, z = (p + move[0] * a for p, a in zip(point, element.axis, strict=True))
        return x, y, z
    seen = list(point)
    if element.turns:
        i, j = _TURNED[element.along]
        c, s = move
        seen[i] = c * point[i] - s * point[j]
        seen[j] = s * point[i] + c * point[j]
    else:
        seen[element.along] = point[element.along] + move[0]
    return seen[0], seen[1], seen[2]


def in_frame_behind(vector: Coordinates, element: Element, move: Move) -> Coordinates:
    """Return a vector seen from the frame behind a turn, from how it is seen from the frame before."""
    if element.axis is not None:
        return _combined(move[0::3], vector), _combined(move[1::3], vector), _combined(move[2::3], vector)
    seen = list(vector)
    i, j = _TURNED[element.along]
    c, s = move
    seen[i] = c * vector[i] + s * vector[j]
    seen[j] = c * vector[j] - s * vector[i]
    return seen[0], seen[1], seen[2]


def _seen_before(tip: Coordinates, elements: Sequence[Element], moves: Sequence[Move]) -> list[Coordinates]:
    """Return a tip seen from the frame before each of some elements, and, as given, from the frame behind them."""
    tips = [tip]
    for element, move in zip(reversed(elements), reversed(moves), strict=True):
        if move:
            tip = in_frame_before(tip, element, move)
        tips.append(tip)
    tips.reverse()
    return tips


def axis_of(element: Element) -> Direction:
    """Return the unit vector an element moves about or along, in its moving frame."""
    return _UNITS[element.along] if element.axis is None else element.axis


def across(element: Element) -> tuple[Direction, Direction]:
    """Return two unit vectors across an element's axis, in its moving frame: x and y of the joint's own axes.

    With the axis as z they are right-handed. For an axis of any direction they are those of the smallest turn from
    z to the axis (Duff et al. 2017, "Building an orthonormal basis, revisited", equation 5), so that they are x and
    y for z itself; close to -z those of the smallest turn from -z to the axis, with y reversed.
    """
    if element.axis is None:
        i, j = _TURNED[element.along]
        return _UNITS[i], _UNITS[j]
    x, y, z = element.axis
    s = 1.0 if z > -0.9 else -1.0
    a = -1.0 / (s + z)
    return (1.0 + s * a * x * x, s * a * x * y, -s * x), (a * x * y, s + a * y * y, -y)


def turn_about(axis: Direction, variable: int) -> Element:
    """Return the element that turns by a variable alone about a unit vector in the moving frame."""
    if axis in _UNITS:
        return Element(_TURNS[_UNITS.index(axis)], variable=variable)
    return Element("R", axis=axis, variable=variable)


def slide_along(axis: Direction, variable: int) -> Element:
    """Return the element that slides by a variable alone along a unit vector in the moving frame."""
    if axis in _UNITS:
        return Element(_SLIDES[_UNITS.index(axis)], variable=variable)
    return Element("T", axis=axis, variable=variable)


def _axis(element: Element, axes: Axes) -> Array:
    """Return the axis of an element in the world, from the axes of the frame before it."""
    return axes[element.along] if element.axis is None else _combined(element.axis, axes)


def _combined(weights: Sequence[Number], parts: Sequence[N]) -> N:
    return weights[0] * parts[0] + weights[1] * parts[1] + weights[2] * parts[2]  # type: ignore[return-value]


def cross(a: Coordinates, b: Coordinates) -> Coordinates:
    """Return the cross product of two vectors."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
