"""Tables of the study kr5-gdt: our figures beside those of the paper."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from papers.kr5_gdt.run import TABLE_3, Outcome, Run, true_errors
from papers.study import Row, Table
from truearm.axis_circles.fit import AxisFit
from truearm.engine.motion.cube import DIRECTIONS
from truearm.validation.lines import reduction
from truearm.validation.tolerances import tolerance_of

#: Table 4: perpendicularity or parallelism [mm].
_TABLE_4: Final = (0.0346, 0.1742, 0.0013, 0.0145, 0.0086, 0.0164)
#: Figure 8: largest difference between the document's model and its measurement [mm].
_MODEL: Final = {"x": "0.56", "y": "0.58", "z": "0.52", "xy": "0.66", "yz": "0.65", "xz": "0.84", "xyz": "0.61"}
#: Figures 9 to 11: by how much the largest error fell [percent].
_REDUCTION: Final = {"x": "90", "y": "88", "z": "81", "xy": "80", "yz": "74", "xz": "71", "xyz": "85"}
_LARGEST: Final = "3.98"


def _words(fit: AxisFit, name: str) -> str:
    """Return what an error found is, in words: sums with factors of one."""
    members = {n: w for n, w in fit.combination(name).items() if abs(w) > 0.02}
    return "".join(f" {'-' if w < 0 else '+'} {n}" for n, w in members.items()).removeprefix(" + ")


def errors_table(found: Run) -> Table:
    """Set the joint errors found beside those put in."""
    exact, truth, rows = found.exact, true_errors(), []
    for p in exact.free.parameters:
        scale, unit = (1e3, "mm") if p.unit == "m" else (math.degrees(1.0), "deg")
        rows.append(
            Row(
                _words(exact, p.name),
                unit,
                [scale * one.fit.robot.values[p.name] for one in found.outcomes],
                f"{sum(w * scale * truth[n] for n, w in exact.combination(p.name).items()):.4f}",
                "Table 3",
                claim="construction",
            )
        )
    return Table(
        "Joint errors from circles",
        "Table 3 has been put into the twin, so this tests the way from circles to errors, not the document's figures.",
        tuple(rows),
    )


def intervals_table(found: Run) -> Table:
    """Count how often the true error lies within its interval."""
    names = found.exact.free.names
    rows = [Row(_words(found.exact, n), "%", float(s)) for n, s in zip(names, found.inside, strict=True)]
    return Table(
        "How often the true value lies within the 95 % interval",
        "Intervals as stated with each measurement, from the deviations of its circles.",
        tuple(rows),
    )


def determined_table(found: Run) -> Table:
    """Count how many of the errors poses, positions and circles determine."""
    exact = found.exact
    unseen = "; ".join(r.combination for r in exact.redundancies)
    return Table(
        "How many of the 30 errors can be told apart",
        "Counted on the nominal robot.",
        (
            Row("from poses of the flange", "", found.from_poses),
            Row("from positions of the flange", "", found.from_positions),
            Row(
                "from circles",
                "",
                len(exact.free.names),
                explanation=f"Not seen: {unseen}. Only {', '.join(exact.moving_flange)} moves the flange.",
            ),
        ),
    )


def tolerances_table() -> Table:
    """Show the tolerances that follow from the errors of Table 3."""
    rows = []
    for number, ((ebeta, egamma, *_), delta) in enumerate(zip(TABLE_3, _TABLE_4, strict=True), 1):
        lean = tolerance_of(math.radians(ebeta), math.radians(egamma), 1.0).delta
        rows.append(Row(f"joint {number}, lean of a hole 100 mm deep", "mm", 100.0 * lean))
        rows.append(Row(f"joint {number}, depth that Table 4 implies", "mm", delta / lean))
    return Table(
        "Tolerances from the errors of Table 3",
        "Table 4 follows from Table 3 through the depths of the holes, which are not printed. Taking the depths from"
        " both tables and comparing them again would be circular, so nothing is compared.",
        tuple(rows),
    )


def before_table(outcomes: Sequence[Outcome]) -> Table:
    """Show errors on lines before compensation."""
    rows = [
        Row(
            "largest of all seven lines",
            "mm",
            [1e3 * max(one.before.largest(d) for d in DIRECTIONS) for one in outcomes],
            _LARGEST,
            "section 5",
            explanation="The box is at an invented place.",
        )
    ]
    rows += [Row(f"{d}, largest", "mm", [1e3 * one.before.largest(d) for one in outcomes]) for d in DIRECTIONS]
    return Table("Errors on lines, uncompensated (Figures 9 to 11)", "Of the position.", tuple(rows))


def reductions_table(outcomes: Sequence[Outcome]) -> Table:
    """Show by how much compensation reduces the largest error."""
    rows = [
        Row(
            d,
            "%",
            [reduction(one.before, one.after, d) for one in outcomes],
            _REDUCTION[d],
            "section 4.4",
            explanation="The twin has joint errors only. The document's robot also has gears that run out, links that"
            " give way and a temperature of 32 to 35 degC: its own model differs from its measurements by 0.5 to 0.8 mm"
            " (Figure 8), which no compensation through that model can remove."
            if d == "x"
            else "",
        )
        for d in DIRECTIONS
    ]
    rows += [
        Row(f"{d}, largest error left", "mm", [1e3 * one.after.largest(d) for one in outcomes]) for d in DIRECTIONS
    ]
    return Table(
        "By how much compensation reduces the largest error (Figures 9 to 11)",
        "With the errors found from noisy circles.",
        tuple(rows),
    )


def models_table(outcomes: Sequence[Outcome]) -> Table:
    """Show how far the model is from the twin on the lines."""
    return Table(
        "Largest difference between model and robot on lines (Figure 8)",
        "Where the model with the errors found says the flange is, and where the twin's is, without noise.",
        tuple(
            Row(
                d,
                "mm",
                [1e3 * float(one.model[one.before.lines.rows(d)].max()) for one in outcomes],
                _MODEL[d],
                "section 4.2",
                explanation="The document's figure is what its model of joint errors does not describe; here nothing"
                " else is wrong."
                if d == "x"
                else "",
            )
            for d in DIRECTIONS
        ),
    )
