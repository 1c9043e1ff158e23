"""Numbers and arrays that callers give: what is none, or has the wrong shape, is refused by the parameter's name."""

from __future__ import annotations

import math
from collections.abc import Mapping
from numbers import Real

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError, wrong_kind


def number_array(
    given: object, parameter: str, shape: tuple[int | str, ...], *, missing: bool = False, allowed: str | None = None
) -> NDArray[np.float64]:
    """Return numbers as an array of floats, refusing what has another shape or holds anything else.

    Parameters
    ----------
    shape
        Length of each axis; a letter for one that may have any length.
    missing
        Whether NaN may stand for numbers that are missing.
    allowed
        What belongs here, for the message; numbers of that shape if None.
    """
    allowed = allowed or f"numbers, {shape_text(shape)}"
    try:
        values = np.asarray(given)
    except (ValueError, TypeError):
        raise InputError("the rows are not of one length", parameter=parameter, allowed=allowed) from None
    if values.dtype.kind not in "iuf":
        raise wrong_kind("numbers belong here", given, parameter, allowed)
    fits = values.ndim == len(shape) and all(
        isinstance(length, str) or length == there for length, there in zip(shape, values.shape, strict=True)
    )
    if not fits:
        raise InputError(
            "the array has the wrong shape", parameter=parameter, came=shape_text(values.shape), allowed=allowed
        )
    numbers = np.asarray(values, float)
    wrong = np.isinf(numbers) if missing else ~np.isfinite(numbers)
    if wrong.any():
        place = tuple(np.argwhere(wrong)[0].tolist())
        raise InputError(
            "infinity cannot be used here" if missing else "NaN and infinity cannot be used here",
            parameter=parameter,
            came=f"{numbers[place]}{f' at {list(place)}' if place else ''}",
            allowed="finite numbers, NaN where one is missing" if missing else "finite numbers",
        )
    return numbers


def axes(given: object) -> int:
    """Return how many axes an array has, 0 of a number and -1 of what is no array."""
    try:
        return int(np.ndim(given))  # type: ignore[arg-type]
    except (TypeError, ValueError):  # such as rows of different lengths
        return -1


def finite_number(
    value: object,
    parameter: str,
    *,
    where: str | None = None,
    lowest: float = -math.inf,
    allowed: str | None = None,
) -> float:
    """Return a finite number, `lowest` or more; `allowed` says what belongs here if not that."""
    if type(value) is float and math.isfinite(value) and value >= lowest:  # nearly all of them, and they are many
        return value
    if allowed is None:
        allowed = "a finite number" if lowest == -math.inf else f"a finite number, {lowest:g} or more"
    if isinstance(value, bool | np.bool_) or not isinstance(value, Real):
        raise wrong_kind("a number belongs here", value, parameter, allowed, where=where)
    number = float(value)
    if not math.isfinite(number) or number < lowest:
        raise InputError(
            "the number cannot be used", parameter=parameter, where=where, came=f"{number:g}", allowed=allowed
        )
    return number


def finite_numbers(values: object, parameter: str, *, allowed: str) -> dict[str, float]:
    """Return finite numbers by name."""
    if not isinstance(values, Mapping):
        raise wrong_kind("numbers by name belong here", values, parameter, allowed)
    return {name: finite_number(value, parameter, where=str(name)) for name, value in values.items()}


def shape_text(shape: tuple[int | str, ...]) -> str:
    """Return a shape as messages show it, such as ``(n, 3)``."""
    return f"({', '.join(map(str, shape))}{',' if len(shape) == 1 else ''})"
