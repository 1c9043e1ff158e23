"""Pictures of the study li-table."""

from __future__ import annotations

from papers.li_table.run import Outcome
from papers.li_table.tables import SURFACE_WORDS
from papers.study import Picture
from truearm.engine.document.drawing import AFTER, BEFORE, COLOURS, axis, figure, rounded


def trajectory_picture(first: Outcome) -> Picture:
    """Draw errors along the other trajectory."""
    followed = {"before": first.following.before}
    followed |= {SURFACE_WORDS[surface]: found for surface, found in first.following.after.items()}
    colours = (BEFORE, *COLOURS, AFTER)
    traces = [
        {
            "type": "scatter",
            "mode": "lines+markers",
            "name": name,
            "x": list(range(1, len(one.path) + 1)),
            "y": rounded(one.path, 4),
            "line": {"color": colour},
            "marker": {"size": 4},
        }
        for (name, one), colour in zip(followed.items(), colours, strict=True)
    ]
    drawn = figure(traces, 340, xaxis=axis("point of the trajectory"), yaxis=axis("error [mm]"))
    return Picture(
        "trajectory",
        "Along the other trajectory",
        "First seed, with play: the twin sent along it by the nominal arm, and by the arm calibrated on each table.",
        drawn,
    )


def paths_pictures(first: Outcome) -> tuple[Picture, ...]:
    """Draw where the nominal arm should go and where the twin goes, as in Figures 6 and 7."""
    titles = (
        "Ideal and actual arm through the verification points, as in Figure 6",
        "Ideal and actual arm along the other trajectory, as in Figure 7",
    )
    pictures = []
    for number, (title, (wanted, went)) in enumerate(zip(titles, first.paths, strict=True), 6):
        traces = [
            {
                "type": "scatter",
                "mode": "lines",
                "name": f"{letter}, {name}",
                "x": list(range(1, len(wanted) + 1)),
                "y": rounded(1e3 * points[:, k], 5),
                "line": {"color": COLOURS[k], "dash": dash},
            }
            for k, letter in enumerate("xyz")
            for name, points, dash in (("ideal", wanted, "dot"), ("actual", went, "solid"))
        ]
        drawn = figure(traces, 360, xaxis=axis("point of the trajectory"), yaxis=axis("place of the tip [mm]"))
        words = "First seed, with play: where the nominal arm should go, and where the twin goes with its readings."
        pictures.append(Picture(f"paths-{number}", title, words, drawn))
    return tuple(pictures)
