"""A virtual instrument that measures a twin reading by reading, dwell by dwell, with the mishaps of a real one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import islice, takewhile
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError, Notice
from truearm.engine.robot.chain import Array
from truearm.engine.robot.postures import approach_from
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import quaternion_from_rotation, rotation_from_quaternion
from truearm.engine.twin.devices import DEVICES
from truearm.engine.twin.devices.device import Device, MeasurementArm
from truearm.engine.twin.devices.touching import Artefact
from truearm.engine.twin.twin import Conditions, Twin
from truearm.measuring.session import Reading, Session, dwell_figures
from truearm.measuring.sources import Incoming

#: Samples of a dwell, and how long it takes [s].
SAMPLES: Final = 20
_DWELL: Final = 2.0
#: From one reading to the next [s].
_PACE: Final = 10.0
#: How far about the base nests stand [m].
_NEST_CIRCLE: Final = 0.6
#: A disturbed reading: so many deviations more scatter, or so many of unrest that dies out, or a beam that breaks.
_UNREST: Final = 15.0
_SCATTER: Final = 8.0
#: So often a point is read in a row; then it is left out.
_MOST_TRIES: Final = 20

#: Instruments that read where targets are, at whatever configurations the robot comes to: by name.
VIRTUAL: Final[dict[str, Device]] = {device.name: device for device in DEVICES if not device.no_plan}


class VirtualInstrument:
    """A source of readings: a device, simulated, that measures a twin at the configurations of a plan.

    Each reading is the mean of the samples of a dwell. The device's deviation is that of the mean about the truth: a
    sample scatters by it about the dwell's own place, so that the mean of many samples looks better than it is, as with
    a real instrument. What it reads depends on the seed and on how many readings there are, so measuring
    that was stopped goes on as if it had not been.

    Args:
        device: One of ``VIRTUAL``.
        twin: The true robot where the device sees it, with its targets.
        placed: The nominal robot at the same place, for the line of sight.
        joints: Of the plan, as the model counts them [rad or m], ``(n, joints)``.
        nests: Names of fixed points; they stand about the base.
        seed: Of all that is drawn.
        disturbed: Share of the readings with a broken beam, an arm that still moves, or too much scatter.
        drift: How far the instrument has moved at the last configuration [m], evenly over the plan.
        sigma: Standard deviation of a coordinate of a reading [m]; the device's if None.
        before: Where the arm stops right before each configuration, as `joints`; None if it comes from the one before.

    Attributes:
        hides: What stands between it and each nest, in words, at each configuration: a nest that is not named is seen.
    """

    kind: Final = "virtual"

    def __init__(
        self,
        device: Device,
        twin: Twin,
        placed: Robot,
        joints: Array,
        nests: tuple[str, ...] = (),
        seed: int = 0,
        disturbed: float = 0.0,
        drift: float = 0.0,
        sigma: float | None = None,
        before: Array | None = None,
    ) -> None:
        self.device, self.placed = device, placed
        self.sigma = device.sigma if sigma is None else sigma
        self._joints, self._seed, self._disturbed = joints, seed, disturbed
        self.hides: Sequence[Mapping[str, str]] = [{} for _ in joints]
        conditions = Conditions(number=np.arange(float(len(joints))))
        if before is not None:
            count = float(2 * len(joints))
            conditions = Conditions(approach=approach_from(before, joints), number=np.arange(1.0, count, 2.0))
        self._frames = twin.frames(joints, **conditions)
        rng = np.random.default_rng([seed, 0])
        way = rng.standard_normal(3)
        self._drift = drift * way / np.linalg.norm(way)
        base = twin.robot.base
        # From a quarter of a step beside the instrument on, so that none of a few is behind the base.
        x, y, _ = -base.rotation.T @ np.array(base.translation)
        turn = np.arctan2(y, x) + 2 * np.pi * (np.arange(len(nests)) + 0.25) / max(len(nests), 1)
        around = _NEST_CIRCLE * np.column_stack([np.cos(turn), np.sin(turn), 0.1 * np.arange(len(nests))])
        self.nests = dict(zip(nests, around @ base.rotation.T + base.translation, strict=True))

    @property
    def looks(self) -> bool:
        """Whether it needs a line of sight; a measurement arm needs none."""
        return not isinstance(self.device, MeasurementArm)

    @property
    def waiting(self) -> str:
        """For what it waits."""
        return "the next reading"

    @property
    def notices(self) -> tuple[Notice, ...]:
        """Nothing went wrong with it."""
        return ()

    def messages(self) -> list[str]:
        """Nothing could not be read."""
        return []

    def close(self) -> None:
        """Nothing is held."""

    def visible(self, configuration: int) -> NDArray[np.bool_]:
        """Return which targets it sees at a configuration, ``(targets,)``."""
        return np.asarray(self.device.visible(self.placed, self._joints[configuration : configuration + 1])[0])

    def poll(self, session: Session, seconds: float) -> list[Incoming]:
        """Return the next reading, or that its target cannot be seen; it takes no time."""
        step = session.next
        if step is None:
            return []
        name, k = step.names[0], step.configuration
        if step.kind == "configuration":
            index = [target.name for target in self.placed.targets].index(name)
            if not self.visible(k)[index]:
                return [Incoming(left=(step.label, name, f"the {self.device.name} does not see it"))]
        elif name in self.hides[k]:
            return [Incoming(left=(step.label, name, f"{self.hides[k][name]} is in the line of sight"))]
        tries = takewhile(lambda entry: (entry.label, entry.name) == (step.label, name), reversed(session.entries))
        if sum(1 for _ in islice(tries, _MOST_TRIES)) == _MOST_TRIES:
            return [Incoming(left=(step.label, name, f"{_MOST_TRIES} readings in a row were set aside"))]
        rng = np.random.default_rng([self._seed, 1, len(session)])
        mishap = int(rng.integers(3)) if rng.random() < self._disturbed else -1
        reading = self._read(name, k, rng, mishap, _PACE * len(session))
        return [Incoming(replace(reading, label=step.label))]

    def _read(self, name: str, k: int, rng: np.random.Generator, mishap: int, time: float) -> Reading:
        turned = None
        if name in self.nests:
            place = self.nests[name]
        else:
            place, turned = self._frames[name][k, :3, 3], self._frames[name][k, :3, :3]
        place = place + self._drift * (k / max(len(self._joints) - 1, 1))
        # The mean of the samples has a variance of 1 / n of theirs; the rest of the deviation is common to the dwell.
        own = self.sigma * np.sqrt(1.0 - 1.0 / SAMPLES) * rng.standard_normal(3)
        spread = self.sigma * (_SCATTER if mishap == 2 else 1.0)
        samples = place + own + spread * rng.standard_normal((SAMPLES, 3))
        if mishap == 1:  # the arm comes to rest while it is measured
            way = rng.standard_normal(3)
            decay = np.exp(-np.linspace(0.0, 4.0, SAMPLES))[:, None]
            samples = samples + _UNREST * self.sigma * decay * way / np.linalg.norm(way)
        mean, deviation, settling = dwell_figures(samples)
        quaternion = spread_angle = None
        if isinstance(self.device, Artefact) and turned is not None:
            spread_angle = self.sigma / self.device.size
            small = np.concatenate([[1.0], 0.5 * spread_angle * rng.standard_normal(3)])
            quaternion = quaternion_from_rotation(rotation_from_quaternion(small / np.linalg.norm(small)) @ turned)
        return Reading(
            name=name,
            time=time + _DWELL,
            position=mean,
            quaternion=quaternion,
            sigma=self.sigma or None,
            sigma_rot=spread_angle or None,
            samples=SAMPLES,
            deviation=deviation,
            settling=settling,
            breaks=1 if mishap == 0 else 0,
            origin=f"virtual {self.device.name}",
        )


def virtual_device(name: str) -> Device:
    """Return a device that can measure a plan virtually.

    Raises:
        InputError: If it does not go through a plan: then the postures are its own.
    """
    if name in VIRTUAL:
        return VIRTUAL[name]
    raise InputError(
        next(device.no_plan for device in DEVICES if device.name == name),
        parameter="device",
        came=name,
        allowed=", ".join(VIRTUAL),
        cure=f"'truearm simulate' finds the postures of {name}, and measures a twin with it.",
    )
