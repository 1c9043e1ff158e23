"""Patel, sections 3.3, 3.7, 4.5 and 5.5: what a Katana is measured with, and what a calibration makes of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Final

import numpy as np
from truearm.studies.katana_campaigns import (
    DOCUMENT,
    LOW_COST,
    OPTOTRAK,
    STARTS,
    TRACKED,
    USED,
    Counts,
    DeviceRun,
    Start,
    run_devices,
)

from truearm.reporting.drawing import AFTER, BEFORE, Figure, axis, figure, logarithmic_axis
from truearm.reporting.numbers import rounded
from truearm.simulation.devices.artefacts import MARKERS
from truearm.studies.study import Picture, Row, Study, Table

#: Table 4.6, mean and largest |dP| of ten uncalibrated points [mm].
_BEFORE: Final = (1.161, 1.54)
_AFTER: Final[dict[Start, tuple[float, float]]] = {"geometry alone": (0.545, 0.75), "tilting first": (0.123, 0.16)}
#: Section 3.3: largest error as the laser tracker read it [mm].
_LARGEST: Final = 2.11
#: Section 5.5.1: mean distance from the circle before and after [mm].
_CIRCLE: Final = {("before", ""): 0.653, ("markers", "geometry alone"): 0.312, ("markers", "tilting first"): 0.132}
#: The document's robot is another one in other poses.
_SIMILAR: Final = 0.25
_BLIND: Final = {"base": "where the robot stands", "size": "how large it is"}
_DIRECTIONS: Final = {"base": 6, "size": 1}
_COLOURS: Final = dict(zip(STARTS, ("#b3261e", AFTER), strict=True))


def study(seeds: int, progress: Callable[[str], None], counts: Counts | None = None) -> Study:
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
    runs = []
    for seed in range(seeds):
        progress(f"seed {seed + 1} of {seeds}")
        runs.append(run_devices(seed, counts))

    return Study(
        name="katana-devices",
        title="A Katana 450 measured with every instrument",
        source="D. Patel, doctoral thesis on the Katana 450, sections 3.3, 3.7, 4.5 and 5.5, Tables 4.5 and 4.6;"
        " geometry of Table 3.2",
        answer=_answer(runs),
        seeds=seeds,
        tables=(
            _document(runs),
            *(_registry(runs, start) for start in STARTS),
            _own(runs),
            _blind(runs),
            _page(runs),
            _visible(runs),
        ),
        pictures=(_by_device(runs), _on_page(runs[0])),
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


def _answer(runs: Sequence[DeviceRun]) -> str:
    def left(what: str, start: Start) -> float:
        return float(np.median([run.reached[what, start].moved[0] for run in runs]))

    tilting = STARTS[1]
    seen, true = (
        [float(np.median([of(run, key) for run in runs])) for key in (("before", ""), (LOW_COST, tilting))]
        for of in (_seen, _true)
    )
    markers, spheres = ([left(what, start) for start in STARTS] for what in (MARKERS.name, "two-spheres"))
    return (
        f"What the model knows of the joints matters more than the instrument. With geometry alone {markers[0]:.2f} mm"
        f" are left on unseen configurations after markers and {spheres[0]:.2f} mm after a touch probe on two spheres;"
        f" with tilting from inclinometers first, {markers[1]:.3f} and {spheres[1]:.3f} mm. The document's low-cost"
        f" set-up, made a measurement, leaves {left(LOW_COST, tilting):.2f} mm. Loops closed at a point or a plane"
        f" leave {left('point', tilting):.1f} and {left('plane', tilting):.1f} mm, since nothing tells them how large"
        " the robot is. The drawn circle shows an improvement of its form, from"
        f" {seen[0]:.2f} to {seen[1]:.2f} mm, and not where it lies: the tip was {true[0]:.2f} mm from where it should"
        f" be, and is {true[1]:.2f} mm after the low-cost calibration, which cannot know where the robot stands."
    )


def _seen(run: DeviceRun, key: tuple[str, str]) -> float:
    return run.pages[key].seen


def _true(run: DeviceRun, key: tuple[str, str]) -> float:
    return float(run.pages[key].distance.mean())


# -- tables ------------------------------------------------------------------------------------------------


def _document(runs: Sequence[DeviceRun]) -> Table:
    rows = []
    for k, name in enumerate(("mean", "largest")):
        rows.append(
            Row(
                f"{OPTOTRAK}, 118 poses, before, {name}",
                "mm",
                [run.before[OPTOTRAK].own[k] for run in runs],
                _BEFORE[k],
                "Table 4.6",
                relative=_SIMILAR,
                explanation="Base and tool are fitted here and take up a part; as they are known, see below."
                if k == 0
                else "",
            )
        )
    for start in STARTS:
        for k, name in enumerate(("mean", "largest")):
            rows.append(
                Row(
                    f"{OPTOTRAK}, 118 poses, {start}, {name}",
                    "mm",
                    [run.reached[OPTOTRAK, start].own[k] for run in runs],
                    _AFTER[start][k],
                    "Table 4.6",
                    relative=_SIMILAR,
                    explanation=_why(start, k),
                )
            )
    for what in list(DOCUMENT)[1:]:
        rows += [
            Row(f"{what}, {start}, mean", "mm", [run.reached[what, start].own[0] for run in runs]) for start in STARTS
        ]
    for what in DOCUMENT:
        tracked = what.startswith(TRACKED)
        rows.append(
            Row(
                f"{what}: largest distance from the nominal robot where it stands",
                "mm",
                [run.read[what][1] for run in runs],
                _LARGEST if tracked or what == OPTOTRAK else None,
                {True: "section 3.3", False: "Table 4.5"}[tracked] if tracked or what == OPTOTRAK else "",
                relative=_SIMILAR,
                explanation="The tracker shows only poses whose tool points at it; the worst may not be among them."
                if tracked
                else "",
            )
        )
    return Table(
        "The document's three instruments",
        "Error of the tip on unseen poses in the instrument's own frame, 200 mm attachment: 118 poses with the Optotrak"
        " as in chapters 3 and 4, and 30 points with each of the three as in section 3.3, which prints no calibration"
        " of the other two. A quarter is allowed: robot and poses are others.",
        tuple(rows),
    )


def _why(start: Start, k: int) -> str:
    if start == "tilting first":
        return (
            "This twin does nothing but what the model knows; for its 0.12 mm the document names control, encoders and"
            " temperature."
            if k == 0
            else "Left where a moment is nearly zero and the side a joint falls to is not known."
        )
    return (
        "Base and tool free as well, on random configurations; held, as in the document, see katana-tilting."
        if k == 0
        else f"The largest of {Counts().unseen}; the document's is that of ten points."
    )


def _registry(runs: Sequence[DeviceRun], start: Start) -> Table:
    why = {
        "stereo": "Balls within 2 mm of three places nobody measured hardly tell how long links are.",
        "point": "Nothing has a length: as large a robot as one likes keeps its tip at the point.",
        "plane": "Nothing has a length here either.",
        "gauges": "Three places of 10 mm, each reading for itself: little leverage, and much hangs on the postures.",
        "sphere": "A radius of 17 mm is the only length.",
        "two-spheres": "The distance of the spheres tells the size: it takes no more than that.",
        "touch-up": "By hand to 0.2 mm, 24 contacts.",
        "drawn-circle": "Led by the nominal robot; two postures of the arm on each page are few.",
        LOW_COST: "Better than either: printed points tell what a circle does not, a line is finer than a hand.",
    }
    rows = [
        Row(
            "before, base and tool fitted",
            "mm",
            [run.before[MARKERS.name].moved[0] for run in runs],
        )
    ]
    for what in (*(device.name for device in USED), LOW_COST):
        rows.append(
            Row(
                f"{what}, {runs[0].reached[what, start].configurations} configurations, mean",
                "mm",
                [run.reached[what, start].moved[0] for run in runs],
                explanation=why.get(what, "") if start == "tilting first" else "",
            )
        )
    return Table(
        f"Every device, {start}",
        "Mean error of the pencil's point on unseen configurations after the best rigid motion of all predictions, so"
        " that closed loops, which do not know where the robot stands, compare.",
        tuple(rows),
    )


def _own(runs: Sequence[DeviceRun]) -> Table:
    rows = []
    for device in USED:
        values = [run.reached[device.name, "tilting first"].own for run in runs]
        if all(math.isfinite(mean) for mean, _ in values):
            rows += [
                Row(f"{device.name}, {name}", "mm", [value[k] for value in values])
                for k, name in enumerate(("mean", "largest"))
            ]
    return Table(
        "In the instrument's own frame, tilting first",
        "Error on unseen configurations without any motion, for devices that say where the robot stands.",
        tuple(rows),
    )


def _blind(runs: Sequence[DeviceRun]) -> Table:
    rows = []
    for what in (*(device.name for device in USED), LOW_COST):
        found = [run.reached[what, "tilting first"] for run in runs]
        if not found[0].trusted:
            continue
        words = [_BLIND[name] for name in found[0].trusted]
        words += [f"a direction of {', '.join(found[0].unseen)}"] if found[0].unseen else []
        rows += [
            Row(
                f"{what}: directions that it does not see",
                "",
                [float(sum(_DIRECTIONS[n] for n in one.trusted) + bool(one.unseen)) for one in found],
                explanation=f"It does not see {' and '.join(words)}.",
            ),
            Row(f"{what}: predicted lengths too long by", "%", [100 * one.size for one in found]),
        ]
    return Table(
        "What closed loops do not see",
        "Of what predictions need. Six directions are where the robot stands; one more is its size, where no length"
        " was measured: then lengths stay as far as the priors hold them.",
        tuple(rows),
    )


def _page(runs: Sequence[DeviceRun]) -> Table:
    rows = []
    for what, name in runs[0].pages:
        key = (what, name)
        shown = "before" if what == "before" else f"{what}, {name}"
        rows += [
            Row(
                f"{shown}: true mean distance",
                "mm",
                [_true(run, key) for run in runs],
                _CIRCLE.get(key),
                "section 5.5.1" if key in _CIRCLE else "",
                relative=_SIMILAR,
                explanation=_true_why(key),
            ),
            Row(
                f"{shown}: after the best rigid motion",
                "mm",
                [float(run.pages[key].moved.mean()) for run in runs],
            ),
            Row(
                f"{shown}: as the page shows it",
                "mm",
                [_seen(run, key) for run in runs],
                explanation="Of that 0.025 mm are noise of scan and potentiometer." if what == "before" else "",
            ),
        ]
    return Table(
        "The circle of section 5.5.1 on the page",
        "The twin goes round it in motion, commanded by the nominal robot and by what two instruments made of it. The"
        " page shows how far the line is from a circle of the right size about its own middle, and the potentiometer"
        " how far from its own plane: where the circle lies, and what goes on along the line, it does not show.",
        tuple(rows),
    )


def _true_why(key: tuple[str, str]) -> str:
    if key == ("before", ""):
        return (
            "Geometry of Table 3.2 and tilting together; tilting alone is what the document has, see katana-trajectory."
        )
    if key[0] == LOW_COST:
        return "Where the robot stands is not known: most of this is a misplaced circle, which moving the page mends."
    if key[1] == "geometry alone":
        return "Geometry from everywhere cannot take up what tilts here."
    return "Most of it is the play of joint 1."


def _visible(runs: Sequence[DeviceRun]) -> Table:
    why = {
        TRACKED: "One reflector that looks along the tool: the document turned to markers for this.",
        "optical-cmm-planar": "A plate within 15 deg: poses have to be chosen for it.",
    }
    return Table(
        "What instruments see of the Katana",
        "Share of configurations drawn evenly from the joint limits that show enough of the tool, 2.6 m away. What the"
        " arm hides is not asked.",
        tuple(Row(what, "%", [run.sees[what] for run in runs], explanation=why.get(what, "")) for what in runs[0].sees),
    )


# -- pictures ----------------------------------------------------------------------------------------------


def _by_device(runs: Sequence[DeviceRun]) -> Picture:
    names = [*(device.name for device in USED), LOW_COST]
    values = {s: np.array([np.median([run.reached[n, s].moved[0] for run in runs]) for n in names]) for s in STARTS}
    order = np.argsort(values["tilting first"])[::-1]
    traces: list[Figure] = [
        {
            "type": "scatter",
            "mode": "markers",
            "name": start,
            "x": rounded(values[start][order], 3),
            "y": [names[k].partition(":")[0] for k in order.tolist()],
            "marker": {"color": _COLOURS[start], "size": 9},
            "hovertemplate": f"{start}<br>%{{y}}: %{{x:.3g}} mm<extra></extra>",
        }
        for start in STARTS
    ]
    drawn = figure(traces, 480, xaxis=logarithmic_axis("mean error [mm]", 0.01, 5.0), yaxis={"automargin": True})
    return Picture(
        "devices",
        "Error on unseen configurations, by device",
        "Median of the seeds, after the best rigid motion.",
        drawn,
    )


def _on_page(run: DeviceRun) -> Picture:
    shown = {("before", ""): BEFORE, (LOW_COST, "geometry alone"): "#b3261e", (LOW_COST, "tilting first"): AFTER}
    traces: list[Figure] = []
    for key, colour in shown.items():
        page = run.pages[key]
        for values, part, dash in ((page.outward, "outward", "solid"), (page.height, "height", "dot")):
            name = f"{'before' if key[0] == 'before' else 'low-cost, ' + key[1]}: {part}"
            traces.append(
                {
                    "type": "scatter",
                    "mode": "lines",
                    "name": name,
                    "x": rounded(page.along, 4),
                    "y": rounded(values, 4),
                    "line": {"color": colour, "width": 1.8, "dash": dash},
                    "hovertemplate": f"{name} %{{y:.3g}} mm at %{{x:.0f}} deg<extra></extra>",
                }
            )
    drawn = figure(traces, 420, xaxis=axis("round the circle [deg]"), yaxis=axis("beside the circle [mm]"))
    return Picture(
        "page",
        "What the page shows, as in Figure 5.13",
        "First seed: the line beside a circle of the right size about its own middle, and the height over its plane.",
        drawn,
    )
