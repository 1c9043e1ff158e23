"""Tables of every instrument, of a tool calibrated alone, and of zones."""

from __future__ import annotations

from collections.abc import Sequence

from papers.irb120_devices.instruments import Accuracy
from papers.irb120_devices.run import COUNT, TOUCHES, Cut, Outcome, Settings, by_instrument, looked_at
from papers.study import Row, Table


def instruments_table(outcomes: Sequence[Outcome], count: int) -> Table:
    """Return what every instrument makes of the robot from as many configurations."""
    rows = []
    for found in by_instrument(outcomes):
        one = found[0]
        name = one.device.name
        if one.configurations != count:
            continue
        rows += [
            Row(f"{name}: mean", "mm", [1e3 * float(a.after.mean()) for a in found], explanation=_words(one)),
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


def _words(one: Accuracy) -> str:
    sigma = one.device.sigma * 1e3
    read = f"{one.numbers} numbers of {sigma:g} mm"
    return f"{read}, {'in the world' if one.anchored else 'up to a rigid motion'}."


def closed_loops_table(outcomes: Sequence[Outcome]) -> Table:
    """Return what closed loops do not see."""
    rows = []
    for found in by_instrument(outcomes):
        one = found[0]
        name = one.device.name
        if one.configurations != COUNT or one.anchored:
            continue
        rows.append(
            Row(
                f"{name}: directions not seen",
                "",
                [float(6 + len(a.unobservable)) for a in found],
                explanation="; ".join(["where the base stands and how it is turned (6)", *one.unobservable])
                + (". The last is the size of all." if "size" in one.gauges else "."),
            )
        )
        rows.append(Row(f"{name}: mean but for a change of size", "mm", [1e3 * float(a.sized.mean()) for a in found]))
    return Table(
        "Directions that closed loops do not see",
        "Beside what no instrument sees of this arm (base against joint 1, tool against joint 6, slides along parallel"
        " axes). What is not seen stays as the nominal robot has it. A size that is seen only over a few millimetres"
        " is hardly known, so the error but for a change of size stands beside.",
        tuple(rows),
    )


def tool_table(outcomes: Sequence[Outcome]) -> Table:
    """Return tool centre points that were found alone."""
    tools = [further.tool for further in looked_at(outcomes)]
    rows = [
        Row(
            f"{robot} robot, {count} touches",
            "mm",
            [1e3 * by_touches[count] for by_touches in found],
            explanation=why if count == TOUCHES[0] else "",
        )
        for robot, found, why in (
            (
                "nominal",
                [errors.nominal for errors in tools],
                "The robot's own errors go into the tool. Many touches average them, and do not remove them.",
            ),
            ("calibrated", [errors.calibrated for errors in tools], "Calibrated by tracker before."),
            (
                "true",
                [errors.true for errors in tools],
                "Errors of the hand alone, 0.05 mm a coordinate: what touching can do at best.",
            ),
        )
        for count in TOUCHES
    ]
    return Table(
        "A tool calibrated alone, by touching one point",
        "Only the tool centre point and the point are found. Its error is its distance from the tool centre point with"
        " which the robot's model errs least over the region.",
        tuple(rows),
    )


def zones_table(outcomes: Sequence[Outcome], settings: Settings) -> Table:
    """Return the errors of models for zones of the workspace."""
    rows = []
    for count in settings.training:
        for name in settings.zoned:
            for divisions in (None, *settings.divisions):
                zones = "one model" if divisions is None else f"{' x '.join(map(str, divisions))} zones"
                words = f"{name}, {count} configurations, {zones}"
                found = [further.zones[Cut(name, count, divisions)] for further in looked_at(outcomes)]
                rows.append(Row(f"{words}: mean", "mm", [1e3 * errors.mean for errors in found]))
                rows.append(Row(f"{words}: maximum", "mm", [1e3 * errors.max for errors in found]))
    return Table(
        "A model for each zone of the workspace",
        "Twin of Tables 2.6 and 2.7 with run-out, all reflectors read to 0.01 mm. Zones are boxes by where the nominal"
        " flange is, along x, y and z of the base, 50 mm of overlap; each starts from the model of the whole. Zones"
        " make up for an effect that the model lacks, such as compliance. A model that has it gains next to nothing"
        " from many configurations and loses from few, which its zones must share.",
        tuple(rows),
    )
