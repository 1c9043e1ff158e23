"""What was found of one robot of a fleet: a row, as the parts on disk hold it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, Literal

import numpy as np
from pydantic_core import to_json

from truearm.measurement.statistics import Spread
from truearm.modeling.chain import Array

Status = Literal["calibrated", "failed"]

#: Columns of the parameters that may be the same for all robots of a part, and stand in its first line once.
_SHARED: Final = ("name", "unit", "nominal", "prior")


@dataclass(frozen=True)
class Accuracy:
    """Position errors of a robot at configurations that its calibration has not seen [m]."""

    mean: float  #: mean, rms, max: of their lengths.
    rms: float
    max: float
    n: int  #: How many.

    @classmethod
    def of_each(cls, errors: Array) -> list[Accuracy]:
        """Summarise error norms of several robots, ``(robots, k)``, k at least 1."""
        means, squares, largest = errors.mean(axis=1), np.mean(errors**2, axis=1), errors.max(axis=1)
        figures = zip(means.tolist(), np.sqrt(squares).tolist(), largest.tolist(), strict=True)
        return [cls(*three, errors.shape[1]) for three in figures]

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
        return cls(content["mean_mm"] / 1e3, content["rms_mm"] / 1e3, content["max_mm"] / 1e3, content["n"])


@dataclass(frozen=True)
class FoundParameter:
    """A parameter of one robot of a fleet, in SI units."""

    unit: str  #: Of all its values.
    value: float  #: value, deviation: as it was identified, and the standard deviation of that.
    deviation: float
    nominal: float  #: nominal, prior: value before, and the standard deviation of that.
    prior: float
    truth: float | None = None  #: True value of a simulated robot; None of others.


@dataclass(frozen=True)
class FoundParameters(Mapping[str, FoundParameter]):
    """The parameters of one robot by their names, kept as columns: of ten thousand robots no object each is made."""

    name: tuple[str, ...] = ()  #: name, unit: of each.
    unit: tuple[str, ...] = ()
    #: nominal, prior, value, deviation: of each, in SI units, see :class:`FoundParameter`.
    nominal: tuple[float, ...] = ()
    prior: tuple[float, ...] = ()
    value: tuple[float, ...] = ()
    deviation: tuple[float, ...] = ()
    truth: tuple[float, ...] | None = None  #: True values of a simulated robot; None of others.

    @classmethod
    def of(cls, parameters: Mapping[str, FoundParameter]) -> FoundParameters:
        """Return parameters, of which all or none have a truth, as columns."""
        those = [*parameters.values()]
        truths = tuple(p.truth for p in those if p.truth is not None)
        return cls(
            tuple(parameters),
            tuple(p.unit for p in those),
            tuple(p.nominal for p in those),
            tuple(p.prior for p in those),
            tuple(p.value for p in those),
            tuple(p.deviation for p in those),
            truths if truths else None,
        )

    def __getitem__(self, name: str) -> FoundParameter:
        """Return one of them."""
        try:
            i = self.name.index(name)
        except ValueError:
            raise KeyError(name) from None
        truth = None if self.truth is None else self.truth[i]
        return FoundParameter(self.unit[i], self.value[i], self.deviation[i], self.nominal[i], self.prior[i], truth)

    def __iter__(self) -> Iterator[str]:
        """Return their names."""
        return iter(self.name)

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.name)

    @property
    def shared(self) -> dict[str, tuple[Any, ...]]:
        """Columns that other robots may have too, as JSON holds them."""
        return {column: getattr(self, column) for column in _SHARED}

    def content(self, shared: Mapping[str, Any]) -> dict[str, tuple[Any, ...]]:
        """Return them as JSON holds them, column by column, without those of `shared`."""
        columns = {} if shared == self.shared else self.shared
        columns |= {"value": self.value, "deviation": self.deviation}
        return columns if self.truth is None else {**columns, "truth": self.truth}

    @classmethod
    def read(cls, content: Mapping[str, Any], shared: Mapping[str, Any]) -> FoundParameters:
        """Read what :meth:`content` returned.

        Raises:
            ValueError: If columns are missing or not equally long, or a name is there twice.
        """
        if not content:  # of a robot that could not be calibrated
            return cls()
        columns = {kind: tuple(column) for kind, column in {**shared, **content}.items()}
        if len({*map(len, columns.values())}) > 1:
            raise ValueError("columns of different lengths")
        made = cls(**columns)
        if not len(made.name) == len({*made.name}) == len(made.unit) == len(made.prior) == len(made.value):
            raise ValueError("columns are missing, or names are there twice")
        return made


@dataclass(frozen=True)
class Row:
    """One robot of a fleet."""

    name: str  #: Of the robot in the fleet.
    status: Status  #: Whether it was calibrated.
    message: str = ""  #: Why not; empty if it was.
    #: Serial number or name of the machine: rows of one machine are measurements of it at several times.
    of: str | None = None
    date: str | None = None  #: When it was measured (ISO 8601).
    #: held_out, nominal: errors of the calibrated and of the nominal robot at configurations not seen, as an instrument
    #: reads them.
    held_out: Accuracy | None = None
    nominal: Accuracy | None = None
    #: Errors of the calibrated robot there without the instrument's noise; None of measured robots.
    truth: Accuracy | None = None
    parameters: FoundParameters = field(default_factory=FoundParameters)  #: Those identified, by name.
    fit_status: str | None = None  #: How the fit ended.
    notices: tuple[str, ...] = ()  #: Codes of what there is to know about it.
    seconds: float = 0.0  #: How long it took; no result depends on it.
    robot: str = ""  #: Name of the robot: robots of one name are compared with one another.
    errors: tuple[str, ...] = ()  #: Those of `notices` that are of the level error.
    drawn: bool = True  #: Whether priors drew the parameters towards nominal.
    #: Of the parameters, in priors: the rows of the lower triangle one after the other; empty where it is not kept.
    covariance: tuple[float, ...] = ()
    simulated: bool = False  #: Whether its measurements are marked as those of a virtual instrument.

    @property
    def machine(self) -> str:
        """The machine that was measured: rows of one machine are measurements of it at several times."""
        return self.of or self.name

    def content(self, shared: Mapping[str, Any] | None = None) -> dict[str, Any]:
        """Return it as JSON holds it, without what `shared` says of its parameters already."""
        return {
            "name": self.name,
            "status": self.status,
            "message": self.message,
            "of": self.of,
            "date": self.date,
            "held_out": None if self.held_out is None else self.held_out.content(),
            "nominal": None if self.nominal is None else self.nominal.content(),
            "truth": None if self.truth is None else self.truth.content(),
            "parameters": self.parameters.content(shared or {}),
            "fit_status": self.fit_status,
            "notices": [*self.notices],
            "seconds": self.seconds,
            "robot": self.robot,
            "errors": [*self.errors],
            **({} if self.drawn else {"drawn": False}),
            **({"covariance": [*self.covariance]} if self.covariance else {}),
            **({"simulated": True} if self.simulated else {}),
        }

    @classmethod
    def read(cls, content: Mapping[str, Any], shared: Mapping[str, Any] | None = None) -> Row:
        """Read what :meth:`content` returned."""

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
            parameters=FoundParameters.read(content["parameters"], shared or {}),
            fit_status=content["fit_status"],
            notices=tuple(content["notices"]),
            seconds=content["seconds"],
            robot=content["robot"],
            errors=tuple(content["errors"]),
            drawn=content.get("drawn", True),
            covariance=tuple(content.get("covariance", ())),
            simulated=content.get("simulated", False),
        )


def part_text(
    rows: Sequence[Row], shared: Mapping[str, Any], written: Sequence[str] = (), changed: Sequence[str] = ()
) -> str:
    """Return robots as a part holds them, behind its first line and before its hash.

    Args:
        shared: Columns that the parameters of all robots have, see :attr:`FoundParameters.shared`.
        written: Files that were written of them, from the folder of the fleet.
        changed: Robots whose files changed while they were computed: they are computed again by the next run.
    """
    first = to_json({"shared": shared, "written": [*written], "changed": [*changed]})
    lines = [first, *(to_json(row.content(shared)) for row in rows)]
    return b"\n".join([*lines, b""]).decode()
