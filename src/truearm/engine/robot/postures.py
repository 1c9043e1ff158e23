"""Postures: joint positions, and what else the shape of an arm depends on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.robot.chain import Array

#: A joint that moved by no more did not move: joints computed from those that a controller shows are rounded [rad, m].
_ROUNDING: Final = 1e-10


@dataclass(frozen=True, eq=False)
class Postures:
    """Joint positions under known circumstances."""

    joints: Array  #: Joint positions [rad; m for sliding joints], ``(n, joints)``.
    #: velocity, acceleration: of the joints [rad/s, m/s and so on], ``(n, joints)``; at rest if None.
    velocity: Array | None = None
    acceleration: Array | None = None
    #: Sign of the last move of each joint, ``(n, joints)``: 1, -1, or 0 where it is not known; None if it is known
    #: nowhere.
    approach: Array | None = None
    number: Array | None = None  #: How many configurations were measured before each, ``(n,)``.
    temperature: Array | None = None  #: Of the arm [degC], ``(n,)``.
    #: External force [N] and moment [N m] on the flange, about its origin, in the axes of the base, ``(n, 6)``.
    wrench: Array | None = None
    #: Force and moment of everything beyond each joint, in the joint's own axes, ``(joints, 6, n)``, as
    #: :meth:`truearm.engine.robot.robot.Robot.loaded` finds them.
    loads: Array | None = None
    #: Direction in which gravity falls, in the axes of the loads, zero without gravity: a row a joint; then a row for
    #: each of :func:`pairs`, what first moments of the second's link turn the first with, in the axes of the second.
    #: ``(joints + pairs, 3, n)``, found with the loads where an effect depends on it.
    fall: Array | None = None
    #: What of the loads each balancer contributes at the factor 1, ``(balancers, joints, 6, n)``, and the factors that
    #: the loads are of; None where no factor is a parameter.
    relief: tuple[Array, tuple[float, ...]] | None = None

    @classmethod
    def of(cls, q: Array | Postures) -> Postures:
        """Return plain joint positions ``(n, joints)`` as postures at rest."""
        return q if isinstance(q, Postures) else cls(np.asarray(q, float))

    def circumstances(self) -> tuple[bytes | None, ...]:
        """Return all that loads are found from, to compare: equal where the loads of a robot are the same."""
        whole = (self.joints, self.velocity, self.acceleration, self.approach, self.number, self.temperature)
        return tuple(None if part is None else part.tobytes() for part in (*whole, self.wrench))

    @property
    def joint_loads(self) -> Array:
        """The loads, of postures that have them."""
        if self.loads is None:
            raise ValueError("the postures have no loads; ask Robot.loaded for them")
        return self.loads

    @property
    def free_fall(self) -> Array:
        """The directions in which gravity falls, of postures that have them."""
        if self.fall is None:
            raise ValueError("the postures have no direction of gravity; ask Robot.loaded for them")
        return self.fall

    def relieved(self, values: Mapping[str, float | Array]) -> Postures:
        """Return them with the loads of other factors of the balancers; values may be ``(trials, 1)``.

        The arm stands as it stood: loads are linear in the factors.
        """
        if self.relief is None:
            return self
        loads = self.joint_loads
        for number, (unit, factor) in enumerate(zip(*self.relief, strict=True), 1):
            more = np.asarray(values[f"balancer_{number}"]) - factor
            if more.ndim and loads.ndim == 3:
                loads = loads[:, :, None, :]
            if more.any():
                loads = loads + more * (unit[:, :, None, :] if more.ndim else unit)
        return replace(self, loads=loads, relief=None)

    def __len__(self) -> int:
        return len(self.joints)

    def at(self, indices: NDArray[np.intp]) -> Postures:
        """Return some of them, without their loads."""

        def part(values: Array | None) -> Array | None:
            return None if values is None else values[indices]

        return replace(
            self,
            joints=self.joints[indices],
            velocity=part(self.velocity),
            acceleration=part(self.acceleration),
            approach=part(self.approach),
            number=part(self.number),
            temperature=part(self.temperature),
            wrench=part(self.wrench),
            loads=None,
            fall=None,
            relief=None,
        )

    def between(self, first: int, end: int) -> Postures:
        """Return those from one to before another, with their loads."""
        relief = None if self.relief is None else (self.relief[0][..., first:end], self.relief[1])
        loads = None if self.loads is None else self.loads[..., first:end]
        fall = None if self.fall is None else self.fall[..., first:end]
        return replace(self.at(np.arange(first, end)), loads=loads, fall=fall, relief=relief)


def pairs(count: int) -> list[tuple[int, int]]:
    """Return the pairs of `count` joints (from 0) of which the second is behind the first."""
    return [(i, k) for i in range(count) for k in range(i + 1, count)]


def approach_of(joints: Array, order: NDArray[np.int64]) -> Array:
    """Return the sign of the last move of each joint, ``(n, joints)``.

    Args:
        joints: Joint positions ``(n, joints)``.
        order: Number of each row in the sequence of measurement, ``(n,)``. A row whose predecessor is not there came
            from nowhere known: its signs are 0. A joint that did not move keeps the sign of its move before.
    """
    signs = np.zeros_like(joints)
    rows = np.argsort(order, kind="stable")
    for before, row in pairwise(rows):
        if order[row] == order[before] + 1:
            way = joints[row] - joints[before]
            moved = np.where(np.abs(way) <= _ROUNDING, 0.0, np.sign(way))
            signs[row] = np.where(moved == 0.0, signs[before], moved)
    return signs


def approach_from(stops: Array, joints: Array) -> Array:
    """Return the sign of the last move of each joint where an arm stops elsewhere right before, ``(n, joints)``.

    Args:
        stops, joints: Where it stops right before each configuration, and the configurations, in the order in which it
            comes to them, ``(n, joints)`` each. A joint that stands there already keeps the sign of its move to that
            stop.
    """
    way = np.stack([stops, joints], axis=1).reshape(-1, joints.shape[1])
    return approach_of(way, np.arange(len(way)))[1::2]
