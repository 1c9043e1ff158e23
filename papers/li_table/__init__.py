"""Li et al.: an arm of three joints calibrated by touching a table, beside their figures and other ways to fit."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Final, Literal

import numpy as np

from papers import Progress
from papers.li_table import arm as li
from papers.li_table.arm import BOUNDS, TILTS, TIP, Objective, Tilt, touched_by_hand, true_positions
from papers.seeds import Figures, Seed, gathered, over_seeds
from papers.study import Study
from papers.texts import told
from papers.traces import scatter
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import csv_text
from truearm.engine.document.drawing import AFTER, BEFORE, COLOURS, Figure, axis, figure, rounded
from truearm.engine.fit.fit import identify, place
from truearm.engine.fit.models import named_model
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.writing import robot_text
from truearm.engine.twin.devices.calibration_table import CalibrationTable, rectangular_grid
from truearm.engine.twin.twin import Twin

#: What is fitted to: one of the three tables, or all of them.
Surface = Literal[Tilt, "together"]
SURFACES: Final[Mapping[Surface, str]] = {**{t: t for t in TILTS}, "together": "all three together"}
#: How, and whether in bounds: the document's sum of distances, the sum of components, squares.
Method = tuple[Objective, bool]
METHODS: Final[Mapping[Method, str]] = {
    ("distances", True): "sum of distances, bounded (the document's)",
    ("components", True): "sum of components, bounded",
    ("squares", True): "least squares, bounded",
    ("squares", False): "least squares, unbounded",
}
THEIRS: Final[Method] = ("distances", True)
#: The two methods that differ in how the document's |X - X'| is understood.
_MEASURES: Final[tuple[Objective, ...]] = ("distances", "components")
#: Base and tip are known: the camera reads in the robot's base frame, and the tip is at the end of link 3.
_FRAMES: Final = f"""\
truearm: truearm-cell/1
units: {{length: mm, angle: deg}}
tools:
  {TIP}: {{of: flange, translation: [0, 0, 0]}}
frames:
  base: {{of: world, translation: [0, 0, 0], quaternion: [1, 0, 0, 0]}}
"""


@dataclass(frozen=True, eq=False)
class _Drawn:
    """What one seed shows beside its figures."""

    #: How far the twin's tip was from the other trajectory [mm]: sent by the nominal arm, and by each fit; with play.
    followed: Mapping[str, Array]
    #: Where the nominal arm should go and where the twin goes [m], ``(n, 3)`` each: through the verification points,
    #: and along the other trajectory; with play.
    paths: tuple[tuple[Array, Array], ...]
    touched: Mapping[Surface, Dataset]  #: Readings of each table, and of all, joints having no play.
    unseen: Dataset  #: Where the tip truly is at the unseen points then.


def study(seeds: int, progress: Progress, unseen: int = 200) -> Study:
    """Calibrate the twin of each seed on every table, and judge it.

    Args:
        seeds: How many: of true parameters, play, noise and unseen points.
        progress: Called with a few words at each step.
        unseen: Points about the table to judge by.
    """
    tables, drawn = gathered(over_seeds(seeds, progress, partial(_one, unseen=unseen)))
    first = drawn[0]
    figures = {f"paths-{number}": _paths_figure(*path) for number, path in enumerate(first.paths, 6)}
    figures["trajectory"] = _trajectory_figure(first.followed)
    return told(__file__, seeds, tables, figures, files=_session_files(first))


def _one(seed: Seed, unseen: int) -> tuple[Figures, _Drawn]:
    rng = seed.generator()
    nominal = li.arm()
    exact, touched = li.truth(nominal, rng), li.tables(li.board())
    twin = li.with_play(exact)
    judged = li.around_the_table(nominal, unseen, rng)

    def fits(data: Mapping[Surface, Dataset]) -> dict[tuple[Surface, Method], Robot]:
        return {(on, method): li.fit(nominal, data[on], *method) for on in SURFACES for method in METHODS}

    data = _measured(touched, twin, rng)
    fitted = fits(data)
    figures: Figures = {"play": _left(nominal, fitted, judged, true_positions(twin, judged, rng))}
    level = {by: _sums(fitted["normal", (by, True)], data["normal"]) for by in _MEASURES}
    figures["measures"] = {
        f"{measure}, fit by {METHODS[by, True]}": level[by][measure] for measure in _MEASURES for by in _MEASURES
    }

    without_play = _measured(touched, exact, rng)
    there = true_positions(exact, judged, rng)
    figures["no_play"] = _left(nominal, fits(without_play), judged, there)
    mistaken = li.with_mistakes(without_play["roll"], rng)
    figures["alone"] = {}
    for tilt, table in touched.items():
        figures["alone"] |= _without_camera(tilt, table, exact, judged, rng)
    figures["mistakes"] = {
        words: _apart(li.fit(nominal, mistaken, *method), judged, there) for method, words in METHODS.items()
    }

    far = li.truth(nominal, rng, li.BEYOND)
    data = _measured(touched, far, rng)
    beyond = {tilt: li.fit(nominal, data[tilt], *THEIRS) for tilt in TILTS}
    figures["geometry"] = _geometry(nominal, beyond, far)
    robots = {on: fitted[on, THEIRS] for on in SURFACES}
    points, path = li.verification(), li.trajectory(li.other_waypoints())
    figures["points"] = _points(nominal, robots, twin, points)
    sent = {"before": nominal} | {SURFACES[on]: robot for on, robot in robots.items()}
    followed = {words: li.following_errors(robot, twin, path) for words, robot in sent.items()}
    figures["trajectory"] = _along(followed)
    paths = tuple((p, li.followed_places(nominal, twin, p)) for p in (li.trajectory(points), path))
    return figures, _Drawn(followed, paths, without_play, _as_read(data["normal"], judged, there))


def gain(before: Array, after: Array) -> float:
    """Return by how much a fit reduces the mean error [%]."""
    return 100.0 * (1.0 - float(after.mean()) / float(before.mean()))


def _points(nominal: Robot, robots: Mapping[Surface, Robot], twin: Twin, points: Array) -> dict[str, float]:
    """Send the twin to the verification points, by each model."""
    before = li.following_errors(nominal, twin, points)
    after = {on: li.following_errors(robot, twin, points) for on, robot in robots.items()}
    return {
        "before": float(before.mean()),
        **{f"after, {tilt} table": float(after[tilt].mean()) for tilt in TILTS},
        f"after, {SURFACES['together']}": float(after["together"].mean()),
        **{f"improvement, {tilt} table [%]": gain(before, after[tilt]) for tilt in TILTS},
        **{f"DH parameters at a bound, {t} table [of 12]": li.at_bounds(nominal, robots[t]) for t in TILTS},
    }


def _along(followed: Mapping[str, Array]) -> dict[str, float]:
    before, *_ = followed.values()
    return {
        "largest error before": float(before.max()),
        "mean error before": float(before.mean()),
        **{f"mean error after, {words}": float(followed[words].mean()) for words in SURFACES.values()},
        **{f"improvement, {tilt} table [%]": gain(before, followed[tilt]) for tilt in TILTS},
    }


def _geometry(nominal: Robot, robots: Mapping[Tilt, Robot], far: Twin) -> dict[str, float]:
    """Send a twin that has no play, and geometry beyond the bounds."""
    points, path = li.verification(), li.trajectory(li.other_waypoints())
    return {
        "before": float(li.following_errors(nominal, far, points).mean()),
        "largest error before, other trajectory": float(li.following_errors(nominal, far, path).max()),
        **{f"after, {tilt} table": float(li.following_errors(robots[tilt], far, points).mean()) for tilt in TILTS},
    }


def _as_read(like: Dataset, joints: Array, positions: Array) -> Dataset:
    """Return where the tip is at joint positions, as readings without noise."""
    count = len(joints)
    return Dataset(
        source="unseen points",
        labels=tuple(str(number + 1) for number in range(count)),
        joints=joints,
        joint_kinds=like.joint_kinds,
        targets=like.targets,
        configuration=np.arange(count),
        target=np.zeros(count, dtype=np.intp),
        position=positions,
    )


def _measured(touched: Mapping[Tilt, CalibrationTable], twin: Twin, rng: np.random.Generator) -> dict[Surface, Dataset]:
    """Touch each table, and all of them, their points captured in the robot's base frame by the camera."""
    points: dict[Surface, Array] = {tilt: table.in_world for tilt, table in touched.items()}
    points["together"] = np.concatenate(list(points.values()))
    return {surface: touched_by_hand(CalibrationTable(holes), twin, rng) for surface, holes in points.items()}


def _left(
    nominal: Robot, fitted: Mapping[tuple[Surface, Method], Robot], judged: Array, there: Array
) -> dict[str, float]:
    """Compare robots with where the twin truly is at unseen joint positions [mm]."""
    after = {f"{SURFACES[on]}: {METHODS[how]}": _apart(robot, judged, there) for (on, how), robot in fitted.items()}
    return {"before": _apart(nominal, judged, there), **after}


def _sums(robot: Robot, data: Dataset) -> dict[Objective, float]:
    """Return equation 4 per hole [mm], by both measures."""
    errors = 1e3 * (robot.world_poses(data.joints, TIP)[0] - data.position)
    return {
        "distances": float(np.linalg.norm(errors, axis=1).mean()),
        "components": float(np.abs(errors).sum(axis=1).mean()),
    }


def _without_camera(
    tilt: Tilt, table: CalibrationTable, twin: Twin, judged: Array, rng: np.random.Generator
) -> dict[str, float]:
    """Identify from the known points in the table's own frame, and judge there."""
    nominal = li.library_arm()
    data = touched_by_hand(table, twin, rng)
    grid = touched_by_hand(li.tables(rectangular_grid(5, 7, 0.025))[tilt], twin, rng).joints
    rotation, origin = table.place.rotation, np.array(table.place.translation)
    found = {}
    for name, robot in (
        ("before, base and tip found", place(nominal, data)),
        (
            "bounded distances, base and tip free",
            identify(nominal, data, named_model("geometric"), loss="l1", bounds=BOUNDS).robot,
        ),
    ):
        for where, joints in (("other points of the table", grid), ("about the table", judged)):
            true = (true_positions(twin, joints, rng) - origin) @ rotation
            found[f"{tilt}: {name}, {where}"] = _apart(robot, joints, true)
        normal = robot.base.rotation[2]  # of T_table_base: the plate's normal in the robot's base
        leaning = math.degrees(math.acos(min(1.0, float(normal @ rotation[:, 2]))))
        found[f"{tilt}: {name}, error of the table's normal [deg]"] = leaning
    return found


def _apart(robot: Robot, joints: Array, true: Array) -> float:
    """Return how far the true tip is on average from where a robot predicts it [mm]."""
    return 1e3 * float(np.linalg.norm(robot.world_poses(joints, TIP)[0] - true, axis=1).mean())


def _session_files(first: _Drawn) -> dict[str, str]:
    """Return the first robot as files, to be calibrated as the document does it, with one command.

    Robot, known frames, bounds, readings of each table and unseen points, by the names of the files; joints have no
    play.
    """
    limits = ", ".join(f"{name}: {size:g}" for name, size in BOUNDS.within.items())
    robot = replace(li.believed(li.arm()), name="li3-table", targets=(), known={})
    return {
        "robot.yaml": robot_text(robot),
        "frames.yaml": _FRAMES,
        "bounds.yaml": f"truearm: truearm-bounds/1\nunits: {{length: mm, angle: deg}}\nwithin: {{{limits}}}\n",
        **{f"{surface}.csv": csv_text(data) for surface, data in first.touched.items()},
        "unseen.csv": csv_text(first.unseen),
    }


def _trajectory_figure(followed: Mapping[str, Array]) -> Figure:
    traces = []
    for (name, errors), colour in zip(followed.items(), (BEFORE, *COLOURS, AFTER), strict=True):
        numbers, look = list(range(1, len(errors) + 1)), {"line": {"color": colour}, "marker": {"size": 4}}
        traces.append(scatter(name, "lines+markers", numbers, rounded(errors, 4), **look))
    return figure(traces, 340, xaxis=axis("point of the trajectory"), yaxis=axis("error [mm]"))


def _paths_figure(wanted: Array, went: Array) -> Figure:
    """Draw where the nominal arm should go and where the twin goes."""
    numbers = list(range(1, len(wanted) + 1))
    traces = [
        scatter(
            f"{letter}, {name}", "lines", numbers, rounded(1e3 * points[:, k], 5), line={"color": colour, "dash": dash}
        )
        for k, (letter, colour) in enumerate(zip("xyz", COLOURS, strict=True))
        for name, points, dash in (("ideal", wanted, "dot"), ("actual", went, "solid"))
    ]
    return figure(traces, 360, xaxis=axis("point of the trajectory"), yaxis=axis("place of the tip [mm]"))
