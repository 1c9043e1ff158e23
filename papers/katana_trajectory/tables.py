"""Tables of the study katana-trajectory: our figures beside those of Patel's chapter 5."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from papers.katana.circle import SPEED
from papers.katana_trajectory.run import FAST, MODELS, MOVING, SAMPLES, Cause, Model, Outcome, Source
from papers.study import Row, Table
from truearm.engine.robot.chain import Array

#: Section 5.5.1, mean distance from the path [mm].
_BEFORE: Final = "0.653"
_AFTER: Final[Mapping[Model, str]] = {"geometric": "0.312", "geometric and stiffness": "0.211", "with tilting": "0.132"}
_LINE: Final = "0.151"


def causes_table(outcomes: Sequence[Outcome]) -> Table:
    """Show how far the model says the tip is from the circle, by cause."""
    why: Mapping[Cause, str] = {
        "stiffness alone": "Stiffnesses in kgf m/deg are so high that this cannot be what takes the document's error"
        " from 0.312 to 0.211 mm.",
        "tilting, full gap": "Equation 5.19 adds the whole gap. But the gap was measured as the shift on reversal, so a"
        " joint lies half of it beside its middle. With the whole gap tilting alone would already be more than was"
        " measured in total.",
        "tilting": "Half the gap: of the size that was measured in total. How large it is hangs on the posture.",
        "tilting and geometry of Table 3.2": "Table 3.2 was fitted to a robot whose joints tilt, so its angles may"
        " hold a part of the tilting, which then counts twice.",
    }
    compared: set[Cause] = {"tilting", "tilting, full gap", "tilting and geometry of Table 3.2"}
    rows = [
        Row(
            f"{cause}, mean",
            "mm",
            [float(one.predicted[cause].mean()) for one in outcomes],
            _BEFORE if cause in compared else None,
            "section 5.5.1" if cause in compared else "",
            explanation=why.get(cause, ""),
        )
        for cause in outcomes[0].predicted
    ]
    rows += [
        Row(
            f"{cause}, largest",
            "mm",
            [float(one.predicted[cause].max()) for one in outcomes],
        )
        for cause in MOVING
    ]
    rows += [
        Row(
            f"{cause}, {speed:g} m/s against rest, largest",
            "mm",
            [one.moving[cause, speed] for one in outcomes],
            explanation={
                ("tilting", SPEED): "Mostly the backlash of joint 1, which only the moments of motion take to a side.",
                ("tilting", FAST): "A point that runs round this circle at 1 m/s is accelerated by 10 m/s^2, as much as"
                " by gravity: joints lean and fall to other sides.",
            }.get((cause, speed), ""),
        )
        for cause, speed in outcomes[0].moving
    ]
    return Table(
        "Predicted distance from the circle, by cause",
        "What the model says with one cause at a time and all else perfect, as in Figure 5.10, at"
        f" {SPEED:g} m/s. The measured total before calibration stands beside those that should not exceed it.",
        tuple(rows),
    )


def corrected_table(outcomes: Sequence[Outcome], source: Source, poses: int) -> Table:
    """Show how far the corrected twin is from circle and line, geometry identified from one source."""
    why: Mapping[tuple[Source, Model], str] = {
        ("poses", "geometric"): "Geometry from everywhere cannot take up what tilts here.",
        ("poses", "geometric and stiffness"): "Stiffness is too high to matter.",
        ("poses", "with tilting"): "Most of what is left is the play of joint 1, see below.",
        ("circle", "geometric"): "One circle tells geometry and tilting not apart: angles that are wrong imitate the"
        " tilting of this circle in this posture. The document's 0.312 mm is not from a fit as good as that.",
        (
            "circle",
            "with tilting",
        ): "No better than geometry alone on the circle that both were fitted to: both take"
        " the play of joint 1 for geometry.",
    }
    rows = []
    if source == "poses":
        rows.append(
            Row(
                "before, mean",
                "mm",
                [float(one.before.mean()) for one in outcomes],
                _BEFORE,
                "section 5.5.1",
                explanation="With the geometry of Table 3.2, which may count a part of the tilting twice.",
            )
        )
        rows.append(
            Row(
                "before, with perfect geometry, mean",
                "mm",
                [float(one.perfect_geometry.mean()) for one in outcomes],
                _BEFORE,
                "section 5.5.1",
            )
        )
    rows += [
        Row(
            f"{model}, mean",
            "mm",
            [float(one.corrected[model, source].circle.mean()) for one in outcomes],
            _AFTER[model],
            "section 5.5.1",
            explanation=why.get((source, model), ""),
        )
        for model in MODELS
    ]
    rows += [
        Row(
            f"{model}, on the straight line, mean",
            "mm",
            [one.corrected[model, source].line for one in outcomes],
            _LINE if model == "with tilting" else None,
            "section 5.5.1" if model == "with tilting" else "",
        )
        for model in MODELS
    ]
    if source == "circle":
        rows.append(
            Row(f"before, error at the {poses} poses, mean", "mm", [one.before_at_poses for one in outcomes]),
        )
        rows += [
            Row(
                f"{model}, error at the {poses} poses, mean",
                "mm",
                [one.corrected[model, source].at_poses for one in outcomes],
                explanation="Points of one circle in one posture do not determine 13 angles. What they give is worth"
                " nothing elsewhere, though the document says that it need not be corrected for other paths."
                if model == "geometric"
                else "",
            )
            for model in MODELS
        ]
    came: Mapping[Source, str] = {
        "poses": f"17 parameters from {poses} poses in the cube of ISO 9283 that the circle belongs to (chapter 4).",
        "circle": f"The angles alone from {SAMPLES} positions read on the circle itself, as chapter 5 describes it.",
    }
    return Table(
        f"Corrected and followed by the twin: geometry from {'poses' if source == 'poses' else 'the circle itself'}",
        f"Mean distance of the twin's tip from the path. {came[source]}",
        tuple(rows),
    )


def rest_table(outcomes: Sequence[Outcome]) -> Table:
    """Show what is left when all tilting is corrected."""
    return Table(
        "What is left when all tilting is corrected",
        "Mean distance of the twin's tip from the circle.",
        (
            Row(
                "all tilting, geometry from poses",
                "mm",
                [float(one.corrected["with tilting", "poses"].circle.mean()) for one in outcomes],
            ),
            Row("model told exactly", "mm", [float(one.exact.mean()) for one in outcomes]),
            Row(
                "joint 1 without backlash, model told exactly",
                "mm",
                [float(one.exact_seated.mean()) for one in outcomes],
                explanation="Gravity has no moment about a vertical axis. In the twin the smallest moment of motion"
                " takes joint 1 to one side of its 0.063 deg of play: 0.17 mm at the circle's distance of 0.3 m, on"
                " which a model that leaves it in the middle knows nothing. What is left then is where the moment of"
                " joint 5 is nearly zero in some postures.",
            ),
            Row(
                "largest distance, joint 1 without backlash, model told exactly",
                "mm",
                [float(one.exact_seated.max()) for one in outcomes],
            ),
        ),
    )


def moments_table(outcomes: Sequence[Outcome]) -> Table:
    """Show the moments of the load at every joint."""
    rows = []
    for joint in range(5):
        about, across = ([one.loads[joint, 5] for one in outcomes], [_across(one.loads, joint) for one in outcomes])
        rows += [
            Row(f"joint {joint + 1}, about its axis, largest", "N m", [float(np.abs(m).max()) for m in about]),
            Row(
                f"joint {joint + 1}, across its axis, largest",
                "N m",
                [float(m.max()) for m in across],
                explanation="As the document says: about the vertical axis there is almost none, across it there is"
                " much, and the bearings carry it."
                if joint == 0
                else "",
            ),
        ]
    moving = [float(np.abs(one.loads[:, 3:] - one.loads_at_rest[:, 3:]).max()) for one in outcomes]
    rows.append(Row(f"any joint, {SPEED:g} m/s against rest, largest difference", "N m", moving))
    return Table(
        "Moments of the load along the circle",
        "Figures 5.8 and 5.9 show them as curves only. A positive moment about an axis turns the joint forward.",
        tuple(rows),
    )


def _across(loads: Array, joint: int) -> Array:
    return np.asarray(np.hypot(loads[joint, 3], loads[joint, 4]))
