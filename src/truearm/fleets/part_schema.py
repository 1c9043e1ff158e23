"""What the lines of a part on disk must hold: the kind and the range of everything in them."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal, NotRequired

from pydantic import AfterValidator, ConfigDict, Field, TypeAdapter
from typing_extensions import TypedDict

from truearm.engine.base.units import SHOWN_AS

_STRICT: Final = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)
#: No length, angle or rate of a robot is larger (SI): squares of it are finite.
_LARGEST: Final = 1e100

Number = Annotated[float, Field(ge=-_LARGEST, le=_LARGEST)]
NotNegative = Annotated[float, Field(ge=0.0, le=_LARGEST)]
Positive = Annotated[float, Field(gt=0.0, le=_LARGEST)]
Name = Annotated[str, Field(min_length=1)]


def _unit(text: str) -> str:
    if text not in SHOWN_AS:
        raise ValueError("there is no such unit")
    return text


Unit = Annotated[str, AfterValidator(_unit)]


class _Accuracy(TypedDict):
    __pydantic_config__ = _STRICT  # type: ignore[misc]

    mean_mm: NotNegative
    rms_mm: NotNegative
    max_mm: NotNegative
    n: Annotated[int, Field(ge=1)]


class _Shared(TypedDict):
    __pydantic_config__ = _STRICT  # type: ignore[misc]

    name: NotRequired[list[Name]]
    unit: NotRequired[list[Unit]]
    nominal: NotRequired[list[Number]]
    prior: NotRequired[list[Positive]]


class _Parameters(_Shared):
    __pydantic_config__ = _STRICT  # type: ignore[misc]

    value: NotRequired[list[Number]]
    deviation: NotRequired[list[NotNegative]]
    truth: NotRequired[list[Number]]


class _Row(TypedDict):
    __pydantic_config__ = _STRICT  # type: ignore[misc]

    name: Name
    status: Literal["calibrated", "failed"]
    message: str
    of: str | None
    date: str | None
    held_out: _Accuracy | None
    nominal: _Accuracy | None
    truth: _Accuracy | None
    parameters: _Parameters
    fit_status: str | None
    notices: list[Name]
    seconds: NotNegative
    robot: str
    errors: list[Name]
    drawn: NotRequired[bool]
    covariance: NotRequired[list[Number]]
    simulated: NotRequired[bool]
    temperature: NotRequired[Number]


class _Said(TypedDict):
    __pydantic_config__ = _STRICT  # type: ignore[misc]

    shared: _Shared
    written: list[Name]
    changed: list[Name]


class _Head(_Said):
    __pydantic_config__ = _STRICT  # type: ignore[misc]

    truearm: Literal["truearm-fleet-part/1"]
    key: str
    part: Annotated[int, Field(ge=1)]
    robots: Annotated[int, Field(ge=1)]


_ROWS: Final[TypeAdapter[Any]] = TypeAdapter(list[_Row])
_SAID: Final[TypeAdapter[Any]] = TypeAdapter(_Said)
_HEAD: Final[TypeAdapter[Any]] = TypeAdapter(_Head)


def head_of(line: bytes) -> dict[str, Any]:
    """Return the first line of a part on disk.

    Raises:
        ValueError: If it is none, or somebody has changed the kind or the range of an entry.
    """
    return dict(_HEAD.validate_json(line))


def said_of(line: bytes) -> dict[str, Any]:
    """Return the first line of a part as :func:`truearm.fleets.series.part_text` makes it, or raise ValueError."""
    return dict(_SAID.validate_json(line))


def rows_of(lines: bytes) -> list[dict[str, Any]]:
    """Return the robots of a part, one a line, or raise ValueError."""
    rows = [*_ROWS.validate_json(b"[" + lines.rstrip(b"\n").replace(b"\n", b",") + b"]")]
    for row in rows:
        calibrated = row["status"] == "calibrated"
        if calibrated == bool(row["message"]):
            raise ValueError("a reason belongs to what failed")
    return rows
