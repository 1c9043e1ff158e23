"""What was found of one robot of a fleet: a row, as the parts on disk hold it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final, Literal

import numpy as np

from truearm.measurement.statistics import Spread
from truearm.modeling.chain import Array

Status = Literal["calibrated", "failed"]

#: What is the same for the robots of a part, and stands in its first line once.
SHARED: Final = ("unit", "nominal", "prior")


@dataclass(frozen=True)
class Accuracy:
    """Position errors of a robot at configurations that its calibration has not seen [m].

    Attributes
    ----------
    mean, rms, max
        Of their lengths.
    n
        How many.
    """

    mean: float
    rms: float
    max: float
    n: int

    @classmethod
    def of(cls, errors: Array) -> Accuracy:
        """Summarise error norms ``(k,)``, k at least 1."""
        return cls(float(errors.mean()), float(np.sqrt(np.mean(errors**2))), float(errors.max()), len(errors))

    @classmethod
    def of_spread(cls, spread: Spread, n: int) -> Accuracy:
        """Take over what a calibration says of its errors."""
        return cls(spread.mean, spread.rms, spread.max, n)

    def content(self) -> dict[str, float | int]:
        """Return it as JSON holds it, in mm."""
        return {"mean_mm": self.mean * 1e3, "rms_mm": self.rms * 1e3, "max_mm": self.max * 1e3, "n": self.n}

    @classmethod
    def read(cls, content: Mapping[str, Any]) -> Accuracy:
        """Read what :meth:`content` returned."""
        mean, rms, largest = (float(content[name]) / 1e3 for name in ("mean_mm", "rms_mm", "max_mm"))
        return cls(mean, rms, largest, int(content["n"]))


@dataclass(frozen=True)
class FoundParameter:
    """A parameter of one robot of a fleet, in SI units.

    Attributes
    ----------
    unit
        Of all its values.
    value, deviation
        As it was identified, and the standard deviation of that.
    nominal, prior
        Value before, and the standard deviation of that.
    truth
        True value of a simulated robot; None of others.
    """

    unit: str
    value: float
    deviation: float
    nominal: float
    prior: float
    truth: float | None = None


@dataclass(frozen=True)
class Row:
    """One robot of a fleet.

    Attributes
    ----------
    name
        Of the robot in the fleet.
    status
        Whether it was calibrated.
    message
        Why not; empty if it was.
    of
        Serial number or name of the machine: rows of one machine are measurements of it at several times.
    date
        When it was measured (ISO 8601).
    held_out, nominal
        Errors of the calibrated and of the nominal robot at configurations not seen, as an instrument reads them.
    truth
        Errors of the calibrated robot there without the instrument's noise; None of measured robots.
    parameters
        Those identified, by name.
    fit_status
        How the fit ended.
    notices
        Codes of what there is to know about it.
    seconds
        How long it took; no result depends on it.
    robot
        Name of the robot: robots of one name are compared with one another.
    errors
        Those of `notices` that are of the level error.
    drawn
        Whether priors drew the parameters towards nominal.
    covariance
        Of the parameters, in priors: the rows of the lower triangle one after the other; empty where it is not kept.
    """

    name: str
    status: Status
    message: str = ""
    of: str | None = None
    date: str | None = None
    held_out: Accuracy | None = None
    nominal: Accuracy | None = None
    truth: Accuracy | None = None
    parameters: Mapping[str, FoundParameter] = field(default_factory=dict)
    fit_status: str | None = None
    notices: tuple[str, ...] = ()
    seconds: float = 0.0
    robot: str = ""
    errors: tuple[str, ...] = ()
    drawn: bool = True
    covariance: tuple[float, ...] = ()

    @property
    def machine(self) -> str:
        """The machine that was measured: rows of one machine are measurements of it at several times."""
        return self.of or self.name

    def content(self, shared: Mapping[str, Mapping[str, Any]] | None = None) -> dict[str, Any]:
        """Return it as JSON holds it, without what `shared` says of its parameters already."""
        known = shared or {}
        parameters = {}
        for name, found in self.parameters.items():
            one = {"value": found.value, "deviation": found.deviation}
            one |= {} if name in known else {kind: getattr(found, kind) for kind in SHARED}
            parameters[name] = one if found.truth is None else {**one, "truth": found.truth}
        return {
            "name": self.name,
            "status": self.status,
            "message": self.message,
            "of": self.of,
            "date": self.date,
            "held_out": None if self.held_out is None else self.held_out.content(),
            "nominal": None if self.nominal is None else self.nominal.content(),
            "truth": None if self.truth is None else self.truth.content(),
            "parameters": parameters,
            "fit_status": self.fit_status,
            "notices": [*self.notices],
            "seconds": self.seconds,
            "robot": self.robot,
            "errors": [*self.errors],
            **({} if self.drawn else {"drawn": False}),
            **({"covariance": [*self.covariance]} if self.covariance else {}),
        }

    @classmethod
    def read(cls, content: Mapping[str, Any], shared: Mapping[str, Mapping[str, Any]] | None = None) -> Row:
        """Read what :meth:`content` returned."""
        known = shared or {}

        def accuracy(name: str) -> Accuracy | None:
            return None if content[name] is None else Accuracy.read(content[name])

        return cls(
            name=content["name"],
            status=content["status"],
            message=content["message"],
            of=content["of"],
            date=content["date"],
            held_out=accuracy("held_out"),
            nominal=accuracy("nominal"),
            truth=accuracy("truth"),
            parameters={
                name: FoundParameter(**{**known.get(name, {}), **one}) for name, one in content["parameters"].items()
            },
            fit_status=content["fit_status"],
            notices=tuple(content["notices"]),
            seconds=content["seconds"],
            robot=content["robot"],
            errors=tuple(content["errors"]),
            drawn=content.get("drawn", True),
            covariance=tuple(content.get("covariance", ())),
        )
