"""What a plan of a calibration is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from truearm.engine.base.errors import InputError, kind_of
from truearm.engine.command.groups import (
    AmongCandidates,
    Drawn,
    FromHome,
    InCell,
    JointsWritten,
    Loaded,
    Long,
    OfCell,
    OfModel,
    OfRobot,
    OnFloor,
    Programmed,
    Repeatable,
    SeenBy,
)
from truearm.engine.command.kinds import Choice, File, Flag, Given, Kind, Text
from truearm.engine.command.request import as_in, job, option, required

if TYPE_CHECKING:
    from truearm.engine.data.dataset import Dataset
    from truearm.engine.robot.chain import Array
    from truearm.planning.result import Plan


class _HowMany(Kind):
    """How many configurations, or that O1 decides."""

    metavar = "N|auto"

    def check(self, value: Any, name: str) -> Any:
        """Refuse what is neither a number nor auto."""
        from truearm.engine.command.arguments import count_argument

        if not isinstance(value, str):
            return count_argument(value, name)
        if value != "auto":
            raise InputError(
                "a number of poses belongs here", parameter=name, came=value, allowed="a whole number, or auto"
            )
        return value

    def read(self, typed: Any, name: str) -> Any:
        """Return a number where the text is one."""
        from truearm.engine.command.texts import read_poses

        return read_poses(typed)


class _Region(Given):
    """A box: lowest and highest x, y and z."""

    at_edges = "mm"

    def read(self, typed: Any, name: str) -> Any:
        """Return the ranges of a text."""
        from truearm.engine.command.texts import read_region

        return read_region(typed)

    def typed_again(self, value: Any) -> list[str]:
        """Return the ranges as they are typed."""
        from truearm.engine.base.units import written

        return [",".join("..".join(f"{written(end, 'mm')}".removesuffix(".0") for end in box) for box in value)]


class _Speed(Given):
    """Speed of the tip, and the largest share of the joints' speed."""

    def read(self, typed: Any, name: str) -> Any:
        """Return the numbers of a text in mm/s and percent."""
        from truearm.engine.command.texts import read_speed

        return read_speed(typed)

    def typed_again(self, value: Any) -> list[str]:
        """Return them in mm/s and percent."""
        from truearm.engine.base.units import written

        speed, *shares = value
        return [",".join(f"{number:g}" for number in (written(speed, "mm"), *(share * 100.0 for share in shares)))]


class PlanPoses(
    OfRobot,
    OfModel,
    SeenBy,
    AmongCandidates,
    Drawn,
    Loaded,
    JointsWritten,
    OnFloor,
    FromHome,
    InCell,
    Programmed,
    Repeatable,
    Long,
):
    """Choose the configurations that tell most, in a measuring order, and say how accurate the result will be.

    Without a device every target on the robot's tool is measured at each of them. Writes a CSV file, its page, the
    ways between and a sheet for the operator; with `program` a folder with these and a program that drives the plan.
    The robot may be calibrated: derivatives are taken at its parameter values. A device finds configurations itself.
    Inclinometers are a device of the command alone; in Python there is truearm.plan_inclinometers.
    """

    job = "plan"
    poses: int | Literal["auto"] = required(
        _HowMany(), "How many configurations; auto lets O1 decide.", kw_only=True, word="poses"
    )
    out: str | Path | None = option(
        File("PLAN"),
        "CSV file to write, its page beside it; a folder with `program`.",
        default=None,
        needed=True,
        repeated=False,
        more="None writes nothing, see :meth:`Plan.save`.",
    )
    candidates_from: Dataset | str | Path | None = option(
        Given("DATA.csv"),
        "Choose among those of a file or a plan, and not among random ones.",
        default=None,
        word="from",
        shown=False,
        more="Such configurations were reached once: they are checked only with joints that can turn further than once "
        "on the turn from -180 to 180 deg, and if `floor`, `no_floor`, `clearance`, `home`, `program` or boxes to keep "
        "out of are said.",
    )
    objective: str | None = option(
        Choice("INDEX", ("O1", "O2", "O3", "O4", "O5", "error")),
        "O1, O2, O3, O4 or O5; error: the error with `accurate_at` or `region`.",
        default=None,
        shown="O1, or error with `accurate_at` or `region`",
        more="The error is the mean square one where the robot shall be accurate.",
    )
    accurate_at: Array | str | Path | None = option(
        Given("PROGRAM|POSES.csv"),
        "Where the robot shall be accurate: a robot program, or flange poses as for 'truearm ik'.",
        default=None,
        word="for",
        shown="everywhere",
        more="Poses are in the base frame, as :func:`truearm.inverse` takes them; an array holds joint positions of "
        "the model ``(n, joints)`` [rad or m].",
    )
    region: Sequence[Sequence[float]] | None = option(
        _Region("X..X,Y..Y,Z..Z"),
        'The same as a box for the flange in the base frame: "300..600,-200..200,100..400".',
        default=None,
        shown="everywhere",
        more="In Python lowest and highest x, y and z, ``(3, 2)``.",
    )
    tools: str | Path | None = as_in(OfCell, "tools", default=None, shown=False)
    frames: str | Path | None = as_in(OfCell, "frames", default=None, shown=False)
    approach: bool = option(
        Flag(), "Every joint comes to each configuration from one side, by a stop before it.", default=False
    )
    speed: Sequence[float] | None = option(
        _Speed("MM/S[,%]"),
        "The highest speed of the tip in the program, and of the joints.",
        default=None,
        shown="250,10",
        more="In Python the higher one of targets and flange [m/s], and the largest share of the joints' speed: "
        "(0.25, 0.1).",
    )
    wait: str | None = option(
        Text("WAIT"),
        'What it waits for then: time, for nothing more; operator, who starts it again; "input 3,300s", a digital '
        "input, at most for so long.",
        default=None,
        shown="time",
        more="After that time the program pauses.",
    )

    def check(self) -> None:
        """Refuse a device with given configurations, and what is said of a program that is not asked for."""
        if self.device is not None and self.candidates_from is not None:
            data = self.candidates_from
            source = str(data) if isinstance(data, str | Path) else kind_of(data)
            raise InputError(
                "a device finds its own configurations to choose from",
                parameter="device, candidates_from",
                came=f"{self.device} and {source}",
                cure="Leave one of them out; `constraints` narrows the choice.",
            )
        for name in ("approach", "speed", "dwell", "wait") if self.program is None else ():
            setting = getattr(self, name)
            if setting is not None and setting is not False:
                raise InputError(
                    "this is said of a measuring program, and none is asked for",
                    parameter=name,
                    cure="State `program`, or leave it out.",
                )

    def run(self) -> Plan:
        """Plan."""
        from truearm.planning.planned import planned

        return planned(self)


plan = job(PlanPoses)
