"""The digital twin: a robot whose truth is known, seen only through its readings.

It follows a path of its own: frames are products of 4x4 matrices, one configuration after the other, moments are
sums over masses of arm times weight, and gears run out of true. Nothing here calls the chain sweep, so a mistake
there cannot hide by appearing on both sides.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from truearm.measurement.dataset import Dataset
from truearm.modeling.chain import Array, Element
from truearm.modeling.robot import Robot

_G = 9.80665


@dataclass(frozen=True)
class Twin:
    """A true robot.

    Attributes
    ----------
    robot
        True parameter values, true base and true targets.
    compliance
        Deflection of a joint per moment of the load about its axis [rad/(N m)], by joint number.
    gear
        Run-out of a joint's gear: amplitude [rad] and phase [rad] of one sine a turn, by joint number.
    payload
        Mass [kg] and centre of gravity in the flange frame [m].
    """

    robot: Robot
    compliance: Mapping[int, float] = field(default_factory=dict)
    gear: Mapping[int, tuple[float, float]] = field(default_factory=dict)
    payload: tuple[float, tuple[float, float, float]] = (0.0, (0.0, 0.0, 0.0))

    def target_frames(self, reading: Array) -> dict[str, Array]:
        """Return ``T_world_target`` ``(4, 4)`` of every target for one joint reading ``(joints,)``."""
        q = np.array(reading, float)
        for number in range(1, len(q) + 1):
            q[number - 1] *= self.robot.values.get(f"gain_{number}", 1.0)
        for joint, (amplitude, phase) in self.gear.items():
            q[joint - 1] += amplitude * math.sin(reading[joint - 1] + phase)
        if self.compliance:
            moments = self.moments(q)
            for joint, rate in self.compliance.items():
                q[joint - 1] += rate * moments[joint - 1]
        flange = self._frames(q)[2]
        return {t.name: flange @ self._product(t.chain.elements, q) for t in self.robot.targets}

    def moments(self, q: Array) -> list[float]:
        """Return the moment of all weights beyond each joint about its axis [N m], with the base's z upwards.

        Its sign is the load's: positive where the weight turns the joint forward, so that compliance lets it sag
        (Nubiola, equation I.10).
        """
        axes, links, flange = self._frames(q)
        down = self.robot.base.rotation @ np.array([0.0, 0.0, -_G])
        payload, cog = self.payload
        weights = [(m.joint, m.mass * down, links[m.joint - 1] @ np.array([*m.cog, 1.0])) for m in self.robot.masses]
        weights.append((len(links), payload * down, flange @ np.array([*cog, 1.0])))
        moments = []
        for joint, T in enumerate(axes, 1):
            beyond = [np.cross(centre[:3] - T[:3, 3], weight) for link, weight, centre in weights if link >= joint]
            moments.append(float(sum(beyond, np.zeros(3)) @ T[:3, 2]))
        return moments

    def _frames(self, q: Array) -> tuple[list[Array], list[Array], Array]:
        """Return frames with z along each joint, frames of each link, and the flange, all in the world."""
        T = self._product(self.robot.base_elements, q)
        axes, links = [], []
        for elements in self.robot.link_elements:
            for element in elements:
                if element.variable is not None:
                    along = T.copy()
                    along[:3, 2] = T[:3, :3] @ _axis(element)
                    axes.append(along)
                T = T @ self._matrix(element, q)
            links.append(T)
        return axes, links, T @ self._product(self.robot.flange_elements, q)

    def _product(self, elements: tuple[Element, ...], q: Array) -> Array:
        T = np.eye(4)
        for element in elements:
            T = T @ self._matrix(element, q)
        return T

    def _matrix(self, element: Element, q: Array) -> Array:
        amount = self.robot.values[element.parameter] if element.parameter else element.value
        if element.variable is not None:
            amount += q[element.variable]
        x, y, z = axis = _axis(element)
        T = np.eye(4)
        if element.turns:
            K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            T[:3, :3] += math.sin(amount) * K + (1 - math.cos(amount)) * K @ K
        else:
            T[:3, 3] = amount * axis
        return T


def _axis(element: Element) -> Array:
    return np.array(element.axis) if element.axis else np.eye(3)["xyz".index(element.motion[1])]


def measure(twin: Twin, joints: Array, noise: float, rng: np.random.Generator, source: str = "twin") -> Dataset:
    """Return what an instrument reads of the twin at joint readings ``(n, joints)``.

    Parameters
    ----------
    noise
        Standard deviation of each coordinate [m]; declared in the data unless it is zero.
    """
    robot = twin.robot
    frames = [twin.target_frames(reading) for reading in joints]
    names = tuple(target.name for target in robot.targets)
    position = np.array([[at[name][:3, 3] for name in names] for at in frames]).reshape(-1, 3)
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
    )
