"""Reading by reading, how far a robot's predictions are from what was measured."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from truearm.measurement.dataset import Dataset
from truearm.measurement.statistics import Errors
from truearm.modeling.chain import Array
from truearm.results.record import Record
from truearm.simulated import Marked, parts_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

Part = Literal["training", "held out"]
Kind = Literal["position", "orientation", "length"]

#: Rows shown where a person reads.
_SHOWN = 10


class Residual(NamedTuple):
    """One row: what was read of a target at a configuration, and by how much the prediction differs."""

    configuration: str  #: configuration, target: by their names.
    target: str
    part: Part  #: Whether the fit has seen it: ``training`` or ``held out``.
    kind: Kind  #: ``position`` [m], ``orientation`` [rad] or ``length`` (a distance or a height) [m].
    #: Predicted minus measured, ``(3,)``: a vector in the instrument's frame (or the fixture's); for an orientation the
    #: rotation vector from measured to predicted; for a length that number and two NaN.
    error: Array
    norm: float  #: Length of it.


@dataclass(frozen=True, eq=False, repr=False)
class Residuals(Record):
    """What a calibrated robot leaves of every reading, in the order of the data: training first, then held out."""

    #: configuration, target, part, kind: of each row, see :class:`Residual`, ``(rows,)``.
    configuration: NDArray[np.str_]
    target: NDArray[np.str_]
    part: NDArray[np.str_]
    kind: NDArray[np.str_]
    error: Array  #: Predicted minus measured [m, rad], ``(rows, 3)``.
    norm: Array  #: Length of it [m, rad], ``(rows,)``.
    simulated_from: tuple[Marked, ...] = ()  #: What of it comes from a virtual instrument.

    def __len__(self) -> int:
        return len(self.norm)

    def __iter__(self) -> Iterator[Residual]:
        columns = (self.configuration, self.target, self.part, self.kind, self.norm)
        rows = zip(*(column.tolist() for column in columns), strict=True)
        for (configuration, target, part, kind, norm), error in zip(rows, self.error, strict=True):
            yield Residual(configuration, target, part, kind, error, norm)

    def summary(self) -> dict[str, Any]:
        """Return every row, in mm and mrad."""
        return {
            "residuals": [
                {
                    "configuration": row.configuration,
                    "target": row.target,
                    "part": row.part,
                    "kind": row.kind,
                    "error": [None if np.isnan(value) else value * 1e3 for value in row.error.tolist()],
                    "norm": row.norm * 1e3,
                }
                for row in self
            ]
        }

    def lines(self) -> list[str]:
        """Return the largest of them, worst first."""
        text = [f"{len(self)} residuals; the largest of each kind:"]
        for kind, unit in (("position", "mm"), ("orientation", "mrad"), ("length", "mm")):
            rows = np.flatnonzero(self.kind == kind)
            for row in rows[np.argsort(-self.norm[rows], kind="stable")][:_SHOWN].tolist():
                where = f"{self.configuration[row]}/{self.target[row]}"
                text.append(f"  {kind:<11} {where:<16} {self.part[row]:<8} {self.norm[row] * 1e3:.3f} {unit}")
        return text

    def to_pandas(self) -> Any:
        """Return the rows as a pandas DataFrame, the error in columns ``ex``, ``ey``, ``ez``; pandas is needed for it.

        Raises:
            ImportError: If pandas is not installed.
        """
        from pandas import DataFrame

        return DataFrame(
            {
                "configuration": self.configuration,
                "target": self.target,
                "part": self.part,
                "kind": self.kind,
                **{f"e{axis}": self.error[:, k] for k, axis in enumerate("xyz")},
                "norm": self.norm,
            }
        )


def residuals_of(parts: Iterable[tuple[Part, Dataset, Errors]]) -> Residuals:
    """Return the residuals of the parts of a campaign, readings that were not made left out.

    Args:
        parts: Of each its name, its readings and their errors.
    """
    parts, names = [*parts], list[tuple[str, str, Part, Kind]]()
    errors = [np.zeros((0, 3))]
    for part, data, found in parts:
        length = None
        if found.length_errors is not None:
            length = np.full((len(found.length_errors), 3), np.nan)
            length[:, 0] = found.length_errors
        kinds: tuple[tuple[Kind, Array | None], ...] = (
            ("position", found.position_errors),
            ("orientation", found.orientation_errors),
            ("length", length),
        )
        for kind, values in kinds:
            if values is None:
                continue
            rows = np.flatnonzero(np.isfinite(values[:, 0]))
            errors.append(values[rows])
            names += [
                (data.labels[c], data.targets[t], part, kind)
                for c, t in zip(data.configuration[rows].tolist(), data.target[rows].tolist(), strict=True)
            ]
    error = np.concatenate(errors)
    configuration, target, part_of, kind_of = np.array(names, dtype=np.str_).reshape(-1, 4).T
    return Residuals(
        configuration,
        target,
        part_of,
        kind_of,
        error,
        np.sqrt(np.nansum(error**2, axis=1)),
        parts_of(data for _, data, _ in parts),
    )
