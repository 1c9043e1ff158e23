"""Which values of two results were planned alike: at the same places, with one tip, under the same rated conditions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Final

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from truearm.modeling.chain import Array
from truearm.planning.iso9283.criteria import TEST_OF, TESTS
from truearm.planning.iso9283.planned import PerformancePlan

#: Places are the same within this length [mm], and turns within this entry of their matrices.
_SAME_LENGTH: Final = 1e-2
_SAME_TURN: Final = 1e-4
#: Rated values, limit bands and times are the same within this share; bandwidths of FV within this factor.
_SAME_SHARE: Final = 1e-3
_SAME_BANDWIDTH: Final = 1.25

_Finite = Annotated[float, Field(allow_inf_nan=False, ge=-1e9, le=1e9)]
_Row = tuple[_Finite, _Finite, _Finite]


class Place(BaseModel):
    """A pose or a path: its points [mm], and three columns for each orientation."""

    model_config = ConfigDict(extra="ignore", frozen=True)
    points_mm: tuple[_Row, ...]
    turns: tuple[_Row, ...]


class PlanOfResult(BaseModel):
    """What a result says of its plan."""

    model_config = ConfigDict(extra="ignore", frozen=True)
    tip: Place
    limit_band_mm: _Finite
    drift_h: _Finite
    places: dict[str, Place]


class Rated(BaseModel):
    """What 100 % stands for in a result."""

    model_config = ConfigDict(extra="ignore", frozen=True)
    load_kg: _Finite
    velocity_mm_s: _Finite


def plan_summary(plan: PerformancePlan) -> dict[str, Any]:
    """Return what another result has to know of a plan, as JSON holds it."""
    tip = plan.robot.tool_place(plan.target)
    poses = {
        **plan.poses,
        **{f"{pose} from {approach}": start for (pose, approach), start in plan.starts.items()},
    }
    return {
        "tip": _place([np.array(tip.translation)], [tip.rotation]),
        "limit_band_mm": plan.limit_band * 1e3,
        "drift_h": plan.hours,
        "places": {
            **{name: _place([pose.position], [pose.rotation]) for name, pose in poses.items()},
            **{
                name: _place(
                    [*path.points, [path.stroke, path.wavelength, 0.0]],
                    [path.rotation, *([] if path.other is None else [path.other]), path.normal],
                )
                for name, path in plan.paths.items()
            },
        },
    }


def _place(points: Any, turns: list[Array]) -> dict[str, Any]:
    return {
        "points_mm": [[round(1e3 * float(value), 6) for value in point] for point in points],
        "turns": [[round(float(value), 9) for value in row] for turn in turns for row in np.reshape(turn, (-1, 3))],
    }


def same_place(one: Place, other: Place) -> bool:
    """Return whether two results have a place alike."""
    return _same(one.points_mm, other.points_mm, _SAME_LENGTH) and _same(one.turns, other.turns, _SAME_TURN)


def _same(one: tuple[_Row, ...], other: tuple[_Row, ...], within: float) -> bool:
    return len(one) == len(other) and bool(np.allclose(one, other, rtol=0.0, atol=within))


def unlike_rated(id_: str, conditions: Mapping[str, float | str], one: Rated, other: Rated) -> str | None:
    """Return why values of a criterion were measured under other rated conditions, None if they were not."""
    loaded = conditions.get("load_percent", 100.0 if id_ == "compliance" else 0.0)
    if loaded != 0.0 and not _near(one.load_kg, other.load_kg):
        return f"the rated load was {other.load_kg:g} kg there, and is {one.load_kg:g} kg here"
    if TESTS[TEST_OF[id_]].readings == "paths" and not _near(one.velocity_mm_s, other.velocity_mm_s):
        return f"the rated velocity was {other.velocity_mm_s:g} mm/s there, and is {one.velocity_mm_s:g} mm/s here"
    return None


def unlike_plans(id_: str, where: str, one: PlanOfResult, other: PlanOfResult) -> str | None:
    """Return why values of a criterion were planned otherwise, None if they were not."""
    test = TEST_OF[id_]
    if test in ("t", "posing-time") and not _near(one.limit_band_mm, other.limit_band_mm):
        return f"the limit band was {other.limit_band_mm:g} mm there, and is {one.limit_band_mm:g} mm here"
    if test == "dAP" and not _near(one.drift_h, other.drift_h):
        return f"drift was planned over {other.drift_h:g} h there, and over {one.drift_h:g} h here"
    for name in sorted({*one.places, *other.places}):
        if _is_of(name, test, where):
            here, there = one.places.get(name), other.places.get(name)
            if here is None or there is None or not same_place(here, there):
                return "poses or paths were planned elsewhere"
    return None


def unlike_bandwidths(one: float | None, other: float | None) -> str | None:
    """Return why values of FV were read otherwise, None if they were not."""
    if one is None or other is None or max(one, other) <= _SAME_BANDWIDTH * min(one, other):
        return None
    return f"fluctuation was read up to {other:.3g} Hz there, and up to {one:.3g} Hz here"


def _near(one: float, other: float) -> bool:
    return abs(one - other) <= _SAME_SHARE * max(abs(one), abs(other))


def _is_of(name: str, test: str, where: str) -> bool:
    """Return whether a value has to do with a place: ``P1-D10`` with P1 and D10, ``rectangle E2`` with it."""
    if test == "compliance":
        return name in TESTS[test].places
    if where == name or where.startswith((f"{name} ", f"{name}-")) or where.endswith(f"-{name}"):
        return True
    return test == "vAP" and name.startswith(f"{where} from ")
