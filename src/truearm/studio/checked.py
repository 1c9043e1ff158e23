"""Measurements of the project that were checked, and where each of their readings is drawn."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError, Notice, worst_first
from truearm.engine.base.files import confined_reads
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.excluded import Exclusion, Read, numbers_read
from truearm.engine.robot.chain import Array
from truearm.studio.tasks import Outcome, Progress

#: The nominal robot is placed by so many configurations at most: to draw points, more are not needed.
_PLACED_BY = 400


@dataclass(frozen=True, eq=False)
class Checked:
    """What a check found, and the readings that it looked at, the excluded ones too."""

    outcome: Outcome  #: What its command prints.
    findings: tuple[Notice, ...]  #: Its notices, the worst first.
    readings: tuple[tuple[str, str], ...]  #: Label of the configuration and name of the target of each reading.
    #: Where the instrument saw it, in the robot's base frame as far as that is known [m], ``(readings, 3)``; NaN where
    #: it read no place of its own.
    points: Array
    read: tuple[Read, ...]  #: What each reading is, as the file of excluded readings notes it.
    joints: Array  #: Of the model at each reading's configuration [rad or m], ``(readings, joints)``.

    def rows_of(self, named: tuple[tuple[str, str], ...]) -> NDArray[np.intp]:
        """Return which readings are named; an empty target names all of its configuration."""
        whole = {label for label, target in named if not target}
        wanted = set(named)
        found = [k for k, reading in enumerate(self.readings) if reading in wanted or reading[0] in whole]
        return np.array(found, dtype=np.intp)

    def named(self, rows: Sequence[int]) -> dict[tuple[str, str], tuple[Read, ...]]:
        """Return the names of readings, and what all readings of each name are."""
        found: dict[tuple[str, str], tuple[Read, ...]] = {self.readings[k]: () for k in rows}
        for name, read in zip(self.readings, self.read, strict=True):
            if name in found and read:
                found[name] += (read,)
        return found


def checked(folder: Path, robot: str, data: str, exclude: str | None, progress: Progress) -> Checked:
    """Say what is wrong with measurements: :func:`truearm.check`."""
    from truearm.checking.check import check
    from truearm.engine.command.loading import load_data

    os.chdir(folder)
    progress("comparing the readings with the robot")
    with confined_reads(folder):
        data_check = check(robot, data, exclude=exclude)
        progress("finding where the robot stands")
        read = load_data(data, robot)
        base = _base(robot, data_check.data)
    parts = [read] if read.references is None else [read, read.references]
    points = np.concatenate([np.where(part.has_position[:, None], part.position, np.nan) for part in parts])
    if base is not None:
        rotation, translation = base
        points = (points - translation) @ rotation
    return Checked(
        Outcome(tuple(data_check.lines()), data_check.warnings),
        worst_first(data_check.warnings),
        tuple(
            (part.labels[c], part.targets[t])
            for part in parts
            for c, t in zip(part.configuration.tolist(), part.target.tolist(), strict=True)
        ),
        points,
        tuple(numbers for part in parts for numbers in numbers_read(part)),
        np.concatenate([read.joints[part.configuration] for part in parts]),
    )


def with_exclusions(
    before: tuple[Exclusion, ...], named: Mapping[tuple[str, str], tuple[Read, ...]], reason: str
) -> tuple[Exclusion, ...]:
    """Return excluded readings with some more; those that are excluded already keep their reason.

    Args:
        named: Of the further ones, as :meth:`Checked.named` returns them.

    Raises:
        InputError: If no reason is given.
    """
    text = " ".join(reason.split())
    if not text:
        raise InputError(
            "a reading is excluded for a reason",
            parameter="Reason",
            came=reason,
            allowed="what went wrong with the instrument, such as: beam broken",
        )
    known = {(one.configuration, one.target) for one in before}
    return (*before, *(Exclusion(*one, text, read=read) for one, read in named.items() if one not in known))


def _base(robot: str, data: Dataset) -> tuple[Array, Array] | None:
    """Return rotation and translation of the robot's base in the world, found by the readings; None if they do not."""
    from truearm.engine.fit.fit import place
    from truearm.engine.robot.library import load_robot

    some = np.unique(np.linspace(0, data.configurations - 1, min(data.configurations, _PLACED_BY)).round().astype(int))
    try:
        transform = place(load_robot(robot), data.of_configurations(some), "cauchy").base
    except InputError:
        return None
    return transform.rotation, np.array(transform.translation)
