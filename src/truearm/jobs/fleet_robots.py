"""One robot of a fleet that was measured: calibrated, and what was found of it as a row."""

from __future__ import annotations

import time

from truearm.errors import InputError
from truearm.fleets.entries import RobotEntry
from truearm.fleets.rows import Accuracy, FoundParameter, Row
from truearm.jobs.calibrate import calibrate
from truearm.measurement.statistics import Errors
from truearm.modeling.parameters import PLACES


def calibrated_row(entry: RobotEntry) -> Row:
    """Calibrate a robot that was measured; what cannot be calibrated is a row too, with the reason."""
    began = time.perf_counter()
    try:
        made = calibrate(entry.robot, entry.data, **entry.options)
    except InputError as error:
        return Row(entry.name, "failed", str(error), entry.of, entry.date, seconds=time.perf_counter() - began)
    found = made.fit.robot.parameters
    return Row(
        entry.name,
        "calibrated",
        "",
        entry.of,
        entry.date,
        held_out=_accuracy(made.validation),
        nominal=_accuracy(made.nominal),
        parameters={
            name: FoundParameter(p.unit, p.value, p.deviation or 0.0, p.nominal, p.prior)
            for name, p in found.items()
            if name in made.fit.free.names and p.group not in PLACES
        },
        fit_status=made.fit.status.value,
        notices=tuple(notice.code for notice in made.warnings),
        seconds=time.perf_counter() - began,
    )


def _accuracy(errors: Errors | None) -> Accuracy | None:
    if errors is None or errors.position is None:
        return None
    return Accuracy.of_spread(errors.position, errors.configurations)
