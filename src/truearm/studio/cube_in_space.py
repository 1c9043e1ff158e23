"""Tests by ISO 9283 in space: the cube, its poses and paths, and the errors that a result has there."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Final, Protocol, TypeVar

import numpy as np

from truearm.engine.motion.cube import Cube
from truearm.engine.robot.chain import Array
from truearm.iso9283.criteria.rows import Conditions
from truearm.iso9283.evaluating.comparison import PlanOfResult, ResultFile, plan_summary
from truearm.iso9283.evaluating.table import conditions_of, velocity_words
from truearm.iso9283.planning.criteria import PerformancePlan, Way

#: Corners of the cube that an edge joins, as C1 to C8 are numbered.
_EDGES: Final = np.array(
    [(k, (k + 1) % 4) for k in range(4)] + [(4 + k, 4 + (k + 1) % 4) for k in range(4)] + [(k, k + 4) for k in range(4)]
)
#: A path is drawn in about so many pieces.
_PIECES: Final = 160


class _UnderConditions(Protocol):
    @property
    def conditions(self) -> dict[str, float | str]: ...


_Kind = TypeVar("_Kind", bound=_UnderConditions)


@dataclass(frozen=True, eq=False)
class CubeInSpace:
    """What is drawn of tests, in the base frame [m]."""

    frame: Array  #: Edges of the cube, and of the plane in it, ``(n, 2, 3)``.
    poses: Mapping[str, Array]  #: Where each commanded pose is, by its name.
    paths: Array  #: Pieces of the commanded paths, ``(m, 2, 3)``.
    #: How far the barycentre of the attained paths is from each piece [m], ``(m,)``; NaN where that is not known.
    path_errors: Array
    #: names, commands, offsets, repeatability: of the poses with a result: their names, where they are, where the
    #: barycentre of the attained poses is from there, ``(k, 3)``, and RP, ``(k,)``; NaN where there is none.
    names: tuple[str, ...] = ()
    commands: Array = field(default_factory=lambda: np.zeros((0, 3)))
    offsets: Array = field(default_factory=lambda: np.zeros((0, 3)))
    repeatability: Array = field(default_factory=lambda: np.zeros(0))
    under: str = ""  #: At which velocity that was, in words; of several the fastest.

    @property
    def accuracy(self) -> Array:
        """AP of each pose [m], ``(k,)``."""
        return np.asarray(np.linalg.norm(self.offsets, axis=1))

    @property
    def largest(self) -> float:
        """The largest AP or AT [m]; 0 without a result."""
        errors = np.concatenate([self.accuracy, self.path_errors])
        return float(np.max(errors[np.isfinite(errors)], initial=0.0))

    def words(self, factor: float, factor_rp: float) -> str:
        """Return what must stand beside the errors: how much they are magnified, and how large the largest is."""
        said = f"AP x {factor:g}, largest {self.accuracy.max() * 1e3:.3g} mm" if len(self.names) else ""
        return f"{said}; RP x {factor_rp:g}" if np.isfinite(self.repeatability).any() else said

    def legend(self) -> str:
        """Return what colours and sizes say; an empty text without a result."""
        said = []
        if len(self.names):
            said.append(
                "Arrows go from the command to the barycentre of the attained poses, spheres have the radius RP"
            )
        if np.isfinite(self.path_errors).any():
            said.append(
                f"paths are coloured by how far the barycentre of the attained ones is aside, at most "
                f"{np.nanmax(self.path_errors) * 1e3:.3g} mm"
            )
        if not said:
            return ""
        return f"{'; '.join(said)}; colours go from 0 (blue) to {self.largest * 1e3:.3g} mm (yellow). {self.under}"


def cube_in_space(plan: PerformancePlan, result: ResultFile | None) -> CubeInSpace:
    """Return what is drawn of a plan, and of its result if there is one."""
    poses = {name: pose.position for name, pose in plan.poses.items()}
    offsets = (
        [] if result is None else [offset for offset in result.offsets if offset.id == "AP" and offset.where in poses]
    )
    offsets = _fastest(offsets, lambda one: None not in one.offset_mm)
    curves = {} if result is None else {one.where: one for one in _fastest([c for c in result.curves if c.id == "AT"])}
    pieces, errors = [np.zeros((0, 2, 3))], [np.zeros(0)]
    for name, path in plan.paths.items():
        way, curve = Way(path), curves.get(name)
        if curve is not None and len(curve.along_mm) > 1:
            chosen = np.unique(np.linspace(0, len(curve.along_mm) - 1, _PIECES).round().astype(np.intp))
            along = np.array(curve.along_mm, float)[chosen] / 1e3
            aside = np.array(curve.distance_mm, float)[chosen] / 1e3
            ends, found = way.position(along), np.maximum(aside[:-1], aside[1:])
        else:
            along = np.unique(np.concatenate([np.linspace(0.0, way.length, _PIECES), way.corners]))
            ends, found = way.position(along), np.full(len(along) - 1, np.nan)
        pieces.append(np.stack([ends[:-1], ends[1:]], axis=1))
        errors.append(found)
    made = CubeInSpace(_frame(plan.cube, plan.plane), poses, np.concatenate(pieces), np.concatenate(errors))
    if not offsets:
        return made
    first = conditions_of(offsets[0].conditions)
    radii = (
        {}
        if result is None
        else {
            value.where: value.value / 1e3
            for value in result.criteria
            if value.id == "RP"
            and value.component == "position"
            and value.value is not None
            and conditions_of(value.conditions) == first
        }
    )
    return replace(
        made,
        names=tuple(offset.where for offset in offsets),
        commands=np.array([poses[offset.where] for offset in offsets]),
        offsets=np.array([offset.offset_mm for offset in offsets], float) / 1e3,
        repeatability=np.array([radii.get(offset.where, np.nan) for offset in offsets]),
        under=_under(first),
    )


def is_of_plan(result: ResultFile, plan: PerformancePlan) -> bool:
    """Return whether a result says that it is of a plan."""
    return result.robot == plan.robot.name and result.plan == PlanOfResult.model_validate(plan_summary(plan))


def _fastest(things: Iterable[_Kind], usable: Callable[[_Kind], bool] = lambda _: True) -> list[_Kind]:
    """Return those at the fastest velocity and the largest load, of several robots those of the first."""
    kinds = [thing for thing in things if usable(thing)]
    if not kinds:
        return []
    conditions = [conditions_of(one.conditions) for one in kinds]
    best = max(conditions, key=lambda condition: (condition.velocity or 0.0, condition.load or 0.0))
    robot = next(
        condition.robot
        for condition in conditions
        if (condition.velocity, condition.load) == (best.velocity, best.load)
    )
    return [
        one
        for one, under in zip(kinds, conditions, strict=True)
        if (under.velocity, under.load, under.robot) == (best.velocity, best.load, robot)
    ]


def _under(conditions: Conditions) -> str:
    load = "" if conditions.load is None else f", load {100 * conditions.load:g} %"
    robot = f", robot {conditions.robot}" if conditions.robot else ""
    return f"Shown: {velocity_words(conditions)} velocity{load}{robot}."


def _frame(cube: Cube, plane: str) -> Array:
    around = cube.plane(plane).points([1, -1, -1, 1], [1, 1, -1, -1])
    edges = np.stack([around, np.roll(around, -1, axis=0)], axis=1)
    return np.concatenate([cube.corners[_EDGES], edges])
