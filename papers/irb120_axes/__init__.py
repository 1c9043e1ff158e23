"""Nubiola, section 2.4.1: one joint of an IRB 120 turned at a time, seen by a tracker (Table 2.3, Figure 2.6)."""

from __future__ import annotations

from papers import Progress
from papers.irb120_axes.pictures import errors_picture
from papers.irb120_axes.run import BETWEEN, NOISE, run
from papers.irb120_axes.tables import (
    allowed_table,
    compliance_table,
    matched_table,
    noiseless_table,
    radii_table,
    shares_table,
)
from papers.study import Study


def study(seeds: int, progress: Progress, coarser: int = 1) -> Study:
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
    found = run(seeds, progress, coarser)
    sines = [chosen.amplitude for chosen in found.run_out.values()]
    least = [chosen.amplitude for chosen in found.allowed[BETWEEN].values()]
    return Study(
        name="irb120-axes",
        title="Single joints of an ABB IRB 120",
        source="A. Nubiola, doctoral thesis, ETS Montreal, section 2.4.1, Table 2.3 and Figure 2.6; truth from Tables"
        " 2.4, 2.6 and 2.7",
        answer="Compliance alone, with the values that the document identified elsewhere, gives the printed errors of"
        " joints 3, 4 and 5 within three tenths, two thirds of what joint 2 shows, too much for joint 6 and nothing"
        " for joint 1. What is missing there, and the backlash, must be in gears and bearings: sines of"
        f" {min(sines):.3f} to {max(sines):.3f} deg a turn would do, and of {min(least):.3f} to {max(least):.3f} deg if"
        " the compliances are others of the document's own.",
        seeds=seeds,
        tables=(
            radii_table(found),
            compliance_table(found),
            noiseless_table(found),
            shares_table(found),
            allowed_table(found),
            matched_table(found),
        ),
        pictures=(errors_picture(found.tests, found.outcomes[0]),),
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
            f"Tracker noise of {NOISE * 1e3:g} mm a coordinate: radial and axial displacements are then about"
            " 0.050 mm, as the document has them. It widens the ranges of joints 4 to 6, whose reflector is only 0.12"
            " to 0.23 m from the axis, by up to 0.02 deg.",
        ),
    )
