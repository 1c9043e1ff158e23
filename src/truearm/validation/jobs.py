"""What judgements of robots are asked for: by new measurements, distances, a ballbar, lines, tolerances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from truearm.engine.base.errors import InputError
from truearm.engine.command.groups import (
    AlsoIntoFile,
    AlsoIntoFolder,
    AtPlace,
    Drawn,
    ForcedAt,
    InBox,
    Instrument,
    JointsWritten,
    Loaded,
    Measured,
    Noted,
    OfData,
    OfRobot,
    OfTruth,
    Repeatable,
)
from truearm.engine.command.kinds import Choice, Given, Numbers, Text, Whole
from truearm.engine.command.request import as_in, job, option, required

if TYPE_CHECKING:
    from truearm.engine.data.dataset import Dataset
    from truearm.engine.fit.refit import Moved
    from truearm.engine.robot.robot import Robot
    from truearm.validation.distances import Distances
    from truearm.validation.lines import LineTest
    from truearm.validation.sphere import SphereTests
    from truearm.validation.tolerances import AllowedErrors, UsedTolerances
    from truearm.validation.validate import Validation


@dataclass(frozen=True)
class _OneOrEach(Numbers):
    """A length for all joints, or one for each; the job knows how many there are."""

    metavar: str = "MM[,MM..]"
    at_edges: str = "mm"  # type: ignore[misc]  # an instance has its own

    def check(self, value: Any, name: str) -> Any:
        """Leave it to the job."""
        return value

    def read(self, typed: Any, name: str) -> Any:
        """Return a single one as a number."""
        values = super().read(typed, name)
        return values[0] if len(values) == 1 else values

    def typed_again(self, value: Any) -> list[str]:
        """Return them with commas between."""
        return super().typed_again([value] if isinstance(value, int | float) else value)


class Validate(OfData, Loaded, ForcedAt, Noted, AlsoIntoFolder, Repeatable):
    """Judge a calibrated robot on new measurements taken in the same frames.

    With `out` it writes result.json and report.html. The robot may be the zones.yaml of a calibration by zones: each
    configuration is then judged by the robot of its zone. The wrench is the same at every configuration; measurements
    may have their own instead (force_x to moment_z).
    """

    job = "validate"
    refuses = "If the robot has no targets, the data name others, or there are too few of them for `refit`."
    refit: Moved | None = option(
        Choice(known=("base", "targets", "tool")),
        "What was moved since the calibration and is found anew from these measurements.",
        default=None,
        shown=False,
        more="Everything else stays: ``base`` is the instrument or the robot's base, ``targets`` each by itself, "
        "``tool`` all targets as one rigid body. The errors of each configuration are then those of what was found "
        "without it.",
    )

    def run(self) -> Validation:
        """Validate."""
        from truearm.validation.validate import validated

        return validated(self)


class JudgeDistances(OfData, Loaded):
    """Judge a robot by the distances between all pairs of measured points; no common frame is needed."""

    job = "distances"
    refuses = "If the robot has no targets, the data name others, or there are positions at one configuration only."

    def run(self) -> Distances:
        """Judge."""
        from truearm.validation.distances import judged

        return judged(self)


class JudgeSphere(OfData, Loaded, AlsoIntoFile, Repeatable):
    """Judge a robot by a ballbar between its tool and a fixed ball, before and after calibration.

    A calibrated robot is judged beside its nominal self. Measurements have the columns target, fixture and distance;
    each pair of a target and a fixture is a sphere. A configuration without a distance was beyond the range of the bar
    and is left out. The file is an HTML page with the error of every reading.
    """

    job = "sphere"
    refuses = "If there are no distances, too few of them, or the robot does not know where the bar is attached."
    taught_at: str | None = option(
        Text("NAME"),
        "Configuration at which the target was brought to the ball.",
        default=None,
        shown="the centre that fits best",
        formerly="taught",
        more="The centre is where a model says that it was then, so that errors in teaching count; this configuration "
        "is not judged itself.",
    )
    tip: Sequence[float] | None = as_in(AtPlace, "tip", default=None, shown="where the robot has the target")

    def run(self) -> SphereTests:
        """Judge."""
        from truearm.validation.sphere import judged

        return judged(self)


class TestLines(OfRobot, Drawn, JointsWritten, AlsoIntoFile):
    """Test a robot along seven directions of a box, and compensate it off-line through its joint errors.

    The robot is the nominal one, as its controller knows it. The CSV file holds the joint positions to command.
    """

    job = "lines"
    refuses = (
        "If the robot cannot go to a pose, joint errors or data are of another robot, or both truth and data are given."
    )
    centre: Sequence[float] = as_in(InBox, "centre", kw_only=False, word="centre", shown=False)
    size: Sequence[float] = option(Numbers("X,Y,Z", "mm", 3), "Of the box.", default=(0.6, 0.8, 0.4))
    joint_errors: Robot | str | Path | None = option(
        Given("FILE"),
        "joint-errors.yaml to compensate with.",
        default=None,
        formerly="model",
        shown=False,
        more="The same robot with joint errors, or its file, as :func:`truearm.axes` writes it.",
    )
    truth: Robot | str | Path | None = as_in(OfTruth, "truth", default=None, more="A twin of it is compensated.")
    data: Dataset | str | Path | None = as_in(
        Measured, "data", default=None, help="Measured, configurations named x-1 to xyz-11."
    )
    noise: float = as_in(Instrument, "noise", default=0.0)
    repeats: int = option(Whole(low=1, counts=True), "Repetitions on the twin.", default=30)

    def check(self) -> None:
        """Refuse two things to compare with."""
        if self.truth is not None and self.data is not None:
            raise InputError("only one of them can be compared", parameter="truth, data", cure="Leave one out.")

    def run(self) -> LineTest:
        """Test."""
        from truearm.validation.lines import tested

        return tested(self)


class JudgeTolerance(OfRobot):
    """Say what joint errors use of their tolerances, or what tolerances may do at the flange.

    With `lean` or `position` the largest flange error that they allow, else the tolerances that the robot's own errors
    use: it must have joint errors then, as 'truearm axes' writes them.
    """

    job = "tolerance"
    refuses = "If the robot has other joints than revolute ones, or no joint errors, or a length is none."
    depth: float | Sequence[float] = required(
        _OneOrEach(), "Depth of each joint's hole, or of all.", kw_only=False, word="depth"
    )
    lean: float | Sequence[float] | None = option(
        _OneOrEach(),
        "Perpendicularity or parallelism that is allowed, of each joint or all.",
        default=None,
        shown=False,
    )
    position: float | Sequence[float] | None = option(
        _OneOrEach(),
        "Radius about its place within which a joint may lie, half the drawing's diameter.",
        default=None,
        shown=False,
        more="Of each joint or all.",
    )

    def run(self) -> UsedTolerances | AllowedErrors:
        """Judge."""
        from truearm.validation.tolerances import judged

        return judged(self)


validate = job(Validate)
distances = job(JudgeDistances)
sphere = job(JudgeSphere)
lines = job(TestLines)
tolerance = job(JudgeTolerance)
