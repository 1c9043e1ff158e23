"""What a tracker sees while one joint of an IRB 120 turns: of twins that sag, and of one whose gears run out too."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from papers import Progress
from papers.irb120_axes.single_joint import AxisTest, RunOut, Turn, places_of, run_out, turn_of
from papers.seeds import Seed, over_seeds
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Payload
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin
from truearm.engine.twin.twin_joint import PERFECT, JointTruth

#: Table 2.3.
TESTS: Final = {
    1: AxisTest(-60, 60, 5, 0.114, 0.013, 0.004),
    2: AxisTest(-40, 40, 1, 1.363, 0.116, 0.002),
    3: AxisTest(-40, 40, 1, 0.912, 0.098, 0.004),
    4: AxisTest(-155, 155, 5, 0.445, 0.207, 0.037),
    5: AxisTest(-90, 90, 5, 0.606, 0.153, 0.017),
    6: AxisTest(-400, 400, 1, 0.156, 0.072, 0.037),
}
#: Deviation of a coordinate [m]: over a run it makes radial and axial displacements of about 0.050 mm, as section 2.4.1
#: says.
NOISE: Final = 0.008e-3
#: The third end-effector, section 2.4.1.
_PAYLOAD: Final = Payload(2.75, (-0.031, -0.013, 0.085))
_REFLECTOR: Final = (-0.1144, -0.0462, 0.1245)
#: Compliances of the document, by the set-up that they were identified with: truth and table.
_COMPLIANCES: Final = {"tracker-triangular": "2.7", "ctrack-triangular": "2.9", "ctrack-spatial": "2.11"}
_FIRST: Final = next(iter(_COMPLIANCES))

#: Compliances between those of the three, in words.
BETWEEN: Final = "between those of the three tables"
#: How often compliances are brought nearer to Table 2.3.
_ROUNDS: Final = 3

#: The turn of each joint, by its number.
Turns = Mapping[int, Turn]


@dataclass(frozen=True, eq=False)
class Outcome:
    """What one seed's noise makes of the turns."""

    compliance: Turns  #: Of a twin with the compliances of Table 2.7 alone.
    gears: Turns  #: Of one whose gears run out and lag behind as well.


@dataclass(frozen=True)
class Share:
    """What the compliance of one joint alone makes of another one's turn."""

    turning: int  #: turning, yielding: numbers of the joint that turns and of the one that gives way.
    yielding: int
    angular: float  #: Range of the angular error [deg].


@dataclass(frozen=True, eq=False)
class Run:
    """The whole study."""

    tests: Mapping[int, AxisTest]  #: How each joint was turned, and what the document found, by its number.
    outcomes: tuple[Outcome, ...]  #: Of the seeds.
    #: What was chosen for each joint, by its number: the smallest with the compliances of Table 2.7.
    run_out: Mapping[int, RunOut]
    #: Compliances that bring the test nearest to Table 2.3, each between the lowest and the highest of the document's
    #: three set-ups, by the joint's number [rad/(N m)].
    nearest: Mapping[int, float]
    #: The smallest run-out of each joint by the compliances it is beside, in words.
    allowed: Mapping[str, Mapping[int, RunOut]]
    noiseless: tuple[Turns, ...]  #: Without noise, one for each of the document's compliances.
    shares: tuple[Share, ...]  #: Whose compliance it is when joints 2 and 3 turn.


def run(seeds: int, progress: Progress, coarser: int) -> Run:
    """Turn every joint, once a seed.

    Args:
        seeds: How many: of the tracker's noise.
        progress: Called with a few words at each step.
        coarser: Factor on the increments.
    """
    tests = {number: replace(test, step=test.step * coarser) for number, test in TESTS.items()}
    places = {}
    for truth, table in _COMPLIANCES.items():
        progress(f"turning joints, compliance of Table {table}")
        places[truth] = _places(_twin(truth), tests)
    progress("choosing run-out")
    rng = np.random.default_rng(seeds)
    nearest = _nearest(tests)
    allowed = {f"Table {table}": places[truth] for truth, table in _COMPLIANCES.items()}
    allowed[BETWEEN] = _places(_with_compliances(nearest), tests)
    smallest = {
        words: {number: run_out(turn, tests[number]) for number, turn in _measured(at, tests, rng).items()}
        for words, at in allowed.items()
    }
    chosen = smallest[f"Table {_COMPLIANCES[_FIRST]}"]
    geared = _places(_with_gears(_twin(_FIRST), chosen), tests)

    return Run(
        tests=tests,
        outcomes=over_seeds(seeds, progress, partial(_one, places[_FIRST], geared, tests)),
        run_out=chosen,
        nearest=nearest,
        allowed=smallest,
        noiseless=tuple({n: turn_of(at[n], test) for n, test in tests.items()} for at in places.values()),
        shares=_shares(tests),
    )


def _twin(truth: str) -> Twin:
    twin = truth_twin(load_robot("irb120"), truth, np.random.default_rng(0))
    robot = twin.robot.with_frames(twin.robot.base, {"1": _REFLECTOR}).with_payload(_PAYLOAD)
    return replace(twin, robot=robot)


def _with_compliances(compliances: Mapping[int, float]) -> Twin:
    twin = _twin(_FIRST)
    joints = {n: replace(twin.joints.get(n, PERFECT), compliance=c) for n, c in compliances.items()}
    return replace(twin, joints={**twin.joints, **joints})


def _nearest(tests: Mapping[int, AxisTest]) -> dict[int, float]:
    """Return compliances between the document's own that make the printed ranges, backlash included, or nearly so."""
    printed = [{n: joint.compliance for n, joint in _twin(truth).joints.items()} for truth in _COMPLIANCES]
    compliances = {n: c for n, c in printed[0].items() if c > 0.0}
    for _ in range(_ROUNDS):
        lagging = _with_gears(_with_compliances(compliances), dict.fromkeys(tests, RunOut(0.0, 0.0)))
        places = _places(lagging, {n: test for n, test in tests.items() if n in compliances})
        for n, at in places.items():
            least, most = min(of[n] for of in printed), max(of[n] for of in printed)
            wanted = compliances[n] * tests[n].angular / turn_of(at, tests[n]).angular
            compliances[n] = min(max(wanted, least), most)
    return compliances


def _places(twin: Twin, tests: Mapping[int, AxisTest]) -> dict[int, Array]:
    """Return where the reflector is during the run of each joint [m], ``(n, 3)``."""
    return {number: places_of(twin, number, test) for number, test in tests.items()}


def _one(
    places: Mapping[int, Array], geared: Mapping[int, Array], tests: Mapping[int, AxisTest], seed: Seed
) -> Outcome:
    """Return what is seen of the arm without gears and with them."""
    rng = seed.generator()
    return Outcome(_measured(places, tests, rng), _measured(geared, tests, rng))


def _measured(places: Mapping[int, Array], tests: Mapping[int, AxisTest], rng: np.random.Generator) -> dict[int, Turn]:
    """Return the turn of each joint that a tracker with noise sees."""
    return {n: turn_of(places[n] + rng.normal(0.0, NOISE, places[n].shape), test) for n, test in tests.items()}


def _with_gears(twin: Twin, chosen: Mapping[int, RunOut]) -> Twin:
    joints = {
        number: replace(
            twin.joints.get(number, PERFECT),
            gear=((1, math.radians(found.amplitude), found.phase),),
            hysteresis=-math.radians(TESTS[number].backlash) / 2,
        )
        for number, found in chosen.items()
    }
    return replace(twin, joints=joints)


def _shares(tests: Mapping[int, AxisTest]) -> tuple[Share, ...]:
    twin = _twin(_FIRST)
    shares = []
    for turning in (2, 3):
        for yielding, truth in twin.joints.items():
            one: dict[int, JointTruth] = {yielding: truth}
            places = places_of(replace(twin, joints=one), turning, tests[turning])
            shares.append(Share(turning, yielding, turn_of(places, tests[turning]).angular))
    return tuple(shares)
