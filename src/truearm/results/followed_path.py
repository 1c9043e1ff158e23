"""A path followed: joint positions over time, corrected ones, and programs."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from truearm.compensation.corrected_path import KNOWLEDGE, STAGES, CorrectedPath, Knowledge
from truearm.compensation.corrected_targets import LedgerEntry, remember
from truearm.modeling.chain import Array
from truearm.modeling.controller import JointsOf
from truearm.modeling.formats.joint_columns import counting, joint_cells, joint_headings
from truearm.modeling.robot import Robot
from truearm.notices import Notice
from truearm.results.record import Record, joints_lines, notice_lines, notice_summaries
from truearm.shown import counted
from truearm.writing import output_folder, write_files

#: Files that are always written.
MOTION: Final = "motion.csv"
REPORT: Final = "report.html"
#: Written for a calibrated robot, and for one with masses.
CORRECTED: Final = "corrected.csv"
LOADS: Final = "loads.csv"


@dataclass(frozen=True, eq=False, repr=False)
class FollowedPath(Record):
    """The joint motion along a path, and what corrects it."""

    robot: Robot  #: The robot, with what it carries.
    path: CorrectedPath  #: The path, its joint motions and the errors that the calibrated robot predicts along it.
    programs: Mapping[str, str]  #: Texts of programs by the names of their files.
    command: str  #: How to run it again.
    warnings: tuple[Notice, ...] = ()  #: What to know about it.
    inputs: tuple[Path, ...] = ()  #: The files that were read: none of them is overwritten.
    #: Whose joint positions the files hold: the ``model``'s, or those that the ``controller`` shows.
    joints_are: JointsOf = "model"
    #: Where the targets of corrected programs are remembered, and what; None for nowhere.
    ledger: tuple[Path, tuple[LedgerEntry, ...]] | None = None

    @property
    def joints(self) -> Array:
        """Joint positions to command, of the model, ``(n, joints)`` [rad or m]."""
        return self.path.joints[self.path.best]

    @property
    def stages(self) -> tuple[Knowledge, ...]:
        """What the corrections that were made know, from nothing to most."""
        return tuple(name for name in KNOWLEDGE if name in self.path.joints)

    def summary(self) -> dict[str, Any]:
        """Return it as JSON holds it: lengths in mm, times in s."""
        path = self.path
        trajectory = path.planned.trajectory
        return {
            "samples": len(trajectory.time),
            "seconds": float(trajectory.time[-1]),
            "length_mm": float(trajectory.distance[-1]) * 1e3,
            "sections": list(path.planned.kinds),
            "frame": path.planned.frame,
            "calibrated": path.calibrated,
            "error_mm": {
                name: {"mean": float(path.errors[name].mean()) * 1e3, "max": float(path.errors[name].max()) * 1e3}
                for name in self.stages
                if path.calibrated
            },
            "joints_are": self.joints_are,
            "programs": list(self.programs),
            "warnings": notice_summaries(self.warnings),
        }

    @property
    def answer(self) -> tuple[str, str]:
        """What the path is, and what can be said of its correction."""
        path = self.path
        trajectory = path.planned.trajectory
        first = (
            f"{counted(len(path.planned.kinds), 'section')} ({', '.join(path.planned.kinds)}), "
            f"{trajectory.distance[-1] * 1e3:.1f} mm in {trajectory.time[-1]:.2f} s, "
            f"{counted(len(trajectory.time), 'sample')}."
        )
        if not path.calibrated:
            return first, "The robot is not calibrated: there is nothing to correct."
        return first, (
            "What is left after the last correction is what the model says of itself: the real robot misses the path "
            "by the model's error."
        )

    def lines(self) -> list[str]:
        """Return how long the path is, and how far the robot is from it before and after correction."""
        first, last = self.answer
        text = [first]
        if self.path.calibrated:
            text.append("Off the path, as the calibrated robot predicts it in motion:")
            wide = max(len(STAGES[name]) for name in self.stages)
            for name in self.stages:
                error = self.path.errors[name] * 1e3
                text.append(f"  {STAGES[name]:<{wide}}  mean {error.mean():.3f}  max {error.max():.3f} mm")
        return [*text, last, *joints_lines(self.joints_are), *notice_lines(self.warnings)]

    def motion_csv(self) -> str:
        """Return what the controller would command: time, section, joint positions, and where the tip shall be."""
        return self._csv(self.path.motion.joints, self.path.planned.trajectory.position, ())

    def corrected_csv(self) -> str:
        """Return the corrected joint positions, where the tip shall be, and the predicted error before and after."""
        path = self.path
        errors = (("error_before [mm]", path.errors["nothing"]), ("error_after [mm]", path.errors[path.best]))
        return self._csv(self.joints, path.planned.trajectory.position, errors)

    def loads_csv(self) -> str:
        """Return force and moment of the load at every joint along the path, in the joint's own axes."""
        loads = self.path.loads
        assert loads is not None
        names = [
            f"{kind}_{axis}_{joint} [{unit}]"
            for joint in range(1, len(loads) + 1)
            for kind, unit in (("force", "N"), ("moment", "N m"))
            for axis in "xyz"
        ]
        rows = loads.transpose(2, 0, 1).reshape(loads.shape[2], -1)
        return _table(
            ["time [s]", *names],
            [[repr(t), *(f"{v:.6g}" for v in row)] for t, row in zip(self._times(), rows.tolist(), strict=True)],
        )

    def contents(self) -> dict[str, str]:
        """Return the texts of all files by their names."""
        from truearm.reporting.path_page import path_page

        files = {MOTION: self.motion_csv()}
        if self.path.calibrated:
            files[CORRECTED] = self.corrected_csv()
        if self.path.loads is not None:
            files[LOADS] = self.loads_csv()
        return files | dict(self.programs) | {REPORT: path_page(self)}

    def save(self, folder: str | Path) -> tuple[Path, ...]:
        """Write all files into a folder; return them."""
        contents = self.contents()
        out = output_folder(folder, contents, self.inputs, "folder")
        if self.ledger is not None:
            remember(*self.ledger)
        write_files(out, contents, self.command)
        return tuple(out / name for name in contents)

    def _times(self) -> list[float]:
        return [round(t, 9) for t in self.path.motion.time.tolist()]

    def _csv(self, joints: Array, tip: Array, errors: tuple[tuple[str, Array], ...]) -> str:
        controller = counting(self.robot, self.joints_are)
        heading = ["time [s]", "section", *joint_headings(self.robot.joints, controller)]
        heading += [f"tip_{axis} [mm]" for axis in "xyz"] + [name for name, _ in errors]
        cells = joint_cells(joints, self.robot.joints, controller)
        millimetres = np.round(tip * 1e3, 6) + 0.0
        rows = []
        for row, time in enumerate(self._times()):
            cell = [repr(time), str(int(self.path.planned.section[row])), *cells[row]]
            rows.append([*cell, *map(repr, millimetres[row].tolist()), *(f"{v[row] * 1e3:.6f}" for _, v in errors)])
        return _table(heading, rows)


def _table(heading: list[str], rows: list[list[str]]) -> str:
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(heading)
    writer.writerows(rows)
    return stream.getvalue()
