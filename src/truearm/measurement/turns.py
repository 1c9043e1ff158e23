"""A joint turned alone: the runs of a campaign in which it is, and how far what it does is from what it reads.

Source: Nubiola, section 2.4.1. A point on the tool goes round the joint's axis. The circle through its places is fitted
by :mod:`.circles`; the angular error is the angle about that axis beyond the joint position, the tangential error the
same at the radius, and backlash is by how much the joint lags when it comes back.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from truearm.measurement.circles import FEWEST, Circle
from truearm.measurement.dataset import Dataset, IntArray
from truearm.modeling.chain import Array

#: Joint positions that differ by less are the same: encoders flicker [rad].
SAME_POSITION: Final = math.radians(0.01)


@dataclass(frozen=True, eq=False)
class Run:
    """Configurations in a row between which one joint alone has moved."""

    joint: int  #: Its number, from 1.
    configurations: IntArray  #: Indices into the dataset, in the order of measurement, ``(n,)``.


def find_runs(data: Dataset) -> tuple[Run, ...]:
    """Return the runs of a dataset, in the order of its configurations.

    A run has four different joint positions or more. A configuration may end one run and begin the next.
    """
    runs: list[Run] = []
    start, joint = 0, -1
    for row in range(1, data.configurations + 1):
        moved = [] if row == data.configurations else _moved(data.joints[start], data.joints[row])
        if row < data.configurations and (not moved or moved == [joint] or (joint < 0 and len(moved) == 1)):
            joint = moved[0] if moved else joint
            continue
        if joint >= 0:
            runs.append(Run(joint + 1, np.arange(start, row)))
        if row < data.configurations:
            step = _moved(data.joints[row - 1], data.joints[row])
            start, joint = (row - 1, step[0]) if len(step) == 1 else (row, -1)
    return tuple(run for run in runs if _different(data.joints[run.configurations, run.joint - 1]) >= FEWEST)


def _moved(before: Array, after: Array) -> list[int]:
    return [int(i) for i in np.flatnonzero(np.abs(after - before) > SAME_POSITION)]


def _different(joints: Array) -> int:
    return 1 + int((np.diff(np.sort(joints)) > SAME_POSITION).sum())


@dataclass(frozen=True, eq=False)
class Turn:
    """A joint turned alone, and what a point on the tool did."""

    #: Through the places of the point; its normal points along the joint's axis, so that angles grow with joint
    #: positions.
    circle: Circle
    joint_position: Array  #: Joint positions [rad], ``(n,)``.
    error: Array  #: Angle about the axis beyond the joint position, zero on average [rad], ``(n,)``.
    direction: Array  #: Sign of the last move, 0 where it is not known, ``(n,)``.

    @property
    def angular(self) -> float:
        """Range of the angular error [rad]."""
        return float(np.ptp(self.error))

    @property
    def tangential(self) -> float:
        """Range of the tangential error [m]."""
        return self.angular * self.circle.radius

    @property
    def backlash(self) -> float | None:
        """How far the joint lags, backward minus forward at the same joint position [rad]; None if nowhere known."""
        places = np.round(self.joint_position / SAME_POSITION).astype(int)
        lags = []
        for place in np.unique(places):
            here = places == place
            forward, backward = (self.error[here & (self.direction == sign)] for sign in (1.0, -1.0))
            if len(forward) and len(backward):
                lags.append(float(backward.mean() - forward.mean()))
        return float(np.mean(lags)) if lags else None


def turn_of(circle: Circle, positions: Array, direction: Array | None = None) -> Turn:
    """Compare the angles about a fitted circle with joint positions ``(n,)`` [rad].

    Args:
        circle: Fitted to the point's places; it is turned round where angles fall as joint positions grow.
        direction: Sign of the last move, ``(n,)``; from the order of the joint positions if None, unknown until the
            first move.
    """
    agreement = [abs(np.exp(1j * (sense * circle.angle - positions)).mean()) for sense in (1, -1)]
    circle = circle if agreement[0] >= agreement[1] else circle.reversed()
    beyond = np.exp(1j * (circle.angle - positions))
    error = np.angle(beyond / beyond.mean())
    return Turn(circle, positions, error - error.mean(), _directions(positions) if direction is None else direction)


def _directions(positions: Array) -> Array:
    signs = np.zeros(len(positions))
    for row in range(1, len(positions)):
        step = positions[row] - positions[row - 1]
        signs[row] = signs[row - 1] if abs(step) <= SAME_POSITION else math.copysign(1.0, step)
    return signs
