"""A robot found axis by axis, from circles: its axes, frames, tables of parameters and joint errors."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from truearm.axis_circles.fit import NORMAL_95, TABLES, AxisAnalysis, AxisCircle, AxisFit, analyse
from truearm.engine.base.errors import InputError, Notice, counted, refusals_of
from truearm.engine.base.units import SHOWN_AS, from_si
from truearm.engine.base.writing import output_folder, write_files
from truearm.engine.command.arguments import (
    files_of,
    folder_for,
    readings_argument,
    refuse_swapped,
    robot_argument,
)
from truearm.engine.document.document import Block, Words, detail, each, say, under
from truearm.engine.document.records import Record
from truearm.engine.fit.problem import Redundancy, in_words
from truearm.engine.robot.conversion import converted
from truearm.engine.robot.lines import joint_axes
from truearm.engine.robot.parameters import FreeParameters, Parameter
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.robot.transform import Transform

if TYPE_CHECKING:
    from truearm.axis_circles.axes import Axes

#: What an axis-by-axis calibration writes into its folder.
AXIS_FILES: Final = ("calibrated.yaml", "joint-errors.yaml", "axes.json")


@dataclass(frozen=True, eq=False, repr=False)
class AxisCalibration(Record):
    """A robot found axis by axis."""

    analysis: AxisAnalysis  #: Circles, axes and the fits of the robot's parameters.
    inputs: tuple[Path, ...] = ()  #: The files that were read: none of them is overwritten.

    @property
    def robot(self) -> Robot:
        """The calibrated robot in its own convention, with base and targets."""
        return self.analysis.robot

    @property
    def robot_with_errors(self) -> Robot:
        """The robot as its design with joint errors, with base and targets."""
        return self.analysis.robot_with_errors

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """What to know about the result, in plain words."""
        return self.analysis.notices

    @property
    def written(self) -> tuple[str, ...]:
        """Names of the files that hold it."""
        return AXIS_FILES

    def blocks(self) -> Iterator[Block]:
        """Give the circles, the axes, and the robot's parameters and joint errors, in mm, deg and mrad."""
        axis_analysis = self.analysis
        yield say(
            truearm="truearm-axes/1",
            robot=axis_analysis.nominal.name,
            configurations=axis_analysis.data.configurations,
            left_out=axis_analysis.found.left_out,
            frame="robot" if axis_analysis.in_robot_frame else "instrument",
            declared=axis_analysis.found.declared,
            excess=axis_analysis.found.excess,
        )
        yield detail(
            "joint  target  points   arc [deg]  radius [mm]  axis +/- [mm]  [mrad]  tangential [mm]  backlash [deg]"
        )
        yield each("circles", map(_circle, axis_analysis.found.circles))
        yield say(
            axes=self._axes(),
            base=_placed(axis_analysis.base),
            flange=_placed(axis_analysis.flange),
            targets={t.name: [self.robot.values[t.parameter(a)] * 1e3 for a in "xyz"] for t in self.robot.targets},
            tables=self._tables,
        )
        yield under("joint_errors", joint_errors(axis_analysis.errors))

    @cached_property
    def _tables(self) -> dict[str, Any]:
        return {name: self._table(name) for name in TABLES}

    def save(self, folder: str | Path) -> tuple[Path, ...]:
        """Write ``calibrated.yaml``, ``joint-errors.yaml`` and ``axes.json`` into a folder.

        Returns:
            The files written.
        """
        folder = output_folder(folder, AXIS_FILES, self.inputs, ours=True)
        files = {
            "calibrated.yaml": robot_text(self.robot),
            "joint-errors.yaml": robot_text(self.robot_with_errors),
            "axes.json": json.dumps(self.summary(), indent=2, allow_nan=False) + "\n",
        }
        write_files(folder, files)
        return tuple(folder / name for name in files)

    def _axes(self) -> list[dict[str, Any]]:
        measured = self.analysis.measured
        axes = []
        for number, axis in enumerate(joint_axes(measured.robot), 1):
            parameters = [p for p in measured.free.parameters if p.name.endswith(f"_{number}")]
            axes.append(
                {
                    "joint": number,
                    "direction": axis.along.tolist(),
                    "point_mm": (axis.point * 1e3).tolist(),
                    "point_deviation_mm": max(p.deviation or 0.0 for p in parameters if p.unit == "m") * 1e3,
                    "direction_deviation_mrad": max(p.deviation or 0.0 for p in parameters if p.unit == "rad") * 1e3,
                }
            )
        return axes

    def _table(self, name: str) -> dict[str, Any]:
        nominal = self.analysis.nominal
        try:
            rows = self.analysis.table(name)
        except InputError as refusal:
            return {"refused": str(refusal)}
        convention = converted(nominal, name).convention
        units = [convention.row_units(joint.kind) for joint in nominal.joints]
        return {
            "rows": [
                {
                    column: {
                        "unit": SHOWN_AS[unit[column]],
                        "value": from_si(value, SHOWN_AS[unit[column]]),
                        "deviation": from_si(deviation, SHOWN_AS[unit[column]]),
                    }
                    for column, (value, deviation) in row.items()
                }
                for row, unit in zip(rows, units, strict=True)
            ]
        }


def joint_errors(fit: AxisFit) -> Iterator[Block]:
    """Give what a fit in joint errors says: what was found, of what, and what circles cannot observe."""
    everything = FreeParameters((*fit.free.parameters, *(fit.robot.parameters[r.dropped] for r in fit.redundancies)))
    parameters = [p for p in fit.free.parameters if p.group != "base"]
    unseen = f"{counted(len(fit.redundancies), 'combination')} of errors unobservable with circles and held"
    yield say(f"Joint errors: {len(parameters)} found, in 95 % intervals; {unseen}:")
    yield each(
        "found", (_joint_error(p, in_words(fit.combination(p.name), everything, summed=True)) for p in parameters)
    )
    yield detail("Unobservable with circles, and held at their nominal values:")
    yield each("unseen", (_unseen(r, moves_flange=r.dropped in fit.moving_flange) for r in fit.redundancies))


def _unseen(redundancy: Redundancy, *, moves_flange: bool) -> Words:
    words = f"  {redundancy.combination}{' (moves the flange)' if moves_flange else ''}"
    return detail(words, name=redundancy.dropped, combination=redundancy.combination, moves_flange=moves_flange)


def _joint_error(p: Parameter, words: str) -> Words:
    unit, half = SHOWN_AS[p.unit], NORMAL_95 * (p.deviation or 0.0)
    value, low, high = (from_si(v, unit) for v in (p.value, p.value - half, p.value + half))
    line = f"  {words:<24} {value:9.4f} {unit:<4} {low:9.4f} to {high:.4f}"
    figures = {"value": value, "deviation": from_si(p.deviation or 0.0, unit), "interval": [low, high], "is": words}
    return say(line, name=p.name, unit=unit, **figures)


def _circle(measured: AxisCircle) -> Words:
    turn, circle = measured.turn, measured.circle
    c = {
        "joint": measured.joint,
        "target": measured.target,
        "points": len(turn.joint_position),
        "arc_deg": math.degrees(circle.arc),
        "centre_mm": (circle.centre * 1e3).tolist(),
        "centre_deviation_mm": circle.centre_deviation * 1e3,
        "direction": circle.normal.tolist(),
        "direction_deviation_mrad": circle.tilt_deviation * 1e3,
        "radius_mm": circle.radius * 1e3,
        "radius_deviation_mm": circle.radius_deviation * 1e3,
        "radial_range_mm": float(np.ptp(circle.radial)) * 1e3,
        "axial_range_mm": float(np.ptp(circle.axial)) * 1e3,
        "tangential_range_mm": turn.tangential * 1e3,
        "angular_range_deg": math.degrees(turn.angular),
        "backlash_deg": None if turn.backlash is None else math.degrees(turn.backlash),
    }
    lag = "" if c["backlash_deg"] is None else f"{c['backlash_deg']:.4f}"
    line = (
        f"{c['joint']:<6} {c['target']:<7} {c['points']:<8} {c['arc_deg']:<10.1f} {c['radius_mm']:<12.3f} "
        f"{c['centre_deviation_mm']:<14.4f} {c['direction_deviation_mrad']:<7.3f} "
        f"{c['tangential_range_mm']:<16.4f} {lag}"
    )
    return detail(line.rstrip(), **c)


def _placed(place: tuple[Transform, float, float]) -> dict[str, Any]:
    transform, slide, turn = place
    return {
        "translation_mm": [v * 1e3 for v in transform.translation],
        "quaternion": list(transform.quaternion),
        "translation_deviation_mm": slide * 1e3,
        "rotation_deviation_mrad": turn * 1e3,
    }


def found_axes(asked: Axes) -> AxisCalibration:
    """Find a robot's axes from circles, and write what they say of it."""
    refuse_swapped(asked.robot, asked.data, "axes")
    folder = None if asked.out is None else folder_for(AXIS_FILES, asked.out, asked.robot, asked.data, ours=True)
    nominal = robot_argument(asked.robot)
    readings = readings_argument(nominal, asked.data)
    asked.progress("fitting circles and axes")
    with refusals_of("data"):
        axis_calibration = AxisCalibration(
            analyse(nominal, readings, in_robot_frame=asked.measurement_frame == "robot"),
            files_of(asked.robot, asked.data),
        )
    if folder is not None:
        asked.progress("writing the files")
        axis_calibration.save(folder)
    return axis_calibration
