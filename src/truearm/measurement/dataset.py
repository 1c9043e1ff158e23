"""Datasets: joint readings and what an instrument saw there, in SI units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from truearm.modeling.chain import Array
from truearm.modeling.postures import Postures

IntArray = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Dataset:
    """Configurations and readings; one reading is one target seen at one configuration.

    Attributes
    ----------
    source
        The file, for messages.
    labels
        Name of each configuration, in file order.
    joints
        Joint readings [rad; m for prismatic joints], ``(configurations, joints)``.
    joint_kinds
        ``revolute`` or ``prismatic`` for each joint, as the units of the file say.
    targets
        Names of the targets, in order of first appearance.
    configuration, target
        Index of the configuration and of the target of each reading, ``(readings,)``.
    position
        Measured position in the instrument's frame [m], ``(readings, 3)``; NaN where it is missing.
    quaternion
        Measured orientation (w, x, y, z), ``(readings, 4)``, NaN where it is missing; None if nothing has one.
    sigma
        Declared standard deviation per coordinate [m], ``(readings,)``; None if the file declares none.
    sigma_rot
        Declared standard deviation per rotation axis [rad], ``(readings,)``; None if the file declares none.
    approach
        Sign of the last move of each joint, ``(configurations, joints)``: 1, -1, or 0 where it is not known; None if
        the order of measurement is not known.
    number
        How many configurations of the campaign were measured before each, ``(configurations,)``; None if that is not
        known.
    temperature
        Of the arm [degC], ``(configurations,)``; None if it was not recorded.
    wrench
        External force [N] and moment [N m] on the flange, about its origin, in the axes of the base,
        ``(configurations, 6)``; None without any.
    references
        Fixed points beside the robot that were measured along with the targets, with the same fields; None if
        there are none.
    """

    source: str
    labels: tuple[str, ...]
    joints: Array
    joint_kinds: tuple[str, ...]
    targets: tuple[str, ...]
    configuration: IntArray
    target: IntArray
    position: Array
    quaternion: Array | None = None
    sigma: Array | None = None
    sigma_rot: Array | None = None
    approach: Array | None = None
    number: Array | None = None
    temperature: Array | None = None
    wrench: Array | None = None
    references: Dataset | None = None

    @property
    def postures(self) -> Postures:
        """What the arm's shape depended on at each configuration."""
        return Postures(
            self.joints,
            approach=self.approach,
            number=self.number,
            temperature=self.temperature,
            wrench=self.wrench,
        )

    @property
    def configurations(self) -> int:
        """Number of configurations."""
        return len(self.labels)

    @property
    def has_position(self) -> NDArray[np.bool_]:
        """Which readings hold a position."""
        return np.asarray(np.isfinite(self.position).all(axis=1))

    @property
    def has_orientation(self) -> NDArray[np.bool_]:
        """Which readings hold an orientation."""
        if self.quaternion is None:
            return np.zeros(len(self.target), dtype=bool)
        return np.asarray(np.isfinite(self.quaternion).all(axis=1))

    def of_configurations(self, indices: Sequence[int] | IntArray) -> Dataset:
        """Return the readings at some configurations, with these in the given order."""
        indices = np.asarray(indices, dtype=np.intp)
        place = np.full(self.configurations, -1, dtype=np.intp)
        place[indices] = np.arange(len(indices))
        kept = place[self.configuration] >= 0

        def part(values: Array | None) -> Array | None:
            return None if values is None else values[kept]

        def of_each(values: Array | None) -> Array | None:
            return None if values is None else values[indices]

        return replace(
            self,
            labels=tuple(self.labels[i] for i in indices),
            joints=self.joints[indices],
            configuration=place[self.configuration[kept]],
            target=self.target[kept],
            position=self.position[kept],
            quaternion=part(self.quaternion),
            sigma=part(self.sigma),
            sigma_rot=part(self.sigma_rot),
            approach=of_each(self.approach),
            number=of_each(self.number),
            temperature=of_each(self.temperature),
            wrench=of_each(self.wrench),
            references=None if self.references is None else self.references.of_configurations(indices),
        )
