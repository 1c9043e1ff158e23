"""Patel, chapter 4: joints that tilt, found by inclinometers first, and what that leaves of the pose errors."""

from __future__ import annotations

from typing import Final

from papers import Progress
from papers.katana.robot import NOISE
from papers.katana_tilting.pictures import errors_picture, poses_picture
from papers.katana_tilting.run import run
from papers.katana_tilting.tables import (
    ASKED,
    constants_table,
    contradictions_table,
    errors_table,
    methods_table,
    shares_table,
    ten_points_table,
    unseen_table,
)
from papers.seeds import median_of
from papers.study import Study
from truearm.engine.motion.largest_cube import POSES

_UNSEEN: Final = 200


def study(seeds: int, progress: Progress, count: int = POSES, unseen: int = _UNSEEN) -> Study:
    """Run the study.

    Parameters
    ----------
    seeds
        How many: of the orientations at the poses, of the postures for the inclinometers, of the unseen
        configurations and of the noise.
    progress
        Called with a few words at each step.
    count
        Poses to calibrate with.
    unseen
        Configurations to judge by.
    """
    found = run(seeds, progress, count, unseen)
    outcomes = found.outcomes
    conventional = median_of(outcomes, lambda one: one.left["conventional"].mean)
    tilting = median_of(outcomes, lambda one: one.left["two-stage"].mean)
    share = median_of(outcomes, lambda one: one.ratio("two-stage"))
    return Study(
        name="katana-tilting",
        title="A Katana 450 whose joints tilt",
        source="D. A. Patel, thesis on the Katana 450, chapter 4, Figure 4.8, Tables 4.3 to 4.6; geometry of Table 3.2",
        answer=f"On unseen poses the conventional calibration leaves {conventional:.3f} mm on average, and"
        f" {tilting:.3f} mm are left if clearance, backlash and stiffness are found by inclinometers first:"
        f" {share:.1f} % (asked: at most {ASKED:g} %, the document has"
        " 25 %). The inclinometers give back the constants of Tables 4.3 and 4.4. Identifying everything at once, from"
        " the poses alone, does as well on this robot.",
        seeds=seeds,
        tables=(
            shares_table(outcomes),
            *(errors_table(outcomes, column) for column in range(3)),
            unseen_table(outcomes),
            ten_points_table(outcomes),
            methods_table(outcomes),
            constants_table(outcomes),
            contradictions_table(),
        ),
        pictures=(poses_picture(found.cube, outcomes[0]), errors_picture(outcomes)),
        notes=(
            "The twin has the geometry of Table 3.2 and the constants of Tables 4.3 and 4.4. It lets the arm sag until"
            " moments and deflections agree, and its backlash jumps where a moment changes its sign. Identification"
            " sees it only through readings: inclinations rounded to 0.001 deg, and positions with"
            f" {NOISE * 1e3:g} mm of noise a coordinate.",
            "The program chooses 24 pairs of postures for the inclinometers (two pulls of 20 N at the flange at the"
            " same joint readings) and 8 pairs for poses, which tell what inclinometers cannot see: joint 1 about its"
            " vertical axis.",
            "The printed backlash is the full gap that a dial shows on reversal, so a joint lies half of it beside the"
            " middle. Equation 5.19 adds the whole; the study katana-trajectory has both.",
            "Base and tool are known, as in the document. Errors are judged against the twin's true poses; unseen"
            " configurations are drawn evenly from all that the limits allow.",
        ),
    )
