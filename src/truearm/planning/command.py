"""``truearm plan`` and ``truearm poses``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from truearm.engine.command.options import (
    Ahead,
    Floor,
    GravityText,
    JointsText,
    Json,
    Nearest,
    PayloadText,
    Pull,
    TargetName,
    TipText,
    command_line,
    end_on_error,
    print_json,
    print_line,
    print_record,
    progress,
    read_gravity,
    refuse_pull,
)
from truearm.engine.command.texts import read_lengths, read_numbers, read_poses, read_region, read_seed, read_speed


def plan(
    robot: Annotated[
        str, typer.Argument(metavar="ROBOT", help="A library id, a robot file, calibrated or not, or a URDF.")
    ],
    poses: Annotated[str, typer.Option(metavar="N|auto", help="How many configurations; auto lets O1 decide.")],
    out: Annotated[
        Path,
        typer.Option("--out", metavar="PLAN", help="CSV file to write, its page beside it; a folder with --program."),
    ],
    candidates_from: Annotated[
        str | None,
        typer.Option("--from", metavar="DATA.csv", help="Choose among those of a file or a plan.", show_default=False),
    ] = None,
    objective: Annotated[
        str | None,
        typer.Option(
            metavar="INDEX",
            help="O1, O2, O3, O4 or O5; error: the error with --for or --region.",
            show_default="O1, or error with --for or --region",
        ),
    ] = None,
    accurate_at: Annotated[
        Path | None,
        typer.Option(
            "--for",
            metavar="PROGRAM|POSES.csv",
            help="Where the robot shall be accurate: a robot program, or flange poses as for 'truearm ik'.",
            show_default="everywhere",
        ),
    ] = None,
    region: Annotated[
        str | None,
        typer.Option(
            metavar="X..X,Y..Y,Z..Z",
            help='The same as a box for the flange in the base frame in mm: "300..600,-200..200,100..400".',
            show_default="everywhere",
        ),
    ] = None,
    tools: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Where the tools of the program are.", show_default=False)
    ] = None,
    frames: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Where the frames of the program are.", show_default=False)
    ] = None,
    model: Annotated[
        str, typer.Option(metavar="MODEL", help="What will be identified, as in truearm calibrate, without auto.")
    ] = "geometric",
    candidates: Annotated[
        int, typer.Option(metavar="N", min=1, help="Random configurations to choose from, without --from.")
    ] = 5000,
    device: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="An instrument of 'truearm devices', or inclinometers; not with --from.",
            show_default="one that reads every target everywhere",
        ),
    ] = None,
    constraints: Annotated[
        Path | None, typer.Option(metavar="FILE", help="What a configuration must keep.", show_default=False)
    ] = None,
    noise: Annotated[
        float, typer.Option(metavar="MM", help="Deviation of a coordinate about a well identified model.")
    ] = 0.1,
    seed: Annotated[int, typer.Option(metavar="S", min=0, help="Of the random configurations.")] = 0,
    payload: PayloadText = None,
    gravity: GravityText = None,
    joints: JointsText = None,
    floor: Annotated[
        float | None,
        typer.Option(
            metavar="MM",
            help="Height of the floor in the base frame, kept clear.",
            show_default="0; where the robot hangs, its mounting surface",
        ),
    ] = None,
    no_floor: Annotated[
        bool, typer.Option("--no-floor", help="There is no floor and no mounting surface to keep clear.")
    ] = False,
    clearance: Annotated[
        float | None,
        typer.Option(
            metavar="MM",
            help="Room that the arm keeps to floor, boxes and its own links, on the ways too.",
            show_default="50",
        ),
    ] = None,
    home: Annotated[
        str | None,
        typer.Option(
            metavar="DEG,DEG,..",
            help="The safe configuration to start and end in (mm if sliding), of the kind that is written.",
            show_default="one is found",
        ),
    ] = None,
    program: Annotated[
        str | None,
        typer.Option(
            metavar="rapid|krl|fanuc|urscript|inform|val3",
            help="Write a program that drives the plan; --out is then a folder.",
            show_default=False,
        ),
    ] = None,
    approach: Annotated[
        bool,
        typer.Option("--approach", help="Every joint comes to each configuration from one side, by a stop before it."),
    ] = False,
    speed: Annotated[
        str | None,
        typer.Option(
            metavar="MM/S[,%]", help="Its highest speed of the tip, and of the joints.", show_default="250,10"
        ),
    ] = None,
    dwell: Annotated[
        float | None, typer.Option(metavar="S", help="How long it stands in each configuration.", show_default="2")
    ] = None,
    wait: Annotated[
        str | None,
        typer.Option(
            metavar="WAIT",
            help='What it waits for then: time, for nothing more; operator, who starts it again; "input 3,300s", a '
            "digital input, at most for so long.",
            show_default="time",
        ),
    ] = None,
    pull: Pull = None,
    json: Json = False,
) -> None:
    """Choose the configurations that tell most, in a measuring order, and say how accurate the result will be.

    Without a device every target on the robot's tool is measured at each of them. Writes a CSV file, its page, the
    ways between and a sheet for the operator; with --program a folder with these and a program that drives the plan.
    """
    from truearm.engine.base.units import sized_si
    from truearm.planning.plan import plan as run

    refuse_pull(pull)
    with progress() as say:
        planned = run(
            robot,
            poses=read_poses(poses),
            out=out,
            candidates_from=candidates_from,
            objective=objective,
            accurate_at=accurate_at,
            region=read_region(region),
            tools=tools,
            frames=frames,
            model=model,
            candidates=candidates,
            device=device,
            constraints=constraints,
            noise=sized_si(noise, "mm", parameter="noise", deviation=True),
            seed=seed,
            payload=payload,
            gravity=read_gravity(gravity),
            joints=joints,  # type: ignore[arg-type]
            floor=None if floor is None else sized_si(floor, "mm", parameter="floor"),
            no_floor=no_floor,
            clearance=None if clearance is None else sized_si(clearance, "mm", parameter="clearance"),
            home=read_seed(robot, home, joints, "home"),
            program=program,
            approach=approach,
            speed=read_speed(speed),
            dwell=dwell,
            wait=wait,
            command=command_line(),
            progress=say,
        )
    if json:
        print_json(planned.summary())
        return
    print_record(planned)
    if planned.program is None:
        ends = [".html", *([] if planned.tour is None else ["-ways.csv", "-sheet.html"])]
        print_line(f"Written: {out}, {', '.join(str(out.with_name(out.stem + end)) for end in ends)}")
    else:
        print_line(f"Written to {out}: {', '.join(planned.contents())}")


def poses(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="A library id, a robot file or a URDF.")],
    set: Annotated[str, typer.Option("--set", metavar="NAME", help="p1-p5, iso-cube, diagonal, 118 or sphere.")],
    out: Annotated[
        Path, typer.Option("--out", metavar="SET.csv", help="File to write, with SET-poses.csv and SET.html beside it.")
    ],
    centre: Annotated[
        str | None,
        typer.Option(metavar="X,Y,Z", help="Of the cube in the base frame \\[mm].", show_default="the largest cube"),
    ] = None,
    side: Annotated[
        float | None,
        typer.Option(metavar="MM", help="Of the cube; the diameter of the sphere.", show_default="the largest cube"),
    ] = None,
    ahead: Ahead = "+x",
    nearest: Nearest = 0.0,
    floor: Floor = 0.0,
    plane: Annotated[str, typer.Option(metavar="CORNERS", help="Diagonal plane, for sets on one.")] = "C1-C2-C7-C8",
    count: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, help="Poses of diagonal, 118 and sphere.", show_default="25, 118 and 50"),
    ] = None,
    target: TargetName = None,
    tip: TipText = None,
    orientation: Annotated[
        str, typer.Option(metavar="free|down|QW,QX,QY,QZ", help="Of the tip in the base frame.")
    ] = "free",
    seed: Annotated[int, typer.Option(metavar="S", min=0, help="Of poses in any orientation.")] = 0,
    joints: JointsText = None,
    json: Json = False,
) -> None:
    """Write a set of poses: those of ISO 9283 in a cube, or those of a ballbar on a sphere.

    SET.csv has their joint positions, and room for readings; SET-poses.csv has the poses, for truearm ik.
    """
    from truearm.engine.base.units import sized_si
    from truearm.planning.poses import PAGE, POSES
    from truearm.planning.poses import poses as run

    found = run(
        robot,
        set,
        centre=None if centre is None else read_lengths(centre, "centre"),  # type: ignore[arg-type]
        side=None if side is None else sized_si(side, "mm", parameter="side"),
        ahead=ahead,  # type: ignore[arg-type]
        nearest=sized_si(nearest, "mm", parameter="nearest"),
        floor=sized_si(floor, "mm", parameter="floor"),
        plane=plane,
        count=count,
        target=target,
        tip=None if tip is None else read_lengths(tip, "tip"),  # type: ignore[arg-type]
        orientation=_orientation(orientation),
        seed=seed,
        joints=joints,  # type: ignore[arg-type]
        out=out,
        command=command_line(),
    )
    if json:
        print_json(found.summary())
    else:
        print_record(found)
        print_line(f"Written: {out}, {out.with_name(out.stem + POSES)}, {out.with_suffix(PAGE)}")
    end_on_error(found.warnings)


def _orientation(text: str) -> Any:
    """Return numbers where the text has them; the job refuses what is neither these nor a name."""
    return read_numbers(text, "orientation", "free, down, or a quaternion w,x,y,z") if "," in text else text
