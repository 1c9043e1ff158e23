"""Li et al.: an arm of three joints calibrated by touching a table, beside their figures and other ways to fit."""

from __future__ import annotations

from typing import Final

from papers import Progress
from papers.li_table.pictures import paths_pictures, trajectory_picture
from papers.li_table.run import Method, Surface, run
from papers.li_table.session import session_files
from papers.li_table.tables import (
    alone_table,
    geometry_table,
    measures_table,
    mistakes_table,
    no_play_table,
    play_table,
    trajectory_table,
    verification_table,
)
from papers.seeds import median_of
from papers.study import Study

_UNSEEN: Final = 200


def study(seeds: int, progress: Progress, unseen: int = _UNSEEN) -> Study:
    """Run the study.

    Parameters
    ----------
    seeds
        How many: of true parameters, play, noise and unseen points.
    progress
        Called with a few words at each step.
    unseen
        Points about the table to judge by.
    """
    outcomes = run(seeds, progress, unseen)

    def at_points(surface: Surface) -> float:
        return median_of(outcomes, lambda one: float(one.following.after[surface].points.mean()))

    before = median_of(outcomes, lambda one: float(one.following.before.points.mean()))

    def with_play(method: Method) -> float:
        return median_of(outcomes, lambda one: one.play.after["normal", method])

    def without_play(method: Method) -> float:
        return median_of(outcomes, lambda one: one.no_play.after["normal", method])

    return Study(
        name="li-table",
        title="A calibration table touched by an arm of three joints",
        source="K.-L. Li, W.-T. Yang, K.-Y. Chan and P.-C. Lin, SpringerPlus 5 (2016) 1771",
        answer="With play in the joints the document's fit takes the twin from"
        f" {before:.1f} mm to {at_points('normal'):.1f},"
        f" {at_points('roll'):.1f} and {at_points('pitch'):.1f} mm (normal, roll, pitch),"
        " where it has 26.9 mm before and 16.4, 19.1 and 22.2 mm after. Its bounds are what makes one table enough:"
        f" about the level table its fit leaves {with_play('distances'):.1f} mm, least squares without bounds"
        f" {with_play('unbounded'):.1f} mm. Without play these are"
        f" {without_play('distances'):.2f} and {without_play('unbounded'):.1f} mm.",
        seeds=seeds,
        tables=(
            verification_table(outcomes),
            trajectory_table(outcomes),
            geometry_table(outcomes),
            play_table(outcomes),
            no_play_table(outcomes),
            measures_table(outcomes),
            alone_table(outcomes),
            mistakes_table(outcomes),
        ),
        pictures=(*paths_pictures(outcomes[0]), trajectory_picture(outcomes[0])),
        files=session_files(outcomes[0]),
        notes=(
            "INVENTED, because the document's Tables 2 to 6 and its figures are lost: all dimensions of the arm, the"
            " size and place of the table, the verification points and the trajectory.",
            "The truth is invented as well: every DH parameter is off by 75 to 100 % of the document's bounds (5 mm and"
            " 2 deg), drawn until the geometry alone errs by 20 to 22 mm at the verification points, and every joint"
            " has play of 2.5 deg either way. The size of the play is chosen so that about as much is left after the"
            " normal table as in the document: that row is no proof, the others follow.",
            "33 holes, 24 on a circle and 9 on a straight path, tilted by 11.7 deg in roll or 11.8 deg in pitch. The"
            " tip is put there by hand, so the play of each joint lies either way. A camera of 0.28 mm (95 %) captures"
            " the holes in the robot's base frame: base and tip are known, the twelve DH deviations are free.",
            "Verification as in the document: the calibrated model computes the readings, the twin moves from point to"
            " point with them, and its true tip is compared with the point.",
            "|X - X'| is taken as the distance of each point; what the sum of components gives stands beside it. The"
            " document chooses absolute values for their physical meaning, not against mistakes; what they do against"
            " mistakes is our addition.",
            "The document's model has no beta between the parallel axes 2 and 3, nor has the twin. Where base and tip"
            " are free the model of the library is used, beta included, with priors of the size of the bounds.",
            "The printed improvements do not quite follow from the printed errors: 26.850 to 16.436 mm are 38.786 %,"
            " not 38.789, and 26.850 to 19.099 mm are 28.868 %, not 28.866.",
        ),
    )
