"""How far the targets of programs were moved: one HTML file."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.units import from_si
from truearm.engine.document.document import (
    Block,
    Cell,
    Document,
    Facts,
    Lead,
    Picture,
    Section,
    Table,
    Words,
    pictured,
    warned,
)
from truearm.engine.document.drawing import (
    AFTER,
    BEFORE,
    CAMERA,
    COLOURS,
    Figure,
    axis,
    figure,
    rounded,
    rounded_to,
    scene_axis,
)
from truearm.engine.document.figures import histogram
from truearm.engine.programs.correction import Correction, way_through

if TYPE_CHECKING:
    from truearm.compensation.result import FileCorrection, ProgramCorrection
    from truearm.engine.robot.chain import Array
    from truearm.engine.robot.parts import Joint

#: Targets in a picture: more slow a browser down and show no more.
_DRAWN: Final = 5000
#: Files that the head of the page counts.
_COUNTED: Final = 5
#: Rows in a table of targets that were skipped.
_LISTED: Final = 500
#: Thickness of a program whose targets lie in a plane [mm].
_FLAT: Final = 2.0
#: Cosine from the vertical of the normal of a plane that is looked at from above, and of directions that are an axis.
_LEVEL: Final = 0.9
_ALONG: Final = 0.9999
#: From far enough to see the axes of a tall picture.
_CAMERA: Final = CAMERA | {"eye": {"x": 1.9, "y": 1.9, "z": 1.0}}
#: How long the longest correction is drawn, as a share of the program's size.
_ARROW: Final = 0.08


def program_html(correction: ProgramCorrection) -> str:
    """Return the page of corrected programs."""
    counts = [Words(f"{file.name}: {file.count_words}.", quiet=True) for file in correction.files]
    if len(counts) > _COUNTED:
        counts = [*counts[:_COUNTED], Words(f"And {len(counts) - _COUNTED} more files.", quiet=True)]
    notes = [("Serial number" if key == "serial" else key.capitalize(), note) for key, note in correction.notes.items()]
    notices = [notice for notice in correction.warnings if notice.code not in ("frames-assumed", "tools-assumed")]
    refers = [Words(sentence) for sentence in correction.frame_words]
    return Document(
        f"Corrected programs for {correction.robot.title}",
        [
            *counts,
            *([Facts(notes)] if notes else []),
            Section("", [_lead(correction), *warned(notices)], "result"),
            *_simulated(correction),
            _files(correction),
            Section("What the correction refers to", refers, "frames"),
            *_pictures(correction),
            *_not_better(correction.files),
            *_skipped(correction.files),
            *_joints(correction),
        ],
        correction.command,
    ).html(correction)


def _lead(correction: ProgramCorrection) -> Lead:
    """Return what the real robot misses before and now, as far as it is known, and how far targets were moved."""
    corrections = correction.result.corrections
    moved = _spread(np.concatenate([c.moved[c.corrected] for c in corrections]) * 1e3)
    turned = _spread(np.degrees(np.concatenate([c.turned[c.corrected] for c in corrections])))
    shifts = [
        Words(
            f"Targets were moved by {moved[0]} mm on average, {moved[1]} mm at most, and turned by up to "
            f"{turned[1]} deg."
        )
    ]
    if correction.result.frames.frames != "assumed":
        shifts += [Words(f"{file.shared_words}.") for file in correction.files if file.shared_words]
    if correction.simulated is not None:
        seen = correction.simulated
        before, after = _spread(seen.original * 1e3), _spread(seen.corrected * 1e3)
        words = (
            f"Mean distance of {seen.robot} from where the program meant it to be, with the original and with the "
            f"corrected program; at most {before[1]} and {after[1]} mm."
        )
        return Lead([Words(words), *shifts], after[0], before[0], "mm")
    expected = _expected(correction.files)
    if expected is None:
        words = (
            f"Targets were moved by that much on average, {moved[1]} mm at most, and turned by {turned[0]} deg on "
            f"average, {turned[1]} deg at most. That is no error: what the robot misses now is not known."
        )
        return Lead([Words(words)], moved[0], unit="mm")
    words = (
        f"Mean {'relative ' if correction.relative else ''}error to expect of the real robot at the targets, with the "
        f"original and with the corrected program. Largest expected, not a bound: {expected[1]} and {expected[3]} mm."
    )
    only = correction.files[0] if len(correction.files) == 1 else None
    if only is not None and only.intervals:
        low, high = (f"{end * 1e3:.3f}" for end in only.intervals[1])
        span = f"{low} mm or more" if correction.lower_bound else f"{low} to {high} mm"
        words += f" With a probability of 90 % the mean is {span} now."
    words += f" {correction.relative}" if correction.relative else ""
    return Lead([Words(words + _larger(correction)), *shifts], expected[2], expected[0], "mm")


def _larger(correction: ProgramCorrection) -> str:
    more = " They may be larger: the calibration cannot know all errors of the robot."
    return more if correction.lower_bound else ""


def _simulated(correction: ProgramCorrection) -> list[Section]:
    seen = correction.simulated
    if seen is None:
        return []
    before, after = seen.original * 1e3, seen.corrected * 1e3
    drawn = histogram(before, after, "mm", "distance from the programmed path", "targets")
    return [Section("Before and after", [Picture("simulated", drawn)])]


def _files(correction: ProgramCorrection) -> Section:
    rows: list[tuple[str | Cell, ...]] = [
        (
            Cell(file.name, code=True),
            *map(str, (file.targets, file.corrected, file.kept.total(), len(file.skipped))),
            *("–" if values is None else f"{values.mean() * 1e3:.3f}" for values in file.expected or (None, None)),
            f"{file.mean_shift * 1e3:.3f}",
            f"{file.largest_shift * 1e3:.3f}",
        )
        for file in correction.files
    ]
    words = (
        "Mean error to expect with the original program and now; mean and largest shift of the corrected targets. "
        f"Programs in {correction.files[0].language}."
    )
    heading = ("targets", "corrected", "kept", "unchanged", "expected [mm]", "now", "shift [mm]", "largest")
    blocks: list[Block] = [Words(words), Table(("file", *heading), rows, look="spread", wide=True)]
    if correction.splits:
        moves, added = (sum(getattr(split, name) for split in correction.splits) for name in ("moves", "added"))
        blocks.append(Words(f"{moves} straight or circular moves were split by {added} more targets."))
    return Section("Files", blocks, "files")


def _pictures(correction: ProgramCorrection) -> list[Section]:
    corrections = correction.result.corrections
    shown = [c for c in corrections if c.corrected.any()]
    known = [c for c in corrections if c.expected is not None and np.isfinite(c.expected.before).any()]
    sections = []
    if shown:
        along = "By how much each target was moved and turned, in the order in which the program goes to them."
        sections.append(pictured("along", "Along the path", along, along_figure(shown)))
        path = path_figure(shown)
        flat = "scene" not in path["layout"]
        words = (
            f"Targets where the program means them, in the frame of the controller's base"
            f"{', which all lie in a plane' if flat else ''}, with the correction drawn longer than it is."
        )
        sections.append(pictured("path", "In their plane" if flat else "In space", words, path))
    if known:
        words = (
            "How far the real robot is expected to be from each target, by what its calibration leaves uncertain: with "
            f"the original program and with this one.{_larger(correction)}"
        )
        sections.append(pictured("expected", "Expected error", words, expected_figure(known)))
    return sections


def _not_better(files: Sequence[FileCorrection]) -> list[Section]:
    rows = [_not_better_row(file, row) for file in files for row in file.not_better]
    heading = ("file", "line", "expected before [mm]", "expected after [mm]", "gets worse with probability", "it is")
    return _listed("Not better for their correction", "not-better", heading, rows, texts=(5,))


def _skipped(files: Sequence[FileCorrection]) -> list[Section]:
    rows = [(Cell(file.name, code=True), str(target.line), target.reason) for file in files for target in file.skipped]
    return _listed("Left as they are", "skipped", ("file", "line", "reason"), rows, texts=(2,))


def _listed(
    title: str, name: str, heading: tuple[str, ...], rows: Sequence[Sequence[str | Cell]], texts: tuple[int, ...]
) -> list[Section]:
    """Return a section of a long table, none of an empty one."""
    if not rows:
        return []
    blocks: list[Block] = [Table(heading, rows[:_LISTED], texts, wide=True)]
    if len(rows) > _LISTED:
        blocks.append(Words(f"And {len(rows) - _LISTED} more; the JSON summary lists all."))
    return [Section(title, blocks, name)]


def _joints(correction: ProgramCorrection) -> list[Section]:
    rows = _joint_rows(correction.robot.joints, correction.result.corrections)
    words = Words("Where the joints go in the corrected programs, as the model counts them.")
    table = Table(("joint", "from", "to", "unit"), rows, texts=(3,))
    return [Section("Joints", [words, table], "joints")] if rows else []


def path_figure(corrections: Sequence[Correction]) -> Figure:
    """Show targets in the order of the program, and by how much and whereto each was moved.

    They are drawn in space, or in their plane where all lie in one.
    """
    traces: list[Figure] = []
    points = np.concatenate([c.tips[c.corrected][:, :3, 3] for c in corrections]) * 1e3
    view = _flat_view(points) or _IN_SPACE
    longest = max(max(float(c.moved.max(initial=0.0)) for c in corrections) * 1e3, 1e-9)
    size = max(float(np.ptp(points, axis=0).max()), 1.0)
    wanted = max(_ARROW * size / longest, 1.0)
    decade = 10.0 ** math.floor(math.log10(wanted))
    stretch = decade * max(step for step in (1, 2, 5) if step * decade <= wanted)
    for number, correction in enumerate(corrections):
        rows = _evenly(np.flatnonzero(correction.corrected))
        tips = correction.tips[rows]
        frame = tips @ np.linalg.inv(correction.before[rows])
        step = np.einsum("nij,nj->ni", frame[:, :3, :3], (correction.after - correction.before)[rows, :3, 3])
        start = tips[:, :3, 3] * 1e3
        way = way_through(correction.program, correction.tips, _DRAWN)
        name = html.escape(correction.program.sources[0].path.stem)
        traces.append(_line(view, way * 1e3, f"path of {name}", "#9aa0a6", 2))
        arrows = np.stack([start, start + stretch * 1e3 * step, np.full_like(start, np.nan)], axis=1).reshape(-1, 3)
        traces.append(_line(view, arrows, f"correction, {stretch:g} times as long", COLOURS[number % 3], 3))
        texts = [
            [html.escape(correction.program.targets[row].name or "inline"), correction.program.targets[row].line]
            for row in rows.tolist()
        ]
        moved = rounded(correction.moved[rows] * 1e3, 3)
        traces.append(
            {
                "type": view.kind,
                "mode": "markers",
                "name": "targets",
                **{letter: rounded_to(column, 1) for letter, column in zip("xyz", view.seen(start).T, strict=False)},
                "customdata": [
                    [*text, value, *place]
                    for text, value, place in zip(texts, moved, rounded_to(start, 0), strict=True)
                ],
                "marker": {
                    "size": 4 if view is _IN_SPACE else 7,
                    "color": moved,
                    "line": {"color": "#9aa0a6", "width": 1},
                    "colorscale": "Viridis",
                    "reversescale": True,
                    "cmin": 0,
                    "cmax": longest,
                    "colorbar": {"title": {"text": "moved [mm]"}, "thickness": 14, "len": 0.75, "outlinewidth": 0},
                    "showscale": number == 0,
                },
                "hovertemplate": "%{customdata[0]}, line %{customdata[1]}: moved by %{customdata[2]} mm<br>"
                "x %{customdata[3]}, y %{customdata[4]}, z %{customdata[5]} mm<extra></extra>",
                "showlegend": False,
            }
        )
    if view is not _IN_SPACE:
        return figure(
            traces,
            520,
            xaxis=axis(view.titles[0]) | {"constrain": "domain"},
            yaxis=axis(view.titles[1]) | {"scaleanchor": "x"},
        )
    axes = {f"{letter}axis": scene_axis(title) for letter, title in zip("xyz", view.titles, strict=True)}
    return figure(traces, 620, scene={**axes, "aspectmode": "data", "camera": _CAMERA})


@dataclass(frozen=True, eq=False)
class _View:
    """How points are looked at: directions of the picture's axes ``(2 or 3, 3)``, and their titles."""

    axes: Array
    titles: tuple[str, ...]

    @property
    def kind(self) -> str:
        """Plotly's name of such traces."""
        return "scatter3d" if len(self.axes) == 3 else "scatter"

    def seen(self, points: Array) -> Array:
        """Return points ``(n, 3)`` along the picture's axes."""
        return np.asarray(points @ self.axes.T)


_IN_SPACE: Final = _View(np.eye(3), tuple(f"{letter} [mm]" for letter in "xyz"))


def _flat_view(points: Array) -> _View | None:
    """Return the view onto the plane in which all points ``(n, 3)`` [mm] lie, None if there is none."""
    if len(points) < 3:
        return None
    away = points - points.mean(axis=0)
    _, spread, directions = np.linalg.svd(away, full_matrices=False)
    normal = directions[2]
    if len(spread) > 1 and spread[1] < 1e-6 * spread[0]:  # on a line: the plane that is level across it
        normal = np.array([0.0, 0.0, 1.0]) - directions[0][2] * directions[0]
        normal = normal / np.linalg.norm(normal) if np.linalg.norm(normal) > 1e-6 else np.array([0.0, -1.0, 0.0])
    if float(np.ptp(away @ normal)) > _FLAT:
        return None
    normal = normal if normal[2] >= 0.0 else -normal
    level = normal[2] > _LEVEL
    right = np.array([1.0, 0.0, 0.0]) - normal[0] * normal if level else np.cross([0.0, 0.0, 1.0], normal)
    right = right / np.linalg.norm(right)
    up = np.cross(normal, right)
    names = []
    for direction, other in ((right, "across its slope"), (up, "up its slope")):
        axis_of = int(np.argmax(np.abs(direction)))
        along = direction[axis_of] > _ALONG
        names.append(f"{'xyz'[axis_of]} [mm]" if along else f"in the targets' plane, {other} [mm]")
    return _View(np.array([right, up]), tuple(names))


def along_figure(corrections: Sequence[Correction]) -> Figure:
    """Show by how much each target was moved and turned, in the order in which the program goes to them."""
    traces: list[Figure] = []
    start = 1
    for number, correction in enumerate(corrections):
        order = _order(correction)
        steps = _evenly(np.flatnonzero(correction.corrected[order]))
        rows = order[steps]
        targets = correction.program.targets
        names = [f"{html.escape(targets[row].name or 'inline')}, line {targets[row].line}" for row in rows.tolist()]
        program = html.escape(correction.program.sources[0].path.stem)
        for name, values, unit, colour, axes in (
            ("moved", correction.moved[rows] * 1e3, "mm", AFTER, "y"),
            ("turned", np.degrees(correction.turned[rows]), "deg", BEFORE, "y2"),
        ):
            traces.append(
                {
                    "type": "scatter",
                    "mode": "lines+markers" if len(rows) < 200 else "lines",
                    "name": f"{name} [{unit}]",
                    "legendgroup": name,
                    "showlegend": number == 0,
                    "x": (steps + start).tolist(),
                    "y": rounded(values, 4),
                    "yaxis": axes,
                    "text": names,
                    "line": {"color": colour, "width": 1.5},
                    "marker": {"size": 5},
                    "hovertemplate": f"{program}, %{{text}}: {name} by %{{y}} {unit}<extra></extra>",
                }
            )
        start += len(order)
    return figure(
        traces,
        380,
        xaxis=axis("step of the program, in the order of its text"),
        yaxis=axis("moved [mm]") | {"rangemode": "tozero"},
        yaxis2=axis("turned [deg]")
        | {"rangemode": "tozero", "overlaying": "y", "side": "right", "showgrid": False, "tickmode": "auto"},
    )


def expected_figure(corrections: Sequence[Correction]) -> Figure:
    """Show how far the real robot is expected to be from each target, before and now, in the order of the program."""
    traces: list[Figure] = []
    start = 1
    for number, correction in enumerate(corrections):
        known = correction.expected
        if known is None:
            continue
        order = _order(correction)
        steps = _evenly(np.flatnonzero(np.isfinite(known.before[order])))
        rows = order[steps]
        targets = correction.program.targets
        names = [f"{html.escape(targets[row].name or 'inline')}, line {targets[row].line}" for row in rows.tolist()]
        after = np.where(correction.corrected, known.after, known.before)
        for name, values, colour in (("before", known.before, BEFORE), ("now", after, AFTER)):
            traces.append(
                {
                    "type": "scatter",
                    "mode": "lines+markers" if len(rows) < 200 else "lines",
                    "name": name,
                    "legendgroup": name,
                    "showlegend": number == 0,
                    "x": (steps + start).tolist(),
                    "y": rounded(values[rows] * 1e3, 4),
                    "text": names,
                    "line": {"color": colour, "width": 1.5},
                    "marker": {"size": 5},
                    "hovertemplate": f"%{{text}}: %{{y}} mm expected {name}<extra></extra>",
                }
            )
        start += len(order)
    return figure(
        traces,
        340,
        xaxis=axis("step of the program, in the order of its text"),
        yaxis=axis("expected distance [mm]") | {"rangemode": "tozero"},
    )


def _expected(files: Sequence[FileCorrection]) -> tuple[str, str, str, str] | None:
    """Return the mean and largest error to expect of all targets before [mm], and the same now; None if unknown."""
    known = [file.expected for file in files if file.expected is not None]
    if not known:
        return None
    before, after = (np.concatenate(values) * 1e3 for values in zip(*known, strict=True))
    return (*_spread(before), *_spread(after))


def _not_better_row(file: FileCorrection, row: int) -> tuple[str | Cell, ...]:
    """Return the row of a table: file, line, expected distances [mm] before and after, probability, what became."""
    known = file.correction.expected
    before, after, worse = (known.before[row], known.after[row], known.worse[row]) if known else (np.nan,) * 3
    state = "corrected" if file.correction.corrected[row] else "kept"
    line = file.correction.program.targets[row].line
    share = f"{worse:.0%}".replace("%", " %")
    return Cell(file.name, code=True), str(line), f"{before * 1e3:.3f}", f"{after * 1e3:.3f}", share, state


def _order(correction: Correction) -> NDArray[np.intp]:
    """Return the targets in the order of the moves, vias too; in the order of the text where nothing moves to them."""
    moves = [row for move in correction.program.moves for row in (move.via, move.target) if row is not None]
    others = sorted(set(range(len(correction.program.targets))) - set(moves))
    return np.array([*moves, *others], dtype=int)


def _line(view: _View, points: Array, name: str, colour: str, width: float) -> Figure:
    values = [[None if math.isnan(v) else round(v, 2) for v in column] for column in view.seen(points).T.tolist()]
    return {
        "type": view.kind,
        "mode": "lines",
        "name": name,
        **dict(zip("xyz", values, strict=False)),
        "line": {"color": colour, "width": width},
        "hoverinfo": "skip",
    }


def _evenly(rows: NDArray[np.intp]) -> NDArray[np.intp]:
    if len(rows) <= _DRAWN:
        return rows
    return np.asarray(rows[np.linspace(0, len(rows) - 1, _DRAWN).astype(int)])


def _joint_rows(robot_joints: Sequence[Joint], corrections: Sequence[Correction]) -> list[tuple[str, str, str, str]]:
    """Return the range of each joint in the corrected programs, in deg or mm as the model counts."""
    joints = np.concatenate([c.joints[c.corrected] for c in corrections])
    if not len(joints):
        return []
    rows = []
    for joint, low, high in zip(robot_joints, joints.min(axis=0).tolist(), joints.max(axis=0).tolist(), strict=True):
        unit = "deg" if joint.kind == "revolute" else "mm"
        rows.append((joint.name, f"{from_si(low, unit):.2f}", f"{from_si(high, unit):.2f}", unit))
    return rows


def _spread(values: Array) -> tuple[str, str]:
    return (f"{values.mean():.3f}", f"{values.max():.3f}") if len(values) else ("–", "–")
