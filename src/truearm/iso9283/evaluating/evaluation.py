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
        return any(
            readings is not None and readings.simulated
            for readings in (self.poses, self.paths, self.settling, self.forces)
        )


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
    evaluation = Evaluation((), alignment, readings=readings, simulated=measured.simulated)
    if poses is not None:
        progress("poses")
        of_poses = evaluate(plan, poses, alignment, readings["poses"])
        values += of_poses.values
        evaluation = replace(evaluation, clouds=of_poses.clouds, drift=of_poses.drift, unusual=of_poses.unusual)
        evaluation = replace(evaluation, missing=of_poses.missing)
    if paths is not None:
        reading = readings["paths"]
        tie = np.sqrt(np.diag(alignment.covariance_at(plan.cube.centre)))
        deviations: list[PathDeviations] = []
        for test in ("AT", "AT-reorientation"):
            progress(TESTS[test].name)
            test_values, courses = path_values(plan, paths, transform, reading, test, tie, alignment.sigma_rot)
            values += test_values
            deviations += courses
        curves: dict[str, Any] = {}
        for test, (name, values_of) in _ALONG_PATHS.items():
            progress(TESTS[test].name)
            test_values, of_test = values_of(plan, paths, transform, reading)
            values += test_values
            curves[name] = tuple(of_test)
        evaluation = replace(evaluation, deviations=tuple(deviations), **curves)
    if measured.settling is not None:
        progress(TESTS["t"].name)
        test_values, settling = settling_values(plan, measured.settling, transform, readings["settling"])
        refuse_other_rests(plan, settling, measured.settling.source)
        values += test_values
        evaluation = replace(evaluation, settling=tuple(settling))
    if measured.forces is not None:
        progress(TESTS["compliance"].name)
        refuse_other_push_place(plan, measured.forces, alignment.in_base(measured.forces.position))
        stiff, pushes = evaluate_pushes(plan, measured.forces, alignment, readings["forces"])
        values += stiff
        evaluation = replace(evaluation, pushes=pushes, outlying_pushes=outlying_pushes(pushes, readings["forces"]))
    absent = missing_places(plan, values)
    values += _not_measured(plan, values, absent)
    return replace(
        evaluation,
        values=tuple(sorted(values, key=lambda value: CRITERIA.index(value.id))),
        missing=(*evaluation.missing, *dict.fromkeys(missing_place.words for missing_place in absent)),
    )


def _readings(measured: Measurements, instrument: Instrument) -> dict[str, Instrument]:
    """Return the instrument as its readings stand in each file, by the names of the files."""
    instruments = {}
    if measured.poses is not None:
        instruments["poses"] = instrument.reading(measured.poses.resolution, measured.poses.resolution_rot)
    sampled = {"paths": measured.paths, "settling": measured.settling, "forces": measured.forces}
    return instruments | {
        name: instrument.reading(samples.resolution) for name, samples in sampled.items() if samples is not None
    }


def _not_measured(plan: PerformancePlan, values: Sequence[Value], absent: Sequence[MissingPlace]) -> list[Value]:
    """Return a value for each that was planned and not measured, at single places and of whole tests."""
    measured = {(value.id, value.where, value.conditions) for value in values}
    places = [(id_, place.where, place.conditions) for place in absent for id_ in TESTS[place.test].criteria]
    not_measured = [_nothing(*place) for place in places if place not in measured]
    known = {value.id for value in (*values, *not_measured)}
    for planned in plan.tests:
        all_places, left_out = (
            ", ".join(planned.places),
            [criterion for criterion in TESTS[planned.id].criteria if criterion not in known],
        )
        not_measured += [_nothing(criterion, all_places, Conditions()) for criterion in left_out]
    return not_measured


def _nothing(criterion: str, place: str, conditions: Conditions) -> Value:
    quantity = _QUANTITIES.get(criterion, "length")
    return Value(criterion, "position", place, float("nan"), quantity, None, 0, conditions, "not-measured")
