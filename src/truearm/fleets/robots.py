"""One robot of a fleet that was measured: calibrated, and what was found of it as a row."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from pydantic import ValidationError
from pydantic_core import to_json

from truearm.calibration.calibrate import calibrate
from truearm.calibration.result import Calibration
from truearm.engine.base.errors import InputError
from truearm.engine.base.files import noted_reads, read_bytes
from truearm.engine.base.manifest import hash_of
from truearm.engine.data.statistics import Errors
from truearm.engine.robot.parameters import PLACES, SCALE_GROUP
from truearm.fleets.entries import RobotEntry
from truearm.fleets.part_schema import rows_of
from truearm.fleets.recorded import ROBOTS
from truearm.fleets.series import Accuracy, FoundParameter, FoundParameters, Row

#: Decimals of a covariance in priors: what a combination of two parameters is known by is seen to a hundredth of a
#: micrometre where each alone is known to a millimetre.
_DECIMALS: Final = 10
#: What belongs to the campaign and not to the robot.
_OF_CAMPAIGN: Final = (*PLACES, SCALE_GROUP)


@dataclass(frozen=True)
class Done:
    """What was done with a robot that was measured."""

    row: Row  #: What was found.
    written: tuple[str, ...] = ()  #: Files that were written, from the folder of the fleet.
    #: Whether its files are others than those that the manifest meant: then the row says nothing but that.
    changed: bool = False


def calibrated_robot(entry: RobotEntry, folder: Path | None = None) -> Done:
    """Calibrate a robot that was measured; what cannot be calibrated is a row too, with the reason.

    Args:
        folder: Of the fleet: the robot's report and calibrated robot are written into ``robots/NAME`` there; None
            writes nothing.

    Raises:
        InputError: If that cannot be written.
    """
    began = time.perf_counter()
    stated = {"date": entry.date, "serial": entry.of}
    notes = {name: text for name, text in stated.items() if text is not None}
    message, changed, result_row = None, None, None
    with noted_reads() as noted:
        try:
            calibration = calibrate(entry.robot, entry.data, notes=notes or None, **entry.options)
            result_row = _row(entry, calibration, began)
            rows_of(to_json(result_row.content()))
        except InputError as error:
            message = str(error)
        except ValidationError:
            message = "the calibration found figures that no part holds, as those that are not finite"
        except (ArithmeticError, ValueError, LookupError) as error:  # LinAlgError is a ValueError
            message = f"the calibration failed ({type(error).__name__}: {error})"
    changed = _changed(entry, noted)
    if changed is not None:
        message = f"{changed.name} changed while the fleet ran; start it again"
    if message is not None or result_row is None:
        row = Row(entry.name, "failed", message or "", entry.of, entry.date, seconds=time.perf_counter() - began)
        return Done(row, changed=changed is not None)
    written = []
    if folder is not None:  # a folder that cannot be written to is no fault of the robot
        written = [
            path.relative_to(folder).as_posix() for path in calibration.save(folder / ROBOTS / entry.name, replace=True)
        ]
    return Done(result_row, tuple(written))


def _changed(entry: RobotEntry, noted: Mapping[Path, Sequence[str]]) -> Path | None:
    """Return a file whose content, as it was read, is not the one that the manifest meant."""
    for path, known in entry.hashes.items():
        if not noted.get(path):
            try:
                seen = [hash_of(read_bytes(path))]
            except InputError:
                return path
        else:
            seen = [*noted[path]]
        if {*seen} != {known}:
            return path
    return None


def _row(entry: RobotEntry, calibration: Calibration, began: float) -> Row:
    names, covariance = _own(calibration)
    mapping, temperature = calibration.fit.robot.parameters, calibration.data.temperature
    return Row(
        entry.name,
        "calibrated",
        "",
        entry.of,
        entry.date,
        held_out=_accuracy(calibration.validation),
        nominal=_accuracy(calibration.nominal),
        parameters=FoundParameters.of(
            {
                p.name: FoundParameter(p.unit, p.value, p.deviation or 0.0, p.nominal, p.prior)
                for p in (mapping[name] for name in names)
            }
        ),
        fit_status=calibration.status.value,
        notices=tuple(notice.code for notice in calibration.warnings),
        seconds=time.perf_counter() - began,
        robot=calibration.fit.robot.name,
        errors=tuple(notice.code for notice in calibration.warnings if notice.level == "error"),
        drawn=entry.options.get("redundancy", "prior") == "prior",
        covariance=covariance,
        simulated=bool(calibration.simulated_from),
        temperature=None if temperature is None else float(temperature.mean()),
    )


def _own(calibration: Calibration) -> tuple[list[str], tuple[float, ...]]:
    """Return the parameters of the arm that were identified, and their covariance in priors, row by row."""
    fit = calibration.fit
    mapping = fit.robot.parameters
    own = [
        (place, name)
        for place, name in enumerate(fit.free.names)
        if (p := mapping[name]).group not in _OF_CAMPAIGN and p.deviation is not None
    ]
    places = [place for place, _ in own]
    prior = np.array([mapping[name].prior for _, name in own])  # those of effects in the fit are as this robot's data
    covariance = fit.covariance[np.ix_(places, places)] / np.outer(prior, prior)
    rows = np.round(covariance, _DECIMALS)[np.tril_indices(len(places))] + 0.0
    return [name for _, name in own], tuple(rows.tolist())


def _accuracy(errors: Errors | None) -> Accuracy | None:
    """Return the errors of positions, of lengths where an instrument reads nothing else; None where there are none."""
    spread = None if errors is None else errors.position or errors.length
    return None if errors is None or spread is None else Accuracy.of_spread(spread, errors.configurations)
