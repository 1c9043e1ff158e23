"""The cycles of a path under one condition, taken from samples: in the base frame, and tied to the plan."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truearm.errors import InputError, nearest_names
from truearm.measurement.performance.records import Samples
from truearm.modeling.chain import Array
from truearm.planning.iso9283.planned import PerformancePlan
from truearm.validation.iso9283.clock import clock_of
from truearm.validation.iso9283.commanded import CommandedPath
from truearm.validation.iso9283.orientation_check import refuse_far_orientations
from truearm.validation.iso9283.streams import FoundStream, found_in
from truearm.validation.iso9283.synchronise import Cycle, along_path, refuse_other_times
from truearm.validation.iso9283.values import Conditions, Status
from truearm.validation.iso9283.wild_samples import refuse_wild, wild_steps

#: Further from its command than this no orientation is on the way, where the servo lags behind [rad].
_FAR_TURNED = np.radians(30.0)
#: Fewer samples than this are no cycle.
LEAST_SAMPLES = 20


@dataclass(frozen=True, eq=False)
class Run:
    """All cycles of a path under one condition."""

    test: str  #: Id of the test.
    path: CommandedPath  #: What was commanded.
    velocity: float  #: Commanded along the path [m/s].
    conditions: Conditions  #: As shares.
    cycles: tuple[Cycle, ...]  #: In their order.
    planned: int  #: How many there should be.
    found: FoundStream | None  #: What was found in the stream from which they are; None where the file numbers them.

    def status(self, *, coarse: bool) -> Status:
        """Return whether a value of it can be relied on."""
        if coarse:
            return "instrument-too-coarse"
        return "too-few-cycles" if len(self.cycles) < self.planned else "measured"


@dataclass(frozen=True, eq=False)
class Part:
    """Rows of one place under one condition."""

    place: str  #: Name of the path or of the pose.
    conditions: Conditions  #: As shares.
    rows: NDArray[np.intp]  #: Indices in the order of the file.
    cycle: NDArray[np.intp]  #: Of each of these rows.

    def cycles(self) -> Iterator[tuple[int, NDArray[np.intp]]]:
        """Yield the number and the rows of each cycle, in their order."""
        order = np.argsort(self.cycle, kind="stable")
        numbers, starts = np.unique(self.cycle[order], return_index=True)
        for number, rows in zip(numbers.tolist(), np.split(self.rows[order], starts[1:]), strict=True):
            yield int(number), rows


def parts_of(samples: Samples, test: str, known: tuple[str, ...]) -> Iterator[Part]:
    """Yield the rows of each place and condition of a test.

    Args:
        known: Places that the plan has.

    Raises:
        InputError: If a place is not in the plan.
    """
    rows = np.flatnonzero(samples.criterion.are(test))
    if not len(rows):
        return
    velocities, of_velocity = np.unique(samples.velocity[rows], return_inverse=True)
    loads, of_load = np.unique(samples.load[rows], return_inverse=True)
    key = (samples.place.code[rows] * len(velocities) + of_velocity) * len(loads) + of_load
    order = np.argsort(key, kind="stable")
    _, starts = np.unique(key[order], return_index=True)
    parts = np.split(rows[order], starts[1:])
    for _, part in sorted(zip((int(part[0]) for part in parts), parts, strict=True), key=lambda both: both[0]):
        place = samples.place.names[int(samples.place.code[part[0]])]
        if place not in known:
            near = nearest_names(place, known, 1, 0.6)
            raise InputError(
                f"the plan has no such place for {test}",
                where=f"{samples.source}, line {samples.line[part[0]]}",
                came=place,
                allowed=", ".join(known) or f"nothing: {test} is not planned",
                cure=f"Did you mean {near[0]}?" if near else "Name it as the plan does.",
            )
        conditions = Conditions(float(samples.velocity[part[0]]), float(samples.load[part[0]]))
        yield Part(place, conditions, part, samples.cycle[part])


def in_base(transform: Array, position: Array) -> Array:
    """Return positions in the base frame, ``(n, 3)``, of those in the instrument's."""
    return np.asarray(position @ transform[:3, :3].T + transform[:3, 3])


def runs_of(plan: PerformancePlan, samples: Samples, transform: Array, test: str) -> Iterator[Run]:
    """Yield the runs of a test, one after the other.

    A cycle that the file numbers is taken from the last dwell before it to the first behind it, where it has such.

    Args:
        transform: The instrument's frame in the robot's base, ``(4, 4)``.
        test: Its id.

    Raises:
        InputError: If the path is not planned, samples are too few or not near it, or no cycle is in a stream.
    """
    planned = plan.test(test)
    known = () if planned is None else planned.places
    for part in parts_of(samples, test, known):
        assert planned is not None
        path = CommandedPath.of(plan.paths[part.place], reoriented=test == "AT-reorientation")
        velocity = plan.rated_velocity * (part.conditions.velocity or 1.0)
        cycles: list[Cycle] = []
        found = None
        for number, rows in part.cycles():
            where = f"{samples.source}, lines {samples.line[rows[0]]} to {samples.line[rows[-1]]}"
            if len(rows) < LEAST_SAMPLES:
                raise InputError(
                    "there are too few samples of this cycle",
                    where=where,
                    came=f"{len(rows)} samples",
                    allowed=f"{LEAST_SAMPLES} or more",
                    cure="Sample faster, or leave the cycle out.",
                )
            position = in_base(transform, samples.position[rows])
            clock = clock_of(samples.time[rows])
            wild = wild_steps(clock.time, position, velocity)
            if wild.single:
                refuse_wild(samples, rows, position, wild, number, clock)
            here = found_in(test, path, clock.time, position, velocity)
            spans = here.cycles
            if number:
                if len(spans) > 1:
                    raise InputError(
                        f"cycle {number} of {part.place} runs the path {len(spans)} times",
                        where=where,
                        came=f"{len(spans)} cycles under one number",
                        allowed="one run of the path",
                        cure="Number the cycles, or leave the cells of the column cycle empty: then they are found.",
                    )
                spans = spans if len(spans) == 1 else ((0, len(rows) - 1),)
            else:
                found = here
                if not spans:
                    raise InputError(
                        f"no cycle of the path {part.place} is found in the stream",
                        where=where,
                        came=f"{len(here.motions)} motions, {len(here.dwells)} dwells",
                        allowed="motions from the begin of the path to its end, near the plan",
                        cure="Check the name of the path, the unit, and how the instrument is tied to the robot's "
                        "base, or number the cycles.",
                    )
            for count, (first, last) in enumerate(spans, 1):
                chosen = rows[first : last + 1]
                place = f"{samples.source}, lines {samples.line[chosen[0]]} to {samples.line[chosen[-1]]}"
                rotation = None if samples.rotation is None else transform[:3, :3] @ samples.rotation[chosen]
                along = along_path(path, position[first : last + 1], place)
                time = clock.time[first : last + 1]
                refuse_other_times(path, time, along, velocity, place)
                if rotation is not None:
                    commanded = path.rotations(along)
                    refuse_far_orientations(
                        rotation, commanded, transform[:3, :3], samples.line[chosen], samples.source, _FAR_TURNED
                    )
                cycles.append(
                    Cycle(
                        number or count,
                        time,
                        position[first : last + 1],
                        rotation,
                        along,
                        samples.line[chosen],
                        clock,
                    )
                )
            refuse_wild(samples, rows, position, wild, number, clock)
        yield Run(test, path, velocity, part.conditions, tuple(cycles), planned.cycles, found)
