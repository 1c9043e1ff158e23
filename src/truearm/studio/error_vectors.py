"""The errors that a result's figures are made of, as vectors: where they were read, before and after."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.base.files import confined_reads
from truearm.engine.data.statistics import Errors, errors_of
from truearm.engine.robot.chain import Array
from truearm.studio.tasks import Progress

#: Figures of the result and of these vectors are the same within [mm].
_SAME = 1e-6


@dataclass(frozen=True, eq=False)
class ErrorVectors:
    """Errors of positions on the configurations that the fit has not seen; of all, if it has seen all."""

    points: Array  #: Where the instrument saw the targets, in its frame [m], ``(readings, 3)``.
    #: before, after: predicted minus measured of the nominal robot, placed as well as it can be, and of the calibrated
    #: one [m], ``(readings, 3)``; NaN where nothing was read.
    before: Array
    after: Array
    held_out: bool  #: Whether the fit has not seen them.

    def between(self, share: float) -> Array:
        """Return the errors on the way from before, 0, to after, 1."""
        return (1.0 - share) * self.before + share * self.after


def error_vectors(folder: Path, robot: str, data: str, result: str, progress: Progress, **options: Any) -> ErrorVectors:
    """Return the errors of a result in the project.

    Args:
        result: Folder of the result.
        options: Of :func:`truearm.calibrate`, those that say what it trains on, by which loss the nominal robot is
            placed, and what it carries.

    Raises:
        InputError: If the result is of other measurements, they were split otherwise, or it is of another robot: the
            errors would not be those of its figures.
    """
    from truearm.calibration.calibrate import calibrate
    from truearm.engine.robot.library import load_robot

    os.chdir(folder)
    with confined_reads(folder):
        progress("placing the nominal robot")
        given = {name: value for name, value in options.items() if value is not None}
        placed = calibrate(robot, data, model="frames", **given)
        seen = placed.held_out if len(placed.held_out) else placed.training
        part = placed.data.of_configurations(seen)
        after = errors_of(load_robot(Path(result) / "calibrated.yaml"), part)
        figures = json.loads((Path(result) / "result.json").read_text(encoding="utf-8"))
    if after.position is None:
        raise InputError("no positions were read, so there are no errors of them to draw", where=data)
    if not _are_those(after, figures["validation" if len(placed.held_out) else "train"]):
        raise InputError(
            "the result is of other measurements than those that are chosen, or they were split otherwise",
            where=result,
            cure="Calibrate again, and draw the errors then.",
        )
    if not _are_those(placed.nominal, figures["nominal"]):
        raise InputError(
            "the robot that is chosen has other errors before the calibration than the result says: its file was "
            "changed, or it was placed otherwise, as by another loss",
            parameter="robot",
            where=result,
            cure="Calibrate again, and draw the errors then.",
        )
    before = placed.nominal.position_errors
    if before.shape != after.position_errors.shape:
        before = np.full(after.position_errors.shape, np.nan)
    return ErrorVectors(part.position, before, after.position_errors, bool(len(placed.held_out)))


def _are_those(errors: Errors, said: dict[str, Any] | None) -> bool:
    """Return whether errors of positions are those of which a result holds the figures."""
    found, figures = errors.position, (said or {}).get("position_mm")
    if found is None or figures is None:
        return found is None and figures is None
    pairs = ((found.mean, "mean"), (found.rms, "rms"), (found.max, "max"))
    return all(abs(value * 1e3 - figures[name]) <= _SAME for value, name in pairs)
