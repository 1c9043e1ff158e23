"""Tables of the study katana-devices: our figures beside those of Patel's sections 3.3, 4.5 and 5.5."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Final

from papers.katana.printed import column_of_4_6
from papers.katana_devices.page import Corrector, OnPage
from papers.katana_devices.run import Errors, Outcome
from papers.katana_devices.setup import (
    DOCUMENT,
    INSTRUMENTS,
    LOW_COST,
    STARTS,
    USED,
    Counts,
    DocumentInstrument,
    Start,
    View,
)
from papers.study import Row, Table
from truearm.engine.twin.devices.touching import PLANAR_ARTEFACT, SPATIAL_ARTEFACT

#: Table 4.6, mean and largest |dP| of ten uncalibrated points [mm].
_BEFORE: Final = column_of_4_6(0)
_AFTER: Final[Mapping[Start, tuple[str, str]]] = {
    "geometry alone": column_of_4_6(1),
    "tilting first": column_of_4_6(2),
}
#: Section 3.3: largest error as the laser tracker read it [mm].
_LARGEST: Final = "2.11"
#: Section 5.5.1: mean distance from the circle before and after [mm].
_CIRCLE_BEFORE: Final = "0.653"
_CIRCLE_AFTER: Final[Mapping[tuple[Corrector, Start], str]] = {
    ("markers", "geometry alone"): "0.312",
    ("markers", "tilting first"): "0.132",
}
_GAUGE_WORDS: Final = {"base": "where the robot stands", "size": "how large it is"}
_DIRECTIONS: Final = {"base": 6, "size": 1}

_OPTOTRAK: Final = "three active markers (Optotrak)"
_TRACKED: Final = "laser tracker, one reflector seen within 45 deg"
#: The document's instruments in words.
_DOCUMENT_WORDS: Final[Mapping[DocumentInstrument, str]] = {
    "optotrak": _OPTOTRAK,
    "optotrak, 30 points": f"{_OPTOTRAK}, 30 points",
    "tracker, 30 points": f"{_TRACKED}, 30 points",
    "cameras, 30 points": "optical CMM of 0.060 mm, 30 points",
}
_VIEW_WORDS: Final[Mapping[View, str]] = {
    "tracker": _TRACKED,
    "tracker, three reflectors": "laser tracker, three reflectors seen within 30 deg",
    "planar artefact": PLANAR_ARTEFACT.name,
    "spatial artefact": SPATIAL_ARTEFACT.name,
    "markers": _OPTOTRAK,
}


def instrument_words(name: str) -> str:
    """Return an instrument in words: a device of the registry by its name."""
    return "low-cost set-up: touch-up and drawn circle" if name == LOW_COST else name


def document_table(outcomes: Sequence[Outcome]) -> Table:
    """Show what the document's three instruments reach."""
    rows = []
    for k, name in enumerate(("mean", "largest")):
        rows.append(
            Row(
                f"{_OPTOTRAK}, 118 poses, before, {name}",
                "mm",
                [_statistic(one.before_optotrak.own, name) for one in outcomes],
                _BEFORE[k],
                "Table 4.6",
                explanation="Base and tool are fitted here and take up a part; as they are known, see below."
                if k == 0
                else "",
            )
        )
    for start in STARTS:
        for k, name in enumerate(("mean", "largest")):
            rows.append(
                Row(
                    f"{_OPTOTRAK}, 118 poses, {start}, {name}",
                    "mm",
                    [_statistic(one.document["optotrak"].reached[start].own, name) for one in outcomes],
                    _AFTER[start][k],
                    "Table 4.6",
                    explanation=_why(start, k),
                )
            )
    for instrument in list(DOCUMENT)[1:]:
        rows += [
            Row(
                f"{_DOCUMENT_WORDS[instrument]}, {start}, mean",
                "mm",
                [one.document[instrument].reached[start].own.mean for one in outcomes],
            )
            for start in STARTS
        ]
    for instrument in DOCUMENT:
        tracked = instrument == "tracker, 30 points"
        published = tracked or instrument == "optotrak"
        rows.append(
            Row(
                f"{_DOCUMENT_WORDS[instrument]}: largest distance from the nominal robot where it stands",
                "mm",
                [one.document[instrument].from_nominal.largest for one in outcomes],
                _LARGEST if published else None,
                ("section 3.3" if tracked else "Table 4.5") if published else "",
                explanation="The tracker shows only poses whose tool points at it; the worst may not be among them."
                if tracked
                else "",
            )
        )
    return Table(
        "The document's three instruments",
        "Error of the tip on unseen poses in the instrument's own frame, 200 mm attachment: 118 poses with the Optotrak"
        " as in chapters 3 and 4, and 30 points with each of the three as in section 3.3, which prints no calibration"
        " of the other two. Robot and poses are others.",
        tuple(rows),
    )


def _statistic(errors: Errors, name: str) -> float:
    return errors.mean if name == "mean" else errors.largest


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


def devices_table(outcomes: Sequence[Outcome], start: Start) -> Table:
    """Show what every device reaches from one start."""
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
            [one.before_markers.moved.mean for one in outcomes],
        )
    ]
    for name in INSTRUMENTS:
        rows.append(
            Row(
                f"{instrument_words(name)}, {outcomes[0].reached[name, start].configurations} configurations, mean",
                "mm",
                [one.reached[name, start].moved.mean for one in outcomes],
                explanation=why.get(name, "") if start == "tilting first" else "",
            )
        )
    return Table(
        f"Every device, {start}",
        "Mean error of the pencil's point on unseen configurations after the best rigid motion of all predictions, so"
        " that closed loops, which do not know where the robot stands, compare.",
        tuple(rows),
    )


def own_frame_table(outcomes: Sequence[Outcome]) -> Table:
    """Show errors in the instrument's own frame."""
    rows = []
    for device in USED:
        own = [one.reached[device.name, "tilting first"].own for one in outcomes]
        if all(math.isfinite(errors.mean) for errors in own):
            rows += [
                Row(f"{device.name}, mean", "mm", [errors.mean for errors in own]),
                Row(f"{device.name}, largest", "mm", [errors.largest for errors in own]),
            ]
    return Table(
        "In the instrument's own frame, tilting first",
        "Error on unseen configurations without any motion, for devices that say where the robot stands.",
        tuple(rows),
    )


def unobservable_table(outcomes: Sequence[Outcome]) -> Table:
    """Show which directions closed loops do not determine."""
    rows = []
    for name in INSTRUMENTS:
        what = instrument_words(name)
        found = [one.reached[name, "tilting first"] for one in outcomes]
        if not found[0].gauge:
            continue
        words = [_GAUGE_WORDS[name] for name in found[0].gauge]
        words += [f"a direction of {', '.join(found[0].unobservable)}"] if found[0].unobservable else []
        rows += [
            Row(
                f"{what}: directions that it does not see",
                "",
                [float(sum(_DIRECTIONS[n] for n in one.gauge) + bool(one.unobservable)) for one in found],
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


def page_table(outcomes: Sequence[Outcome]) -> Table:
    """Show the circle before and after correction."""
    rows = _page_rows([one.pages.before for one in outcomes], None)
    for key in outcomes[0].pages.after:
        rows += _page_rows([one.pages.after[key] for one in outcomes], key)
    return Table(
        "The circle of section 5.5.1 on the page",
        "The twin goes round it in motion, commanded by the nominal robot and by what two instruments made of it. The"
        " page shows how far the line is from a circle of the right size about its own middle, and the potentiometer"
        " how far from its own plane: where the circle lies, and what goes on along the line, it does not show.",
        tuple(rows),
    )


def _page_rows(pages: Sequence[OnPage], key: tuple[Corrector, Start] | None) -> list[Row]:
    """Return the rows of the circle before correction, or after correction by an instrument and a start."""
    words = "before" if key is None else f"{instrument_words(key[0])}, {key[1]}"
    published = _CIRCLE_BEFORE if key is None else _CIRCLE_AFTER.get(key)
    return [
        Row(
            f"{words}: true mean distance",
            "mm",
            [float(page.distance.mean()) for page in pages],
            published,
            "" if published is None else "section 5.5.1",
            explanation=_why_so_far(key),
        ),
        Row(f"{words}: after the best rigid motion", "mm", [float(page.moved.mean()) for page in pages]),
        Row(
            f"{words}: as the page shows it",
            "mm",
            [page.shown for page in pages],
            explanation="Of that 0.025 mm are noise of scan and potentiometer." if key is None else "",
        ),
    ]


def _why_so_far(key: tuple[Corrector, Start] | None) -> str:
    if key is None:
        return (
            "Geometry of Table 3.2 and tilting together; tilting alone is what the document has, see katana-trajectory."
        )
    if key[0] == "low-cost":
        return "Where the robot stands is not known: most of this is a misplaced circle, which moving the page mends."
    if key[1] == "geometry alone":
        return "Geometry from everywhere cannot take up what tilts here."
    return "Most of it is the play of joint 1."


def views_table(outcomes: Sequence[Outcome]) -> Table:
    """Show what share of configurations instruments see."""
    why: Mapping[View, str] = {
        "tracker": "One reflector that looks along the tool: the document turned to markers for this.",
        "planar artefact": "A plate within 15 deg: poses have to be chosen for it.",
    }
    return Table(
        "What instruments see of the Katana",
        "Share of configurations drawn evenly from the joint limits that show enough of the tool, 2.6 m away. What the"
        " arm hides is not asked.",
        tuple(
            Row(_VIEW_WORDS[view], "%", [one.views[view] for one in outcomes], explanation=why.get(view, ""))
            for view in outcomes[0].views
        ),
    )
