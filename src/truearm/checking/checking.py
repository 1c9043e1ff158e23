"""Checks of measurements before a calibration."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from truearm.engine.base.errors import InputError, Notice, has_error, listed
from truearm.engine.base.units import Marked, parts_of
from truearm.engine.command.arguments import (
    data_argument,
    device_argument,
    readings_argument,
    refuse_swapped,
    robot_argument,
)
from truearm.engine.command.reading import count_excluded, excluded_notices, without_excluded
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import errors_of
from truearm.engine.diagnose.changes import notices_of_change, what_moved
from truearm.engine.diagnose.data_check import compared_with
from truearm.engine.diagnose.next_step import NextStep
from truearm.engine.diagnose.next_steps import steps_after_check
from truearm.engine.diagnose.unmodelled import LeftOver
from truearm.engine.document.document import Block, say
from truearm.engine.document.records import Record

if TYPE_CHECKING:
    from truearm.checking.check import Check


@dataclass(frozen=True, eq=False, repr=False)
class DataCheck(Record):
    """What was found wrong with measurements."""

    data: Dataset  #: The measurements.
    warnings: tuple[Notice, ...]  #: One notice for each kind of fault; none for believable data.
    next: tuple[NextStep, ...] = ()  #: What to do next, three steps at most, the most useful first.
    simulated_from: tuple[Marked, ...] = ()  #: What of measurements and robot comes from a virtual instrument.

    def blocks(self) -> Iterator[Block]:
        """Give what was read, and whether anything is wrong with it."""
        data = self.data
        yield say(
            f"{data.source}: {data.configurations} configurations, targets {listed(data.targets)}",
            configurations=data.configurations,
            targets=list(data.targets),
        )
        if not self.warnings:
            yield say(self._clean)

    @property
    def _clean(self) -> str:
        """What is said where nothing has a name; configurations may be off all the same."""
        if any(step.gain is not None and step.code == "measure-again" for step in self.next):
            return "Nothing looks wrong but the configurations named next."
        return "Nothing looks wrong."


def checked(asked: Check) -> DataCheck:
    """Read the measurements, by themselves or beside a robot, and say what is wrong with them."""
    robot, data = (None, asked.robot) if asked.data is None else (asked.robot, asked.data)
    asked.progress("checking")
    refuse_swapped(robot, data, "check")
    against = None if robot is None else robot_argument(robot)
    measured = data_argument(data) if against is None else readings_argument(against, data)
    measured, excluded = without_excluded(measured, asked.exclude)
    parts = [measured] if measured.references is None else [measured, measured.references]
    if not any(part.has_reading.any() for part in parts):
        raise InputError(
            "there is no reading", parameter="data", where=measured.source, cure="Fill in x, y and z, or distance."
        )
    device = None if asked.device is None else device_argument(asked.device)
    noticed, fit, part = compared_with(measured, against, device, excluded=count_excluded(excluded))
    noticed, marks = (*noticed, *excluded_notices(excluded)), parts_of((measured, against))
    if fit is None or part is None:
        return DataCheck(measured, noticed, steps_after_check(noticed, robot=against is not None), marks)
    left = LeftOver.of(fit, part)
    moved = None if has_error(noticed) else what_moved(left)
    if moved is not None:
        noticed = (*noticed, *notices_of_change(*moved))
    return DataCheck(measured, noticed, steps_after_check(noticed, left, errors_of(fit.robot, part), moved), marks)
