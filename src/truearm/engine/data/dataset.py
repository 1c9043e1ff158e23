"""Datasets: joint positions and what an instrument saw there, in SI units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from truearm.engine.base.arrays import axes, finite_number, number_array
from truearm.engine.base.errors import InputError, as_html, counted, listed, short_text
from truearm.engine.base.units import Marked, mark_lines
from truearm.engine.data.dataset_fields import (
    checked_joints,
    checked_kinds,
    checked_labels,
    checked_order,
    checked_positions,
    checked_quaternions,
    checked_selection,
    checked_sigma,
    checked_visits,
    distinct_labels,
    refuse_unsound,
)
from truearm.engine.data.parting import parted
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import JointsOf
from truearm.engine.robot.postures import Postures, approach_of

IntArray = NDArray[np.intp]


@dataclass(frozen=True, eq=False, repr=False)
class Dataset:
    """Configurations and readings; one reading is one target seen at one configuration.

    It checks itself when it is made: a field of the wrong shape, or with numbers that cannot be, is refused by name.
    :meth:`of` makes one from plain arrays.
    """

    source: str  #: The file, for messages.
    labels: tuple[str, ...]  #: Name of each configuration, in file order.
    joints: Array  #: Joint positions [rad; m for prismatic joints], ``(configurations, joints)``.
    joint_kinds: tuple[str, ...]  #: ``revolute`` or ``prismatic`` for each joint, as the units of the file say.
    targets: tuple[str, ...]  #: Names of the targets, in order of first appearance.
    #: configuration, target: index of the configuration and of the target of each reading, ``(readings,)``.
    configuration: IntArray
    target: IntArray
    #: Measured position in the instrument's frame, or counted from the reading's fixture [m], ``(readings, 3)``; NaN
    #: where it is missing.
    position: Array
    #: Measured orientation (w, x, y, z), ``(readings, 4)``, NaN where it is missing; None if nothing has one.
    quaternion: Array | None = None
    #: Measured distance from the origin of the reading's fixture [m], ``(readings,)``, NaN where none was measured;
    #: None if nothing has one.
    distance: Array | None = None
    #: Measured height over the plane of the reading's fixture [m], ``(readings,)``, likewise.
    height: Array | None = None
    fixtures: tuple[str, ...] = ()  #: Names of the fixtures, in order of first appearance.
    #: Index of the fixture that each reading is measured against, ``(readings,)``, -1 for the instrument's own frame;
    #: None if that is all of them.
    fixture: IntArray | None = None
    #: What is known of the fixtures themselves: readings whose targets are fixtures, all at one configuration that says
    #: nothing, with their deviations; None if nothing is.
    setup: Dataset | None = None
    #: Declared standard deviation per coordinate, or of a distance or height [m], ``(readings,)``; None if the file
    #: declares none.
    sigma: Array | None = None
    #: Declared standard deviation per rotation axis [rad], ``(readings,)``; None if the file declares none.
    sigma_rot: Array | None = None
    #: Standard deviation of how much longer than it reads the instrument's unit of length is, one number for all
    #: readings; None if it is exact.
    scale_sigma: float | None = None
    #: Which visit of its configuration each reading was taken on, whole numbers, ``(readings,)``: the robot came anew
    #: for each. None if it came once.
    visit: IntArray | None = None
    #: Sign of the last move of each joint, ``(configurations, joints)``: 1, -1, or 0 where it is not known; None if the
    #: order of measurement is not known.
    approach: Array | None = None
    #: How many configurations of the campaign were measured before each, ``(configurations,)``; None if that is not
    #: known.
    number: Array | None = None
    temperature: Array | None = None  #: Of the arm [degC], ``(configurations,)``; None if it was not recorded.
    #: External force [N] and moment [N m] on the flange, about its origin, in the axes of the base, ``(configurations,
    #: 6)``; None without any.
    wrench: Array | None = None
    #: Fixed points beside the robot that were measured along with the targets, with the same fields; None if there are
    #: none.
    references: Dataset | None = None
    #: ``model``: the joints are those of the robot's model. ``controller``: they are what its controller shows, and no
    #: robot can be compared with them before :func:`~truearm.engine.data.controller_joints.in_model_joints` has made
    #: them the model's; they are ``converted`` then.
    joints_are: str = "model"
    simulated: bool = False  #: Whether a virtual instrument read any of it.

    def __post_init__(self) -> None:
        """Refuse fields that do not fit together."""
        refuse_unsound(self)

    def __repr__(self) -> str:
        counts = {
            "position": self.position,
            "orientation": self.quaternion,
            "distance": self.distance,
            "height": self.height,
        }
        readings = [
            counted(int(np.isfinite(values).reshape(len(values), -1).all(axis=1).sum()), name)
            for name, values in counts.items()
            if values is not None
        ]
        known = {
            "order of measurement": self.number,
            "standard deviations": self.sigma if self.sigma is not None else self.sigma_rot,
            "temperature": self.temperature,
            "external forces": self.wrench,
            "visits": self.visit,
            "fixtures": self.fixtures or None,
            "reference points": self.references,
        }
        return short_text(
            [
                *mark_lines(self.simulated_from),
                f"{self.source}: {counted(self.configurations, 'configuration')} "
                f"of {counted(len(self.joint_kinds), 'joint')}"
                f"{' as the controller shows them' if self.joints_are == 'controller' else ''}",
                f"{counted(len(self.targets), 'target')}: {listed(self.targets)}",
                f"readings: {', '.join(readings)}",
                f"with: {', '.join(name for name, values in known.items() if values is not None) or 'nothing else'}",
            ]
        )

    def _repr_html_(self) -> str:
        return as_html(repr(self))

    @classmethod
    def of(
        cls,
        joints: ArrayLike,
        positions: ArrayLike,
        *,
        targets: Sequence[str] | None = None,
        configurations: Sequence[str | int] | None = None,
        quaternions: ArrayLike | None = None,
        sigma: ArrayLike | None = None,
        sigma_rot: ArrayLike | None = None,
        visit: ArrayLike | None = None,
        order: ArrayLike | None = None,
        temperature: ArrayLike | None = None,
        joint_kinds: Sequence[str] | None = None,
        joints_are: JointsOf = "model",
        source: str = "arrays",
    ) -> Dataset:
        """Make a dataset from arrays, one row a configuration.

        Parameters
        ----------
        joints
            Joint positions [rad; m for prismatic joints], ``(n, joints)``.
        positions
            What the instrument read of one target, ``(n, 3)``, or of each of several, ``(n, targets, 3)`` [m]; NaN for
            a reading that is missing.
        targets
            Names of the targets; ``1``, ``2`` and so on if None.
        configurations
            Names of the configurations; ``1``, ``2`` and so on if None.
        quaternions
            Measured orientations (w, x, y, z), ``(n, 4)`` or ``(n, targets, 4)``, NaN where one is missing.
        sigma
            Standard deviation of each coordinate [m]: a number, ``(n,)`` or ``(n, targets)``.
        sigma_rot
            Standard deviation about each axis of rotation [rad], likewise.
        visit
            Which visit of its configuration each target was read on, whole numbers, ``(n,)`` or ``(n, targets)``; all
            on one if None.
        order
            Place of each configuration in the order of measurement, counted from 0 or 1, ``(n,)``; not known if None.
        temperature
            Of the arm [degC], ``(n,)`` or a number.
        joint_kinds
            ``revolute`` or ``prismatic`` for each joint; all revolute if None.
        joints_are
            ``model``, or ``controller`` if they are what the robot's controller shows.
        source
            What messages call the data.

        Raises
        ------
        InputError
            If shapes do not fit together, joints are not finite, a deviation is not above zero or a quaternion not of
            length 1, or names are there twice.
        """
        q = checked_joints(joints)
        p, each = checked_positions(positions, len(q))
        n, k, _ = p.shape
        turned = None if quaternions is None else checked_quaternions(quaternions, each)
        names = checked_labels(targets, "targets", k)
        sequence = None if order is None else checked_order(order, n)
        return cls(
            source=source,
            labels=checked_labels(configurations, "configurations", n),
            joints=q,
            joint_kinds=checked_kinds(joint_kinds, q.shape[1]),
            joints_are=joints_are,
            targets=names,
            configuration=np.repeat(np.arange(n), k),
            target=np.tile(np.arange(k), n),
            position=p.reshape(n * k, 3),
            quaternion=turned,
            sigma=None if sigma is None else checked_sigma(sigma, "sigma", each),
            sigma_rot=None if sigma_rot is None else checked_sigma(sigma_rot, "sigma_rot", each),
            visit=None if visit is None else checked_visits(visit, each),
            approach=None if sequence is None else approach_of(q, sequence),
            number=None if sequence is None else np.asarray(sequence - min(int(sequence.min()), 1), float),
            temperature=None if temperature is None else _of_each(temperature, "temperature", n),
        )

    @property
    def postures(self) -> Postures:
        """What the arm's shape depended on at each configuration.

        Raises
        ------
        InputError
            If the joints are the controller's.
        """
        if self.joints_are == "controller":
            raise InputError(
                "the joint positions are the controller's, and the model's belong here",
                where=self.source,
                cure="Load them with the robot, truearm.load_data(data, robot), which knows how its controller counts.",
            )
        return Postures(
            self.joints, approach=self.approach, number=self.number, temperature=self.temperature, wrench=self.wrench
        )

    @property
    def simulated_from(self) -> tuple[Marked, ...]:
        """``data``, if a virtual instrument read any of it."""
        return ("data",) if self.simulated else ()

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

    def of_readings(self, chosen: Sequence[int] | Sequence[bool] | IntArray | NDArray[np.bool_]) -> Dataset:
        """Return some of the readings, with all configurations.

        Parameters
        ----------
        chosen
            A mask ``(readings,)``, or indices of readings in the order they shall have, repeated ones too.
        """
        rows = checked_selection(chosen, len(self.target), "chosen", "readings")

        def part(values: Array | None) -> Array | None:
            return None if values is None else values[rows]

        return replace(
            self,
            configuration=self.configuration[rows],
            target=self.target[rows],
            position=self.position[rows],
            quaternion=part(self.quaternion),
            distance=part(self.distance),
            height=part(self.height),
            fixture=None if self.fixture is None else self.fixture[rows],
            sigma=part(self.sigma),
            sigma_rot=part(self.sigma_rot),
            visit=None if self.visit is None else self.visit[rows],
        )

    def of_configurations(self, chosen: Sequence[int] | Sequence[bool] | IntArray | NDArray[np.bool_]) -> Dataset:
        """Return some of the configurations with their readings.

        Parameters
        ----------
        chosen
            A mask ``(configurations,)``, or indices of configurations in the order they shall have. One that is
            repeated becomes a configuration of its own each time, called ``7``, ``7#2``, ``7#3``: a bootstrap.
        """
        return self._at(checked_selection(chosen, self.configurations, "chosen", "configurations"))

    def split(self, train: float = 0.7, *, seed: int = 0) -> tuple[Dataset, Dataset]:
        """Return the configurations to train on, and those that judge.

        They are those of `calibrate` with the same seed: ``calibrate(robot, training, train="all")`` and
        ``validate(robot, judging)`` find what ``calibrate(robot, data, train=...)`` finds at once.

        Parameters
        ----------
        train
            The share to train on, above 0 and below 1, or how many: 1 to all but one.
        seed
            Of the split: training is the first part of ``numpy.random.default_rng(seed).permutation(n)``. Where joints
            come back to a posture, all configurations there are in the part of the first.

        Raises
        ------
        InputError
            If one part would have no configuration, or `seed` is no whole number from 0.
        """
        n = self.configurations
        share = finite_number(train, "train")
        count = round(share * n) if 0.0 < share < 1.0 else int(share)
        if not 1 <= count < n or (share >= 1.0 and share != count):
            raise InputError(
                "each part needs a configuration",
                parameter="train",
                came=train,
                allowed=f"a share above 0 and below 1, or 1 to {n - 1} configurations",
            )
        whole = finite_number(seed, "seed")
        if whole < 0 or whole != int(whole):
            raise InputError("a whole number from 0 belongs here", parameter="seed", came=seed)
        training, judging = parted(self.joints, self.joint_kinds, count, int(whole))
        return self.of_configurations(training), self.of_configurations(judging)

    def _at(self, indices: IntArray) -> Dataset:
        times = np.bincount(indices, minlength=self.configurations)
        first = np.cumsum(times) - times
        readings = np.repeat(np.arange(len(self.target)), times[self.configuration])
        of_each_reading = times[self.configuration]
        repetition = np.arange(len(readings)) - np.repeat(np.cumsum(of_each_reading) - of_each_reading, of_each_reading)
        place = np.argsort(indices, kind="stable")[first[self.configuration[readings]] + repetition]
        some = self.of_readings(readings)

        def of_each(values: Array | None) -> Array | None:
            return None if values is None else values[indices]

        return replace(
            some,
            labels=distinct_labels([self.labels[i] for i in indices]),
            joints=self.joints[indices],
            configuration=place,
            approach=of_each(self.approach),
            number=of_each(self.number),
            temperature=of_each(self.temperature),
            wrench=of_each(self.wrench),
            references=None if self.references is None else self.references._at(indices),
        )


def _of_each(values: ArrayLike, parameter: str, n: int) -> Array:
    return np.array(np.broadcast_to(number_array(values, parameter, () if axes(values) == 0 else (n,)), n))
