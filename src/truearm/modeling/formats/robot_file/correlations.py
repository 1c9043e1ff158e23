"""Correlations of a proof in a robot file: rows of numbers, or, where there are thousands of them, one short text.

The factor of hundreds of parameters has tens of thousands of numbers, which nobody reads and YAML reads slowly. They
are whole multiples of 1e-7 (:mod:`truearm.modeling.proof` rounds them) from -1 to 1, and are written as 25 bits each in
base64: two fifths of their length in digits. Others are written in digits, so that nothing is lost.
"""

from __future__ import annotations

import base64
import binascii
import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.modeling.proof import DECIMALS
from truearm.shown import counted
from truearm.units import as_number

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
        found = base64.b64decode(text, validate=True)
    except (binascii.Error, ValueError):
        found = None
    numbers = count * (count + 1) // 2
    length = math.ceil(numbers * len(_PLACES) / 8)
    if found is None or len(found) != length:
        raise InputError(
            "this is no text of correlations of so many parameters",
            where=where,
            came="other signs than those of base64" if found is None else counted(len(found), "byte"),
            allowed=f"{length} bytes in base64",
            cure=cure,
        )
    bits = np.unpackbits(np.frombuffer(found, dtype=np.uint8), count=numbers * len(_PLACES)).reshape(numbers, -1)
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
