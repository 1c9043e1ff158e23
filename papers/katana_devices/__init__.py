"""Patel, sections 3.3, 3.7, 4.5 and 5.5: what a Katana is measured with, and what a calibration makes of it."""

from __future__ import annotations

from collections.abc import Sequence

from papers import Progress
from papers.katana_devices.pictures import devices_picture, page_picture
from papers.katana_devices.run import Outcome, run
from papers.katana_devices.setup import LOW_COST, STARTS, Counts, Start
from papers.katana_devices.tables import (
    devices_table,
    document_table,
    own_frame_table,
    page_table,
    unobservable_table,
    views_table,
)
from papers.seeds import median_of
from papers.study import Study
from truearm.engine.twin.devices.touching import MARKERS


def study(seeds: int, progress: Progress, counts: Counts | None = None) -> Study:
    """Run the study.

    Parameters
    ----------
    seeds
        How many: of the configurations, of the noise, and of the posture in which the circle is drawn.
    progress
        Called with a few words at each step.
    counts
        How much is measured and judged.
    """
    counts = Counts() if counts is None else counts
    outcomes = run(seeds, progress, counts)
    return Study(
        name="katana-devices",
        title="A Katana 450 measured with every instrument",
        source="D. A. Patel, thesis on the Katana 450, sections 3.3, 3.7, 4.5 and 5.5, Tables 4.5 and 4.6;"
        " geometry of Table 3.2",
        answer=_answer(outcomes),
        seeds=seeds,
        tables=(
            document_table(outcomes),
            *(devices_table(outcomes, start) for start in STARTS),
            own_frame_table(outcomes),
            unobservable_table(outcomes),
            page_table(outcomes),
            views_table(outcomes),
        ),
        pictures=(devices_picture(outcomes), page_picture(outcomes[0])),
        notes=(
            "The twin has the geometry of Table 3.2 and the tilting of Tables 4.3, 4.4 and 5.2. Errors are those of the"
            " tip against the twin's true places, on configurations drawn evenly from all that the limits allow.",
            "Each calibration frees every geometric parameter within its prior (1 mm, 0.1 deg), base and tool; the"
            " document holds base and tool as known. Deviations of readings are estimated from what the fit leaves: a"
            " model that lacks something is not as good as the instrument, and where it is told so, closed loops put"
            " the lack into lengths.",
            "Tilting first: clearance, backlash and stiffness from simulated inclinometers of 0.001 deg and 8 pairs of"
            " poses, as in the study katana-tilting, then geometry from the instrument. The pairs need an instrument"
            " that reads positions, for joint 1 alone, about which gravity has no moment.",
            f"The document's rows have the 200 mm attachment; all other devices touch or see the point of the pencil,"
            f" 130 mm further out, where errors are larger. The registry's devices have {counts.registry}"
            f" configurations each, the touch-up {counts.touched} contacts on two pages, the drawn circles"
            f" {counts.drawn} points on six circles, two on each of three pages. The document's own touch-up has four"
            " points on one page, which is too little to calibrate with.",
            "The hexapod of ballbars is left out: its tool has to take whole poses, which five joints cannot.",
            "The drawn circle's reading is the distance from the middle and the height over the page of the tip of the"
            " unsprung pencil, each with 0.02 mm. The document reads the line by eye and the height by potentiometer.",
            "The circle of section 5.5.1 is followed in motion, as in the study katana-trajectory: what is left with"
            " tilting known is mostly the play of joint 1.",
        ),
    )


def _answer(outcomes: Sequence[Outcome]) -> str:
    def left(instrument: str, start: Start) -> float:
        return median_of(outcomes, lambda one: one.reached[instrument, start].moved.mean)

    tilting: Start = "tilting first"
    before = [one.pages.before for one in outcomes]
    after = [one.pages.after["low-cost", tilting] for one in outcomes]
    shown = [median_of(pages, lambda page: page.shown) for pages in (before, after)]
    true = [median_of(pages, lambda page: float(page.distance.mean())) for pages in (before, after)]
    markers, spheres = ([left(name, start) for start in STARTS] for name in (MARKERS.name, "two-spheres"))
    return (
        f"What the model knows of the joints matters more than the instrument. With geometry alone {markers[0]:.2f} mm"
        f" are left on unseen configurations after markers and {spheres[0]:.2f} mm after a touch probe on two spheres;"
        f" with tilting from inclinometers first, {markers[1]:.3f} and {spheres[1]:.3f} mm. The document's low-cost"
        f" set-up, made a measurement, leaves {left(LOW_COST, tilting):.2f} mm. Loops closed at a point or a plane"
        f" leave {left('point', tilting):.1f} and {left('plane', tilting):.1f} mm, since nothing tells them how large"
        " the robot is. The drawn circle shows an improvement of its form, from"
        f" {shown[0]:.2f} to {shown[1]:.2f} mm, and not where it lies: the tip was {true[0]:.2f} mm from where it"
        f" should be, and is {true[1]:.2f} mm after the low-cost calibration, which cannot know where the robot stands."
    )
