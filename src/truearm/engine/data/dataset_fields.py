"""What the fields of a dataset must be, and how the rest is refused: by the name of the field."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from numbers import Integral
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from truearm.engine.base.arrays import LARGEST, axes, finite_number, number_array, shape_text
from truearm.engine.base.errors import InputError, is_one_line, wrong_kind
from truearm.engine.base.units import accepted_range
from truearm.engine.robot.chain import Array

if TYPE_CHECKING:
    from truearm.engine.data.dataset import Dataset

IntArray = NDArray[np.intp]

#: The length of a quaternion may be off by this much, as by rounding.
_UNIT: Final = 1e-6
_KINDS: Final = ("revolute", "prismatic")
_JOINTS_ARE: Final = ("model", "controller", "converted")
#: Highest place in the order of measurement: whole numbers are exact up to here.
_LAST: Final = 2.0**53
#: What a label ends with that was there before: #2 or more, of a copy of a copy again.
_REPEATED: Final = re.compile(r"(#([2-9]|[1-9][0-9]+))+$")
#: Label of the configuration that says nothing, of what is known of fixtures.
_NO_CONFIGURATION: Final = ("",)
#: What names can be: those that files can hold.
NAMES: Final = "one line of text without control characters, not blank"
#: What visits of a configuration are numbered with.
VISITS: Final = "whole numbers, 0 or more"
#: Highest standard deviation of an instrument's scale that is meant.
LARGEST_SCALE: Final = 0.1
#: Lowest and highest standard deviation that is meant [m, rad].
_DEVIATIONS: Final = {"sigma": accepted_range("m", deviation=True), "sigma_rot": accepted_range("rad", deviation=True)}


def refuse_unsound(data: Dataset) -> None:
    """Refuse a dataset whose fields do not fit together, or hold numbers that cannot be."""
    if not isinstance(data.source, str):
        raise wrong_kind("a text belongs here", data.source, "source", "what messages call the data")
    for field in ("labels", "targets", "fixtures"):
        _names(getattr(data, field), field)
    if not isinstance(data.joint_kinds, tuple):
        raise wrong_kind("a kind of each joint belongs here", data.joint_kinds, "joint_kinds", "a tuple of texts")
    checked_kinds(data.joint_kinds, len(data.joint_kinds))
    if data.joints_are not in _JOINTS_ARE:
        raise InputError(
            "there is no such kind of joint positions",
            parameter="joints_are",
            came=str(data.joints_are),
            allowed=", ".join(_JOINTS_ARE),
        )
    _places(data.target, "target", "readings", len(data.targets))
    n, m = len(data.labels), len(data.target)
    _array(data.joints, "joints", (n, len(data.joint_kinds)))
    _places(data.configuration, "configuration", m, n)
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
    for field, unit in (("sigma", "m"), ("sigma_rot", "rad")):
        deviation: Array | None = getattr(data, field)
        if deviation is not None:
            _array(deviation, field, (m,), missing=True)
            _refuse(deviation <= 0.0, deviation, field, "a standard deviation is not above zero", "above 0")
            low, high = _DEVIATIONS[field]
            off = (deviation < low) | (deviation > high)
            _refuse(off, deviation, field, "the standard deviation is not plausible", f"{low:g} to {high:g} {unit}")
    if data.scale_sigma is not None:
        finite_number(data.scale_sigma, "scale_sigma", lowest=0.0)
        if not 0.0 < data.scale_sigma <= LARGEST_SCALE:
            raise InputError(
                "the standard deviation of a scale is not plausible",
                parameter="scale_sigma",
                came=f"{data.scale_sigma:g}",
                allowed=f"above 0, up to {LARGEST_SCALE:g}",
            )
    if data.visit is not None:
        visits = _array(data.visit, "visit", (m,))
        if visits.dtype.kind not in "iu":
            raise InputError("visits must be whole numbers", parameter="visit", came=str(visits.dtype), allowed=VISITS)
        _refuse((visits < 0) | (visits > _LAST), visits, "visit", "this is no number of a visit", VISITS)
    if data.approach is not None:
        _array(data.approach, "approach", data.joints.shape)
        signs = data.approach
        _refuse(np.abs(np.abs(signs) - 0.5) != 0.5, signs, "approach", "this is no sign of a move", "1, -1 or 0")
    for field, shape in (("number", (n,)), ("temperature", (n,)), ("wrench", (n, 6))):
        values: Array | None = getattr(data, field)
        if values is not None:
            _array(values, field, shape)
    for field in ("setup", "references"):
        part = getattr(data, field)
        if part is not None and not isinstance(part, type(data)):
            raise wrong_kind("a dataset belongs here", part, field, "a Dataset, or None")
    if data.references is not None and data.references.joints_are != data.joints_are:
        raise InputError("the joints of the reference points are of another kind", parameter="references")
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
    if np.ma.is_masked(chosen):
        raise InputError("masked entries choose nothing", parameter=parameter, allowed=span)
    values = np.asarray(chosen)
    if values.dtype.kind == "b":
        if len(values) != count:
            raise InputError("the mask has the wrong length", parameter=parameter, came=len(values), allowed=span)
        return np.asarray(np.flatnonzero(values), dtype=np.intp)
    if not values.size:
        return np.zeros(0, dtype=np.intp)
    mixed = isinstance(chosen, list | tuple) and any(isinstance(v, bool | np.bool_) for v in chosen)
    if mixed or values.dtype.kind not in "iu":
        came = "True or False among numbers" if mixed else str(values[0])
        raise InputError("indices must be whole numbers", parameter=parameter, came=came, allowed=span)
    outside = (values < 0) | (values >= count)
    _refuse(outside, values, parameter, "there is no such index", span)
    return np.asarray(values, dtype=np.intp)


def checked_joints(joints: ArrayLike) -> Array:
    """Return joint positions, ``(n, joints)``."""
    values = np.array(number_array(joints, "joints", ("n", "joints")))
    if not len(values):
        raise InputError("there is no configuration", parameter="joints", allowed="one row or more")
    return values


def checked_positions(positions: ArrayLike, count: int) -> tuple[Array, tuple[int, ...]]:
    """Return positions ``(count, targets, 3)``, NaN where a coordinate is missing, and the shape of the readings."""
    is_single = axes(positions) == 2
    values = number_array(positions, "positions", (count, 3) if is_single else (count, "targets", 3), missing=True)
    values = values.reshape(count, 1 if is_single else values.shape[1], 3)
    if not values.shape[1]:
        raise InputError("there is no target", parameter="positions", allowed="one target or more")
    whole = np.isfinite(values).all(axis=2, keepdims=True)
    return np.where(whole, values, np.nan), (count,) if is_single else values.shape[:2]


def checked_quaternions(quaternions: ArrayLike, shape: tuple[int, ...]) -> Array:
    """Return the orientation of each reading, ``(readings, 4)``."""
    values = np.array(number_array(quaternions, "quaternions", (*shape, 4), missing=True)).reshape(-1, 4)
    refuse_other_lengths(values, "quaternions")
    return values


def checked_labels(names: Sequence[str | int] | None, parameter: str, count: int) -> tuple[str, ...]:
    """Return names of `count` things, ``1``, ``2`` and so on if None."""
    if names is None:
        return tuple(str(number + 1) for number in range(count))
    if isinstance(names, str | bytes) or axes(names) != 1 or len(names) != count:
        raise wrong_kind("the names do not fit the positions", names, parameter, f"{count} names")
    for name in names:
        if isinstance(name, bool) or not isinstance(name, str | Integral):
            raise wrong_kind("a name must be a text", name, parameter, "texts")
    labels = tuple(str(name) for name in names)
    _names(labels, parameter)
    return labels


def distinct_labels(labels: Sequence[str]) -> tuple[str, ...]:
    """Return the labels, those that are there again with their number."""
    distinct: list[str] = []
    taken, last = set(labels), dict[str, int]()
    for label in labels:
        name, last[label] = label, last.get(label, 0) + 1
        if last[label] > 1:
            while (name := f"{label}#{last[label]}") in taken:
                last[label] += 1
            taken.add(name)
        distinct.append(name)
    return tuple(distinct)


def drawn_from(label: str) -> str:
    """Return the label without the numbers that :func:`distinct_labels` adds to it."""
    return _REPEATED.sub("", label)


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
    ndim = axes(sigma)
    if np.ma.is_masked(sigma):
        raise InputError("masked numbers cannot be used here", parameter=parameter, allowed="numbers without a mask")
    values = number_array(sigma, parameter, shape[:ndim] if 0 <= ndim <= len(shape) else shape, missing=True)
    if ndim == 0 and np.isnan(values):
        raise InputError("NaN cannot be used here", parameter=parameter, allowed="above 0")
    return np.array(np.broadcast_to(values.reshape(values.shape + (1,) * (len(shape) - values.ndim)), shape)).ravel()


def checked_visits(visit: ArrayLike, shape: tuple[int, ...]) -> IntArray:
    """Return the number of the visit of each reading, from one for each configuration or for each reading."""
    ndim = axes(visit)
    values = number_array(visit, "visit", shape[:ndim] if 1 <= ndim <= len(shape) else shape, largest=_LAST)
    whole = np.asarray(np.round(values), dtype=np.intp)
    _refuse((values != whole) | (values < 0), values, "visit", "visits must be whole numbers", VISITS)
    return np.array(np.broadcast_to(whole.reshape(whole.shape + (1,) * (len(shape) - whole.ndim)), shape)).ravel()


def checked_order(order: ArrayLike, count: int) -> IntArray:
    """Return the place of each configuration in the order of measurement."""
    places = number_array(order, "order", (count,), largest=_LAST)
    whole = np.asarray(np.round(places), dtype=np.intp)
    _refuse(
        (places != whole) | (places < 0), places, "order", "places must be whole numbers", "whole numbers, 0 or more"
    )
    if len(np.unique(whole)) < count:
        raise InputError("two configurations have the same place", parameter="order", allowed="each place once")
    return whole


def _array(values: object, field: str, shape: tuple[int | str, ...], *, missing: bool = False) -> NDArray[Any]:
    if not isinstance(values, np.ndarray) or isinstance(values, np.ma.MaskedArray):
        raise wrong_kind("an array belongs here", values, field, f"an array without a mask, {shape_text(shape)}")
    number_array(values, field, shape, missing=missing, largest=_LAST if field == "number" else LARGEST)
    return values


def _places(values: object, field: str, count: int | str, end: int, lowest: int = 0) -> None:
    indices = _array(values, field, (count,))
    allowed = f"{lowest} to {end - 1}"
    if indices.dtype.kind not in "iu":
        raise InputError("indices must be whole numbers", parameter=field, came=str(indices.dtype), allowed=allowed)
    _refuse((indices < lowest) | (indices >= end), indices, field, "there is no such index", allowed)


def _names(names: object, field: str) -> None:
    if not isinstance(names, tuple):
        raise wrong_kind("names belong here", names, field, "a tuple of texts")
    if field == "labels" and names == _NO_CONFIGURATION:
        return
    quick = False
    with suppress(TypeError):  # what is printable is one line, and quickly asked of all
        quick = "".join(names).isprintable() and all(map(str.strip, names))
    for name in () if quick else names:
        if not isinstance(name, str):
            raise wrong_kind("a name must be a text", name, field, "a tuple of texts")
        if not is_one_line(name):
            raise InputError("this cannot be a name", parameter=field, came=name, allowed=NAMES)
    _distinct(names, field)


def _distinct(names: Sequence[str], field: str) -> None:
    if len({*names}) < len(names):
        twice = Counter(names).most_common(1)[0][0]
        raise InputError("two have the same name", parameter=field, came=twice, allowed="each name once")


def _refuse(wrong: NDArray[np.bool_], values: NDArray[np.generic], field: str, what: str, allowed: str) -> None:
    if wrong.any():
        place = tuple(np.argwhere(wrong)[0].tolist())
        shown = place[0] if len(place) == 1 else list(place)
        raise InputError(what, parameter=field, came=f"{values[place]:g} at index {shown}", allowed=allowed)
