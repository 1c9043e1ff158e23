"""Tables of the study of the hexapod device."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations
from typing import Final

import numpy as np

from papers.hexapod_device.run import ATTACHED, REPEATED, Outcome
from papers.study import Row, Table
from truearm.engine.data.hexapod import (
    CUPS,
    DEVICE,
    HexapodPose,
    assemblies,
    designs,
    distance,
    distinct,
    leg_lengths,
    near_equal,
    tool_cups,
    triangle,
)
from truearm.engine.robot.transform import rigid_motion
from truearm.hexapod.places import CupUncertainty, all_solutions, cup_uncertainty
from truearm.hexapod.sheet import SIDES_OF_FOUR, four_cups
from truearm.validation.pose_accuracy import repeatability

_SIGMA: Final = DEVICE.sigma
#: Section 3.2: pairs of the three groups, from the closest.
_PRINTED: Final = (
    ((10, 37), (46, 49), (2, 70), (34, 61), (22, 25), (13, 58)),
    ((14, 59), (35, 62), (11, 38), (47, 50), (23, 26), (3, 71)),
    ((1, 72), (12, 39), (15, 60), (48, 51), (24, 27), (36, 63)),
)
#: Table 3.1, by solution: t1, t2, t3.
_TABLE_3_1: Final = {
    1: ("2.309", "2.646", "3.179"),
    2: ("2.309", "2.646", "3.054"),
    3: ("2.309", "2.480", "2.853"),
    4: ("2.309", "2.480", "3.180"),
}
#: The same along x, y and z.
_PER_AXIS: Final = {
    1: (("1.5", "1.6", "0.7"), ("1.5", "1.9", "1.1"), ("1.6", "2.6", "1.0")),
    2: (("1.5", "1.6", "0.7"), ("1.5", "1.9", "1.1"), ("1.1", "2.5", "1.5")),
    3: (("1.5", "1.6", "0.7"), ("1.5", "1.2", "1.6"), ("1.0", "2.1", "1.7")),
    4: (("1.5", "1.6", "0.7"), ("1.5", "1.2", "1.6"), ("1.6", "2.2", "1.7")),
}


def counts_table(found: Sequence[HexapodPose]) -> Table:
    """Return designs, assemblies and poses, and how far apart poses are."""
    pairs = set(near_equal(found))
    groups = [len(pairs & set(group)) for group in _PRINTED]
    by_number = {pose.number: pose for pose in found}
    apart = np.array([distance(a, b) for a, b in combinations(found, 2)])
    _, alike = np.unique(np.round(apart, 6), axis=0, return_counts=True)
    flanges = np.array([pose.position for pose in found])
    apex = four_cups(np.full(3, DEVICE.base), np.full(3, DEVICE.base))[3] * [1.0, 1.0, -1.0]
    radius = float(np.linalg.norm(flanges - apex, axis=1).max())
    alike.sort()
    rows = [
        Row("designs", "", len(designs()), "36", "section 3.2"),
        Row("assemblies above the base", "", len(list(assemblies())), "144", "abstract"),
        Row("poses", "", len(found), "72", "section 3.2"),
        Row("near-equal pairs (30 deg, 50 mm)", "", len(pairs), "18", "section 3.2"),
        Row("poses kept", "", len(distinct(found)), "54", "section 3.2"),
    ]
    for n, (group, count) in enumerate(zip(_PRINTED, groups, strict=True), 1):
        rows.append(Row(f"group {n}: pairs as printed", "", count, "6", "section 3.2"))
        turned, way = (np.mean([distance(by_number[a], by_number[b])[k] for a, b in group]) for k in (0, 1))
        rows.append(Row(f"group {n}: angle", "deg", math.degrees(turned)))
        rows.append(Row(f"group {n}: distance", "mm", 1e3 * float(way)))
    rows += [
        Row("fewest pairs that a point of Figure 3.7 stands for", "", int(alike.min()), "3", "section 3.2"),
        Row(
            "most pairs that a point of Figure 3.7 stands for, but for one",
            "",
            int(alike[-2]),
            "24",
            "section 3.2",
            explanation=f"One point, at 120 deg and 260 mm, stands for {alike[-1]} pairs.",
        ),
        Row(
            "radius of the sphere that holds all flanges",
            "mm",
            1e3 * radius,
            "240",
            "section 3.2",
            claim="order",
            explanation="Its centre is the point 300 mm above all base cups. The document has about 240 mm.",
        ),
        Row(
            "largest distance of two flanges",
            "mm",
            1e3 * float(apart[:, 1].max()),
            "500",
            "section 3.6",
            claim="at most",
            explanation='The document prints "no more than 500 mm".',
        ),
    ]
    return Table("What can be measured (Figures 3.6 and 3.7)", "Counted at nominal lengths.", tuple(rows))


def uncertainty_table(outcomes: Sequence[Outcome]) -> Table:
    """Return Table 3.1."""
    rows = []
    for solution, u in all_solutions().items():
        printed = float(np.linalg.norm(u.third_as_printed))
        for cup, (ours, theirs) in enumerate(zip(u.norms, _TABLE_3_1[solution], strict=True), 1):
            rows.append(
                Row(
                    f"solution {solution}, t{cup}",
                    "sigma",
                    ours,
                    theirs,
                    "Table 3.1",
                    explanation="With all correlations: T3 hangs on T1 and T2, which come from the same lengths, and"
                    " on B2."
                    if solution == 1 and cup == 3
                    else "",
                )
            )
            drawn = [one.monte_carlo[solution][cup - 1] for one in outcomes]
            rows.append(Row(f"solution {solution}, t{cup}, Monte Carlo", "sigma", drawn))
        rows += _per_axis(solution, u)
        rows.append(
            Row(
                f"solution {solution}, t3 as if nothing were correlated",
                "sigma",
                printed,
                _TABLE_3_1[solution][2],
                "Table 3.1",
                explanation="The document's way, which takes T1 and T2, and their coordinates, as independent and B2 as"
                " exact, gives its figures."
                if solution == 1
                else "",
            )
        )
    return Table(
        "Uncertainty of the tool's cups (Table 3.1)",
        "In standard deviations of one length, each over all axes together.",
        tuple(rows),
    )


def _per_axis(solution: int, u: CupUncertainty) -> list[Row]:
    per_axis = np.sqrt(np.diag(u.covariance)).reshape(3, 3)
    per_axis[2] = u.third_as_printed
    words = ("t1", "t2", "t3 as if nothing were correlated")
    return [
        Row(f"solution {solution}, {words[cup]}, along {letter}", "sigma", ours, theirs, "Table 3.1")
        for cup in range(3)
        for letter, ours, theirs in zip("xyz", per_axis[cup].tolist(), _PER_AXIS[solution][cup], strict=True)
    ]


def accuracy_table(outcomes: Sequence[Outcome], worst: float) -> Table:
    """Return what Table 3.1 means in micrometres."""
    of_designs = [max(cup_uncertainty(solution, design).norms) for design, solution in assemblies()]
    rng = np.random.default_rng(0)
    d = np.repeat([DEVICE.base, DEVICE.tool, DEVICE.leg], (3, 3, 6))
    off = [
        max(cup_uncertainty(solution, lengths=d + rng.uniform(-1.0, 1.0, 12) * DEVICE.reach).norms)
        / max(cup_uncertainty(solution).norms)
        - 1.0
        for solution in _TABLE_3_1
        for _ in range(25)
    ]
    return Table(
        "Accuracy of the device",
        "Of the worst cup.",
        (
            Row("standard deviation", "um", worst * _SIGMA * 1e6, "1.622", "section 3.4"),
            Row(
                "at 95 %",
                "um",
                1.96 * worst * _SIGMA * 1e6,
                "3.18",
                "section 3.4",
                explanation="3.359 instead of 3.180 standard deviations, see Table 3.1.",
            ),
            Row("standard deviation, best of all designs", "um", min(of_designs) * _SIGMA * 1e6),
            Row(
                "standard deviation, worst of all designs",
                "um",
                max(of_designs) * _SIGMA * 1e6,
                explanation="The document takes all 36 designs to be as good as one. The frame begins at B1 and B2, and"
                " that makes a difference.",
            ),
            Row(
                "largest change by lengths 1 mm off",
                "%",
                100.0 * float(np.abs(off).max()),
                explanation='"Negligibly", says the document (section 3.4).',
            ),
            Row("lengths to cups and back, largest difference", "mm", 1e3 * _round_trip()),
            Row(
                "flange, standard deviation of its place",
                "um",
                [1e6 * one.flange[0] for one in outcomes],
                explanation="The document leaves the flange out. The tool's cups stand before it, and the turn of the"
                " tool moves it as well.",
            ),
            Row("flange, standard deviation of its turn", "urad", [1e6 * one.flange[1] for one in outcomes]),
        ),
    )


def _round_trip() -> float:
    rng = np.random.default_rng(0)
    base, tool, legs = (
        nominal + rng.uniform(-1.0, 1.0, (count, 100)) * DEVICE.reach
        for nominal, count in ((DEVICE.base, 3), (DEVICE.tool, 3), (DEVICE.leg, 6))
    )
    feet = triangle(base, "B")
    return max(
        float(np.abs(leg_lengths(design, feet, tool_cups(design, solution, base, tool, legs)) - legs).max())
        for design, solution in assemblies()
    )


def spoilt_table(outcomes: Sequence[Outcome]) -> Table:
    """Return what drift does."""
    rows = []
    for words, errors, why in (
        ("a bar that does not drift", [one.steady for one in outcomes], ""),
        (
            "put on its calibrator before each pose",
            [one.each_pose for one in outcomes],
            "Six readings drift by less than they scatter.",
        ),
        (
            "never put on its calibrator",
            [one.never for one in outcomes],
            "All legs are too long by the same length then, and the fixtures, measured first, are not.",
        ),
    ):
        rows.append(Row(f"{words}: mean", "um", [1e6 * float(norms.mean()) for norms in errors]))
        rows.append(Row(f"{words}: largest", "um", [1e6 * float(norms.max()) for norms in errors], explanation=why))
    readings = 6 * len(outcomes[0].never)
    return Table(
        "Drift of the bar (section 3.5)",
        f"Error of the three cups over a session of {readings} leg lengths, against the truth. The document prints that"
        " readings are off by as much as 3 um, which was put in, and not what becomes of the poses.",
        tuple(rows),
    )


def changer_table(outcomes: Sequence[Outcome]) -> Table:
    """Return what the tool changer does."""
    rows = []
    for cup in range(3):
        apart = [
            1e3 * max(float(np.linalg.norm(a[cup] - b[cup])) for a, b in combinations(one.attachments, 2))
            for one in outcomes
        ]
        name = f"T{cup + 1}, largest difference between {ATTACHED} attachments"
        if cup == 2:
            why = "Chosen to match: the document says as much as 0.100 mm."
            rows.append(Row(name, "mm", apart, "0.100", "section 3.5", claim="construction", explanation=why))
        else:
            rows.append(Row(name, "mm", apart))
    found = [1e3 * one.changer for one in outcomes]
    rows.append(
        Row(
            "attached anew before every pose: mean error of the cups",
            "mm",
            [float(errors.mean()) for errors in found],
            explanation="Against a tool that sits as it did when the fixture was set up. The device itself measures"
            " this to a few um, so it is not the device's error but what it sees.",
        )
    )
    rows.append(Row("attached anew before every pose: largest", "mm", [float(e.max()) for e in found]))
    return Table("The tool changer (section 3.5)", "The robot does not move.", tuple(rows))


def repeatability_table(outcomes: Sequence[Outcome]) -> Table:
    """Return how well the device repeats."""
    rows = []
    for cup in range(3):
        most = [1e6 * max(repeatability(places[:, cup]) for places in one.repeated) for one in outcomes]
        rows.append(Row(f"T{cup + 1}", "um", most))
    flange = [1e6 * max(repeatability(rigid_motion(CUPS, places)[1]) for places in one.repeated) for one in outcomes]
    rows.append(
        Row(
            "flange",
            "um",
            flange,
            explanation="The document has 36 to 43 um for the cups and 21 um for the flange of its robot, so little of"
            " that is the device.",
        )
    )
    return Table(
        "Repeatability of the device alone",
        f"Largest of four poses measured {REPEATED} times by a robot that repeats exactly (ISO 9283: mean distance"
        " from the middle plus three standard deviations).",
        tuple(rows),
    )


def fourth_table(outcomes: Sequence[Outcome]) -> Table:
    """Return what a fourth cup is worth."""
    sides = len(SIDES_OF_FOUR)
    rows = [
        Row("sides, and times as many poses of the device", "", sides, "4", "section 4.5"),
        *(
            Row(
                f"times as many configurations of the {title}",
                "",
                [one.gain[name] for one in outcomes],
                "4",
                "section 4.5",
                explanation='The document says "as much as four times". The three more sides look sideways and down'
                " when the first one lies flat, and what looks away from the robot is out of its reach."
                if name == "irb120"
                else "",
            )
            for name, title in (("irb120", "IRB 120"), ("lrmate200ic", "LR Mate 200iC"))
            if outcomes[0].gain
        ),
    ]
    return Table(
        "A fourth cup on the base fixture (section 4.5)",
        "It is 300 mm from the three others, below their plane. Fixtures lie flat before the robot, at places drawn for"
        " each seed.",
        tuple(rows),
    )
