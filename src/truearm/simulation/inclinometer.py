"""What inclinometers on the links of the digital twin read, alone and in comparisons."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Unpack

import numpy as np

from truearm.measurement.dataset import Dataset
from truearm.measurement.inclinometer import (
    Inclinations,
    InclinometerReadings,
    Instruments,
    Pairs,
    deviation_of_change,
    deviation_of_reading,
)
from truearm.modeling.chain import Array
from truearm.simulation.twin import Conditions, Twin, measure


def inclinations(
    twin: Twin,
    joints: Array,
    noise: float,
    rng: np.random.Generator,
    resolution: float = 0.0,
    **conditions: Unpack[Conditions],
) -> Array:
    """Return what inclinometers on all links read at joint positions ``(n, joints)``.

    Each link carries one with three sensitive axes along x, y and z of the link's frame (the frame behind the tilt of
    its joint, :attr:`Posture.links`). A reading is the angle of such an axis above the horizontal plane, -pi/2 to
    pi/2: ``asin(-g . axis)`` with the unit vector g along gravity. The direction of gravity in the link's frame is
    therefore ``-sin`` of the three readings. An axis that is horizontal sees a small turn about a horizontal axis
    across it in full; one near the vertical hardly sees it. Differences between configurations are free of how the
    instrument sits on its link as long as the link turns little between them.

    Args:
        noise: Standard deviation of each reading [rad].
        resolution: Readings are whole multiples of it [rad], unless it is zero.
        conditions: See :class:`Conditions`.

    Returns:
        inclinations: ``(n, links, 3)`` [rad].
    """
    down = np.array(twin.robot.gravity) / np.linalg.norm(twin.robot.gravity)
    links = np.array([posture.links for posture in twin.postures(joints, **conditions)])
    pulled = np.einsum("nlij,i->nlj", links[:, :, :3, :3], down)
    read = np.arcsin(np.clip(-pulled, -1.0, 1.0))
    read = read + rng.normal(0.0, 1.0, read.shape) * noise
    return np.asarray(np.round(read / resolution) * resolution if resolution else read)


def read_pairs(
    twin: Twin, pairs: Pairs, resolution: float, rng: np.random.Generator, axes: Sequence[int] = (0, 1)
) -> Inclinations:
    """Return what inclinometers on all links of a twin read at the postures of pairs, in turn.

    Args:
        resolution: Of each reading [rad].
        axes: Which axes of the link each of them has: 0, 1 and 2 for x, y and z.
    """
    joints, wrench = pairs.joints_in_turn()
    count, links = len(joints), len(twin.robot.joints)
    angle = np.full((count, links, 3), np.nan)
    angle[..., list(axes)] = inclinations(twin, joints, 0.0, rng, resolution, wrench=wrench)[..., list(axes)]
    return Inclinations(
        source="twin",
        labels=tuple(str(number) for number in range(1, count + 1)),
        joints=joints,
        joint_kinds=tuple(joint.kind for joint in twin.robot.joints),
        instruments=Instruments.on_every_link(links),
        angle=angle,
        sigma=np.full((count, links), deviation_of_reading(resolution)),
        order=np.arange(1, count + 1),
        wrench=wrench + 0.0,  # no negative zeros
        payload=np.zeros((count, 4)),
        simulated=True,
    )


def compare(
    twin: Twin, pairs: Pairs, resolution: float, rng: np.random.Generator, noise: float = 0.0
) -> InclinometerReadings:
    """Return by how much inclinometers on the links of a twin change their readings between postures.

    Args:
        resolution, noise: Of each reading [rad]; see :func:`inclinations`.
    """
    joints, wrench = pairs.joints_in_turn()
    read = inclinations(twin, joints, noise, rng, resolution, wrench=wrench)
    return InclinometerReadings(pairs, read[1::2] - read[::2], deviation_of_change(resolution, noise))


def measure_pairs(twin: Twin, pairs: Pairs, noise: float, rng: np.random.Generator) -> Dataset:
    """Return what an instrument reads of a twin's targets at the postures of pairs, in turn; noise in metres."""
    joints, wrench = pairs.joints_in_turn()
    return measure(twin, joints, noise, rng, wrench=wrench)
