"""Tables of the ballbar on a sphere (Nubiola, Tables 2.12 and 2.13)."""

from __future__ import annotations

from collections.abc import Sequence

from papers.irb120_hexapod.spheres import PRINTED, Spheres
from papers.study import Row, Table


def sphere_tables(outcomes: Sequence[Spheres]) -> tuple[Table, Table]:
    """Return Tables 2.12 and 2.13, and what the centre has to do with them."""
    rows, about = [], []
    for key, (count, mean, deviation, largest) in PRINTED.items():
        nest, name = key
        tests = [one.taught[key] for one in outcomes]
        table = "Table 2.13" if "spatial" in name else "Table 2.12"
        first = key == ("1", "laser tracker")
        words = f"nest {nest}, {name}"
        rows += [
            Row(
                f"{words}: size of the mean, {count} readings",
                "mm",
                [1e3 * abs(test.mean) for test in tests],
                mean.removeprefix("-"),
                table,
                explanation="A ball that was taught by hand too high or too low makes all distances too long or too"
                " short, by chance. Here it was taught to 0.1 mm a coordinate, which is invented; about the centre that"
                " fits best nothing is left of the mean."
                if first
                else "",
            ),
            Row(
                f"{words}: standard deviation",
                "mm",
                [1e3 * test.deviation for test in tests],
                deviation,
                table,
                explanation="Gears and lag of the twin were chosen so that calibration by tracker leaves what the"
                " document has; here they are met by another way."
                if first
                else "",
            ),
            Row(f"{words}: maximum", "mm", [1e3 * test.largest for test in tests], largest, table),
        ]
        free = [one.found[key] for one in outcomes]
        about.append(Row(f"{words}: size of the mean", "mm", [1e3 * abs(test.mean) for test in free]))
        about.append(Row(f"{words}: standard deviation", "mm", [1e3 * test.deviation for test in free]))
    about.append(
        Row(
            "nominal robot: readings within the range of the bar",
            "%",
            [100.0 * one.nominal for one in outcomes],
            explanation="The document has no measurements of the nominal robot, because of the range. Here its errors"
            " are nearly the same everywhere on the sphere and at its centre, and a distance does not see that part.",
        )
    )
    return (
        Table(
            "Ballbar on a sphere of 300 mm (Tables 2.12 and 2.13)",
            "Measured length minus 300 mm, about the centre as it was taught with nest 1.",
            tuple(rows),
        ),
        Table(
            "The same about the centre that fits best",
            "What the model's error at the taught centre adds is taken out.",
            tuple(about),
        ),
    )
