"""What the fields of a dataset must be, and how the rest is refused: by the name of the field."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from numbers import Integral
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from truearm.arrays import axes, number_array, shape_text
from truearm.errors import InputError, wrong_kind
from truearm.modeling.chain import Array

if TYPE_CHECKING:
    from truearm.measurement.dataset import Dataset

IntArray = NDArray[np.intp]

#: The length of a quaternion may be off by this much, as by rounding.
_UNIT: Final = 1e-6
_KINDS: Final = ("revolute", "prismatic")


def refuse_unsound(data: Dataset) -> None:
    """Refuse a dataset whose fields do not fit together, or hold numbers that cannot be."""
    n, m = len(data.labels), len(data.target)
    _distinct(data.labels, "labels")
    _distinct(data.targets, "targets")
    _distinct(data.fixtures, "fixtures")
    _array(data.joints, "joints", (n, len(data.joint_kinds)))
    checked_kinds(data.joint_kinds, len(data.joint_kinds))
    _places(data.configuration, "configuration", m, n)
    _places(data.target, "target", m, len(data.targets))
    if data.fixture is not None:
        _places(data.fixture, "fixture", m, len(data.fixtures), lowest=-1)
    _array(data.position, "position", (m, 3), missing=True)
    if data.quaternion is not None:
        _array(data.quaternion, "quaternion", (m, 4), missing=True)
        refuse_other_lengths(data.quaternion, "quaternion")
    for field in ("distance", "height"):
        lengths: Array | None = getattr(data, field)
        if lengths is not None:
            _array(lengths, field, (m,), missing=True)
    for field in ("sigma", "sigma_rot"):
        deviation: Array | None = getattr(data, field)
        if deviation is not None:
            _array(deviation, field, (m,), missing=True)
            _refuse(deviation <= 0.0, deviation, field, "a standard deviation is not above zero", "above 0")
    if data.approach is not None:
        _array(data.approach, "approach", data.joints.shape)
    for field, shape in (("number", (n,)), ("temperature", (n,)), ("wrench", (n, 6))):
        values: Array | None = getattr(data, field)
        if values is not None:
            _array(values, field, shape)
    if data.references is not None and data.references.labels != data.labels:
        raise InputError("the reference points belong to other configurations", parameter="references")


def refuse_other_lengths(quaternions: Array, parameter: str) -> None:
    """Refuse quaternions ``(n, 4)`` that are neither of length 1 nor missing."""
    length = np.sqrt((quaternions * quaternions).sum(axis=1))
    _refuse(np.abs(length - 1.0) > _UNIT, length, parameter, "a quaternion does not have length 1", "1, or NaN")


def checked_selection(chosen: object, count: int, parameter: str, things: str) -> IntArray:
    """Return the indices that a mask or a sequence of indices chooses."""
    span = f"indices from 0 to {count - 1}, or a mask of {count} {things}" if count else "none: there are none"
    if axes(chosen) != 1 or isinstance(chosen, str | bytes):
        raise wrong_kind("indices or a mask belong here", chosen, parameter, span)
    values = np.asarray(chosen)
    if values.dtype.kind == "b":
        if len(values) != count:
            raise InputError("the mask has the wrong length", parameter=parameter, came=len(values), allowed=span)
        return np.asarray(np.flatnonzero(values), dtype=np.intp)
    if not values.size:
        return np.zeros(0, dtype=np.intp)
    if values.dtype.kind not in "iu":
        raise InputError("indices must be whole numbers", parameter=parameter, came=str(values[0]), allowed=span)
    outside = (values < 0) | (values >= count)
    _refuse(outside, values, parameter, "there is no such index", span)
    return np.asarray(values, dtype=np.intp)


def checked_labels(names: Sequence[str | int] | None, parameter: str, count: int) -> tuple[str, ...]:
    """Return names of `count` things, ``1``, ``2`` and so on if None."""
    if names is None:
        return tuple(str(number + 1) for number in range(count))
    if isinstance(names, str | bytes) or axes(names) != 1 or len(names) != count:
        raise wrong_kind("the names do not fit the positions", names, parameter, f"{count} names")
    for name in names:
        if isinstance(name, bool) or not isinstance(name, str | Integral):
            raise wrong_kind("a name must be a text", name, parameter, "texts")
    made = tuple(str(name) for name in names)
    _distinct(made, parameter)
    return made


def distinct_labels(labels: Sequence[str]) -> tuple[str, ...]:
    """Return the labels, those that are there again with their number."""
    made: list[str] = []
    taken, last = set(labels), dict[str, int]()
    for label in labels:
        name, last[label] = label, last.get(label, 0) + 1
        if last[label] > 1:
            while (name := f"{label}#{last[label]}") in taken:
                last[label] += 1
            taken.add(name)
        made.append(name)
    return tuple(made)


def checked_kinds(kinds: Sequence[str] | None, count: int) -> tuple[str, ...]:
    """Return the kind of each joint, revolute if None."""
    if kinds is None:
        return ("revolute",) * count
    if isinstance(kinds, str | bytes) or axes(kinds) != 1 or len(kinds) != count or {*kinds} - {*_KINDS}:
        allowed = f"{count} of {', '.join(_KINDS)}"
        raise wrong_kind("a kind of each joint belongs here", kinds, "joint_kinds", allowed)
    return tuple(kinds)


def checked_sigma(sigma: ArrayLike, parameter: str, shape: tuple[int, ...]) -> Array:
    """Return a standard deviation for each reading, from one for all, one a configuration or one for each."""
    given = axes(sigma)
    found = number_array(sigma, parameter, shape[:given] if 0 <= given <= len(shape) else shape, missing=True)
    if given == 0 and np.isnan(found):
        raise InputError("NaN cannot be used here", parameter=parameter, allowed="above 0")
    return np.array(np.broadcast_to(found.reshape(found.shape + (1,) * (len(shape) - found.ndim)), shape)).ravel()


def checked_order(order: ArrayLike, count: int) -> IntArray:
    """Return the place of each configuration in the order of measurement."""
    places = number_array(order, "order", (count,))
    whole = np.asarray(np.round(places), dtype=np.intp)
    _refuse(
        (places != whole) | (places < 0), places, "order", "places must be whole numbers", "whole numbers, 0 or more"
    )
    if len(np.unique(whole)) < count:
        raise InputError("two configurations have the same place", parameter="order", allowed="each place once")
    return whole


def _array(values: object, field: str, shape: tuple[int | str, ...], *, missing: bool = False) -> None:
    if not isinstance(values, np.ndarray):
        raise wrong_kind("an array belongs here", values, field, shape_text(shape))
    number_array(values, field, shape, missing=missing)


def _places(values: object, field: str, count: int, end: int, lowest: int = 0) -> None:
    _array(values, field, (count,))
    assert isinstance(values, np.ndarray)
    allowed = f"{lowest} to {end - 1}"
    if values.dtype.kind not in "iu":
        raise InputError("indices must be whole numbers", parameter=field, came=str(values.dtype), allowed=allowed)
    _refuse((values < lowest) | (values >= end), values, field, "there is no such index", allowed)


def _distinct(names: Sequence[str], field: str) -> None:
    if len({*names}) < len(names):
        twice = Counter(names).most_common(1)[0][0]
        raise InputError("two have the same name", parameter=field, came=twice, allowed="each name once")


def _refuse(wrong: NDArray[np.bool_], values: NDArray[np.generic], field: str, what: str, allowed: str) -> None:
    if wrong.any():
        place = int(np.flatnonzero(wrong)[0])
        raise InputError(what, parameter=field, came=f"{values[place]:g} at index {place}", allowed=allowed)
