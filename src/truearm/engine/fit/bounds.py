"""Bounds on parameters, from a file."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from truearm.engine.base.errors import InputError, did_you_mean
from truearm.engine.base.files import read_yaml
from truearm.engine.base.units import SHOWN_AS, to_si
from truearm.engine.robot.chain import Array
from truearm.engine.robot.parameters import FreeParameters, Parameter

_Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]


class _Units(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)
    length: Literal["mm", "m", "um", "in"]
    angle: Literal["deg", "rad"]


class Bounds(BaseModel):
    """Schema ``truearm-bounds/1``.

    A name is a parameter (``theta_offset_2``) or a family (``theta_offset``: those of all joints).
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    truearm: Literal["truearm-bounds/1"]
    units: _Units
    #: Largest distance from the nominal value.
    within: dict[str, Annotated[float, Field(ge=0, strict=True, allow_inf_nan=False)]] = {}
    between: dict[str, tuple[_Number, _Number]] = {}  #: Lowest and highest value.


def read_bounds(path: Path) -> Bounds:
    """Read a bounds file."""
    return read_yaml(path, Bounds)


def bound_vectors(
    bounds: Bounds, free: FreeParameters, where: str, others: Iterable[Parameter] = ()
) -> tuple[Array, Array]:
    """Return lowest and highest value of every free parameter [SI], infinite where the file says nothing.

    Args:
        others: What is not free, and may be named all the same.

    Raises:
        InputError: For a name that is no free parameter and no family of them, or bounds that leave no room.
    """
    low = np.full(len(free.names), -np.inf)
    high = np.full(len(free.names), np.inf)
    shown = {**SHOWN_AS, "m": bounds.units.length, "rad": bounds.units.angle}
    for name, width in bounds.within.items():
        for i in _places(name, free, others, f"{where}, within"):
            p = free.parameters[i]
            size = to_si(width, shown[p.unit])
            low[i], high[i] = max(low[i], p.nominal - size), min(high[i], p.nominal + size)
    for name, (lowest, highest) in bounds.between.items():
        for i in _places(name, free, others, f"{where}, between"):
            unit = shown[free.parameters[i].unit]
            low[i], high[i] = max(low[i], to_si(lowest, unit)), min(high[i], to_si(highest, unit))
    for i in np.flatnonzero(low > high).tolist():
        raise InputError(
            "the bounds leave no value",
            parameter="bounds",
            where=f"{where}, {free.names[i]}",
            cure="The lower one must not be higher.",
        )
    return low, high


def _places(name: str, free: FreeParameters, others: Iterable[Parameter], where: str) -> list[int]:
    indices = [i for i, p in enumerate(free.parameters) if name in (p.name, _family(p))]
    if indices or any(name in (p.name, _family(p)) for p in others):
        return indices
    known = sorted({*free.names, *(_family(p) for p in free.parameters)})
    raise InputError(
        "no free parameter of this model has this name",
        parameter="bounds",
        where=where,
        came=name,
        allowed=", ".join(known),
        cure=did_you_mean(name, known),
    )


def _family(p: Parameter) -> str:
    return p.name.rpartition("_")[0] if p.group not in ("base", "target") else p.name
