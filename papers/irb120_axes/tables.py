"""Tables of single joints of an IRB 120: what compliance explains of Table 2.3, and what gears must add."""

from __future__ import annotations

import math

from papers.irb120_axes.run import BETWEEN, Run
from papers.study import Row, Table


def radii_table(found: Run) -> Table:
    """Return how far the reflector is from each axis."""
    rows = []
    for number, test in found.tests.items():
        radii = [one.compliance[number].radius for one in found.outcomes]
        rows += [
            Row(f"joint {number}, distance", "mm", radii),
            Row(
                f"joint {number}, printed tangential range over this distance",
                "deg",
                [math.degrees(test.tangential / radius) for radius in radii],
                f"{test.angular:.3f}",
                "Table 2.3",
            ),
        ]
    return Table(
        "Distance of the reflector from each axis",
        "Radius of the fitted circle. The document's tangential range over it is its angular range where posture and"
        " reflector are the document's.",
        tuple(rows),
    )


def compliance_table(found: Run) -> Table:
    """Return what compliance and noise make of the turns."""
    why = {
        1: "Axis 1 is vertical: nothing that sags changes when it turns, so compliance predicts zero, and what we see"
        " is noise. The rest must be in the gear.",
        2: f"Too little by a third. A gear that runs out by {found.run_out[2].amplitude:.3f} deg once a turn, or a"
        " compliance of 0.046e-6 instead of 0.032e-6 rad/(N mm), would make up for it.",
        3: "Too much by a quarter, as much as the document's own compliances differ.",
        4: "Too much by a quarter. It is the sag of joint 5, whose axis leaves the horizontal: alone it would make"
        " 0.33 deg, and joints 4 and 6 take a part of it away.",
        5: "Joint 5 itself makes 0.12 deg, joint 3 another 0.07 deg.",
        6: "Too much by far: the moment here is only 0.9 N m, and the document's own compliances of joint 6 run from"
        " 0.243e-6 to 2.000e-6 rad/(N mm), see below: its calibrations hardly determine it.",
    }
    rows = []
    for number, test in found.tests.items():
        rows.append(
            Row(
                f"joint {number}, angular",
                "deg",
                [one.compliance[number].angular for one in found.outcomes],
                f"{test.angular:.3f}",
                "Table 2.3",
                explanation=why[number],
            )
        )
        rows.append(
            Row(
                f"joint {number}, tangential",
                "mm",
                [one.compliance[number].tangential for one in found.outcomes],
                f"{test.tangential:.3f}",
                "Table 2.3",
            )
        )
    return Table(
        "Range of the error: compliance of Table 2.7 and noise",
        "Nothing is chosen here: compliances from another experiment of the document, masses and centres of gravity of"
        " Table 2.4 and of the third end-effector. The document's compliances of joints 2 to 5 differ by a quarter"
        " between its three set-ups.",
        tuple(rows),
    )


def noiseless_table(found: Run) -> Table:
    """Return what each of the document's compliances makes without noise."""
    return Table(
        "Range of the angular error with each of the document's compliances, without noise",
        "Ours from Tables 2.7, 2.9 and 2.11: median, lowest and highest of the three set-ups, not of seeds.",
        tuple(
            Row(
                f"joint {number}",
                "deg",
                [turns[number].angular for turns in found.noiseless],
                f"{test.angular:.3f}",
                "Table 2.3",
            )
            for number, test in found.tests.items()
        ),
    )


def allowed_table(found: Run) -> Table:
    """Return the smallest run-out that Table 2.3 allows."""
    own = ", ".join(f"{n}: {1e6 * c:.0f}" for n, c in found.nearest.items())
    return Table(
        "Smallest run-out that Table 2.3 allows",
        "The smallest sine a turn of each joint that leaves the printed range and backlash, with the compliances of"
        " each of the document's three set-ups, and with compliances between theirs that come nearest to the ranges"
        f" ({own} in 1e-6 rad/(N m)). The document prints no run-out, and the test bounds it from below only: with"
        " compliances that are its own it needs a quarter to three quarters of what Table 2.7 needs.",
        tuple(
            Row(
                f"joint {number}, compliances {'' if words == BETWEEN else 'of '}{words}",
                "deg",
                chosen[number].amplitude,
            )
            for number in found.tests
            for words, chosen in found.allowed.items()
        ),
    )


def shares_table(found: Run) -> Table:
    """Return whose compliance it is when joints 2 and 3 turn."""
    return Table(
        "Whose compliance it is when joints 2 and 3 turn",
        "Range of the angular error if one joint alone gives way (Table 2.7), without noise. The ranges need not"
        " add up.",
        tuple(
            Row(f"joint {share.turning} turns, joint {share.yielding} gives way", "deg", share.angular)
            for share in found.shares
            if share.angular > 0.005
        ),
    )


def matched_table(found: Run) -> Table:
    """Return what gears that run out and lag behind make of the turns."""
    rows = []
    for number, test in found.tests.items():
        turns = [one.gears[number] for one in found.outcomes]
        rows.append(
            Row(
                f"joint {number}, angular",
                "deg",
                [turn.angular for turn in turns],
                f"{test.angular:.3f}",
                "Table 2.3",
                claim="construction",
            )
        )
        rows.append(
            Row(
                f"joint {number}, backlash",
                "deg",
                [turn.backlash for turn in turns],
                f"{test.backlash:.3f}",
                "Table 2.3",
                claim="construction",
            )
        )
        rows.append(Row(f"joint {number}, run-out chosen", "deg", found.run_out[number].amplitude))
    return Table(
        "With run-out and backlash chosen to match",
        "That these agree is no proof: run-out is the smallest amplitude that leaves the printed range, backlash is the"
        " printed one. It shows that gears as good as that are enough, and how large they would have to be.",
        tuple(rows),
    )
