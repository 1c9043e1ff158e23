"""What jobs with the hexapod device are asked for: its poses, plans, cups from lengths, and the base fixture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from truearm.engine.base.errors import InputError
from truearm.engine.command.groups import AlsoIntoFile, Drawn, IntoFile, JointsWritten, OfRobot
from truearm.engine.command.kinds import File, Flag, Given, GivenFiles, Names, Number, Numbers, Text, Whole
from truearm.engine.command.request import Request, as_in, job, option, required

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from truearm.engine.robot.transform import Transform
    from truearm.hexapod.results import HexapodFrame, HexapodPlan, HexapodPoses, HexapodSolution, HexapodUncertainty
    from truearm.hexapod.sheet import Sheet

_THREE = Numbers("MM,MM,MM", "mm", 3)


class _Fixtures(Given):
    """Where the base fixture stands, one place or several."""

    typed = list[str]
    at_edges = "mm, deg"

    @property
    def unit(self) -> str:
        """Units in Python."""
        return "m, rad"

    def check(self, value: Any, name: str) -> Any:
        """Return the places as transforms."""
        from truearm.hexapod.planning import places_argument

        return places_argument(value)

    def read(self, typed: Any, name: str) -> Any:
        """Return x, y, z [m] and what follows, a turn [rad] or a quaternion, of each text in mm and deg."""
        from truearm.engine.base.units import sized_si
        from truearm.engine.command.texts import read_numbers

        places = []
        for text in typed:
            numbers = read_numbers(text, name, "X,Y,Z,TURN in mm and deg, or X,Y,Z,QW,QX,QY,QZ")
            units = ["mm"] * 3 + (["deg"] if len(numbers) == 4 else ["1"] * (len(numbers) - 3))
            places.append(
                [sized_si(number, unit, parameter=name) for number, unit in zip(numbers, units, strict=False)]
            )
        return places

    def typed_again(self, value: Any) -> list[str]:
        """Return each place as a text."""
        at = [
            (Numbers("", "mm").typed_again(place.translation), Numbers().typed_again(place.quaternion))
            for place in value
        ]
        return [",".join([*place, *turn]) for place, turn in at]


class _WithTool(Request):
    """Which cups are on the flange."""

    tool: str | None = option(
        Text("NAME"), "Of the robot file.", default=None, shown="first", more="It has the three cups as its targets."
    )


class _Ranged(Request):
    """How far the ballbar reads."""

    reach: float = option(Number("mm", low=0.0), "What the ballbar reads about nominal.", default=1e-3, word="range")


class EnumeratePoses(Request):
    """Count designs, assemblies and poses, and list the poses that teach much the same."""

    job = "hexapod_enumerate"
    words = "hexapod enumerate"
    refuses = ""

    def run(self) -> HexapodPoses:
        """Count."""
        from truearm.hexapod.solving import enumerated

        return enumerated()


class KnowCups(Drawn):
    """Say how well the tool's cups are known, in standard deviations of one length (Nubiola, Table 3.1)."""

    job = "hexapod_uncertainty"
    words = "hexapod uncertainty"
    refuses = "If one of them is no such number."
    trials: int = option(Whole(low=2, counts=True), "Of the Monte Carlo.", default=100_000)

    def run(self) -> HexapodUncertainty:
        """Say it."""
        from truearm.hexapod.solving import known

        return known(self)


class PlanHexapod(OfRobot, _WithTool, JointsWritten, IntoFile):
    """Plan which configurations of a robot can be measured with the fixture at one place or several.

    The robot has six joints that are solved in closed form. Writes a sheet to fill in.
    """

    job = "hexapod_plan"
    words = "hexapod plan"
    refuses = (
        "If the robot has no such tool or no closed form, or can reach none of the poses with the fixture at a place."
    )
    fixture: Transform | Sequence[float] | Sequence[Transform | Sequence[float]] = required(
        _Fixtures("X,Y,Z,TURN"),
        "Base fixture in the robot's base frame: B1 and turn about z, or X,Y,Z,QW,QX,QY,QZ.",
        kw_only=False,
        word="fixture",
        more="A transform; x, y, z and a turn; or x, y, z and a quaternion w, x, y, z. Several of them "
        "are places where it stands one after the other.",
    )
    steps: str | Path | None = option(
        File("STEPS.txt"), "The same step by step, to print.", default=None, shown="none is written"
    )
    distinct: bool = option(Flag(), "Leave out near-equal poses.", default=False)
    branches: Sequence[str] = option(
        Names("NAME,..", "how branches begin, as front-up", repeated=False),
        "Only these, as front-up,back-down.",
        default=(),
        shown="all",
        more="Their names begin so; all of them if empty.",
    )
    fourth_cup: bool = option(Flag(), "Plan for a fourth cup below the three others, on all four sides.", default=False)
    attachments: int = option(
        Whole(low=1, high=50),
        "How often the tool is attached; what is measured again then.",
        default=1,
        more="After each time but the first, five configurations of the last place are measured again, which tells how "
        "well the tool changer repeats the cups.",
    )
    arm_radius: float = option(Number("mm", low=0.0), "Of the arm's links, for room at the bars.", default=0.05)

    def run(self) -> HexapodPlan:
        """Plan."""
        from truearm.hexapod.planning import planned

        return planned(self)


class SolveCups(_Ranged, AlsoIntoFile):
    """Find the tool's cups from measured lengths, in the frame of the base fixture.

    Writes the cups of sheets as measurements, for 'truearm calibrate'.
    """

    job = "hexapod_solve"
    words = "hexapod solve"
    refuses = (
        "If neither a sheet nor a pose is given, or both; if a length is beyond the ballbar's range, or legs do not "
        "meet; if sheets are not of one robot and tool, or a fixture did not stand still."
    )
    sheet: Sheet | str | Path | Sequence[Sheet | str | Path] | None = option(
        GivenFiles("SHEET.csv"),
        "Sheets of 'truearm hexapod plan', filled in, of one robot and tool.",
        default=None,
        kw_only=False,
    )
    pose: int | None = option(Whole("1..72", low=1, high=72), "Without a sheet: which pose.", default=None)
    legs: Sequence[float] | None = option(
        Numbers("MM,..", "mm", 6), "Without a sheet: six lengths in the order of the pose's legs.", default=None
    )
    base_sides: Sequence[float] = option(
        _THREE, "B1-B2, B2-B3, B3-B1.", default=(0.3,) * 3, more="With `pose`.", formerly="base"
    )
    tool_sides: Sequence[float] = option(
        _THREE, "T1-T2, T2-T3, T3-T1.", default=(0.15,) * 3, more="With `pose`.", formerly="tool"
    )

    def check(self) -> None:
        """Refuse a sheet and a pose at once, or neither, and a file for what is no data."""
        if (self.sheet is None) == (self.legs is None) or (self.legs is None) != (self.pose is None):
            raise InputError(
                "a sheet, or a pose and its six legs, belong here",
                parameter="sheet, pose, legs",
                allowed="a sheet, or `pose` and `legs`",
            )
        if self.legs is not None and self.out is not None:
            raise InputError(
                "one pose without joint positions is no data file",
                parameter="out",
                cure="Use a sheet, or leave it out.",
            )

    def run(self) -> HexapodSolution:
        """Find them."""
        from truearm.hexapod.solving import solved

        return solved(self)


class FindFixture(OfRobot, _WithTool, _Ranged):
    """Find the base fixture from the joint positions at its cups and the distances between them."""

    job = "hexapod_world_frame"
    words = "hexapod world-frame"
    refuses = "If the robot has no such tool or target, or a distance is beyond the ballbar's range or of no triangle."
    touches: ArrayLike | str | Path = required(
        Given("TOUCHES.csv"),
        "Columns cup, joint_1 or axis_1 [deg] ..; B1, B2, B3.",
        kw_only=False,
        more="Or joint positions at B1, B2 and B3 [rad or m], ``(3, joints)``.",
    )
    base_sides: Sequence[float] = as_in(
        SolveCups, "base_sides", kw_only=False, word="base_sides", shown=False, more="They were measured."
    )
    cup: str | None = option(Text("NAME"), "Of the tool, that touched.", default=None, shown="first", formerly="target")

    def run(self) -> HexapodFrame:
        """Find it."""
        from truearm.hexapod.solving import fixture_found

        return fixture_found(self)


hexapod_enumerate = job(EnumeratePoses)
hexapod_uncertainty = job(KnowCups)
hexapod_plan = job(PlanHexapod)
hexapod_solve = job(SolveCups)
hexapod_world_frame = job(FindFixture)
