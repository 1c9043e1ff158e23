"""What an instrument would read of a robot whose truth is known."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from truearm.engine.base.arrays import finite_number
from truearm.engine.base.errors import InputError, counted, refusals_of, wrong_kind
from truearm.engine.base.files import path_argument
from truearm.engine.base.limits import refuse_beyond
from truearm.engine.base.writing import write_text
from truearm.engine.command.arguments import (
    JOINTS_OF,
    choice_argument,
    configurations_argument,
    count_argument,
    deviation_argument,
    device_argument,
    file_for,
    gravity_argument,
    joints_argument,
    payload_argument,
    progress_argument,
    pushed_at_argument,
    robot_argument,
    stops_argument,
    whole_argument,
    wrench_argument,
)
from truearm.engine.data.controller_joints import in_controller_joints
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.data.readers.rows import before_each, in_order, places_after_stops
from truearm.engine.document.records import Record
from truearm.engine.robot.controller import JointsOf
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.postures import approach_from
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.wrench import Wrench, WrenchFrame
from truearm.engine.twin.devices import DEVICES
from truearm.engine.twin.devices.device import Device, in_view_of, measured_with
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Conditions, measure, with_wrench_read


@dataclass(frozen=True, eq=False, repr=False)
class Simulation(Record):
    """What an instrument reads of a simulated robot."""

    robot: str  #: Name of the nominal robot.
    truth: str  #: What the simulated robot truly is: the name of a truth, or the robot file.
    data: Dataset  #: The readings.
    out: Path | None = None  #: The file that holds them; None if none was written.
    stopped_before: bool = False  #: Whether the arm stopped right before each configuration where a plan says so.

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it."""
        return {
            "robot": self.robot,
            "truth": self.truth,
            "configurations": self.data.configurations,
            "joints_are": self.data.joints_are,
            "readings": len(self.data.target),
            "targets": list(self.data.targets),
            "fixtures": list(self.data.fixtures),
            "stopped_before": self.stopped_before,
        }

    def lines(self) -> list[str]:
        """Return what was read."""
        data = self.data
        what = f"{counted(len(data.target), 'reading')} of {counted(len(data.targets), 'target')}"
        against = f" against {', '.join(data.fixtures)}" if data.fixtures else ""
        where = "" if self.out is None else f": {self.out}"
        many = counted(data.configurations, "configuration")
        said = [f"{many} of {self.robot} ({self.truth}), {what}{against}{where}"]
        if self.stopped_before:
            said.append("Before each the arm stopped at its approach_i; the order of the data counts these stops, too.")
        return said


@dataclass(frozen=True, eq=False, repr=False)
class DeviceList(Record):
    """The instruments that can be simulated and planned for."""

    devices: tuple[Device, ...]  #: In the order of the registry.

    def summary(self) -> dict[str, Any]:
        """Return name, words, deviation and source of each, as JSON holds them."""
        rows = [
            {"name": d.name, "summary": d.summary, "sigma_mm": d.sigma * 1e3, "source": d.source} for d in self.devices
        ]
        return {"devices": rows}

    def lines(self) -> list[str]:
        """Return one line an instrument."""
        width = max(len(device.name) for device in self.devices)
        return [f"{d.name:<{width}}  {d.summary}; deviation {d.sigma * 1e3:g} mm" for d in self.devices]


def devices() -> DeviceList:
    """List the instruments that can be simulated and planned for, with what each is good for."""
    return DeviceList(DEVICES)


def simulate(
    robot: Robot | str | Path,
    *,
    truth: Robot | str | Path,
    poses: int | Dataset | str | Path,
    out: str | Path | None = None,
    noise: float | None = None,
    device: str | None = None,
    seed: int = 0,
    payload: Payload | str | None = None,
    gravity: Sequence[float] | None = None,
    wrench: Wrench | Sequence[float] | str | None = None,
    wrench_frame: WrenchFrame | None = None,
    wrench_at: str | None = None,
    joints: JointsOf = "model",
    progress: Callable[[str], None] = lambda _: None,
) -> Simulation:
    """Measure a digital twin whose truth is known, with a simulated instrument.

    Configurations are measured in their order: what depends on the way the arm came, or on how long it has been moving,
    follows from it. Where the table of a plan says where to stop right before each (``approach_i``), the joints come
    from there. The data then count these stops in their order, so that no configuration follows another.

    Parameters
    ----------
    robot
        The nominal robot, or what :func:`truearm.load_robot` takes.
    truth
        ``nominal``; ``random``, geometry and joint zeros drawn from their priors; ``gear-errors`` or ``tooth-errors``,
        the same with errors of encoders and gears; the name of a truth in the robot's file; or another robot or its
        file, with its own base and targets if it has targets.
    poses
        How many configurations, drawn evenly within the limits; or a file or dataset whose configurations are measured,
        such as :func:`truearm.poses` or :func:`truearm.plan` writes.
    out
        Canonical CSV file to write; None writes nothing.
    noise
        Standard deviation of a reading [m], 0 for none; None for the deviation of the device.
    device
        Name of the instrument, of ``truearm.devices()``; None for one that sees every target everywhere. For
        inclinometers there is :func:`truearm.simulate_inclinometers`.
    seed
        Of configurations, noise and a random truth.
    payload, gravity
        What the robot truly carries (an object, or a text such as ``2.7kg,50mm,25mm,100mm``) and free fall in its base
        frame [m/s^2]; None for what its file says.
    wrench, wrench_frame
        External force and moment, the same at every configuration, and whose axes it is given in, as for
        :func:`truearm.inverse`. The data say what it was on the flange, ``force_x`` to ``moment_z``.
    wrench_at
        The target on which it acts, or ``flange``; None where there is one target.
    joints
        Whose joint positions the data hold: the ``model``'s, or as the ``controller`` shows them.
    progress
        Called with a few words at each step.

    Raises
    ------
    InputError
        For anything that cannot be used, with a message that says what to do.
    """
    progress_argument(progress)
    if noise is None and device is None:
        raise InputError("no noise is given", parameter="noise", cure="Give `noise`, or a `device`.")
    instrument = None if device is None else device_argument(device)
    sigma = 0.0 if instrument is None else instrument.sigma
    if noise is not None:
        sigma = deviation_argument(noise, "noise") if finite_number(noise, "noise", lowest=0.0) else 0.0
    given = isinstance(poses, Dataset | str | Path)
    count = 0 if given else count_argument(poses, "poses")
    if given and instrument is not None:
        raise InputError(
            "a device finds its own configurations",
            parameter="poses, device",
            came=f"{device} and {poses if isinstance(poses, str | Path) else poses.source}",  # type: ignore[union-attr]
            cure="Give a number of `poses`, or leave `device` out and give the `noise`.",
        )
    if not isinstance(truth, Robot):
        if not isinstance(truth, str | Path):
            raise wrong_kind(
                "a truth belongs here",
                truth,
                "truth",
                "nominal, random, gear-errors, tooth-errors, a truth's name, or a robot",
            )
        path_argument(truth, "truth")
    file = None if out is None else file_for(out, robot, truth, poses)
    rng = np.random.default_rng(whole_argument(seed, "seed"))
    nominal = robot_argument(robot)
    joints_are = joints_argument(choice_argument(joints, "joints", JOINTS_OF), nominal)
    wanted = configurations_argument(nominal, poses, "poses") if given else None
    stops = stops_argument(nominal, poses, "poses") if given else None
    count = count if wanted is None else wanted.configurations
    with refusals_of("truth"):
        twin = truth_twin(nominal, truth, rng)
    twin = replace(twin, robot=twin.robot.with_payload(payload_argument(payload), gravity_argument(gravity)))
    twin = replace(twin, robot=pushed_at_argument(twin.robot, wrench_argument(wrench, wrench_frame), wrench_at))
    seen = twin.robot if instrument is None else in_view_of(instrument, twin.robot)
    refuse_beyond("readings", count * len(seen.targets), parameter="poses")
    progress(f"measuring {count} configurations")
    if wanted is not None:
        conditions = Conditions() if stops is None else _stopped_before(wanted, stops)
        data = replace(measure(twin, wanted.joints, sigma, rng, **conditions), labels=wanted.labels)
    elif instrument is None:
        data = measure(twin, nominal.random_configurations(count, rng), sigma, rng)
    else:
        data = measured_with(instrument, nominal, twin, count, rng, sigma)
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


def _stopped_before(wanted: Dataset, stops: Dataset) -> Conditions:
    """Return how the arm comes to configurations, each from where it stops right before: that stop is one, too."""
    places = places_after_stops(wanted.configurations)
    return Conditions(approach=approach_from(stops.joints, wanted.joints), number=before_each(places))
