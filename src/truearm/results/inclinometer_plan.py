"""Which postures inclinometers are read in, under which loads, and what an instrument of that kind reads of a twin."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from truearm.library.wider_limits import wider_limits_notices
from truearm.measurement.dataset import Dataset
from truearm.measurement.inclinometer import Inclinations
from truearm.measurement.readers.canonical import csv_text
from truearm.measurement.readers.inclinations import inclinations_text
from truearm.modeling.controller import JointsOf
from truearm.modeling.formats.joint_columns import counting, joint_cells, joint_headings
from truearm.modeling.robot import Robot
from truearm.notices import Notice
from truearm.planning.choosing.inclinometer import TiltingPlan
from truearm.planning.driving.tour import Tour
from truearm.planning.driving.tour_table import tour_csv, tour_words
from truearm.results.record import Record, joints_lines, notice_lines, notice_summaries
from truearm.results.tour_files import tour_summary, ways_beside
from truearm.shown import counted, listed
from truearm.units import SHOWN_AS, from_si
from truearm.writing import output_file, write_files

#: What the poses under a load are called, beside what inclinometers read.
PUSHED: Final = "-pushed"


def pushed_file(file: Path) -> Path:
    """Return where the poses under a load are written, beside a file of inclinations."""
    return file.with_name(f"{file.stem}{PUSHED}{file.suffix}")


@dataclass(frozen=True, eq=False, repr=False)
class InclinometerPlan(Record):
    """Configurations in which inclinometers are read, in pairs, and poses under a load for what they do not see."""

    robot: Robot  #: With its payload.
    made: TiltingPlan  #: The pairs, and how accurate every constant of the joints will be.
    pull: float  #: Force on the flange [N], 0 for gravity alone.
    command: str  #: How to run it again.
    tour: Tour  #: How the configurations are driven, each way checked.
    inputs: tuple[Path, ...] = ()  #: The files that were read: none of them is overwritten.
    #: Whose joint positions the file holds: the ``model``'s, or those that the ``controller`` shows.
    joints_are: JointsOf = "model"
    replaced: tuple[Notice, ...] = ()  #: What to know of another plan that it was written over.

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """What to know of its ways, and of the files."""
        return (*self.tour.notices, *wider_limits_notices(self.robot), *self.replaced)

    def _expected(self) -> list[tuple[str, str, float, float]]:
        """Return name, unit, deviation to expect and prior of each constant, as they are shown."""
        known = self.robot.with_effects(sorted({name.rpartition("_")[0] for name in self.made.expected})).parameters
        rows = []
        for name, deviation in self.made.expected.items():
            unit = SHOWN_AS[known[name].unit]
            rows.append((name, unit, from_si(deviation, unit), from_si(known[name].prior, unit)))
        return rows

    @property
    def unseen(self) -> tuple[str, ...]:
        """Constants that stay about as unknown as they were."""
        return tuple(name for name, _, deviation, prior in self._expected() if deviation > 0.7 * prior)

    def summary(self) -> dict[str, Any]:
        """Return the figures as JSON holds them."""
        return {
            "inclined": 2 * len(self.made.inclined),
            "posed": 2 * len(self.made.posed),
            "pull_n": self.pull,
            "joints_are": self.joints_are,
            "ways": tour_summary(self.tour, self.robot, self.joints_are),
            "expected": [
                {"name": name, "unit": unit, "deviation": deviation, "prior": prior}
                for name, unit, deviation, prior in self._expected()
            ],
            "unseen": list(self.unseen),
            "warnings": notice_summaries(self.warnings),
        }

    def lines(self) -> list[str]:
        """Return what was chosen, and how accurate every constant will be."""
        how = f"under pulls of {self.pull:g} N at the flange" if self.pull else "by gravity alone"
        text = [f"{counted(2 * len(self.made.inclined), 'configuration')} for inclinometers, in pairs, {how}."]
        if len(self.made.posed):
            text.append(
                f"{counted(2 * len(self.made.posed), 'configuration')} for poses, in pairs under pulls: they tell what "
                "inclinometers cannot see, the turn of a joint about a vertical axis."
            )
        text += tour_words(self.tour, self.robot, self.joints_are)
        for name, unit, deviation, prior in self._expected():
            known = "stays unknown" if name in self.unseen else f"known to {deviation:.2g} {unit}"
            text.append(f"  {name:<14} {known} (before: {prior:.2g} {unit})")
        return [*text, *joints_lines(self.joints_are), *notice_lines(self.warnings)]

    def csv_text(self) -> str:
        """Return the plan as CSV: one row a configuration, in the order of measurement, and what is read there."""
        joints, controller = self.robot.joints, counting(self.robot, self.joints_are)
        stream = io.StringIO()
        writer = csv.writer(stream, lineterminator="\n")
        forces = [f"force_{axis} [N]" for axis in "xyz"]
        writer.writerow(["configuration", "order", *joint_headings(joints, controller), *forces, "reads"])
        number = 0
        for pairs, reads in ((self.made.inclined, "inclinations"), (self.made.posed, "positions")):
            if not len(pairs):
                continue
            at, wrench = pairs.joints_in_turn()
            for cells, force in zip(joint_cells(at, joints, controller), (wrench[:, :3] + 0.0).tolist(), strict=True):
                number += 1
                writer.writerow([number, number, *cells, *(f"{part:g}" for part in force), reads])
        return stream.getvalue()

    def save(self, file: str | Path) -> tuple[Path, ...]:
        """Write the plan as CSV, and every stop on the ways in a second one.

        Returns:
            The files written; the second ends in ``-ways.csv``.
        """
        table = output_file(file, self.inputs, ours=True)
        ways = output_file(ways_beside(table), self.inputs, ours=True)
        stops = tour_csv(self.tour, self.robot, self.joints_are)
        write_files(table.parent, {table.name: self.csv_text(), ways.name: stops}, self.command)
        return table, ways


@dataclass(frozen=True, eq=False, repr=False)
class InclinometerSimulation(Record):
    """What inclinometers read of a simulated robot, and its poses under loads that push the joints both ways."""

    robot: str  #: Name of the nominal robot.
    truth: str  #: What the simulated robot truly is: the name of a truth, or the robot file.
    inclinations: Inclinations  #: The readings.
    #: Positions of the targets in pairs of configurations under two loads; None where nothing pulls.
    pushed: Dataset | None = None
    #: The file that holds the readings, see :func:`pushed_file` for the poses; None if none was written.
    out: Path | None = None

    @property
    def files(self) -> tuple[Path, ...]:
        """The files written."""
        if self.out is None:
            return ()
        return (self.out,) if self.pushed is None else (self.out, pushed_file(self.out))

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it."""
        return {
            "robot": self.robot,
            "truth": self.truth,
            "configurations": len(self.inclinations.labels),
            "instruments": list(self.inclinations.instruments.names),
            "joints_are": self.inclinations.joints_are,
            "angles": int(np.isfinite(self.inclinations.angle).sum()),
            "pushed": 0 if self.pushed is None else self.pushed.configurations,
        }

    def lines(self) -> list[str]:
        """Return what was read."""
        read = self.inclinations
        many, angles = counted(len(read.labels), "configuration"), int(np.isfinite(read.angle).sum())
        where = f": {listed([str(file) for file in self.files])}" if self.files else ""
        text = f"{many} of {self.robot} ({self.truth}), {angles} angles of {len(read.instruments)} inclinometers"
        if self.pushed is not None:
            text += f"; {counted(self.pushed.configurations, 'configuration')} for poses under loads"
        return [text + where]

    def texts(self) -> dict[str, str]:
        """Return what its files hold, by name."""
        if self.out is None:
            return {}
        held = {self.out.name: inclinations_text(self.inclinations)}
        return held if self.pushed is None else held | {pushed_file(self.out).name: csv_text(self.pushed)}
