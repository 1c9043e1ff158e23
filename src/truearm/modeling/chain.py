"""The chain of elementary transforms that every kinematic convention is a special case of.

A chain is a product of rotations and translations along fixed axes. Every element has a value; some add a
joint variable to it, and some values are named parameters that identification may change. Forward kinematics
runs over the elements once, on all configurations together; the derivative with respect to a value falls out of
the same sweep, because turning about an axis moves the tip by ``axis x (tip - origin)`` and sliding along it
moves the tip by ``axis`` (Whitney 1972, "The mathematics of coordinated control of prosthetic arms").

Arrays are kept configuration-last: a column of the rotation matrix is ``(3, n)``, so that a rotation touches two
columns with two multiply-adds and no matrix product. A leading trial axis of the values, ``(trials, 1)`` against
``(n,)`` configurations, broadcasts through: columns are then ``(3, trials, n)``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Motion = Literal["Rx", "Ry", "Rz", "Tx", "Ty", "Tz", "R", "T"]

_AXIS: Final = {"x": 0, "y": 1, "z": 2}
_IDENTITY: Final = tuple(np.eye(3)[:, [k]] for k in range(3))


@dataclass(frozen=True, slots=True)
class Element:
    """One elementary transform.

    Parameters
    ----------
    motion
        ``Rx``, ``Ry``, ``Rz`` turn about and ``Tx``, ``Ty``, ``Tz`` slide along an axis of the moving frame;
        ``R`` and ``T`` do so along `axis`.
    value
        Nominal value [rad or m].
    parameter
        Name of the parameter that replaces `value`, if it has one.
    variable
        Index of the joint variable that is added to the value, if there is one.
    axis
        Unit vector in the moving frame, for ``R`` and ``T``.
    """

    motion: Motion
    value: float = 0.0
    parameter: str | None = None
    variable: int | None = None
    axis: tuple[float, float, float] | None = None

    @property
    def turns(self) -> bool:
        """Whether the element is a rotation."""
        return self.motion[0] == "R"


@dataclass(frozen=True, eq=False)
class Sweep:
    """A chain run through for all configurations, with what its derivatives need.

    Attributes
    ----------
    rotation
        The three columns of the tip frame in the world, each ``(3, ..., n)``.
    position
        Origin of the tip frame [m], ``(3, ..., n)``.
    elements
        The elements passed, in order.
    axes, origins
        World axis and world origin of each element as the sweep passed it, each ``(3, ..., 1 or n)``.
    """

    rotation: tuple[Array, Array, Array]
    position: Array
    elements: tuple[Element, ...] = ()
    axes: tuple[Array, ...] = ()
    origins: tuple[Array, ...] = ()

    def matrix(self) -> Array:
        """Return the rotation of the tip frame, ``(..., n, 3, 3)``."""
        columns = np.stack(np.broadcast_arrays(*self.rotation))  # (column, row, ..., n)
        return np.moveaxis(columns, (1, 0), (-2, -1))

    def derivatives(self, indices: Sequence[int]) -> tuple[Array, Array]:
        """Return the derivative of the tip with respect to the values of the elements `indices`.

        Returns
        -------
        linear, angular
            Velocity of the tip's origin [m per unit] and angular velocity of the tip frame [rad per unit] in
            the world, each ``(len(indices), 3, ..., n)``.
        """
        shape = (len(indices), *self.position.shape)
        linear, angular = np.zeros(shape), np.zeros(shape)
        for row, index in enumerate(indices):
            axis = self.axes[index]
            if self.elements[index].turns:
                arm = self.position - self.origins[index]
                linear[row, 0] = axis[1] * arm[2] - axis[2] * arm[1]
                linear[row, 1] = axis[2] * arm[0] - axis[0] * arm[2]
                linear[row, 2] = axis[0] * arm[1] - axis[1] * arm[0]
                angular[row] = axis
            else:
                linear[row] = axis
        return linear, angular


_START: Final = Sweep(_IDENTITY, np.zeros((3, 1)))  # type: ignore[arg-type]


@dataclass(frozen=True)
class Chain:
    """A product of elementary transforms.

    Parameters
    ----------
    elements
        The transforms from base to tip. A parameter name may occur once.
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

    def sweep(
        self,
        variables: Array,
        values: Mapping[str, float | Array] | None = None,
        start: Sweep = _START,
    ) -> Sweep:
        """Run through the chain for all configurations.

        Parameters
        ----------
        variables
            Joint variables [rad or m], ``(variables, n)``, or ``(variables, trials, n)`` with trial values.
        values
            Parameter values that replace nominal ones, each a number or ``(trials, 1)`` [rad or m].
        start
            A sweep to go on from, with the same `variables`.
        """
        given = values or {}
        columns, position = list(start.rotation), start.position
        if position.ndim == 2 and any(isinstance(value, np.ndarray) for value in given.values()):
            columns, position = [column[:, None, :] for column in columns], position[:, None, :]
        axes, origins = list(start.axes), list(start.origins)
        for element in self.elements:
            amount: float | Array = element.value
            if element.parameter is not None:
                amount = given.get(element.parameter, amount)
            if element.variable is not None:
                amount = amount + variables[element.variable]
            if element.axis is None:
                k = _AXIS[element.motion[1]]
                axis = columns[k]
            else:
                k = -1
                x, y, z = element.axis
                axis = x * columns[0] + y * columns[1] + z * columns[2]
            axes.append(axis)
            origins.append(position)
            if not element.turns:
                position = position + amount * axis
                continue
            c, s = np.cos(amount), np.sin(amount)
            if k >= 0:
                i, j = (k + 1) % 3, (k + 2) % 3
                columns[i], columns[j] = c * columns[i] + s * columns[j], c * columns[j] - s * columns[i]
            else:
                columns = [
                    c * column + s * cross(axis, column) + ((1 - c) * a) * axis
                    for a, column in zip(element.axis, columns, strict=True)  # type: ignore[arg-type]
                ]
        shape = np.broadcast_shapes(position.shape, variables.shape[1:], *(c.shape for c in columns))
        return Sweep(
            rotation=tuple(np.broadcast_to(column, shape) for column in columns),  # type: ignore[arg-type]
            position=np.broadcast_to(position, shape),
            elements=(*start.elements, *self.elements),
            axes=tuple(axes),
            origins=tuple(origins),
        )


def dot(a: Array, b: Array) -> Array:
    """Return the dot product of vectors ``(3, ...)`` along the first axis."""
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def cross(a: Array, b: Array) -> Array:
    """Return the cross product of vectors ``(3, ...)`` along the first axis."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
