"""Nubiola, section 2.4.1: one joint of an IRB 120 turned at a time, seen by a tracker (Table 2.3, Figure 2.6).

Twins that sag turn, and one whose gears run out and lag behind as well.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final

import numpy as np

from papers import Progress
from papers.seeds import Figures, Seed, gathered, over_seeds
from papers.study import Study
from papers.texts import Rows, told
from truearm.axis_circles import fit as turns
from truearm.engine.data.circles import fit_circle
from truearm.engine.document.drawing import AFTER, BEFORE, Figure, axis, figure, rounded_to
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Payload
from truearm.engine.twin.truths import truth_twin
from truearm.engine.twin.twin import Twin, measure
from truearm.engine.twin.twin_joint import PERFECT, JointTruth


@dataclass(frozen=True)
class AxisTest:
    """A row of Table 2.3: interval and increment [deg], ranges of the errors [mm, deg], backlash [deg]."""

    low: int
    high: int
    step: int
    tangential: float
    angular: float
    backlash: float


#: Table 2.3.
_TESTS: Final = {
    1: AxisTest(-60, 60, 5, 0.114, 0.013, 0.004),
    2: AxisTest(-40, 40, 1, 1.363, 0.116, 0.002),
    3: AxisTest(-40, 40, 1, 0.912, 0.098, 0.004),
    4: AxisTest(-155, 155, 5, 0.445, 0.207, 0.037),
    5: AxisTest(-90, 90, 5, 0.606, 0.153, 0.017),
    6: AxisTest(-400, 400, 1, 0.156, 0.072, 0.037),
}
#: Deviation of a coordinate [m]: over a run it makes radial and axial displacements of about 0.050 mm, as section 2.4.1
#: says.
_NOISE: Final = 0.008e-3
#: The third end-effector, section 2.4.1.
_PAYLOAD: Final = Payload(2.75, (-0.031, -0.013, 0.085))
_REFLECTOR: Final = (-0.1144, -0.0462, 0.1245)
#: Compliances of the document, by the set-up that they were identified with: truth and table.
_COMPLIANCES: Final = {"tracker-triangular": "2.7", "ctrack-triangular": "2.9", "ctrack-spatial": "2.11"}
_FIRST: Final = next(iter(_COMPLIANCES))

#: Compliances between those of the three, in words.
_BETWEEN: Final = "between those of the three tables"
#: How often compliances are brought nearer to Table 2.3.
_ROUNDS: Final = 3


@dataclass(frozen=True)
class Turn:
    """What circle fitting makes of one joint's run, forward and back, in the document's units."""

    angle: Array  #: Commanded [deg], ``(n,)``: forward, then backward.
    #: Angle about the fitted axis beyond the commanded one, zero where the joint is at zero [deg], ``(n,)``.
    error: Array
    radius: float  #: [mm].
    angular: float  #: angular, tangential: range of the angular error [deg] and of the tangential one [mm].
    tangential: float
    backlash: float  #: How far the joint lags behind, backward minus forward [deg].


@dataclass(frozen=True)
class RunOut:
    """A sine a turn by which a gear runs out."""

    amplitude: float  #: [deg].
    phase: float  #: [rad].


#: The turn of each joint, by its number.
_Turns = Mapping[int, Turn]


def study(seeds: int, progress: Progress, coarser: int = 1) -> Study:
    """Turn every joint, once a seed.

    Args:
        seeds: How many: of the tracker's noise.
        progress: Called with a few words at each step.
        coarser: Factor on the increments.
    """
    tests = {number: replace(test, step=test.step * coarser) for number, test in _TESTS.items()}
    places = {}
    for truth, table in _COMPLIANCES.items():
        progress(f"turning joints, compliance of Table {table}")
        places[truth] = _places(_twin(truth), tests)
    progress("choosing run-out")
    rng = np.random.default_rng(seeds)
    nearest = _nearest(tests)
    allowed = {f"of Table {table}": places[truth] for truth, table in _COMPLIANCES.items()}
    allowed[_BETWEEN] = _places(_with_compliances(nearest), tests)
    smallest = {
        words: {number: run_out(turn, tests[number]) for number, turn in _measured(at, tests, rng).items()}
        for words, at in allowed.items()
    }
    chosen = smallest[f"of Table {_COMPLIANCES[_FIRST]}"]
    geared = _places(_with_gears(_twin(_FIRST), chosen), tests)
    found, drawn = gathered(over_seeds(seeds, progress, partial(_one, places[_FIRST], geared, tests)))
    matched: dict[str, Any] = {}
    for number in tests:
        matched |= {row: of for row, of in found["matched"].items() if row.startswith(f"joint {number},")}
        matched[f"joint {number}, run-out chosen"] = chosen[number].amplitude
    tables: dict[str, Rows] = {
        **found,
        "noiseless": {f"joint {n}": [turn_of(at[n], t).angular for at in places.values()] for n, t in tests.items()},
        "shares": _shares(tests),
        "allowed": {
            f"joint {n}, compliances {words}": of[n].amplitude for n in tests for words, of in smallest.items()
        },
        "matched": matched,
    }
    sines, least = ([of.amplitude for of in group.values()] for group in (chosen, smallest[_BETWEEN]))
    figures = {"angular-errors": _errors_figure(*drawn[0])}
    texts: dict[str, object] = {"sines": (min(sines), max(sines)), "least": (min(least), max(least))}
    texts |= {"own": ", ".join(f"{n}: {1e6 * c:.0f}" for n, c in nearest.items()), "noise": _NOISE * 1e3}
    return told(__file__, seeds, tables, figures, texts)


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
) -> tuple[Figures, tuple[_Turns, _Turns]]:
    """Return figures of one seed's noise, and the turns: of compliance alone, and of gears too."""
    rng = seed.generator()
    turns, matched = _measured(places, tests, rng), _measured(geared, tests, rng)
    figures: Figures = {"radii": {}, "compliance": {}, "matched": {}}
    for n, test in tests.items():
        radius, joint = turns[n].radius, f"joint {n}"
        over_radius = math.degrees(test.tangential / radius)
        figures["radii"] |= {
            f"{joint}, distance [mm]": radius,
            f"{joint}, printed tangential range over this distance": over_radius,
        }
        figures["compliance"] |= {
            f"{joint}, angular": turns[n].angular,
            f"{joint}, tangential [mm]": turns[n].tangential,
        }
        figures["matched"] |= {f"{joint}, angular": matched[n].angular, f"{joint}, backlash": matched[n].backlash}
    return figures, (turns, matched)


def _measured(places: Mapping[int, Array], tests: Mapping[int, AxisTest], rng: np.random.Generator) -> dict[int, Turn]:
    """Return the turn of each joint that a tracker with noise sees."""
    return {n: turn_of(places[n] + rng.normal(0.0, _NOISE, places[n].shape), test) for n, test in tests.items()}


def _with_gears(twin: Twin, chosen: Mapping[int, RunOut]) -> Twin:
    joints = {
        number: replace(
            twin.joints.get(number, PERFECT),
            gear=((1, math.radians(found.amplitude), found.phase),),
            hysteresis=-math.radians(_TESTS[number].backlash) / 2,
        )
        for number, found in chosen.items()
    }
    return replace(twin, joints=joints)


def _angles(test: AxisTest) -> Array:
    """Return the commanded angles [deg], forward and then backward."""
    steps = np.arange(-(-test.low // test.step), test.high // test.step + 1) * float(test.step)
    return np.concatenate([steps, steps[::-1]])


def places_of(twin: Twin, number: int, test: AxisTest) -> Array:
    """Return where the reflector is during the run of one joint [m], ``(n, 3)``."""
    joints = np.zeros((len(_angles(test)), 6))
    joints[:, number - 1] = np.radians(_angles(test))
    approach = np.zeros_like(joints)
    approach[:, number - 1] = np.repeat([1.0, -1.0], len(joints) // 2)
    return measure(twin, joints, 0.0, np.random.default_rng(0), approach=approach).position


def turn_of(places: Array, test: AxisTest) -> Turn:
    """Fit a circle to the places of a reflector [m] and compare its angle with the commanded one."""
    angle = _angles(test)
    turned = turns.turn_of(fit_circle(places), np.radians(angle), np.repeat([1.0, -1.0], len(angle) // 2))
    error = np.degrees(turned.error)
    return Turn(
        angle=angle,
        error=error - error[angle == 0.0].mean(),
        radius=turned.circle.radius * 1e3,
        angular=math.degrees(turned.angular),
        tangential=turned.tangential * 1e3,
        backlash=math.degrees(turned.backlash or 0.0),
    )


def run_out(turn: Turn, test: AxisTest) -> RunOut:
    """Return the smallest sine a turn that leaves the printed range and backlash; none if no sine does.

    Args:
        turn: What compliance and noise do.
    """
    at = np.radians(turn.angle)
    lagging = turn.error + np.repeat([-0.5, 0.5], len(at) // 2) * test.backlash
    amplitudes, phases = np.arange(0.0, 0.2, 0.001), np.radians(np.arange(0, 360, 15))
    found = []
    for phase in phases.tolist():
        ranges = np.ptp(lagging + amplitudes[:, None] * np.sin(at + phase), axis=1)
        passed = np.flatnonzero(np.sign(ranges - test.angular) != np.sign(ranges[0] - test.angular))
        if len(passed):
            found.append((float(amplitudes[passed[0]]), phase))
    # Noise alone may make more than the printed range already.
    return RunOut(*min(found, default=(0.0, 0.0)))


def _shares(tests: Mapping[int, AxisTest]) -> dict[str, float]:
    """Return what the compliance of one joint alone makes of another one's turn [deg], where that is something."""
    twin = _twin(_FIRST)
    shares = {}
    for turning in (2, 3):
        for yielding, truth in twin.joints.items():
            one: dict[int, JointTruth] = {yielding: truth}
            places = places_of(replace(twin, joints=one), turning, tests[turning])
            shares[f"joint {turning} turns, joint {yielding} gives way"] = turn_of(places, tests[turning]).angular
    return {row: angular for row, angular in shares.items() if angular > 0.005}


def _errors_figure(compliance: _Turns, gears: _Turns) -> Figure:
    """Draw the angular error while each joint turns, as one seed's noise makes it."""
    traces: list[Figure] = []
    layout: dict[str, Any] = {}
    labels = []
    for place, (number, alone) in enumerate(compliance.items()):
        suffix = "" if place == 0 else str(place + 1)
        x, y = axis(""), axis("")
        row, column = divmod(place, 2)
        x["domain"] = [0.0, 0.46] if column == 0 else [0.54, 1.0]
        top = 1.0 - row * 0.35
        y["domain"] = [top - 0.25, top]
        x["anchor"], y["anchor"] = f"y{suffix}", f"x{suffix}"
        layout |= {f"xaxis{suffix}": x, f"yaxis{suffix}": y}
        half = len(alone.angle) // 2
        corner = {"x": 0.0, "y": 1.0, "xanchor": "left", "yanchor": "bottom", "showarrow": False}
        frame = {"xref": f"x{suffix} domain", "yref": f"y{suffix} domain"}
        labels.append({"text": f"joint {number}", **frame, **corner})
        for name, turn, part, colour in (
            ("compliance alone", alone, slice(0, half), BEFORE),
            ("forward", gears[number], slice(0, half), AFTER),
            ("backward", gears[number], slice(half, None), "#b3261e"),
        ):
            traces.append(
                {
                    **{"type": "scatter", "mode": "lines", "name": name, "legendgroup": name},
                    **{"showlegend": place == 0, "x": rounded_to(turn.angle[part], 1)},
                    **{"y": rounded_to(turn.error[part], 5), "xaxis": f"x{suffix}", "yaxis": f"y{suffix}"},
                    "line": {"color": colour, "width": 1.5, "dash": "solid"},
                    "hovertemplate": f"joint {number}, {name}<br>%{{x}} deg: %{{y:.4f}} deg<extra></extra>",
                }
            )
    drawn = figure(traces, 900, annotations=labels, **layout)
    drawn["layout"]["legend"]["y"] = 1.05
    return drawn
