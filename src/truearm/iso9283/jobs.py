"""What tests of a robot's performance are asked for: planned, simulated, evaluated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from truearm.engine.base.errors import InputError, Words
from truearm.engine.command.groups import (
    AtTip,
    Drawn,
    InCell,
    InCube,
    Instrument,
    IntoFolder,
    Long,
    OfRobot,
    OfTruth,
    Programmed,
    Repeatable,
)
from truearm.engine.command.kinds import File, Given, Names, Number, Numbers
from truearm.engine.command.request import as_in, job, option, required

if TYPE_CHECKING:
    from truearm.engine.robot.robot import Robot
    from truearm.iso9283.evaluating.evaluate import Iso9283Evaluation
    from truearm.iso9283.planning.criteria import PerformancePlan
    from truearm.iso9283.planning.result import Iso9283Plan
    from truearm.iso9283.simulating.simulate import Iso9283Simulation


@dataclass(frozen=True)
class _Criteria(Names):
    """Criteria by their ids, in capitals or not."""

    def check(self, value: Any, name: str) -> Any:
        """Return the ids as they are, each once."""
        from truearm.engine.command.arguments import choices_argument
        from truearm.iso9283.planning.criteria import CRITERIA

        known = ("all", *CRITERIA)
        by_small = {criterion.lower(): criterion for criterion in known}
        if isinstance(value, Sequence) and not isinstance(value, str):
            value = [by_small.get(entry.lower(), entry) if isinstance(entry, str) else entry for entry in value]
        wanted = choices_argument(value, name, known, "criterion")
        if not wanted:
            raise InputError("no criterion is given", parameter=name, allowed=", ".join(known))
        return wanted


@dataclass(frozen=True)
class _Percent(Numbers):
    """Percent of what a robot is rated for."""

    may_be_zero: bool = False

    def check(self, value: Any, name: str) -> Any:
        """Refuse what is none, and shares: no test is run at 1 % or less."""
        from truearm.engine.command.arguments import numbers_argument

        zero = "0, or " * self.may_be_zero
        allowed = f"percent of the rated one, {zero}above 1 up to 100, one or more"
        percent = numbers_argument(value, name, len(value) if isinstance(value, Sequence) else 1, allowed)
        if not percent:
            raise InputError("no number is given", parameter=name, allowed=allowed)
        for percentage in percent:
            if not (1.0 < percentage <= 100.0 or (percentage == 0.0 and self.may_be_zero)):
                raise InputError(
                    "these are percent of the rated one",
                    parameter=name,
                    came=Words(f"{percentage:g} %"),
                    allowed=allowed,
                    cure=f"Give {100 * percentage:g}, not {percentage:g}, if this is a share."
                    if 0.0 < percentage <= 1.0
                    else None,
                )
        return percent


class PlanTests(OfRobot, InCube, AtTip, InCell, Programmed, IntoFolder, Repeatable):
    """Plan the tests: poses and paths in the cube, cycles, velocities, loads, and a sheet for the operator.

    The robot is the nominal one, as its controller knows it. Writes plan.yaml, robot.yaml and sheet.html. Ways keep
    clear of what stands in the cell where that or a clearance is stated, or the plan is refused.
    """

    job = "iso9283_plan"
    words = "iso9283 plan"
    refuses = (
        "If there is no such criterion, plane or target, the arm has fewer than six joints, or it cannot come to all "
        "poses and along all paths of the cube; for programs if it has more joints, is calibrated, or cannot make a "
        "move; if the slow run was of another plan, or is not completed."
    )
    criteria: Sequence[str] = option(
        _Criteria("ID,..|all", repeated=False), "Which criteria, as ap,rp,at.", default=("all",)
    )
    cube: str | Path = option(
        File("auto|FILE"), "The largest one, or a file with one (schema truearm-cube/1).", default="auto"
    )
    load: float | None = option(
        Number("kg", low=0.0, above=True), "Rated load.", default=None, shown="that of the robot file"
    )
    velocity: float | None = option(
        Number("mm/s", low=10.0, high=20000.0), "Rated velocity along a path.", default=None, shown="1000 mm/s"
    )
    velocities: Sequence[float] = option(
        _Percent("%,..", example="percent, as 100,50,10"),
        "Percent of the rated velocity.",
        default=(100.0, 50.0, 10.0),
    )
    loads: Sequence[float] = option(
        _Percent("%,..", example="percent, as 100,50,10", may_be_zero=True),
        "Percent of the rated load.",
        default=(100.0,),
    )
    limit_band: float = option(
        Number("mm", low=0.0, above=True), "Within which the tip is said to stand.", default=0.1e-3
    )
    hours: float = option(Number("h", low=0.0, above=True), "How long the drift is watched.", default=8.0)
    slow_run: str | Path | None = option(
        File("FILE"), "slow-run.yaml, completed: writes the faster ones.", default=None, shown=False
    )

    def check(self) -> None:
        """Refuse a slow run where no programs are asked for."""
        if self.slow_run is not None and self.program is None:
            raise InputError(
                "a slow run allows faster programs, and none are asked for",
                parameter="slow_run",
                cure="State `program`, or leave it out.",
            )

    def run(self) -> Iso9283Plan:
        """Plan."""
        from truearm.iso9283.planning.plan import planned

        return planned(self)


class SimulateTests(OfRobot, Instrument, Drawn, IntoFolder, Repeatable, Long):
    """Run the tests of a plan on a twin that moves, and read it with a simulated instrument.

    The controller believes in the nominal robot. The twin adds what a test of performance sees beside wrong geometry:
    joints that follow as damped springs, come to rest a little elsewhere each time and have some play, links that grow
    while the arm warms up, and an arm that gives way to its load and to pushes; where the truth knows of no compliance,
    joints give way to pushes alone, by what is drawn. Readings are in the instrument's frame; how that is tied to the
    robot's base is written beside them, with an error drawn from its stated uncertainty.
    """

    job = "iso9283_simulate"
    words = "iso9283 simulate"
    refuses = (
        "For a plan or a truth of another robot, poses or paths that cannot be commanded, too many samples, or a robot "
        "for the correction that is not calibrated or stands elsewhere."
    )
    plan: PerformancePlan | str | Path = required(
        Given("PLAN.yaml"), "Of 'truearm iso9283 plan', with robot.yaml beside it.", kw_only=False, word="plan"
    )
    truth: Robot | str | Path = as_in(
        OfTruth,
        "truth",
        default="random",
        shown=True,
        more="Robots that are exchanged are drawn in the same way; where the truth is not drawn, by the priors of "
        "geometry and joint zeros about it.",
    )
    rate: float = option(Number("Hz", low=10.0, high=2000.0), "Readings in a second.", default=500.0)
    corrected: Robot | str | Path | None = option(
        Given("ROBOT"),
        "Correct commands by this calibrated robot.",
        default=None,
        shown=False,
        more="It is calibrated in the instrument's frame, as one from data of :func:`truearm.simulate`; where the tool "
        "is on its flange is found from 30 readings.",
    )

    def run(self) -> Iso9283Simulation:
        """Simulate."""
        from truearm.iso9283.simulating.simulate import simulated

        return simulated(self)


class EvaluateTests(Instrument, IntoFolder, Repeatable, Long):
    """Evaluate what was measured: each criterion with its 95 % interval or the range of its cycles, and a report."""

    job = "iso9283_evaluate"
    words = "iso9283 evaluate"
    refuses = "If a file cannot be used or does not fit the plan; the message names the row."
    plan: str | Path = required(
        File("PLAN.yaml"), "Of 'truearm iso9283 plan', with robot.yaml beside it.", kw_only=False
    )
    poses: str | Path | None = option(File("CSV"), "Attained poses.", default=None, shown=False)
    paths: str | Path | None = option(File("CSV"), "Samples along paths.", default=None, shown=False)
    settling: str | Path | None = option(File("CSV"), "Samples on the way to a pose.", default=None, shown=False)
    forces: str | Path | None = option(File("CSV"), "The tip under forces.", default=None, shown=False)
    alignment: str | Path | None = option(
        File("FILE"),
        "How the instrument was tied to the base (schema truearm-alignment/1).",
        default=None,
        shown="best fit, with a warning",
    )
    compare: str | Path | None = option(
        File("RESULT.json"), "iso9283.json of another result.", default=None, shown=False
    )

    def check(self) -> None:
        """Refuse an instrument without noise."""
        for name in ("noise", "noise_rot"):
            if not getattr(self, name):
                raise InputError("no instrument is without noise", parameter=name, came=0, allowed="above 0")

    def run(self) -> Iso9283Evaluation:
        """Evaluate."""
        from truearm.iso9283.evaluating.evaluate import evaluation

        return evaluation(self)


iso9283_plan = job(PlanTests)
iso9283_simulate = job(SimulateTests)
iso9283_evaluate = job(EvaluateTests)
