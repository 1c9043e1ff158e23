"""The sphere test: a ballbar between the tool and a fixed ball (Nubiola, 2.6.3)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from truearm.engine.base.errors import InputError, Notice, counted, refusals_of
from truearm.engine.base.units import Marked, parts_of
from truearm.engine.base.writing import output_file, write_text
from truearm.engine.command.arguments import (
    file_for,
    files_of,
    readings_argument,
    refuse_swapped,
    robot_argument,
)
from truearm.engine.command.split import changed_since, faults_of
from truearm.engine.data.dataset import Dataset
from truearm.engine.document.document import Block, each, say
from truearm.engine.document.records import Record
from truearm.engine.programs.fake_targets import nominal_robot
from truearm.engine.programs.gauge import best_agreement
from truearm.engine.robot.chain import Array
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY
from truearm.validation.validate import refuse_unknown

if TYPE_CHECKING:
    from truearm.validation.jobs import JudgeSphere

# One end of the bar is at a target of the tool, the other at a ball on the table. Whatever the robot does, the bar
# reads the distance between the two; the robot's model predicts it. No tracker is needed, and no common frame but the
# centre.
_STEPS: Final = 50
_SETTLED: Final = 1e-12


@dataclass(frozen=True, eq=False)
class SphereTest:
    """Errors of distances from the centre of a sphere."""

    errors: Array  #: Measured minus predicted distance of each reading [m], ``(n,)``.
    centre: Array  #: The centre that was used, in the robot's world [m], ``(3,)``.

    @property
    def mean(self) -> float:
        """Mean of the signed errors [m]."""
        return float(self.errors.mean())

    @property
    def deviation(self) -> float:
        """Standard deviation of the errors about their mean [m]."""
        return float(self.errors.std(ddof=1))

    @property
    def largest(self) -> float:
        """Largest absolute error [m]."""
        return float(np.abs(self.errors).max())

    @property
    def figures(self) -> dict[str, float]:
        """These three as JSON holds them [mm]."""
        return {"mean": self.mean * 1e3, "deviation": self.deviation * 1e3, "largest": self.largest * 1e3}

    @property
    def words(self) -> str:
        """These three in words."""
        return "  ".join(f"{name} {value:.3f}" for name, value in self.figures.items()) + " mm"


def sphere_test(
    robot: Robot, joints: ArrayLike | Postures, lengths: ArrayLike, target: str, centre: ArrayLike | None = None
) -> SphereTest:
    """Compare lengths that a ballbar read with those that a model predicts.

    Args:
        robot: The model to judge.
        joints: Joint positions at which the bar was read [rad or m], ``(n, joints)``, or postures.
        lengths: What the bar read [m], ``(n,)``; NaN where it was beyond its range, which is left out.
        target: The target of the tool at which the bar is attached.
        centre: The fixed ball in the robot's world [m], ``(3,)``: where the model says the robot was when it was
            taught. If None, the centre that makes the sum of squared errors least; an error in teaching then does not
            count.

    Raises:
        InputError: If there are not as many lengths as configurations, fewer than two are left, or fewer than five to
            find the centre from; or if they lie so that it cannot be found.
    """
    q = joints if isinstance(joints, Postures) else Postures(np.asarray(joints, float))
    read = np.asarray(lengths, float)
    if read.shape != (len(q),):
        raise InputError(
            "every configuration needs one length",
            where="lengths",
            came=f"{read.shape} for {len(q)} configurations",
            allowed=f"({len(q)},)",
        )
    inside = np.isfinite(read)
    needed = 2 if centre is not None else 5
    if inside.sum() < needed:
        raise InputError(
            "too few lengths within the range of the ballbar",
            where="lengths",
            came=int(inside.sum()),
            allowed=f"{needed} or more",
            cure="Send the tool to more points of the sphere." if inside.all() else "Calibrate the robot first.",
        )
    points, _ = robot.world_poses(q.at(np.flatnonzero(inside)), target)
    middle = _centre(points, read[inside]) if centre is None else np.asarray(centre, float)
    return SphereTest(read[inside] - np.linalg.norm(points - middle, axis=1), middle)


def _centre(points: Array, lengths: Array) -> Array:
    """Return the point whose distances from others are nearest to given ones, by least squares."""
    # Differences of squared distances are linear in the centre: a start that needs no guess.
    about = points.mean(axis=0)
    p = points - about
    size = float(np.linalg.norm(p, axis=1).max())
    A = np.column_stack([2 * p / size, np.ones(len(p))])
    spread = np.linalg.svd(A, compute_uv=False)
    if not spread[-1] > 1e-6 * spread[0]:
        raise InputError(
            "the centre cannot be found: the points lie in one plane",
            where="centre",
            cure="Give the centre, or spread the points over the sphere.",
        )
    centre = np.linalg.lstsq(A, ((p**2).sum(axis=1) - lengths**2) / size, rcond=None)[0][:3]
    for _ in range(_STEPS):
        away = p - centre
        distance = np.linalg.norm(away, axis=1)
        step = np.linalg.lstsq(-away / distance[:, None], lengths - distance, rcond=None)[0]
        centre = centre + step
        if math.sqrt(step @ step) < _SETTLED:
            break
    return np.asarray(centre + about)


@dataclass(frozen=True, eq=False)
class OneSphere:
    """The test of one target about one ball."""

    target: str  #: At which the bar is attached.
    fixture: str  #: The fixed ball.
    lengths: Array  #: What the bar read [m], ``(n,)``.
    left_out: int  #: How many configurations have no length: there the bar was beyond its range.
    before: SphereTest | None  #: By the nominal robot; None for a robot that is not calibrated.
    after: SphereTest  #: By the robot.

    def blocks(self) -> Iterator[Block]:
        """Give its errors."""
        lost = f", {self.left_out} beyond the range of the bar" if self.left_out else ""
        yield say(
            f"{self.target} about {self.fixture}, {counted(len(self.lengths), 'reading')}{lost}",
            target=self.target,
            fixture=self.fixture,
            readings=len(self.lengths),
            left_out=self.left_out,
        )
        if self.before is not None:
            yield say(f"  nominal     {self.before.words}", nominal_mm=self.before.figures)
        name = "this robot" if self.before is None else "calibrated"
        yield say(f"  {name}  {self.after.words}", robot_mm=self.after.figures)


@dataclass(frozen=True, eq=False, repr=False)
class SphereTests(Record):
    """Every sphere of a file of measurements."""

    robot: Robot  #: The robot that is judged.
    source: str  #: The measurements, for messages.
    spheres: tuple[OneSphere, ...]  #: One for each target and ball.
    #: Name of the configuration at which the robot was taught where the ball is; None where the centre that fits best
    #: was taken.
    taught: str | None
    command: str  #: How to run it again.
    warnings: tuple[Notice, ...] = ()  #: What speaks against the calibration of the robot.
    inputs: tuple[Path, ...] = ()  #: The files that were read: none of them is overwritten.
    simulated_from: tuple[Marked, ...] = ()  #: What of it comes from a virtual instrument.

    def blocks(self) -> Iterator[Block]:
        """Give the centre, and mean, deviation and largest error of each sphere."""
        if self.taught is None:
            yield say("Measured less predicted distance from the centre that fits best:", centre="found")
        else:
            words = f"Measured less predicted distance from the centre that was taught at configuration {self.taught}:"
            yield say(words, centre="taught")
        yield each("spheres", (sphere.blocks() for sphere in self.spheres))

    def written_at(self, out: str) -> str:
        """Return the line that says which file holds it."""
        return f"Written: {out}"

    def save(self, file: str | Path) -> Path:
        """Write a page with the errors of every reading; return the file."""
        from truearm.validation.sphere_page import sphere_page

        page = output_file(file, self.inputs)
        write_text(page, sphere_page(self))
        return page


def judged(asked: JudgeSphere) -> SphereTests:
    """Judge every sphere of the measurements."""
    refuse_swapped(asked.robot, asked.data, "sphere")
    page = None if asked.out is None else file_for(asked.out, asked.robot, asked.data)
    arm = asked.loads.on(robot_argument(asked.robot))
    measured = readings_argument(arm, asked.data)
    if measured.distance is None or not np.isfinite(measured.distance).any():
        raise InputError(
            "there are no distances of a ballbar",
            parameter="data",
            where=measured.source,
            allowed="the columns target, fixture and distance [mm]",
            cure="Give what the bar read, one row a configuration.",
        )
    if asked.tip is not None:
        arm = arm.with_frames(arm.base, dict.fromkeys(measured.targets, asked.tip))
    refuse_unknown(measured, measured.targets, arm.target)
    at_ball = None if asked.taught_at is None else _taught(measured, asked.taught_at)
    sphere_tests = SphereTests(
        arm,
        measured.source,
        _spheres(arm, measured, at_ball),
        asked.taught_at,
        asked.again,
        (*changed_since(asked.robot), *faults_of(arm)),
        files_of(asked.robot, asked.data),
        parts_of((arm, measured)),
    )
    if page is not None:
        sphere_tests.save(page)
    return sphere_tests


def _spheres(arm: Robot, data: Dataset, at_ball: int | None) -> tuple[OneSphere, ...]:
    """Return the test of each target about each ball; `at_ball` is the configuration that was taught."""
    assert data.distance is not None
    nominal, spheres = _nominal(arm), []
    for number, fixture in enumerate(data.fixtures):
        for index, target in enumerate(data.targets):
            rows = np.flatnonzero((data.target == index) & (data.against == number))
            if at_ball is not None:
                rows = rows[data.configuration[rows] != at_ball]
            if not len(rows):
                continue
            lengths = data.distance[rows]
            inside = np.isfinite(lengths)
            before = None if nominal is None else _judged(nominal, data, rows, target, at_ball)
            after = _judged(arm, data, rows, target, at_ball)
            spheres.append(OneSphere(target, fixture, lengths[inside], int((~inside).sum()), before, after))
    return tuple(spheres)


def _judged(model: Robot, data: Dataset, rows: NDArray[np.intp], target: str, at_ball: int | None) -> SphereTest:
    assert data.distance is not None
    centre = None if at_ball is None else _centre_sphere(model, data, at_ball)
    with refusals_of("data"):
        return sphere_test(model, data.postures.at(data.configuration[rows]), data.distance[rows], target, centre)


def _nominal(robot: Robot) -> Robot | None:
    """Return the nominal robot with the targets where its own flange has them; None if the robot is nominal itself."""
    try:
        nominal = nominal_robot(robot)
    except InputError:
        return None
    flange = np.linalg.inv(best_agreement(robot)[1])
    places = {}
    for target in robot.targets:
        at = np.array([robot.values[target.parameter(axis)] for axis in "xyz"])
        places[target.name] = flange[:3, :3] @ at + flange[:3, 3]
    return nominal.with_frames(IDENTITY, places)


def _taught(data: Dataset, name: str) -> int:
    """Return which configuration has a name, or refuse one at which it is not clear what was at the ball."""
    if name not in data.labels:
        raise InputError(
            "the measurements have no configuration of this name",
            parameter="taught_at",
            where=data.source,
            came=name,
            cure="Name the configuration at which the target was brought to the ball.",
        )
    number = data.labels.index(name)
    targets = np.unique(data.target[data.configuration == number])
    if len(targets) > 1:
        raise InputError(
            "it is not clear which target was brought to the ball",
            parameter="taught_at",
            where=f"{data.source}, configuration {name}",
            came=", ".join(data.targets[k] for k in targets),
            cure="Leave the row of that target alone in this configuration.",
        )
    return number


def _centre_sphere(model: Robot, data: Dataset, number: int) -> Array:
    """Return where a model says that the ball is [m], ``(3,)``."""
    target = data.targets[int(data.target[data.configuration == number][0])]
    return np.asarray(model.world_poses(data.postures.at(np.array([number])), target)[0][0])
