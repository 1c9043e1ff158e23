"""What a calibration knows about its own result, kept by the robot that it made and by that robot's file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, Self

import numpy as np

from truearm.engine.base.errors import Notice
from truearm.engine.base.units import SHOWN_AS, from_si, to_si
from truearm.engine.robot.chain import Array
from truearm.engine.robot.parameters import Parameter

#: Digits of deviations, and decimals of the rows of the factor: a prediction changes by less than a thousandth of its
#: own deviation.
_DIGITS: Final = 9
DECIMALS: Final = 7
#: How a proof says that the base was known, or by targets on it all of the flange's pose.
BASE: Final = "base"
FLANGE: Final = "flange"
HELD: Final = (BASE, FLANGE)
#: Measured joint positions that are kept, and their decimals in deg or mm.
MOST_MEASURED: Final = 1000
_POSITIONDECIMALS: Final = 3
_LOADDECIMALS: Final = 6


@dataclass(frozen=True)
class Proof:
    """What a calibration knows about its own result.

    It is about certain values, of which it keeps a hash: whether a robot still has them is asked with
    :func:`truearm.engine.robot.robot_file.seal.is_intact`.
    """

    status: str  #: How the fit ended, in the word of files: ``converged``, ``rank-loss``.
    errors: tuple[Notice, ...]  #: Notices of the level error.
    #: Lowest and highest position of each joint at which it was measured [rad or m].
    region: tuple[tuple[float, float], ...]
    #: Standard deviation of the error of each joint that readings of a visit share [rad or m].
    joint_error: tuple[float, ...]
    names: tuple[str, ...]  #: The parameters that were identified.
    deviations: tuple[float, ...]  #: Their standard deviations [SI].
    #: Rows of the lower triangular factor of their correlation matrix, each one longer than the one before; zero for
    #: parameters that are not uncertain.
    factor: tuple[tuple[float, ...], ...]
    #: Whether the error may be larger than covariance and joint error say, for a reason that is known.
    lower_bound: bool = False
    warnings: tuple[Notice, ...] = ()  #: Notes of the calibration that whoever corrects programs should hear again.
    #: What was known beforehand and not found: ``base``; ``flange``, where the places of targets on it say all of its
    #: pose; and parameters of the targets that were held, by name.
    held: tuple[str, ...] = ()
    digest: str = ""  #: SHA-256 of the values that it is about; empty if it is about none yet.
    #: Joint positions at which it was measured [rad or m], to a thousandth of a degree or millimetre; a thousand of
    #: them at most, evenly taken. Empty where only the region is known.
    measured: tuple[tuple[float, ...], ...] = ()
    #: Lowest and highest moment about each joint's axis, or force along it, while it was measured [N m or N]; empty if
    #: that is not known.
    loads: tuple[tuple[float, float], ...] = ()

    @classmethod
    def of(
        cls,
        status: str,
        errors: Sequence[Notice],
        region: Sequence[tuple[float, float]],
        joint_error: Array,
        parameters: Sequence[Parameter],
        covariance: Array,
        *,
        warnings: Sequence[Notice] = (),
        lower_bound: bool = False,
        held: Sequence[str] = (),
        measured: Sequence[Sequence[float]] = (),
        joint_units: Sequence[str] = (),
        loads: Sequence[tuple[float, float]] = (),
    ) -> Self:
        """Make the proof of a calibration, rounded to what a file holds of it.

        Args:
            parameters: That were identified.
            covariance: Of these parameters [SI], ``(parameters, parameters)``.
            measured: Joint positions at which it was measured [rad or m].
            joint_units: Units in which a file holds these, ``deg`` or ``mm``.
        """
        deviation = np.sqrt(np.diag(covariance))
        units = [SHOWN_AS[p.unit] for p in parameters]
        return cls(
            status,
            tuple(errors),
            tuple(region),
            tuple(joint_error.tolist()),
            tuple(p.name for p in parameters),
            tuple(
                to_si(float(f"{from_si(d, unit):.{_DIGITS}g}"), unit)
                for d, unit in zip(deviation.tolist(), units, strict=True)
            ),
            tuple(
                tuple(round(v, DECIMALS) + 0.0 for v in row[: number + 1])
                for number, row in enumerate(_factor(covariance, deviation).tolist())
            ),
            lower_bound,
            tuple(warnings),
            held=tuple(held),
            measured=tuple(
                tuple(to_si(float(position_text(v, u)), u) for v, u in zip(row, joint_units, strict=True))
                for row in _some(measured)
            ),
            loads=tuple((round(low, _LOADDECIMALS) + 0.0, round(high, _LOADDECIMALS) + 0.0) for low, high in loads),
        )

    def summary(self) -> dict[str, Any]:
        """Return how the calibration ended, and what it is about, as JSON holds it."""
        return {"status": self.status, "errors": [error.code for error in self.errors], "sha256": self.digest}

    @property
    def root(self) -> Array:
        """Lower triangular ``L`` of the covariance ``L L^T`` of the parameters [SI], ``(parameters, parameters)``."""
        root = np.zeros((len(self.names), len(self.names)))
        for number, row in enumerate(self.factor):
            root[number, : number + 1] = row
        return np.asarray(root * np.reshape(self.deviations, (-1, 1)))

    @property
    def covariance(self) -> Array:
        """Covariance of the parameters [SI], ``(parameters, parameters)``."""
        root = self.root
        return np.asarray(root @ root.T)


def position_text(value: float, unit: str) -> str:
    """Return a measured joint position [rad or m] as a file holds it, in deg or mm."""
    text = f"{from_si(value, unit):.{_POSITIONDECIMALS}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text


def _some(measured: Sequence[Sequence[float]]) -> list[Sequence[float]]:
    """Return different joint positions in their order, as many as a file holds, evenly taken."""
    rows = [*{tuple(row): row for row in measured}.values()]
    if len(rows) <= MOST_MEASURED:
        return rows
    return [rows[i] for i in np.linspace(0, len(rows) - 1, MOST_MEASURED).round().astype(int).tolist()]


def _factor(covariance: Array, deviation: Array) -> Array:
    """Return the lower triangular factor of the correlations, of a covariance that may be singular."""
    safe = np.where(deviation > 0.0, deviation, 1.0)
    size, axes = np.linalg.eigh(covariance / np.outer(safe, safe))
    upper = np.linalg.qr((axes * np.sqrt(np.maximum(size, 0.0))).T, mode="r")
    signs = np.where(np.diag(upper) < 0.0, -1.0, 1.0)
    return np.asarray((signs[:, None] * upper).T)
