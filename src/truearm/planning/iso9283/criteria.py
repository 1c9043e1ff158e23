"""The performance criteria of ISO 9283:1998: what each is called, what is measured for it, where and how often.

The text of the standard was not at hand. Names, cycles and places are those that Nubiola (section 2.6), Patel (chapter
3) and the literature give; who wants to claim conformity must read the standard itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

#: In which file the measurements of a test are.
Readings = Literal["poses", "paths", "settling", "forces"]


@dataclass(frozen=True)
class PerformanceTest:
    """A test: measurements that are evaluated together, and never with those of another."""

    id: str  #: What its rows have in the column ``criterion``.
    name: str  #: In words.
    criteria: tuple[str, ...]  #: What is evaluated from it.
    readings: Readings  #: In which file its rows are.
    cycles: int  #: How often each place is gone to, or each path run.
    places: tuple[str, ...]  #: Poses, paths or corners, as a plan calls them.


_ALL_POSES: Final = ("P1", "P2", "P3", "P4", "P5")
_PATHS: Final = ("line", "rectangle", "large-circle", "small-circle")

#: Every test by what its rows have in the column ``criterion``.
TESTS: Final[Mapping[str, PerformanceTest]] = {
    test.id: test
    for test in (
        PerformanceTest("AP", "pose accuracy and repeatability", ("AP", "RP"), "poses", 30, _ALL_POSES),
        PerformanceTest("vAP", "multi-directional pose accuracy variation", ("vAP",), "poses", 30, ("P1", "P2", "P4")),
        PerformanceTest("AD", "distance accuracy and repeatability", ("AD", "RD"), "poses", 30, ("P2", "P4")),
        PerformanceTest("dAP", "drift of pose accuracy and repeatability", ("dAP", "dRP"), "poses", 10, ("P1",)),
        PerformanceTest("E", "exchangeability", ("E",), "poses", 30, _ALL_POSES),
        PerformanceTest("t", "position stabilisation time and overshoot", ("t", "OV"), "settling", 3, ("P1",)),
        PerformanceTest("posing-time", "minimum posing time", ("posing-time",), "settling", 3, ("P1",)),
        PerformanceTest("AT", "path accuracy and repeatability", ("AT", "RT"), "paths", 10, _PATHS),
        PerformanceTest(
            "AT-reorientation",
            "path accuracy and repeatability on reorientation",
            ("AT-reorientation", "RT-reorientation"),
            "paths",
            10,
            ("line",),
        ),
        PerformanceTest("CR", "cornering deviations", ("CR", "CO"), "paths", 3, ("rectangle",)),
        PerformanceTest("AV", "path velocity characteristics", ("AV", "RV", "FV"), "paths", 10, ("line",)),
        PerformanceTest("WS", "weaving deviations", ("WS", "WF"), "paths", 3, ("weave",)),
        PerformanceTest("compliance", "static compliance", ("compliance",), "forces", 3, ("P1",)),
    )
}
#: The test in which each criterion is measured, in the order of the standard's table.
TEST_OF: Final[Mapping[str, str]] = {
    criterion: TESTS[test].id
    for criterion, test in (
        ("AP", "AP"),
        ("RP", "AP"),
        ("vAP", "vAP"),
        ("AD", "AD"),
        ("RD", "AD"),
        ("t", "t"),
        ("OV", "t"),
        ("dAP", "dAP"),
        ("dRP", "dAP"),
        ("E", "E"),
        ("AT", "AT"),
        ("RT", "AT"),
        ("AT-reorientation", "AT-reorientation"),
        ("RT-reorientation", "AT-reorientation"),
        ("CR", "CR"),
        ("CO", "CR"),
        ("AV", "AV"),
        ("RV", "AV"),
        ("FV", "AV"),
        ("posing-time", "posing-time"),
        ("compliance", "compliance"),
        ("WS", "WS"),
        ("WF", "WS"),
    )
}
#: Every criterion.
CRITERIA: Final = tuple(TEST_OF)
