"""All criteria of a plan, from the files that were measured for it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.base.units import Marked
from truearm.engine.robot.chain import Array
from truearm.engine.robot.transform import homogeneous
from truearm.iso9283.criteria.alignment import Alignment
from truearm.iso9283.criteria.compliance import PushLine, WildPush, evaluate_pushes, wild_pushes
from truearm.iso9283.criteria.corners import CornerCurves, WeaveCurves, corner_values, weaving_values
from truearm.iso9283.criteria.drift import DriftCourse
from truearm.iso9283.criteria.paths import PathDeviations, path_values
from truearm.iso9283.criteria.poses import PoseCloud, evaluate, missing_places
from truearm.iso9283.criteria.rows import Conditions, Instrument, Quantity, Value, best_fit_of
from truearm.iso9283.criteria.settling import SettlingCurve, settling_values
from truearm.iso9283.criteria.velocity import VelocityCurves, velocity_values
from truearm.iso9283.criteria.wild_rows import UnusualRows
from truearm.iso9283.evaluating.doubts import refuse_other_push_place, refuse_other_rests
from truearm.iso9283.planning.criteria import CRITERIA, TESTS, PerformancePlan, PlannedTest
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
    wild_pushes: tuple[WildPush, ...] = ()  #: Pushes far from the line of the others.
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
    values: list[Value] = []
    unusual = UnusualRows()
    missing: tuple[str, ...] = ()
    clouds: tuple[PoseCloud, ...] = ()
    drift: tuple[DriftCourse, ...] = ()
    pushes: tuple[PushLine, ...] = ()
    deviations: list[PathDeviations] = []
    corners: list[CornerCurves] = []
    velocities: list[VelocityCurves] = []
    weaves: list[WeaveCurves] = []
    settling: list[SettlingCurve] = []
    place = alignment.T_base_instrument
    transform: Array = homogeneous(place.rotation[None], np.array(place.translation)[None])[0]
    readings = _readings(measured, instrument)
    if poses is not None:
        progress("poses")
        of_poses = evaluate(plan, poses, alignment, readings["poses"])
        values += of_poses.values
        clouds, drift = of_poses.clouds, of_poses.drift
        unusual, missing = of_poses.unusual, of_poses.missing
    if paths is not None:
        reading = readings["paths"]
        tie = np.sqrt(np.diag(alignment.covariance_at(plan.cube.centre)))
        for test in ("AT", "AT-reorientation"):
            progress(TESTS[test].name)
            found, courses = path_values(plan, paths, transform, reading, test, tie, alignment.sigma_rot)
            values += found
            deviations += courses
        progress(TESTS["CR"].name)
        found, corners = corner_values(plan, paths, transform, reading)
        values += found
        progress(TESTS["AV"].name)
        found, velocities = velocity_values(plan, paths, transform, reading)
        values += found
        progress(TESTS["WS"].name)
        found, weaves = weaving_values(plan, paths, transform, reading)
        values += found
    if measured.settling is not None:
        progress(TESTS["t"].name)
        found, settling = settling_values(plan, measured.settling, transform, readings["settling"])
        refuse_other_rests(plan, settling, measured.settling.source)
        values += found
    if measured.forces is not None:
        progress(TESTS["compliance"].name)
        refuse_other_push_place(plan, measured.forces, alignment.in_base(measured.forces.position))
        stiff, pushes = evaluate_pushes(plan, measured.forces, alignment, readings["forces"])
        values += stiff
    absent = missing_places(plan, values)
    values += [
        Value(id_, "position", one.where, float("nan"), _quantity(id_), None, 0, one.conditions, "not-measured")
        for one in absent
        for id_ in TESTS[one.test].criteria
        if not any((value.id, value.where, value.conditions) == (id_, one.where, one.conditions) for value in values)
    ]
    there = {value.id for value in values}
    for planned in plan.tests:
        values += [_nothing(criterion, planned) for criterion in TESTS[planned.id].criteria if criterion not in there]
    return Evaluation(
        tuple(sorted(values, key=lambda value: CRITERIA.index(value.id))),
        alignment,
        clouds,
        drift,
        tuple(deviations),
        tuple(corners),
        tuple(velocities),
        tuple(weaves),
        tuple(settling),
        pushes,
        unusual,
        wild_pushes(pushes, readings.get("forces", instrument)),
        (*missing, *dict.fromkeys(one.words for one in absent)),
        readings,
        measured.simulated,
    )


def _readings(measured: Measurements, instrument: Instrument) -> dict[str, Instrument]:
    """Return the instrument as its readings stand in each file, by the names of the files."""
    made = {}
    if measured.poses is not None:
        made["poses"] = instrument.reading(measured.poses.resolution, measured.poses.resolution_rot)
    rest = {"paths": measured.paths, "settling": measured.settling, "forces": measured.forces}
    return made | {name: instrument.reading(one.resolution) for name, one in rest.items() if one is not None}


def _nothing(criterion: str, test: PlannedTest) -> Value:
    """Return the value of a criterion that was planned and not measured."""
    where = ", ".join(test.places)
    return Value(
        criterion, "position", where, float("nan"), _quantity(criterion), None, 0, Conditions(), "not-measured"
    )


def _quantity(criterion: str) -> Quantity:
    return _QUANTITIES.get(criterion, "length")
