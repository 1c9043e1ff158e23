"""Inclinometers on the links: what they read, postures in pairs, and by how much readings change between them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError
from truearm.engine.base.units import Marked
from truearm.engine.robot.chain import Array
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot


@dataclass(frozen=True, eq=False)
class Pairs:
    """Postures in pairs, whose readings are compared."""

    first: Postures  #: first, second: ``n`` postures each, with their wrenches.
    second: Postures

    def __len__(self) -> int:
        return len(self.first)

    def at(self, indices: NDArray[np.intp]) -> Pairs:
        """Return some of them."""
        return Pairs(self.first.at(indices), self.second.at(indices))

    @property
    def in_turn(self) -> Postures:
        """All postures, first and second of each pair in turn, as they are measured."""
        joints, wrench = self.joints_in_turn()
        return Postures(joints, wrench=wrench)

    def joints_in_turn(self) -> tuple[Array, Array]:
        """Return readings ``(2n, joints)`` and wrenches ``(2n, 6)``."""
        wrenches = [np.zeros((len(p), 6)) if p.wrench is None else p.wrench for p in (self.first, self.second)]
        joints = np.stack([self.first.joints, self.second.joints], axis=1)
        return joints.reshape(2 * len(self), -1), np.stack(wrenches, axis=1).reshape(2 * len(self), 6)


@dataclass(frozen=True, eq=False)
class Instruments:
    """Inclinometers, and on which links they sit."""

    names: tuple[str, ...]  #: Of each, for messages.
    links: tuple[int, ...]  #: Link that each sits on, from 0.
    #: Rotation from the link's frame to the instrument's, ``(instruments, 3, 3)``, as far as it is known.
    mounts: Array

    @classmethod
    def on_every_link(cls, count: int) -> Self:
        """Return one on each of `count` links, aligned with the link's frame."""
        names = tuple(f"link {number}" for number in range(1, count + 1))
        return cls(names, tuple(range(count)), np.tile(np.eye(3), (count, 1, 1)))

    def __len__(self) -> int:
        return len(self.links)


@dataclass(frozen=True, eq=False)
class Inclinations:
    """What inclinometers read, configuration by configuration, as a file has it."""

    source: str  #: The file, for messages.
    labels: tuple[str, ...]  #: Name of each configuration.
    joints: Array  #: Joint positions [rad; m for prismatic joints], ``(n, joints)``.
    joint_kinds: tuple[str, ...]  #: ``revolute`` or ``prismatic`` for each joint.
    instruments: Instruments  #: That were read.
    #: Of the axes x, y and z of each instrument above the horizontal plane [rad], ``(n, instruments, 3)``, up is
    #: positive; NaN where none was read.
    angle: Array
    sigma: Array  #: Standard deviation of each reading [rad], ``(n, instruments)``; NaN where none was read.
    order: NDArray[np.intp]  #: Number of each configuration in the sequence of measurement, from 1, ``(n,)``.
    #: External force [N] and moment [N m] on the flange, about its origin, in the axes of the base, ``(n, 6)``.
    wrench: Array
    #: Mass [kg] beside what the robot carries already and its centre of gravity in the flange's frame [m], ``(n, 4)``.
    payload: Array
    joints_are: str = "model"  #: ``model``, or ``controller`` if it shows these joint positions.
    simulated: bool = False  #: Whether virtual instruments read any of it.

    def __post_init__(self) -> None:
        """Refuse fields that do not fit together, and angles that are none."""
        n, count, joints = len(self.labels), len(self.instruments), len(self.joint_kinds)
        shapes = {
            "joints": (n, joints),
            "angle": (n, count, 3),
            "sigma": (n, count),
            "order": (n,),
            "wrench": (n, 6),
            "payload": (n, 4),
        }
        for name, shape in shapes.items():
            came = np.shape(getattr(self, name))
            if came != shape:
                raise InputError(
                    f"wrong number of values: {name}", where=self.source, came=str(came), allowed=str(shape)
                )
        wrong = {
            "a joint position is no number": not np.isfinite(self.joints).all(),
            "a force or a moment is no number": not np.isfinite(self.wrench).all(),
            "a payload is no mass": not (np.isfinite(self.payload).all() and (self.payload[:, 0] >= 0.0).all()),
            "an angle is beyond the vertical": bool((np.abs(self.angle) > math.pi / 2).any()),
            "a reading has no deviation above zero": not (self.sigma[np.isfinite(self.angle).any(axis=2)] > 0.0).all(),
            "two configurations have the same place in the order": len(np.unique(self.order)) < n,
            "there is no such link": not all(0 <= link < joints for link in self.instruments.links),
        }
        for what, is_so in wrong.items():
            if is_so:
                raise InputError(what, where=self.source)

    @property
    def simulated_from(self) -> tuple[Marked, ...]:
        """``data``, if virtual instruments read any of it."""
        return ("data",) if self.simulated else ()

    @cached_property
    def pairs(self) -> NDArray[np.intp]:
        """Configurations that are compared, ``(pairs, 2)``: those of the orders 1 and 2, 3 and 4 and so on."""
        place = {int(order): index for index, order in enumerate(self.order)}
        return np.array(
            [(place[n], place[n + 1]) for n in sorted(place) if n % 2 and n + 1 in place], dtype=np.intp
        ).reshape(-1, 2)

    @property
    def unpaired(self) -> tuple[str, ...]:
        """Labels of the configurations that have no partner."""
        paired = set(self.pairs.reshape(-1).tolist())
        return tuple(label for index, label in enumerate(self.labels) if index not in paired)

    def postures(self, robot: Robot) -> Postures:
        """Return how the arm stood; payloads are weights at the flange, whose directions are the nominal robot's."""
        wrench = self.wrench.copy()
        if self.payload[:, 0].any():
            R = np.swapaxes(robot.base.rotation, -1, -2) @ robot.forward_kinematics(self.joints).matrix()
            force = self.payload[:, :1] * np.array(robot.gravity)
            wrench[:, :3] += force
            wrench[:, 3:] += np.cross(np.einsum("nij,nj->ni", R, self.payload[:, 1:]), force)
        return Postures(self.joints, wrench=wrench)

    def changes(self, robot: Robot, mounts: Array | None = None) -> InclinometerReadings:
        """Return by how much readings changed within pairs.

        Args:
            mounts: Of the instruments, as they were found; as they are stated if None.
        """
        first, second = self.pairs.T
        at = self.postures(robot)
        stated = self.instruments
        return InclinometerReadings(
            Pairs(at.at(first), at.at(second)),
            self.angle[second] - self.angle[first],
            np.hypot(self.sigma[first], self.sigma[second])[..., None],
            Instruments(stated.names, stated.links, stated.mounts if mounts is None else mounts),
        )


@dataclass(frozen=True, eq=False)
class InclinometerReadings:
    """By how much the readings of inclinometers changed from one posture to another."""

    pairs: Pairs  #: The postures.
    #: Second reading less first of each axis of each instrument ``(n, instruments, 3)`` [rad]; NaN where there is none.
    #: Axes and readings are those of :func:`truearm.inclinometers.pairs.inclinations`.
    change: Array
    #: Standard deviation of one change [rad], one for all or ``(n, instruments, 1)``; :func:`deviation_of_change` finds
    #: it for an instrument.
    sigma: float | Array
    instruments: Instruments | None = None  #: That were read; None for one on each link, aligned with the link's frame.

    def __post_init__(self) -> None:
        shape = (len(self.pairs), len(self.mounted), 3)
        if self.change.shape != shape:
            raise InputError(
                "inclinometers read three axes of every link in every pair of postures",
                where="inclinometer readings",
                came=f"an array of shape {self.change.shape}",
                allowed=str(shape),
            )
        sigma = np.broadcast_to(np.asarray(self.sigma, float), shape)[np.isfinite(self.change)]
        if not np.all(sigma > 0.0):
            raise InputError(
                "changes of inclination need a standard deviation",
                where="inclinometer readings",
                came=f"{np.min(sigma):g} rad",
                allowed="more than 0",
            )

    @property
    def mounted(self) -> Instruments:
        """The instruments, and where they sit."""
        return self.instruments or Instruments.on_every_link(self.pairs.first.joints.shape[1])

    @property
    def deviations(self) -> Array:
        """Standard deviation of each change [rad], ``(n, instruments, 3)``; 1 where there is none."""
        return np.where(np.isfinite(self.change), np.broadcast_to(np.asarray(self.sigma), self.change.shape), 1.0)


def deviation_of_change(resolution: float, noise: float = 0.0) -> float:
    """Return the standard deviation of the difference of two readings [rad].

    Rounding to multiples of the resolution spreads a reading evenly over one step (variance ``step^2 / 12``).
    """
    return math.sqrt(2.0) * deviation_of_reading(resolution, noise)


def deviation_of_reading(resolution: float, noise: float = 0.0) -> float:
    """Return the standard deviation of one reading [rad], see :func:`deviation_of_change`."""
    return math.sqrt(resolution**2 / 12.0 + noise**2)
