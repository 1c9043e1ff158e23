"""The file iso9283.json of an evaluation, read again."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from truearm.errors import InputError, Words
from truearm.files import read_text
from truearm.printable import shortened
from truearm.validation.iso9283.comparable import PlanOfResult, Rated
from truearm.validation.iso9283.values import Component, Status

_LENIENT = ConfigDict(extra="ignore", frozen=True)
_Number = Annotated[float, Field(allow_inf_nan=False)]
_Length = _Number | None


class Entry(BaseModel):
    """A value of a criterion in its unit, with the conditions as files have them."""

    model_config = _LENIENT
    id: str
    component: Component
    where: str
    value: _Number | None
    unit: Literal["mm", "deg", "s", "%", "mm/s", "mm/N"]
    interval_95: tuple[float, float] | None
    cycles: int = 0
    conditions: dict[str, float | str]
    status: Status
    range: tuple[_Length, _Length] | None = None
    bandwidth_hz: Annotated[float, Field(allow_inf_nan=False, gt=0)] | None = None


class _Tie(BaseModel):
    model_config = _LENIENT
    kind: str


class InstrumentOfResult(BaseModel):
    """What was said of the instrument."""

    model_config = _LENIENT
    sigma_mm: _Number
    sigma_rot_deg: _Length


class ReadFile(BaseModel):
    """A file that an evaluation has read: as it was named, and its SHA-256."""

    model_config = _LENIENT
    file: str
    sha256: str


class Curve(BaseModel):
    """How far the barycentre of a path is from its command, by the arc length [mm]."""

    model_config = _LENIENT
    id: str
    where: str
    conditions: dict[str, float | str]
    along_mm: tuple[_Length, ...]
    distance_mm: tuple[_Length, ...]


class Offset(BaseModel):
    """From the command of a pose to the barycentre of what was attained, in the base frame [mm]."""

    model_config = _LENIENT
    id: str
    where: str
    conditions: dict[str, float | str]
    offset_mm: tuple[_Length, _Length, _Length]


class ToldNotice(BaseModel):
    """What was to know about the result."""

    model_config = _LENIENT
    code: str
    message: str
    level: Literal["note", "warning", "error"] = "warning"


class ResultFile(BaseModel):
    """Schema ``truearm-iso9283-result/1``; what older versions did not write is empty."""

    model_config = _LENIENT
    truearm: Literal["truearm-iso9283-result/1"]
    simulated: bool = False
    robot: str
    alignment: _Tie
    instrument: InstrumentOfResult | None = None
    inputs: dict[str, ReadFile] | None = None
    rated: Rated | None = None
    plan: PlanOfResult | None = None
    criteria: tuple[Entry, ...]
    curves: tuple[Curve, ...] = ()
    offsets: tuple[Offset, ...] = ()
    warnings: tuple[ToldNotice, ...] = ()


def read_result(path: Path) -> ResultFile:
    """Read the result of an evaluation.

    Raises:
        InputError: If the file is none.
    """
    text = read_text(path)
    try:
        return ResultFile.model_validate_json(text)
    except ValidationError as error:
        raise _no_result(path, error.errors()[0]) from error


def _no_result(path: Path, fault: Any) -> InputError:
    """Return the refusal of a file that is no result, in words of a person who gave another file."""
    entry = ".".join(map(str, fault["loc"]))
    if fault["type"] == "json_invalid":
        came = "a text that is not JSON"
    elif entry in ("", "truearm"):
        kind = fault["input"] if entry and isinstance(fault["input"], str) else None
        came = "JSON of something else" if kind is None else f"a file of the kind {shortened(kind, 60)}"
    else:
        came = f"a result {'without' if fault['type'] == 'missing' else 'with another kind of'} {entry}"
    return InputError(
        "this is no result of tests by ISO 9283",
        where=str(path),
        came=Words(came),
        allowed="the file iso9283.json that an evaluation has written",
        cure="Evaluate the other tests first, and give the iso9283.json of that folder.",
    )
