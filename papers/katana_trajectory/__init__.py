"""Patel, chapter 5: what tilting joints make of a circle, and of what is corrected before it is commanded."""

from __future__ import annotations

from typing import Final

import numpy as np

from papers import Progress
from papers.katana.circle import SPEED
from papers.katana_trajectory.pictures import (
    about_picture,
    across_picture,
    followed_picture,
    joints_picture,
    predicted_picture,
    robot_picture,
)
from papers.katana_trajectory.run import MODELS, run
from papers.katana_trajectory.tables import causes_table, corrected_table, moments_table, rest_table
from papers.seeds import median_of
from papers.study import Study
from truearm.engine.motion.largest_cube import POSES

#: Time between samples [s].
_STEP: Final = 0.05


def study(seeds: int, progress: Progress, step: float = _STEP, poses: int = POSES) -> Study:
    """Run the study.

    Parameters
    ----------
    seeds
        How many: of the posture in which the arm follows the circle, of the noise, and of the postures for the
        inclinometers.
    progress
        Called with a few words at each step.
    step
        Time between samples [s].
    poses
        How many geometry is identified from, besides the samples of the circle.
    """
    outcomes = run(seeds, progress, step, poses)
    alone = [float(one.predicted["tilting"].mean()) for one in outcomes]
    stiff = median_of(outcomes, lambda one: float(one.predicted["stiffness alone"].mean()))
    geometric, stiffness, tilting = (
        float(np.median([one.corrected[model, "poses"].circle.mean() for one in outcomes])) for model in MODELS
    )
    return Study(
        name="katana-trajectory",
        title="A Katana 450 on a circle",
        source="D. A. Patel, thesis on the Katana 450, chapter 5, Figures 5.7 to 5.10 and 5.12; geometry of Table 3.2",
        answer=f"Tilting alone takes the tip {np.median(alone):.2f} mm beside the circle, {min(alone):.2f} to"
        f" {max(alone):.2f} mm by the posture in which the arm goes round, which the document does not print; stiffness"
        f" alone takes it {stiff:.3f} mm. With geometry from {poses} poses the"
        f" corrected twin is {geometric:.3f} mm beside it, {stiffness:.3f} mm if"
        f" stiffness is known as well, and {tilting:.3f} mm if all tilting is: here stiffness gains"
        " next to nothing, and tilting two thirds. Most of what is left is the backlash of joint 1, which gravity"
        " pushes to neither side.",
        seeds=seeds,
        tables=(
            causes_table(outcomes),
            corrected_table(outcomes, "poses", poses),
            corrected_table(outcomes, "circle", poses),
            rest_table(outcomes),
            moments_table(outcomes),
        ),
        pictures=(
            robot_picture(outcomes[0]),
            joints_picture(outcomes[0]),
            about_picture(outcomes[0]),
            across_picture(outcomes[0]),
            predicted_picture(outcomes[0]),
            followed_picture(outcomes[0]),
        ),
        notes=(
            f"The circle goes through the four points of section 5.5.1 with the tip of the 330 mm pencil tool, at"
            f" {SPEED:g} m/s from rest to rest, accelerated by 0.4 m/s^2 at most. The document prints no speed.",
            "Its orientation is free: with the tool normal to the plane the highest point cannot be reached. Which"
            " posture the arm has is drawn anew for each seed, at least 0.1 reach lengths a rad away from singular"
            " ones, so lowest and highest show what the posture does.",
            "The straight line is the circle's diameter from the highest to the lowest point; the document does not say"
            " where its line is.",
            "The correction of equation 5.22 is subtracted (the document does not say so, and added it would double the"
            " error) and made again until the model's prediction keeps to the path. The twin then follows the corrected"
            " readings in motion.",
            "Stiffness, clearance and backlash come from simulated inclinometers of 0.001 deg and pairs of poses, as in"
            " the study katana-tilting.",
            "The model's backlash changes its side smoothly within 0.05 N m of zero moment, as if friction held the"
            " joint in the middle; the twin's jumps.",
        ),
    )
