"""Nubiola, section 2.4.1: one joint of an IRB 120 turned at a time, seen by a tracker (Table 2.3, Figure 2.6)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np

from truearm.library import load_robot
from truearm.modeling.chain import Array
from truearm.modeling.parts import Payload
from truearm.reporting.drawing import AFTER, BEFORE, Figure, axis, figure
from truearm.reporting.numbers import rounded_to
from truearm.simulation.truths import truth_twin
from truearm.simulation.twin import Twin
from truearm.simulation.twin_joint import PERFECT, JointTruth
from truearm.studies.single_joint import AxisTest, Turn, places_of, run_out, turn_of
from truearm.studies.study import Picture, Row, Study, Table

_TESTS: Final = {
    1: AxisTest(-60, 60, 5, 0.114, 0.013, 0.004),
    2: AxisTest(-40, 40, 1, 1.363, 0.116, 0.002),
    3: AxisTest(-40, 40, 1, 0.912, 0.098, 0.004),
    4: AxisTest(-155, 155, 5, 0.445, 0.207, 0.037),
    5: AxisTest(-90, 90, 5, 0.606, 0.153, 0.017),
    6: AxisTest(-400, 400, 1, 0.156, 0.072, 0.037),
}
#: The third end-effector, section 2.4.1.
_PAYLOAD: Final = Payload(2.75, (-0.031, -0.013, 0.085))
_REFLECTOR: Final = (-0.1144, -0.0462, 0.1245)
#: Of a coordinate: over a run it makes radial and axial displacements of about 0.050 mm, as section 2.4.1 says.
_NOISE: Final = 0.008e-3
_TABLES: Final = {"tracker-triangular": "2.7", "ctrack-triangular": "2.9", "ctrack-spatial": "2.11"}
#: The document's own compliances of joints 2 to 5 differ by this much between its three set-ups.
_SPREAD: Final = 0.25


def study(seeds: int, progress: Callable[[str], None], coarser: int = 1) -> Study:
    """Run the study.

    Parameters
    ----------
    seeds
        How many: of the tracker's noise.
    progress
        Called with a few words at each step.
    coarser
        Factor on the increments.
    """
    tests = {number: replace(test, step=test.step * coarser) for number, test in _TESTS.items()}
    seen = {}
    for truth, table in _TABLES.items():
        progress(f"turning joints, compliance of Table {table}")
        seen[truth] = {number: places_of(_twin(truth), number, test) for number, test in tests.items()}
    sprung = seen["tracker-triangular"]
    progress("choosing run-out")
    rng = np.random.default_rng(seeds)
    gear = {number: run_out(turn_of(_noisy(sprung[number], rng), test), test) for number, test in tests.items()}
    chosen = _with_gear(_twin("tracker-triangular"), gear)
    geared = {number: places_of(chosen, number, test) for number, test in tests.items()}
    progress("measuring")
    alone, whole = [], []
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        alone.append({number: turn_of(_noisy(sprung[number], rng), test) for number, test in tests.items()})
        whole.append({number: turn_of(_noisy(geared[number], rng), test) for number, test in tests.items()})
    shares = _shares(tests)
    tables = {
        table: {number: turn_of(seen[truth][number], test) for number, test in tests.items()}
        for truth, table in _TABLES.items()
    }
    return Study(
        name="irb120-axes",
        title="Single joints of an ABB IRB 120",
        source="A. Nubiola, doctoral thesis, ETS Montreal, section 2.4.1, Table 2.3 and Figure 2.6; truth from Tables"
        " 2.4, 2.6 and 2.7",
        answer="Compliance alone, with the values that the document identified elsewhere, gives the printed errors of"
        " joints 3, 4 and 5 within three tenths, two thirds of what joint 2 shows, too much for joint 6 and nothing"
        " for joint 1. What is missing there, and the backlash, must be in gears and bearings: sines of"
        f" {min(a for a, _ in gear.values()):.3f} to {max(a for a, _ in gear.values()):.3f} deg a turn would do.",
        seeds=seeds,
        tables=(
            _radii(tests, alone),
            _compliance(tests, alone, gear),
            _by_table(tests, tables),
            _shares_table(shares),
            _matched(tests, whole, gear),
        ),
        pictures=(_picture(tests, alone[0], whole[0]),),
        notes=(
            "One joint runs forward and then backward over the interval of Table 2.3, the others stand at 0 deg."
            " The reflector's places are fitted by a circle (plane by singular values, centre by least squares), its"
            " centre is the axis, and the error is the angle about it minus the commanded one.",
            "Backlash is the mean of backward minus forward at the same angle. It is a joint that lags behind its"
            " last move by half of the printed value, either way, and has been put in: getting it back tests the"
            " evaluation, not the robot.",
            "Run-out is one sine a turn, the smallest that leaves the printed range whatever its phase. It is chosen to"
            " match, and the document says nothing about it.",
            "Bearings that lean are not in this twin. On the measured robot (irb120-faro) they are the largest effect"
            " beyond the compliance about the axes, and may well be what joint 2 lacks.",
            f"Tracker noise of {_NOISE * 1e3:g} mm a coordinate: radial and axial displacements are then about"
            " 0.050 mm, as the document has them. It widens the ranges of joints 4 to 6, whose reflector is only 0.12"
            " to 0.23 m from the axis, by up to 0.02 deg.",
        ),
    )


def _twin(truth: str) -> Twin:
    twin = truth_twin(load_robot("irb120"), truth, np.random.default_rng(0))
    robot = twin.robot.with_frames(twin.robot.base, {"1": _REFLECTOR}).with_payload(_PAYLOAD)
    return replace(twin, robot=robot)


def _noisy(places: Array, rng: np.random.Generator) -> Array:
    return places + rng.normal(0.0, _NOISE, places.shape)


def _with_gear(twin: Twin, gear: Mapping[int, tuple[float, float]]) -> Twin:
    joints = {
        number: replace(
            twin.joints.get(number, PERFECT),
            gear=((1, math.radians(amplitude), phase),),
            hysteresis=-math.radians(_TESTS[number].backlash) / 2,
        )
        for number, (amplitude, phase) in gear.items()
    }
    return replace(twin, joints=joints)


def _shares(tests: Mapping[int, AxisTest]) -> dict[tuple[int, int], float]:
    """Return the range [deg] that the compliance of one joint alone makes while joint 2 or 3 is turned."""
    twin = _twin("tracker-triangular")
    shares = {}
    for turned in (2, 3):
        for number, truth in twin.joints.items():
            one: dict[int, JointTruth] = {number: truth}
            places = places_of(replace(twin, joints=one), turned, tests[turned])
            shares[turned, number] = turn_of(places, tests[turned]).angular
    return shares


# -- tables ------------------------------------------------------------------------------------------------


def _radii(tests: Mapping[int, AxisTest], alone: list[dict[int, Turn]]) -> Table:
    rows = []
    for number, test in tests.items():
        angular, tangential = test.angular, test.tangential
        rows.append(
            Row(
                f"joint {number}",
                "mm",
                [turns[number].radius for turns in alone],
                round(tangential / math.radians(angular), 1),
                "Table 2.3",
                relative=0.0005 / angular + 0.0005 / tangential,
            )
        )
    return Table(
        "Distance of the reflector from each axis",
        "Radius of the fitted circle, and the document's tangential over its angular range. The tolerance is what"
        " rounding of its digits allows. It shows that posture and reflector are the document's.",
        tuple(rows),
    )


def _compliance(
    tests: Mapping[int, AxisTest], alone: list[dict[int, Turn]], gear: Mapping[int, tuple[float, float]]
) -> Table:
    why = {
        1: "Axis 1 is vertical: nothing that sags changes when it turns, so compliance predicts zero, and what we see"
        " is noise. The rest must be in the gear.",
        2: f"Too little by a third. A gear that runs out by {gear[2][0]:.3f} deg once a turn, or a compliance of"
        " 0.046e-6 instead of 0.032e-6 rad/(N mm), would make up for it.",
        3: "Too much by a quarter, as much as the document's own compliances differ.",
        4: "Too much by a quarter. It is the sag of joint 5, whose axis leaves the horizontal: alone it would make"
        " 0.33 deg, and joints 4 and 6 take a part of it away.",
        5: "Joint 5 itself makes 0.12 deg, joint 3 another 0.07 deg.",
        6: "Too much by far: the moment here is only 0.9 N m, and the document's own compliances of joint 6 run from"
        " 0.243e-6 to 2.000e-6 rad/(N mm), see below: its calibrations hardly determine it.",
    }
    rows = []
    for number, test in tests.items():
        rows.append(
            Row(
                f"joint {number}, angular",
                "deg",
                [turns[number].angular for turns in alone],
                test.angular,
                "Table 2.3",
                relative=_SPREAD,
                explanation=why[number],
            )
        )
        rows.append(
            Row(
                f"joint {number}, tangential",
                "mm",
                [turns[number].tangential for turns in alone],
                test.tangential,
                "Table 2.3",
                relative=_SPREAD,
            )
        )
    return Table(
        "Range of the error: compliance of Table 2.7 and noise",
        "Nothing is chosen here: compliances from another experiment of the document, masses and centres of gravity of"
        " Table 2.4 and of the third end-effector. A quarter is allowed, as much as the document's compliances of"
        " joints 2 to 5 differ between its three set-ups.",
        tuple(rows),
    )


def _by_table(tests: Mapping[int, AxisTest], tables: Mapping[str, Mapping[int, Turn]]) -> Table:
    return Table(
        "Range of the angular error with each of the document's compliances, without noise",
        "Ours from Tables 2.7, 2.9 and 2.11: median, lowest and highest of the three set-ups, not of seeds.",
        tuple(
            Row(
                f"joint {number}",
                "deg",
                [turns[number].angular for turns in tables.values()],
                test.angular,
                "Table 2.3",
                relative=_SPREAD,
            )
            for number, test in tests.items()
        ),
    )


def _shares_table(shares: Mapping[tuple[int, int], float]) -> Table:
    return Table(
        "Whose compliance it is when joints 2 and 3 turn",
        "Range of the angular error if one joint alone gives way (Table 2.7), without noise. The ranges need not"
        " add up.",
        tuple(
            Row(f"joint {turned} turns, joint {number} gives way", "deg", [value])
            for (turned, number), value in shares.items()
            if value > 0.005
        ),
    )


def _matched(
    tests: Mapping[int, AxisTest], whole: list[dict[int, Turn]], gear: Mapping[int, tuple[float, float]]
) -> Table:
    rows = []
    for number, test in tests.items():
        turns = [found[number] for found in whole]
        rows.append(
            Row(
                f"joint {number}, angular",
                "deg",
                [turn.angular for turn in turns],
                test.angular,
                "Table 2.3",
                absolute=0.005,
                relative=_SPREAD,
            )
        )
        rows.append(
            Row(
                f"joint {number}, backlash",
                "deg",
                [turn.backlash for turn in turns],
                test.backlash,
                "Table 2.3",
                absolute=0.001,
            )
        )
        rows.append(Row(f"joint {number}, run-out chosen", "deg", [gear[number][0]]))
    return Table(
        "With run-out and backlash chosen to match",
        "That these agree is no proof: run-out is the smallest amplitude that leaves the printed range, backlash is the"
        " printed one. It shows that gears as good as that are enough, and how large they would have to be.",
        tuple(rows),
    )


def _picture(tests: Mapping[int, AxisTest], alone: Mapping[int, Turn], whole: Mapping[int, Turn]) -> Picture:
    traces: list[Figure] = []
    layout: dict[str, Any] = {}
    labels = []
    for place, number in enumerate(tests):
        suffix = "" if place == 0 else str(place + 1)
        x, y = axis(""), axis("")
        row, column = divmod(place, 2)
        x["domain"] = [0.0, 0.46] if column == 0 else [0.54, 1.0]
        top = 1.0 - row * 0.35
        y["domain"] = [top - 0.25, top]
        x["anchor"], y["anchor"] = f"y{suffix}", f"x{suffix}"
        layout |= {f"xaxis{suffix}": x, f"yaxis{suffix}": y}
        labels.append(
            {
                "text": f"joint {number}",
                "xref": f"x{suffix} domain",
                "yref": f"y{suffix} domain",
                "x": 0.0,
                "y": 1.0,
                "xanchor": "left",
                "yanchor": "bottom",
                "showarrow": False,
            }
        )
        for name, turn, half, colour, dash in (
            ("compliance alone", alone[number], slice(0, len(alone[number].angle) // 2), BEFORE, "solid"),
            ("forward", whole[number], slice(0, len(whole[number].angle) // 2), AFTER, "solid"),
            ("backward", whole[number], slice(len(whole[number].angle) // 2, None), "#b3261e", "solid"),
        ):
            traces.append(
                {
                    "type": "scatter",
                    "mode": "lines",
                    "name": name,
                    "legendgroup": name,
                    "showlegend": place == 0,
                    "x": rounded_to(turn.angle[half], 1),
                    "y": rounded_to(turn.error[half], 5),
                    "xaxis": f"x{suffix}",
                    "yaxis": f"y{suffix}",
                    "line": {"color": colour, "width": 1.5, "dash": dash},
                    "hovertemplate": f"joint {number}, {name}<br>%{{x}} deg: %{{y:.4f}} deg<extra></extra>",
                }
            )
    drawn = figure(traces, 900, annotations=labels, **layout)
    drawn["layout"]["legend"]["y"] = 1.05
    return Picture(
        "angular-errors",
        "Angular error while one joint turns, as in Figure 2.6",
        "Error [deg] against the commanded angle [deg], first seed: compliance of Table 2.7 alone (forward run), and"
        " with run-out and backlash chosen to match, forward and backward.",
        drawn,
    )
