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
        Measured position in the instrument's frame, or counted from the reading's fixture [m], ``(readings, 3)``; NaN
        where it is missing.
    quaternion
        Measured orientation (w, x, y, z), ``(readings, 4)``, NaN where it is missing; None if nothing has one.
    distance
        Measured distance from the origin of the reading's fixture [m], ``(readings,)``, NaN where none was measured;
        None if nothing has one.
    height
        Measured height over the plane of the reading's fixture [m], ``(readings,)``, likewise.
    fixtures
        Names of the fixtures, in order of first appearance.
    fixture
        Index of the fixture that each reading is measured against, ``(readings,)``, -1 for the instrument's own frame;
        None if that is all of them.
    setup
        What is known of the fixtures themselves: readings whose targets are fixtures, all at one configuration that
        says nothing, with their deviations; None if nothing is.
    sigma
        Declared standard deviation per coordinate, or of a distance or height [m], ``(readings,)``; None if the file
        declares none.
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
    distance: Array | None = None
    height: Array | None = None
    fixtures: tuple[str, ...] = ()
    fixture: IntArray | None = None
    setup: Dataset | None = None
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
    def against(self) -> IntArray:
        """Index of the fixture of each reading, -1 for the instrument's own frame, ``(readings,)``."""
        return np.full(len(self.target), -1, dtype=np.intp) if self.fixture is None else self.fixture

    @property
    def has_position(self) -> NDArray[np.bool_]:
        """Which readings hold a position in the instrument's own frame."""
        return np.asarray(np.isfinite(self.position).all(axis=1) & (self.against < 0))

    @property
    def has_orientation(self) -> NDArray[np.bool_]:
        """Which readings hold an orientation in the instrument's own frame."""
        if self.quaternion is None:
            return np.zeros(len(self.target), dtype=bool)
        return np.asarray(np.isfinite(self.quaternion).all(axis=1) & (self.against < 0))

    @property
    def has_reading(self) -> NDArray[np.bool_]:
        """Which readings hold anything."""
        lengths = [np.isfinite(v) for v in (self.distance, self.height) if v is not None]
        whole = [np.isfinite(v).all(axis=1) for v in (self.position, self.quaternion) if v is not None]
        return np.asarray(np.any([*whole, *lengths], axis=0))

    @property
    def anchored(self) -> bool:
        """Whether anything says where the robot stands: the instrument's own frame, or a fixture's place in it."""
        in_frame = bool((self.has_position | self.has_orientation).any())
        return in_frame or (self.setup is not None and bool(self.setup.has_position.any()))

    def of_readings(self, kept: NDArray[np.bool_]) -> Dataset:
        """Return some of the readings ``(readings,)``, with all configurations."""

        def part(values: Array | None) -> Array | None:
            return None if values is None else values[kept]

        return replace(
            self,
            configuration=self.configuration[kept],
            target=self.target[kept],
            position=self.position[kept],
            quaternion=part(self.quaternion),
            distance=part(self.distance),
            height=part(self.height),
            fixture=None if self.fixture is None else self.fixture[kept],
            sigma=part(self.sigma),
            sigma_rot=part(self.sigma_rot),
        )

    def of_configurations(self, indices: Sequence[int] | IntArray) -> Dataset:
        """Return the readings at some configurations, with these in the given order."""
        indices = np.asarray(indices, dtype=np.intp)
        place = np.full(self.configurations, -1, dtype=np.intp)
        place[indices] = np.arange(len(indices))
        kept = place[self.configuration] >= 0

        def of_each(values: Array | None) -> Array | None:
            return None if values is None else values[indices]

        some = self.of_readings(kept)
        return replace(
            some,
            labels=tuple(self.labels[i] for i in indices),
            joints=self.joints[indices],
            configuration=place[some.configuration],
            approach=of_each(self.approach),
            number=of_each(self.number),
            temperature=of_each(self.temperature),
            wrench=of_each(self.wrench),
            references=None if self.references is None else self.references.of_configurations(indices),
        )
