"""Tables of what limits the models of a measured IRB 120: instrument, table, and what is left over."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from typing import Final

import numpy as np

from papers.irb120_faro.remainder import FOLDS, Cause, Remainder
from papers.irb120_faro.run import PLAIN, Run
from papers.study import Row, Table
from truearm.engine.data.checks import clean_references
from truearm.engine.data.rigid_tool import constellation

#: How tables call each cause, and what it would be.
_CAUSES: Final = {
    Cause.ARRIVAL: (
        "direction of arrival of each joint",
        "What differs between a joint that comes from below and one that comes from above.",
    ),
    Cause.ANGLE: ("angle of each joint, three harmonics", "Gears and encoders that run out of true."),
    Cause.ROBOT_DRIFT: (
        "steady drift of the whole robot",
        "The robot creeps against the reflectors on its table, from the first configuration to the last.",
    ),
    Cause.JOINT_DRIFT: ("steady drift of each joint", "Joint zeros that creep."),
}


def instrument_table(found: Run) -> Table:
    """Return what tracker and table contribute."""
    raw = found.raw
    points = constellation(raw) * 1e3
    spreads = [
        float(np.nanstd(np.linalg.norm(points[:, i] - points[:, j], axis=1), ddof=1))
        for i, j in combinations(range(points.shape[1]), 2)
    ]
    noise = float(np.sqrt(np.mean(np.square(spreads)) / 2))
    rows = [
        Row("distance between two reflectors of the tool, deviation", "mm", spreads, explanation="One value a pair."),
        Row(
            "tracker noise: deviation of a coordinate",
            "mm",
            noise,
            explanation="From those distances, equal in all directions. The mean length of such an error is 1.6 times"
            " as much. A slow error of the tracker that moves all reflectors alike does not show here.",
        ),
    ]
    references = clean_references(raw)
    if references is not None:
        away = np.linalg.norm(references - np.nanmedian(references, axis=0), axis=2) * 1e3
        rows += [
            Row("table: mean distance of its reflectors from their usual place", "mm", float(np.nanmean(away))),
            Row("table: largest", "mm", float(np.nanmax(away))),
        ]
    left_in = np.array([one.table_motion_left_in.mean for one in found.outcomes])
    out = np.array([one.many[PLAIN].mean for one in found.outcomes])
    rows.append(
        Row(
            "held-out mean that taking the table's motion out gains, elastic",
            "mm",
            (left_in - out).tolist(),
            explanation=f"{np.median(left_in):.4f} mm with the motion left in, {np.median(out):.4f} mm without.",
        )
    )
    turned = np.degrees(raw.joints)
    nearest = np.abs(turned[:, None] - turned[None]).max(axis=2) + 1e9 * np.eye(len(turned))
    rows.append(
        Row(
            "two configurations nearest to each other: largest difference of a joint",
            "deg",
            float(nearest.min()),
            explanation="No configuration was measured twice, or nearly so: these data cannot tell the robot's"
            " repeatability.",
        )
    )
    return Table(
        "Error budget: tracker, table, repeatability", "What the data say without a model of the robot.", tuple(rows)
    )


def _models(run: Run) -> tuple[tuple[str, tuple[Remainder, ...]], ...]:
    return (
        ("elastic", run.elastic),
        ("elastic and five more, no warm-up", run.cold),
        ("elastic and six more", run.warm),
    )


def remainder_table(run: Run) -> Table:
    """Return how the rest divides between motions of the tool and what no motion explains."""
    lines: tuple[tuple[str, Callable[[Remainder], float], str], ...] = (
        ("mean length", lambda one: one.mean, ""),
        ("root mean square", lambda one: one.whole, ""),
        ("shared by all three reflectors", lambda one: one.common, "The robot, or the tracker as a whole."),
        ("turn of the tool about their middle", lambda one: one.turning, "The robot's orientation."),
        ("what no motion of the tool explains", lambda one: one.rest, "Tracker noise, and the tool itself."),
    )
    return Table(
        "Error budget: what the model leaves over",
        f"Each of {FOLDS} parts of the configurations is predicted by a fit to the others. Root mean squares are of the"
        " length of a reading's error; the squares of the last three add up to that of all.",
        tuple(
            Row(f"{name}: {what}", "mm", [figure(one) for one in found], explanation=why)
            for name, found in _models(run)
            for what, figure, why in lines
        ),
    )


def cause_table(run: Run) -> Table:
    """Return what the rest goes along with."""
    rows = []
    for name, found in _models(run):
        rows.append(Row(f"{name}: nothing more", "mm", [one.mean for one in found]))
        for cause, (words, why) in _CAUSES.items():
            means = [one.without[cause] for one in found]
            rows.append(Row(f"{name}: {words}", "mm", means, explanation=why if found is run.elastic else ""))
        rows.append(
            Row(
                f"{name}: correlation with the configuration before",
                "1",
                [one.follows for one in found],
                explanation="Of the part that all reflectors share; chance alone makes about 0.03.",
            )
        )
    return Table(
        "Error budget: what the rest goes along with",
        "Mean error if one more cause is taken out, too. It is fitted to what the training parts leave over, as small"
        " turns of the joints or of the whole robot, and judged on the part that was left out. A cause that takes"
        " nothing more is not there, or in the model already.",
        tuple(rows),
    )
