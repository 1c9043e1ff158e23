"""What an instrument would read of a robot whose truth is known."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from truearm.engine.base.errors import counted, refusals_of
from truearm.engine.base.limits import refuse_beyond
from truearm.engine.base.writing import write_text
from truearm.engine.command.arguments import (
    configurations_argument,
    device_argument,
    file_for,
    joints_argument,
    pushed_at_argument,
    robot_argument,
    stops_argument,
    wrench_argument,
)
from truearm.engine.data.controller_joints import in_controller_joints
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.data.readers.rows import before_each, in_order, places_after_stops
from truearm.engine.document.document import Block, detail, each, say
from truearm.engine.document.records import Record
from truearm.engine.robot.postures import approach_from
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.devices.device import Device, in_view_of, measured_with
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Conditions, Twin, measure, with_wrench_read

if TYPE_CHECKING:
    from truearm.simulation.jobs import Simulate


@dataclass(frozen=True, eq=False, repr=False)
class Simulation(Record):
    """What an instrument reads of a simulated robot."""

    robot: str  #: Name of the nominal robot.
    truth: str  #: What the simulated robot truly is: the name of a truth, or the robot file.
    data: Dataset  #: The readings.
    out: Path | None = None  #: The file that holds them; None if none was written.
    stopped_before: bool = False  #: Whether the arm stopped right before each configuration where a plan says so.

    def blocks(self) -> Iterator[Block]:
        """Give what was read."""
        data = self.data
        readings = f"{counted(len(data.target), 'reading')} of {counted(len(data.targets), 'target')}"
        against = f" against {', '.join(data.fixtures)}" if data.fixtures else ""
        destination = "" if self.out is None else f": {self.out}"
        many = counted(data.configurations, "configuration")
        yield say(
            f"{many} of {self.robot} ({self.truth}), {readings}{against}{destination}",
            robot=self.robot,
            truth=self.truth,
            configurations=data.configurations,
            joints_are=data.joints_are,
            readings=len(data.target),
            targets=list(data.targets),
            fixtures=list(data.fixtures),
        )
        words = "Before each the arm stopped at its approach_i; the order of the data counts these stops, too."
        yield detail(words if self.stopped_before else "", stopped_before=self.stopped_before)


@dataclass(frozen=True, eq=False, repr=False)
class DeviceList(Record):
    """The instruments that can be simulated and planned for."""

    devices: tuple[Device, ...]  #: In the order of the registry.
    is_list: ClassVar = True

    def as_json(self) -> Any:
        """Return the rows alone."""
        return self.summary()["devices"]

    def blocks(self) -> Iterator[Block]:
        """Give name, words, deviation [mm] and source of each."""
        width = max(len(device.name) for device in self.devices)
        yield each(
            "devices",
            (
                say(
                    f"{d.name:<{width}}  {d.summary}; deviation {d.sigma * 1e3:g} mm",
                    name=d.name,
                    summary=d.summary,
                    sigma_mm=d.sigma * 1e3,
                    source=d.source,
                )
                for d in self.devices
            ),
        )


def simulated(asked: Simulate) -> Simulation:
    """Read the robot, make the twin, and measure it."""
    truth = asked.truth
    file = None if asked.out is None else file_for(asked.out, asked.robot, truth, asked.poses)
    rng = np.random.default_rng(asked.seed)
    nominal = robot_argument(asked.robot)
    joints_are = joints_argument(asked.joints, nominal)
    stated = not isinstance(asked.poses, int)
    wanted = configurations_argument(nominal, asked.poses, "poses") if stated else None
    stops = stops_argument(nominal, asked.poses, "poses") if stated else None
    with refusals_of("truth"):
        twin = truth_twin(nominal, truth, rng)
    twin = replace(twin, robot=asked.loads.on(twin.robot))
    wrench = wrench_argument(asked.wrench, asked.wrench_frame)
    twin = replace(twin, robot=pushed_at_argument(twin.robot, wrench, asked.wrench_at))
    data = _measured(asked, nominal, twin, wanted, stops, rng)
    if twin.robot.wrench is not None:
        data = with_wrench_read(twin, data)
    if stops is not None:
        data = in_order(data, places_after_stops(data.configurations))
    if joints_are == "controller":
        data = in_controller_joints(nominal, data)
    if file is not None:
        write_text(file, csv_text(data))
    named = truth.name if isinstance(truth, Robot) else str(truth)
    return Simulation(nominal.name, named, data, file, stopped_before=stops is not None)


def _measured(
    asked: Simulate,
    nominal: Robot,
    twin: Twin,
    wanted: Dataset | None,
    stops: Dataset | None,
    rng: np.random.Generator,
) -> Dataset:
    """Return what the instrument reads, at the configurations that are given, or at so many that it finds."""
    instrument = None if asked.device is None else device_argument(asked.device)
    sigma = asked.noise
    if sigma is None:
        sigma = 0.0 if instrument is None else instrument.sigma
    count = wanted.configurations if wanted is not None else int(asked.poses)  # type: ignore[arg-type]  # a number then
    seen = twin.robot if instrument is None else in_view_of(instrument, twin.robot)
    refuse_beyond("readings", count * len(seen.targets), parameter="poses")
    asked.progress(f"measuring {count} configurations")
    if wanted is not None:
        conditions = Conditions() if stops is None else _stopped_before(wanted, stops)
        return replace(measure(twin, wanted.joints, sigma, rng, **conditions), labels=wanted.labels)
    if instrument is None:
        return measure(twin, nominal.random_configurations(count, rng), sigma, rng)
    return measured_with(instrument, nominal, twin, count, rng, sigma)


def _stopped_before(wanted: Dataset, stops: Dataset) -> Conditions:
    """Return how the arm comes to configurations, each from where it stops right before: that stop is one, too."""
    places = places_after_stops(wanted.configurations)
    return Conditions(approach=approach_from(stops.joints, wanted.joints), number=before_each(places))
