"""Numbers and arrays that callers give: what is none, or has the wrong shape, is refused by the parameter's name."""

from __future__ import annotations

import math
from collections.abc import Mapping
from numbers import Real
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError, wrong_kind
from truearm.engine.base.units import accepted_range

#: No number that is meant is larger: the limit of every file holds for arrays too [SI].
LARGEST: Final = accepted_range("1")[1]


def number_array(
    value: object,
    parameter: str,
    shape: tuple[int | str, ...],
    *,
    missing: bool = False,
    allowed: str | None = None,
    largest: float = LARGEST,
) -> NDArray[np.float64]:
    """Return numbers as an array of floats, refusing what has another shape or holds anything else.

    Args:
        shape: Length of each axis; a letter for one that may have any length.
        missing: Whether NaN may stand for numbers that are missing; what an array masks is missing.
        allowed: What belongs here, for the message; numbers of that shape if None.
        largest: Size that no number may exceed.
    """
    allowed = allowed or f"numbers, {shape_text(shape)}"
    try:
        values = _without_mask(value)
    except (ValueError, TypeError):
        raise InputError("the rows are not of one length", parameter=parameter, allowed=allowed) from None
    if values.dtype.kind not in "iuf":
        raise wrong_kind("numbers belong here", value, parameter, allowed)
    if isinstance(values, np.ma.MaskedArray):
        if not missing:
            raise InputError("masked numbers cannot be used here", parameter=parameter, allowed=allowed)
        values = np.ma.filled(values.astype(float), np.nan)
    fits = values.ndim == len(shape) and all(
        isinstance(length, str) or length == size for length, size in zip(shape, values.shape, strict=True)
    )
    if not fits:
        raise InputError(
            "the array has the wrong shape", parameter=parameter, came=shape_text(values.shape), allowed=allowed
        )
    numbers = np.asarray(values, float)
    size = np.abs(numbers)
    wrong = size > largest if missing else ~(size <= largest)
    if wrong.any():
        place = tuple(np.argwhere(wrong)[0].tolist())
        if np.isfinite(numbers[place]):
            raise InputError(
                "the number is too large to be plausible",
                parameter=parameter,
                came=f"{numbers[place]:g}{f' at {list(place)}' if place else ''}",
                allowed=f"{-largest:g} to {largest:g}, in SI units",
                cure="Correct the number, or its unit.",
            )
        raise InputError(
            "infinity cannot be used here" if missing else "NaN and infinity cannot be used here",
            parameter=parameter,
            came=f"{numbers[place]}{f' at {list(place)}' if place else ''}",
            allowed="finite numbers, NaN where one is missing" if missing else "finite numbers",
        )
    return numbers


def _without_mask(value: object) -> NDArray[np.generic]:
    """Return an array, without its mask if that hides nothing."""
    rows = value if isinstance(value, list | tuple) else [value]
    if not any(isinstance(row, np.ma.MaskedArray) for row in rows):
        return np.asarray(value)
    masked: np.ma.MaskedArray[tuple[int, ...], np.dtype[np.generic]] = np.ma.array(value)
    return masked if np.ma.is_masked(masked) else np.asarray(masked.data)


def axes(value: object) -> int:
    """Return how many axes an array has, 0 of a number and -1 of what is no array."""
    try:
        return int(np.ndim(value))  # type: ignore[arg-type]
    except (TypeError, ValueError):  # such as rows of different lengths
        return -1


def finite_number(
    value: object, parameter: str, *, where: str | None = None, lowest: float = -math.inf, allowed: str | None = None
) -> float:
    """Return a finite number, `lowest` or more; `allowed` says what belongs here if not that."""
    if type(value) is float and math.isfinite(value) and value >= lowest:  # nearly all of them, and they are many
        return value
    if allowed is None:
        allowed = "a finite number" if lowest == -math.inf else f"a finite number, {lowest:g} or more"
    if isinstance(value, bool | np.bool_) or not isinstance(value, Real):
        raise wrong_kind("a number belongs here", value, parameter, allowed, where=where)
    if where is not None:
        where = f"{where}, {parameter}"
    try:
        number = float(value)
    except OverflowError:
        raise InputError(
            "the number is too large", parameter=parameter, where=where, came=value, allowed=allowed
        ) from None
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
