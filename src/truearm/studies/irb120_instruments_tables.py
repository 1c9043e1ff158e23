"""Tables and a picture of every instrument, tools and zones, for the study irb120-devices."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from truearm.reporting.drawing import AFTER, BEFORE, axis, figure, logarithmic_axis
from truearm.reporting.numbers import rounded
from truearm.studies.irb120_instruments import Accuracy
from truearm.studies.irb120_setups_tables import Found
from truearm.studies.study import Picture, Row, Table

#: What was found of an instrument at every seed, by its name and the number of configurations.
Results = Mapping[tuple[str, int], list[Accuracy]]

#: Every instrument gets as many configurations; those that read one number at a time also three times as many.
COUNT: Final = 36
ONE_NUMBER: Final = ("ballbar", "plane", "sphere", "two-spheres")
TOUCHES: Final = (4, 10, 36)
ZONED: Final = ("offsets", "geometric", "elastic")
DIVISIONS: Final = {"2 x 1 x 2": (2, 1, 2), "3 x 1 x 3": (3, 1, 3)}


def instruments(results: Results, count: int) -> Table:
    """Return what every instrument makes of the robot from as many configurations."""
    rows = []
    for (name, of), found in results.items():
        if of != count:
            continue
        one = found[0]
        rows += [
            Row(f"{name}: mean", "mm", _means(found, "after"), explanation=_words(one)),
            Row(f"{name}: maximum", "mm", [1e3 * float(a.after.max()) for a in found]),
        ]
    title = "Every instrument" if count == COUNT else "Three times as many, where one reading is one number"
    return Table(
        f"{title}: {count} configurations by chance",
        "Twin of Tables 2.6 and 2.7 without run-out, which the elastic model with beta can follow: what is left is the"
        " instrument's. Position error of its own target. Closed loops do not know where the base is, so the best rigid"
        " motion is taken out of theirs; the others are judged where they say the robot stands.",
        tuple(rows),
    )


def _means(found: list[Accuracy], what: str) -> list[float]:
    return [1e3 * float(getattr(a, what).mean()) for a in found]


def _words(one: Accuracy) -> str:
    sigma = one.device.sigma * 1e3
    told = f"{one.numbers} numbers of {sigma:g} mm"
    return f"{told}, {'in the world' if one.anchored else 'up to a rigid motion'}."


def closed_loops(results: Results) -> Table:
    """Return what closed loops do not see."""
    rows = []
    for (name, count), found in results.items():
        if count != COUNT or found[0].anchored:
            continue
        one = found[0]
        rows.append(
            Row(
                f"{name}: directions not seen",
                "",
                [float(6 + len(a.unseen)) for a in found],
                explanation="; ".join(["where the base stands and how it is turned (6)", *one.unseen])
                + (". The last is the size of all." if "size" in one.trusted else "."),
            )
        )
        rows.append(Row(f"{name}: mean but for a change of size", "mm", _means(found, "sized")))
    return Table(
        "Directions that closed loops do not see",
        "Beside what no instrument sees of this arm (base against joint 1, tool against joint 6, slides along parallel"
        " axes). What is not seen stays as the nominal robot has it. A size that is seen only over a few millimetres"
        " is hardly known, so the error but for a change of size stands beside.",
        tuple(rows),
    )


def tool(found: Found) -> Table:
    """Return tool centre points that were found alone."""
    why = {
        "nominal": "The robot's own errors go into the tool. Many touches average them, and do not remove them.",
        "calibrated": "Calibrated by tracker before.",
        "true": "Errors of the hand alone, 0.05 mm a coordinate: what touching can do at best.",
    }
    rows = [
        Row(
            f"{robot} robot, {count} touches",
            "mm",
            found["tool", robot, str(count)],
            explanation=why[robot] if count == TOUCHES[0] else "",
        )
        for robot in why
        for count in TOUCHES
    ]
    return Table(
        "A tool calibrated alone, by touching one point",
        "Only the tool centre point and the point are found. Its error is its distance from the tool centre point with"
        " which the robot's model errs least over the region.",
        tuple(rows),
    )


def zones(found: Found, training: tuple[int, int]) -> Table:
    """Return the errors of models for zones of the workspace."""
    rows = []
    for count in training:
        for name in ZONED:
            for title in ("whole", *DIVISIONS):
                key = ("zones", name, str(count), title)
                cut = "one model" if title == "whole" else f"{title} zones"
                rows.append(Row(f"{name}, {count} configurations, {cut}: mean", "mm", found[key]))
                rows.append(Row(f"{name}, {count} configurations, {cut}: maximum", "mm", found[(*key, "max")]))
    return Table(
        "A model for each zone of the workspace",
        "Twin of Tables 2.6 and 2.7 with run-out, all reflectors read to 0.01 mm. Zones are boxes by where the nominal"
        " flange is, along x, y and z of the base, 50 mm of overlap; each starts from the model of the whole. Zones"
        " make up for an effect that the model lacks, such as compliance. A model that has it gains next to nothing"
        " from many configurations and loses from few, which its zones must share.",
        tuple(rows),
    )


def instruments_picture(results: Results) -> Picture:
    """Return what every instrument leaves, as bars."""
    names = list(dict.fromkeys(name for name, _ in results))
    traces = []
    for count, colour in ((COUNT, AFTER), (3 * COUNT, BEFORE)):
        mine = [name for name in names if (name, count) in results]
        means = [float(np.median(_means(results[name, count], "after"))) for name in mine]
        traces.append(
            {
                "type": "bar",
                "orientation": "h",
                "name": f"{count} configurations",
                "y": mine,
                "x": rounded(np.array(means), 4),
                "marker": {"color": colour},
                "hovertemplate": "%{y}: %{x:.3g} mm<extra></extra>",
            }
        )
    across = logarithmic_axis("mean position error [mm]", 1e-3, 1.0)
    down = axis("") | {"autorange": "reversed"}
    return Picture(
        "instruments",
        "What every instrument leaves",
        "At unseen configurations, of a robot that the model can follow; closed loops up to a rigid motion.",
        figure(traces, 520, xaxis=across, yaxis=down, barmode="group"),
    )
