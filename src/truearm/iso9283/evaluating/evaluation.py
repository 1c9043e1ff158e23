"""All criteria of a plan, from the files that were measured for it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.base.units import Marked
from truearm.engine.robot.chain import Array
from truearm.engine.robot.transform import homogeneous
from truearm.iso9283.criteria.alignment import Alignment
from truearm.iso9283.criteria.compliance import OutlyingPush, PushLine, evaluate_pushes, outlying_pushes
from truearm.iso9283.criteria.corners import CornerCurves, WeaveCurves, corner_values, weaving_values
from truearm.iso9283.criteria.drift import DriftCourse
from truearm.iso9283.criteria.outlying_rows import UnusualRows
from truearm.iso9283.criteria.paths import PathDeviations, path_values
from truearm.iso9283.criteria.poses import MissingPlace, PoseCloud, evaluate, missing_places
from truearm.iso9283.criteria.rows import Conditions, Instrument, Quantity, Value, best_fit_of
from truearm.iso9283.criteria.settling import SettlingCurve, settling_values
from truearm.iso9283.criteria.velocity import VelocityCurves, velocity_values
from truearm.iso9283.evaluating.doubts import refuse_other_push_place, refuse_other_rests
from truearm.iso9283.planning.criteria import CRITERIA, TESTS, PerformancePlan
from truearm.iso9283.planning.records import AttainedPoses, Pushes, Samples

#: What kind of number each criterion is; a length if it is not here.
_QUANTITIES: dict[str, Quantity] = {
    "t": "time",
    "posing-time": "time",
    "AV": "ratio",
    "RV": "ratio",
    "FV": "speed",
    "WS": "ratio",
    "WF": "ratio",
    "compliance": "compliance",
}
#: By what tests along paths are evaluated, and the field of an evaluation with their curves.
_ALONG_PATHS: Final[dict[str, tuple[str, Callable[..., tuple[list[Value], list[Any]]]]]] = {
    "CR": ("corners", corner_values),
    "AV": ("velocities", velocity_values),
    "WS": ("weaves", weaving_values),
}


@dataclass(frozen=True, eq=False)
class Measurements:
    """The files of a plan that were measured; None for one that was not."""

    poses: AttainedPoses | None = None  #: poses, paths, settling, forces: as read.
    paths: Samples | None = None
    settling: Samples | None = None
    forces: Pushes | None = None

    @property
    def simulated(self) -> bool:
        """Whether a virtual instrument read any of them."""
        return any(one is not None and one.simulated for one in (self.poses, self.paths, self.settling, self.forces))


@dataclass(frozen=True, eq=False)
class Evaluation:
    """The values of all criteria, and what they come from."""

    values: tuple[Value, ...]  #: In the order of :data:`truearm.iso9283.planning.criteria.CRITERIA`.
    alignment: Alignment  #: How the instrument was tied to the robot's base.
    #: clouds, drift, deviations, corners, velocities, weaves, settling, pushes: for pictures.
    clouds: tuple[PoseCloud, ...] = ()
    drift: tuple[DriftCourse, ...] = ()
    deviations: tuple[PathDeviations, ...] = ()
    corners: tuple[CornerCurves, ...] = ()
    velocities: tuple[VelocityCurves, ...] = ()
    weaves: tuple[WeaveCurves, ...] = ()
    settling: tuple[SettlingCurve, ...] = ()
    pushes: tuple[PushLine, ...] = ()
    #: Rows of poses far from the others, and poses with two places of rest.
    unusual: UnusualRows = field(default_factory=UnusualRows)
    outlying_pushes: tuple[OutlyingPush, ...] = ()  #: Pushes far from the line of the others.
    missing: tuple[str, ...] = ()  #: Places that have no value in tests that were measured, in words.
    #: The instrument as its readings stand in each file: by the names of :class:`Measurements`.
    readings: Mapping[str, Instrument] = field(default_factory=dict)
    simulated: bool = False  #: Whether a virtual instrument read any of them.

    @property
    def simulated_from(self) -> tuple[Marked, ...]:
        """``data``, if a virtual instrument read any of it."""
        return ("data",) if self.simulated else ()


def evaluated(
    plan: PerformancePlan,
    measured: Measurements,
    alignment: Alignment | None,
    instrument: Instrument,
    progress: Callable[[str], None] = lambda _: None,
) -> Evaluation:
    """Evaluate all criteria of a plan.

    Args:
        alignment: How the instrument was tied to the robot's base; None for the best fit of the attained poses to the
            commanded.
        progress: Called with a few words at each step.

    Raises:
        InputError: If nothing was measured, the tie is not known and there are no poses for a best fit, or rows do not
            fit the plan.
    """
    poses, paths = measured.poses, measured.paths
    if poses is None and paths is None and measured.settling is None and measured.forces is None:
        raise InputError(
            "nothing was measured",
            parameter="poses, paths, settling, forces",
            cure="Give the files that were measured.",
        )
    if alignment is None:
        if poses is None:
            raise InputError(
                "how the instrument was tied to the robot's base is not known",
                parameter="alignment",
                cure="Give it, or the poses of the test AP, to which the frame is then fitted.",
            )
        alignment = best_fit_of(plan, poses)
    place = alignment.T_base_instrument
    transform: Array = homogeneous(place.rotation[None], np.array(place.translation)[None])[0]
    readings = _readings(measured, instrument)
    values: list[Value] = []
    made = Evaluation((), alignment, readings=readings, simulated=measured.simulated)
    if poses is not None:
        progress("poses")
        of_poses = evaluate(plan, poses, alignment, readings["poses"])
        values += of_poses.values
        made = replace(made, clouds=of_poses.clouds, drift=of_poses.drift, unusual=of_poses.unusual)
        made = replace(made, missing=of_poses.missing)
    if paths is not None:
        reading = readings["paths"]
        tie = np.sqrt(np.diag(alignment.covariance_at(plan.cube.centre)))
        deviations: list[PathDeviations] = []
        for test in ("AT", "AT-reorientation"):
            progress(TESTS[test].name)
            found, courses = path_values(plan, paths, transform, reading, test, tie, alignment.sigma_rot)
            values += found
            deviations += courses
        curves: dict[str, Any] = {}
        for test, (name, values_of) in _ALONG_PATHS.items():
            progress(TESTS[test].name)
            found, of_test = values_of(plan, paths, transform, reading)
            values += found
            curves[name] = tuple(of_test)
        made = replace(made, deviations=tuple(deviations), **curves)
    if measured.settling is not None:
        progress(TESTS["t"].name)
        found, settling = settling_values(plan, measured.settling, transform, readings["settling"])
        refuse_other_rests(plan, settling, measured.settling.source)
        values += found
        made = replace(made, settling=tuple(settling))
    if measured.forces is not None:
        progress(TESTS["compliance"].name)
        refuse_other_push_place(plan, measured.forces, alignment.in_base(measured.forces.position))
        stiff, pushes = evaluate_pushes(plan, measured.forces, alignment, readings["forces"])
        values += stiff
        made = replace(made, pushes=pushes, outlying_pushes=outlying_pushes(pushes, readings["forces"]))
    absent = missing_places(plan, values)
    values += _not_measured(plan, values, absent)
    return replace(
        made,
        values=tuple(sorted(values, key=lambda value: CRITERIA.index(value.id))),
        missing=(*made.missing, *dict.fromkeys(one.words for one in absent)),
    )


def _readings(measured: Measurements, instrument: Instrument) -> dict[str, Instrument]:
    """Return the instrument as its readings stand in each file, by the names of the files."""
    made = {}
    if measured.poses is not None:
        made["poses"] = instrument.reading(measured.poses.resolution, measured.poses.resolution_rot)
    rest = {"paths": measured.paths, "settling": measured.settling, "forces": measured.forces}
    return made | {name: instrument.reading(one.resolution) for name, one in rest.items() if one is not None}


def _not_measured(plan: PerformancePlan, values: Sequence[Value], absent: Sequence[MissingPlace]) -> list[Value]:
    """Return a value for each that was planned and not measured, at single places and of whole tests."""
    there = {(value.id, value.where, value.conditions) for value in values}
    places = [(id_, one.where, one.conditions) for one in absent for id_ in TESTS[one.test].criteria]
    made = [_nothing(*place) for place in places if place not in there]
    known = {value.id for value in (*values, *made)}
    for planned in plan.tests:
        where, left_out = ", ".join(planned.places), [one for one in TESTS[planned.id].criteria if one not in known]
        made += [_nothing(criterion, where, Conditions()) for criterion in left_out]
    return made


def _nothing(criterion: str, where: str, conditions: Conditions) -> Value:
    quantity = _QUANTITIES.get(criterion, "length")
    return Value(criterion, "position", where, float("nan"), quantity, None, 0, conditions, "not-measured")
