"""Short entries of a robot file for hundreds of numbers: curves of joints, and correlations of a proof."""

from __future__ import annotations

import base64
import binascii
import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Annotated, Final

import numpy as np
from pydantic import BaseModel, Field, StringConstraints

from truearm.engine.base.errors import InputError, counted
from truearm.engine.base.units import as_number, from_si, sized_si, written
from truearm.engine.robot.effects.joint_curve import HIGHEST, JointCurve, curve_names
from truearm.engine.robot.parameters import Parameter
from truearm.engine.robot.proof import DECIMALS
from truearm.engine.robot.robot_file.entries import STRICT

# Correlations of a proof in a robot file: rows of numbers, or, where there are thousands of them, one short text.
#
# The factor of hundreds of parameters has tens of thousands of numbers, which nobody reads and YAML reads slowly. They
# are whole multiples of 1e-7 (:mod:`truearm.engine.robot.proof` rounds them) from -1 to 1, and are written as 25 bits
# each in base64: two fifths of their length in digits. Others are written in digits, so that nothing is lost.
Factor = tuple[tuple[float, ...], ...]

#: Parameters up to which rows of numbers are written.
_READABLE: Final = 60
#: Of the numbers in a short text, which are -1 to 1: how many of it are one, and how many bits it has, highest first.
_PER_ONE: Final = 10**DECIMALS
_PLACES: Final = np.arange(24, -1, -1)


def digits_of(factor: Sequence[Sequence[float]]) -> list[str]:
    """Return the rows of a factor as texts of their numbers."""
    return [" ".join(f"{v:.7g}" for v in row) for row in factor]


def correlations_text(factor: Sequence[Sequence[float]]) -> list[str] | str:
    """Return the rows of a factor as texts of their numbers, or all of it as one text where they are many."""
    if len(factor) <= _READABLE:
        return digits_of(factor)
    values = np.concatenate([np.asarray(row) for row in factor])
    steps = np.rint(values * _PER_ONE)
    if (steps / _PER_ONE != values).any():
        return digits_of(factor)
    bits = (steps.astype(np.int64) + _PER_ONE)[:, None] >> _PLACES & 1
    return base64.b64encode(np.packbits(bits.astype(np.uint8)).tobytes()).decode()


def factor_from(entry: Sequence[str] | str, count: int, where: str, cure: str) -> Factor:
    """Return the factor that a file states.

    Args:
        entry: What :func:`correlations_text` returns.
        count: How many parameters there are.
        where, cure: For messages.

    Raises:
        InputError: If there are more or fewer numbers, or one is not from -1 to 1.
    """
    if isinstance(entry, str):
        return _unpacked(entry, count, where, cure)
    if len(entry) != count:
        raise InputError(
            "one row belongs here for each of the deviations",
            where=where,
            came=counted(len(entry), "row"),
            allowed=str(count),
            cure=cure,
        )
    return tuple(_row(row, number, f"{where}[{number}]", cure) for number, row in enumerate(entry, 1))


def _unpacked(text: str, count: int, where: str, cure: str) -> Factor:
    try:
        content = base64.b64decode(text, validate=True)
    except (binascii.Error, ValueError):
        content = None
    numbers = count * (count + 1) // 2
    length = math.ceil(numbers * len(_PLACES) / 8)
    if content is None or len(content) != length:
        raise InputError(
            "this is no text of correlations of so many parameters",
            where=where,
            came="other signs than those of base64" if content is None else counted(len(content), "byte"),
            allowed=f"{length} bytes in base64",
            cure=cure,
        )
    bits = np.unpackbits(np.frombuffer(content, dtype=np.uint8), count=numbers * len(_PLACES)).reshape(numbers, -1)
    steps = bits @ (1 << _PLACES) - _PER_ONE
    if np.abs(steps).max(initial=0) > _PER_ONE:
        raise InputError("correlations are -1 to 1", where=where, cure=cure)
    values = (steps / _PER_ONE).tolist()
    ends = [n * (n + 1) // 2 for n in range(count + 1)]
    return tuple(tuple(values[a:b]) for a, b in pairwise(ends))


def _row(text: str, count: int, where: str, cure: str) -> tuple[float, ...]:
    numbers = [as_number(word) for word in text.split()]
    known = tuple(number for number in numbers if number is not None and abs(number) <= 1.0)
    if len(known) != count or len(numbers) != count:
        raise InputError(
            "numbers from -1 to 1 belong here, one more than in the row before",
            where=where,
            came=text,
            allowed=counted(count, "number"),
            cure=cure,
        )
    return known


#: What may be left out where it is zero, or not known, for all terms of a joint.
_OPTIONAL: Final = ("nominal", "deviation", "informed")
_COLUMNS: Final = ("nominal", "value", "prior", "deviation", "informed")

#: No coefficient is larger [rad]: five times what a fit expects of all of a joint together.
_LARGEST: Final = math.radians(30.0)

Numbers = Annotated[str, StringConstraints(strict=True)]


class CurveEntry(BaseModel):
    """The curve of a joint: its terms, and for each of them the numbers of a parameter in degrees or radians."""

    model_config = STRICT
    joint: Annotated[int, Field(strict=True)]
    terms: Numbers
    value: Numbers
    prior: Numbers
    nominal: Numbers | None = None
    deviation: Numbers | None = None
    informed: Numbers | None = None


def curve_entries(known: Mapping[str, Parameter], joints: int) -> tuple[list[dict[str, object]], set[str]]:
    """Return the entries of the curves of a robot, in degrees, and the names of the parameters that they hold.

    Args:
        known: Parameters that differ from the plain nominal ones.
        joints: How many joints there are.
    """
    entries: list[dict[str, object]] = []
    names: set[str] = set()
    for number in range(1, joints + 1):
        parameters = [known[name] for name in curve_names(number) if name in known]
        if not parameters:
            continue
        entry: dict[str, object] = {
            "joint": number,
            "terms": " ".join(p.name.removeprefix("curve_").removesuffix(f"_{number}") for p in parameters),
        }
        columns: dict[str, Sequence[float | None]] = {
            "nominal": [written(p.nominal, "deg") for p in parameters],
            "value": [written(p.value, "deg") for p in parameters],
            "prior": [written(p.prior, "deg") for p in parameters],
            "deviation": [None if p.deviation is None else written(p.deviation, "deg") for p in parameters],
            "informed": [p.informed for p in parameters],
        }
        if any(None in column and any(v is not None for v in column) for column in columns.values()):
            continue  # such parameters stand one by one
        if not any(columns["nominal"]):
            del columns["nominal"]
        entry |= {name: " ".join(map(repr, column)) for name, column in columns.items() if None not in column}
        entries.append(entry)
        names |= {p.name for p in parameters}
    return entries, names


def curve_parameters(
    entries: Sequence[CurveEntry], effect: JointCurve | None, angle: str, where: str
) -> dict[str, Parameter]:
    """Return the parameters that the entries of curves state.

    Args:
        effect: Of the robot; None if it has no curves.
        angle: Unit of angles in the file.
        where: Names the file in messages.

    Raises:
        InputError: If there is no such joint or term, one stands twice, a list has other numbers than it should, or one
            of them is larger than any curve.
    """
    parameters: dict[str, Parameter] = {}
    for place, entry in enumerate(entries, 1):
        location = f"{where}, joint_curves[{place}]"
        if effect is None:
            raise InputError(
                "the robot has no curves of joints",
                where=location,
                cure=f"Add the joint effect {JointCurve.name} to the entry effects.",
            )
        turning = [joint + 1 for joint in effect.terms]
        if entry.joint not in turning:
            raise InputError(
                "there is no such turning joint",
                where=f"{location}.joint",
                came=entry.joint,
                allowed=", ".join(map(str, turning)) or "none",
            )
        plain = {p.name: p for p in effect.parameters}
        names = [f"curve_{term}_{entry.joint}" for term in entry.terms.split()]
        for name in names:
            if name not in plain:
                raise InputError(
                    "there is no such term of a curve",
                    where=f"{location}.terms",
                    came=name.removeprefix("curve_").removesuffix(f"_{entry.joint}"),
                    allowed=f"sin1, cos1 to sin{HIGHEST}, cos{HIGHEST}",
                )
            if name in parameters or names.count(name) > 1:
                raise InputError("a term of a curve stands twice", where=f"{location}.terms", came=name)
        columns = {
            column: _numbers(getattr(entry, column), len(names), f"{location}.{column}", least=column in _POSITIVE)
            for column in _COLUMNS
            if getattr(entry, column) is not None
        }
        for number, name in enumerate(names):
            stated = {
                column: _share(values[number], f"{location}.{column}")
                if column == "informed"
                else coefficient_si(values[number], angle, f"{location}.{column}", deviation=column in _POSITIVE)
                for column, values in columns.items()
            }
            parameters[name] = Parameter(
                name,
                plain[name].unit,
                plain[name].group,
                nominal=stated.get("nominal", 0.0),
                value=stated["value"],
                prior=stated["prior"],
                deviation=stated.get("deviation"),
                informed=stated.get("informed"),
            )
    return parameters


def coefficient_si(value: float, unit: str, where: str, *, deviation: bool) -> float:
    """Return a coefficient of a curve, or its prior or `deviation`, in radians.

    Raises:
        InputError: If it is larger than any curve of a joint.
    """
    size = sized_si(value, unit, where, deviation=deviation)
    if abs(size) > _LARGEST:
        raise InputError(
            "the number is too large for a curve of a joint",
            where=where,
            came=f"{value:g} {unit}",
            allowed=f"{from_si(_LARGEST, unit):.4g} {unit} or less",
            cure="Correct the number, or its unit.",
        )
    return size


def _share(value: float, where: str) -> float:
    if not 0.0 <= value <= 1.0:
        raise InputError("a share is meant here", where=where, came=f"{value:g}", allowed="0 to 1")
    return value


_POSITIVE: Final = ("prior", "deviation")


def _numbers(text: str, count: int, where: str, *, least: bool) -> list[float]:
    numbers = [as_number(word) for word in text.split()]
    known = [v for v in numbers if v is not None and math.isfinite(v) and (v >= 0.0 or not least)]
    if len(known) != len(numbers) or len(known) != count:
        raise InputError(
            f"{'numbers of 0 or more belong' if least else 'numbers belong'} here, one for each term",
            where=where,
            came=text if len(text) < 80 else f"{text[:77]}...",
            allowed=counted(count, "number"),
        )
    return known
