"""``truearm hexapod``: poses from six lengths between cups."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from truearm.engine.command.options import Commands, JointsText, Json, print_json, print_line, print_record
from truearm.engine.command.texts import read_lengths, read_numbers

if TYPE_CHECKING:
    from truearm.hexapod.jobs import HexapodFrame, HexapodPlan, HexapodPoses, HexapodSolution, HexapodUncertainty

app = Commands(
    no_args_is_help=True, help="Measure poses with one ballbar between three cups on the tool and three on the base."
)

_THREE = "MM,MM,MM"
Range = Annotated[float, typer.Option("--range", metavar="MM", min=0.0, help="What the ballbar reads about nominal.")]
RobotName = Annotated[str, typer.Argument(metavar="ROBOT", help="A library id, a robot file or a URDF.")]
ToolName = Annotated[
    str | None, typer.Option("--tool", metavar="NAME", help="Of the robot file.", show_default="first")
]


@app.command("enumerate")
def enumerate_(json: Json = False) -> None:
    """Count designs, assemblies and poses, and list the poses that teach much the same."""
    from truearm.hexapod.jobs import hexapod_enumerate

    _print(hexapod_enumerate(), json)


@app.command()
def uncertainty(
    trials: Annotated[int, typer.Option(metavar="N", min=2, help="Of the Monte Carlo.")] = 100_000,
    seed: Annotated[int, typer.Option(metavar="S", min=0, help="Of the Monte Carlo.")] = 0,
    json: Json = False,
) -> None:
    """Say how well the tool's cups are known, in standard deviations of one length (Nubiola, Table 3.1)."""
    from truearm.hexapod.jobs import hexapod_uncertainty

    _print(hexapod_uncertainty(trials=trials, seed=seed), json)


@app.command()
def solve(
    sheet: Annotated[
        list[Path] | None,
        typer.Argument(metavar="SHEET.csv", help="Sheets of 'truearm hexapod plan', filled in, of one robot and tool."),
    ] = None,
    pose: Annotated[int | None, typer.Option(metavar="1..72", help="Without a sheet: which pose.")] = None,
    legs: Annotated[
        str | None, typer.Option(metavar="MM,..", help="Without a sheet: six lengths in the order of the pose's legs.")
    ] = None,
    base: Annotated[str, typer.Option(metavar=_THREE, help="B1-B2, B2-B3, B3-B1.")] = "300,300,300",
    tool: Annotated[str, typer.Option(metavar=_THREE, help="T1-T2, T2-T3, T3-T1.")] = "150,150,150",
    reach: Range = 1.0,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DATA.csv", help="Cups as measurements, for 'truearm calibrate'.")
    ] = None,
    json: Json = False,
) -> None:
    """Find the tool's cups from measured lengths, in the frame of the base fixture."""
    from truearm.engine.base.units import sized_si
    from truearm.hexapod.jobs import hexapod_solve

    found = hexapod_solve(
        sheet or None,
        pose=pose,
        legs=None if legs is None else read_lengths(legs, "legs"),  # type: ignore[arg-type]
        base=read_lengths(base, "base"),  # type: ignore[arg-type]
        tool=read_lengths(tool, "tool"),  # type: ignore[arg-type]
        reach=sized_si(reach, "mm", parameter="reach"),
        out=out,
    )
    _print(found, json)
    if out is not None and not json:
        print_line(f"Written to {out}")


@app.command()
def plan(
    robot: RobotName,
    fixture: Annotated[
        list[str],
        typer.Option(
            metavar="X,Y,Z,TURN",
            help="Base fixture in the robot's base frame: B1 \\[mm] and turn about z \\[deg], or X,Y,Z,QW,QX,QY,QZ. "
            "Again for each place.",
        ),
    ],
    out: Annotated[Path, typer.Option("--out", metavar="SHEET.csv", help="Sheet to fill in.")],
    steps: Annotated[Path | None, typer.Option(metavar="STEPS.txt", help="The same step by step, to print.")] = None,
    tool: ToolName = None,
    distinct: Annotated[bool, typer.Option("--distinct", help="Leave out near-equal poses.")] = False,
    branches: Annotated[
        str | None, typer.Option(metavar="NAME,..", help="Only these, as front-up,back-down.", show_default="all")
    ] = None,
    fourth_cup: Annotated[
        bool, typer.Option("--fourth-cup", help="Plan for a fourth cup below the three others, on all four sides.")
    ] = False,
    attachments: Annotated[
        int, typer.Option(metavar="N", min=1, help="How often the tool is attached; what is measured again then.")
    ] = 1,
    arm_radius: Annotated[float, typer.Option(metavar="MM", min=0.0, help="Of the arm, for room at the bars.")] = 50.0,
    joints: JointsText = None,
    json: Json = False,
) -> None:
    """Plan which configurations of a robot can be measured with the fixture at one place or several."""
    from truearm.engine.base.units import sized_si
    from truearm.hexapod.jobs import hexapod_plan

    found = hexapod_plan(
        robot,
        [_read_fixture(place) for place in fixture],
        out=out,
        steps=steps,
        tool=tool,
        distinct=distinct,
        branches=() if branches is None else branches.split(","),
        fourth_cup=fourth_cup,
        attachments=attachments,
        arm_radius=sized_si(arm_radius, "mm", parameter="arm_radius"),
        joints=joints,  # type: ignore[arg-type]
    )
    _print(found, json)
    if not json:
        print_line(f"Written to {', '.join(str(path) for path in (out, steps) if path is not None)}")


@app.command("world-frame")
def world_frame(
    robot: RobotName,
    touches: Annotated[
        Path, typer.Argument(metavar="TOUCHES.csv", help="Columns cup, joint_1 or axis_1 \\[deg] ..; B1, B2, B3.")
    ],
    base: Annotated[str, typer.Option(metavar=_THREE, help="Measured distances B1-B2, B2-B3, B3-B1.")],
    target: Annotated[str | None, typer.Option(metavar="NAME", help="Cup of the tool that touched.")] = None,
    tool: ToolName = None,
    reach: Range = 1.0,
    json: Json = False,
) -> None:
    """Find the base fixture from the joint positions at its cups and the distances between them."""
    from truearm.engine.base.units import sized_si
    from truearm.hexapod.jobs import hexapod_world_frame

    found = hexapod_world_frame(
        robot,
        touches,
        read_lengths(base, "base"),  # type: ignore[arg-type]
        target=target,
        tool=tool,
        reach=sized_si(reach, "mm", parameter="reach"),
    )
    _print(found, json)


def _print(found: HexapodPoses | HexapodUncertainty | HexapodSolution | HexapodPlan | HexapodFrame, json: bool) -> None:
    if json:
        print_json(found.summary())
    else:
        print_record(found)


def _read_fixture(text: str) -> list[float]:
    """Return x, y, z [m] and what follows, a turn [rad] or a quaternion, of a text in mm and deg."""
    from truearm.engine.base.units import sized_si

    numbers = read_numbers(text, "fixture", "X,Y,Z,TURN in mm and deg, or X,Y,Z,QW,QX,QY,QZ")
    lengths = [sized_si(number, "mm", parameter="fixture") for number in numbers[:3]]
    turn = (
        [sized_si(number, "deg", parameter="fixture") for number in numbers[3:]] if len(numbers) == 4 else numbers[3:]
    )
    return [*lengths, *turn]
