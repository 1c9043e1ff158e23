"""How often outlying rows and second places of rest are named: in clean campaigns, and in those that have them.

    python benchmarks/iso9283_outlying_rows.py [campaigns]

Campaigns have the poses of ``iso9283 plan``: AP alone (5 poses of 30 cycles), all tests of poses (57 groups), and all
with five cycles each. Poses scatter as balls, discs or needles, from group to group up to three times as much. A row is
taken off by a multiple of the root mean square distance of its group's cycles from their mean.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence

import numpy as np

from truearm.engine.robot.chain import Array
from truearm.iso9283.criteria.outlying_rows import unusual_rows
from truearm.iso9283.criteria.rows import Cycles, Instrument

SHAPES = ([1.0, 1.0, 1.0], [1.0, 1.0, 0.1], [3.0, 1.0, 0.3], [1.0, 0.1, 0.02])
TRACKER = Instrument(1e-9)
_GROUPS = [("AP", f"P{k}", "", 30) for k in range(1, 6)]
_OTHERS = [
    *[("vAP", pose, approach, 30) for pose in ("P1", "P2", "P4") for approach in "xyz"],
    ("AD", "P2", "", 30),
    ("AD", "P4", "", 30),
    *[("dAP", "P1", "", 10)] * 16,
    *[("E", f"P{k}", f"r{r}", 30) for r in range(5) for k in range(1, 6)],
]
CAMPAIGNS = {
    "AP": _GROUPS,
    "all": [*_GROUPS, *_OTHERS],
    "five cycles": [(test, pose, name, 5) for test, pose, name, _ in [*_GROUPS, *_OTHERS]],
}
Scatter = Callable[[np.random.Generator, int], Array]


KINDS: dict[str, Scatter] = {
    "Gaussian": lambda rng, n: rng.standard_normal((n, 3)),
    "uniform": lambda rng, n: rng.uniform(-1, 1, (n, 3)),
    "Laplace": lambda rng, n: rng.laplace(size=(n, 3)),
    "Student, 5": lambda rng, n: rng.standard_normal((n, 3)) / np.sqrt(rng.chisquare(5, (n, 1)) / 5),
    "Student, 3": lambda rng, n: rng.standard_normal((n, 3)) / np.sqrt(rng.chisquare(3, (n, 1)) / 3),
    "creeping": lambda rng, n: rng.standard_normal((n, 3)) + np.linspace(0, 6, n)[:, None] * [1, 0, 0],
}


def campaign(rng: np.random.Generator, name: str, kind: str) -> list[Cycles]:
    """Return the groups of a campaign; of ``two places, 30 %`` each pose has its own second place."""
    shapes = np.array(SHAPES)
    share = float(kind.split(",")[1].split()[0]) / 100 if kind.startswith("two") else 0.0
    second: dict[tuple[str, str, str], Array] = {}
    made = []
    begin = 0
    for test, pose, other, n in CAMPAIGNS[name]:
        size = 1e-5 * np.exp(rng.uniform(0, 1.1))
        shape = shapes[rng.integers(len(shapes))]
        if share:
            way = second.setdefault((test, pose, other), _direction(rng) * rng.choice([10.0, 20.0, 40.0]))
            points = rng.standard_normal((n, 3)) * shape + (rng.random(n) < share)[:, None] * way
        else:
            points = KINDS[kind](rng, n) * shape
        approach, robot = (other, "") if test == "vAP" else ("", other)
        cycle = np.arange(1, n + 1)
        # Groups of drift are told apart by their cycles; here each comes as its own.
        time = np.full(n, np.nan)
        made.append(
            Cycles(test, robot, pose, approach, 1.0, 1.0, cycle, time, size * points, None, np.zeros(3), begin + cycle)
        )
        begin += n
    return made


def _direction(rng: np.random.Generator) -> Array:
    way = rng.standard_normal(3)
    return np.asarray(way / np.linalg.norm(way))


def spoilt(rng: np.random.Generator, groups: Sequence[Cycles], times: float, rows: int) -> set[int]:
    """Take some rows off; return their lines."""
    lines: set[int] = set()
    while len(lines) < rows:
        one = groups[int(rng.integers(len(groups)))]
        k = int(rng.integers(len(one)))
        if int(one.line[k]) in lines:
            continue
        spread = np.sqrt(((one.points - one.points.mean(axis=0)) ** 2).sum(axis=1).mean())
        one.points[k] += times * spread * _direction(rng)
        lines.add(int(one.line[k]))
    return lines


def main(trials: int) -> None:
    """Print the shares."""
    rng = np.random.default_rng(1)
    for name in CAMPAIGNS:
        sys.stdout.write(f"{name}: campaigns with an outlying row named, with two places named\n")
        for kind in (*KINDS, "two places, 50 %", "two places, 30 %", "two places, 10 %"):
            found = [unusual_rows(campaign(rng, name, kind), TRACKER) for _ in range(trials)]
            outlying, two = np.mean([[bool(one.outlying), bool(one.two_places)] for one in found], axis=0)
            sys.stdout.write(f"  {kind:18} {100 * outlying:5.1f} % {100 * two:5.1f} %\n")
        sys.stdout.write("  named of rows that are 5, 7, 10, 15, 30, 100 times off\n")
        for kind, rows in (("Gaussian", 1), ("Gaussian", 3), ("Student, 5", 1)):
            hits = []
            for times in (5.0, 7.0, 10.0, 15.0, 30.0, 100.0):
                share = 0.0
                for _ in range(trials // 3):
                    groups = campaign(rng, name, kind)
                    lines = spoilt(rng, groups, times, rows)
                    named = {int(one.of.line[0]) for one in unusual_rows(groups, TRACKER).outlying}
                    share += len(lines & named) / rows / (trials // 3)
                hits.append(f"{100 * share:4.0f} %")
            sys.stdout.write(f"  {kind}, {rows} row{'s' * (rows > 1)}: {', '.join(hits)}\n")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 300)
