"""``truearm import``: files of other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.cli.options import Commands, command_line
from truearm.cli.output import Json, print_json, print_line, print_record, progress
from truearm.errors import InputError

JointsAreText = Annotated[
    str | None,
    typer.Option(
        "--joints-are",
        metavar="controller|model",
        help="Whose joint positions they are: as the robot's controller shows them, or its model's.",
        show_default="the model's",
    ),
]

app = Commands(
    help="Turn measurement files into the canonical CSV, and a controller's kinematics into a robot file.",
    no_args_is_help=True,
)


@app.command()
def matrices(
    joints: Annotated[Path, typer.Option(metavar="FILE", help="Joint positions, one configuration a row.")],
    targets: Annotated[
        list[str], typer.Option("--target", metavar="NAME=FILE", help="Positions of a target; repeat for each.")
    ],
    angle_unit: Annotated[str, typer.Option(metavar="deg|rad", help="Unit of the joint positions.")],
    length_unit: Annotated[str, typer.Option(metavar="mm|m", help="Unit of the positions.")],
    out: Annotated[Path, typer.Option("--out", metavar="DATA.csv", help="File to write.")],
    references: Annotated[
        list[str] | None,
        typer.Option(
            "--reference",
            metavar="NAME=FILE",
            help="Positions of a fixed point beside the robot; repeat for each.",
        ),
    ] = None,
    joints_are: JointsAreText = None,
) -> None:
    """White-space separated matrices, one configuration a row. A row of zeros or NaN is a missing reading."""
    from truearm.jobs.import_matrices import import_matrices

    imported = import_matrices(
        joints,
        _named(targets, "targets"),
        _named(references or [], "references"),
        angle_unit=angle_unit,
        length_unit=length_unit,
        joints_are=joints_are or "model",  # type: ignore[arg-type]
        out=out,
    )
    print_record(imported)


@app.command()
def table(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A CSV, another delimited text, or an Excel workbook.")],
    mapping: Annotated[
        Path,
        typer.Option(
            "--map",
            metavar="MAPPING.yaml|PRESET",
            help="Which column is what: a file, or one of spatial-analyzer and t-mac.",
        ),
    ],
    out: Annotated[Path, typer.Option("--out", metavar="DATA.csv", help="File to write.")],
    joints: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Second file with the joint positions.", show_default="as the mapping says"),
    ] = None,
    joints_are: JointsAreText = None,
) -> None:
    """Any table of points or poses, by a mapping that says which column is what (`guess` writes one)."""
    from truearm.jobs.import_table import import_table

    imported = import_table(file, mapping, joints=joints, joints_are=joints_are, out=out)  # type: ignore[arg-type]
    print_record(imported)


@app.command()
def guess(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A CSV, another delimited text, or an Excel workbook.")],
    out: Annotated[Path, typer.Option("--out", metavar="MAPPING.yaml", help="File to write; nothing is overwritten.")],
    json: Json = False,
) -> None:
    """Look at a table and write the mapping that it seems to need, for you to confirm. Nothing is imported."""
    from truearm.jobs.import_guess import import_guess

    guessed = import_guess(file, out=out)
    if json:
        print_json(guessed.summary())
    else:
        print_record(guessed)


@app.command()
def robodk(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Calibration or validation measurements, as exported.")],
    out: Annotated[Path, typer.Option("--out", metavar="DATA.csv", help="File to write.")],
    angle_unit: Annotated[
        str | None, typer.Option(metavar="deg|rad", help="Unit of the angles of measured poses.", show_default=False)
    ] = None,
    joints_are: JointsAreText = None,
    delimiter: Annotated[
        str, typer.Option(metavar="comma|semicolon|tab", help="What stands between columns.")
    ] = "comma",
    decimal: Annotated[str, typer.Option(metavar="point|comma", help="The decimal sign.")] = "point",
    json: Json = False,
) -> None:
    """Calibration or validation measurements of RoboDK: joints, measured points and tool points."""
    from truearm.jobs.import_robodk import import_robodk

    imported = import_robodk(
        file,
        angle_unit=angle_unit,  # type: ignore[arg-type]
        joints_are=joints_are or "model",  # type: ignore[arg-type]
        delimiter=delimiter,  # type: ignore[arg-type]
        decimal=decimal,  # type: ignore[arg-type]
        out=out,
    )
    if json:
        print_json(imported.summary())
    else:
        print_record(imported)


@app.command()
def circle(
    scans: Annotated[list[str], typer.Option("--scan", metavar="NAME=IMAGE", help="A scanned page; repeat for each.")],
    points: Annotated[
        list[str],
        typer.Option(metavar="NAME=FILE", help="Joints, angle and height read while it was drawn; one a page."),
    ],
    out: Annotated[Path, typer.Option("--out", metavar="DATA.csv", help="File to write.")],
    dpi: Annotated[
        str | None, typer.Option(metavar="N|X,Y", help="Dots per inch of the scans.", show_default="as the files say")
    ] = None,
    sigma: Annotated[
        float | None, typer.Option(metavar="MM", help="Deviation of radius and height.", show_default="not declared")
    ] = None,
) -> None:
    """Circles that the robot drew with a pencil: scanned pages and the potentiometer's readings."""
    from truearm.jobs.import_circle import import_circle
    from truearm.units import sized_si

    imported = import_circle(
        _named(scans, "scans"),
        _named(points, "points"),
        dpi=_dots(dpi),
        sigma=None if sigma is None else sized_si(sigma, "mm", parameter="sigma", deviation=True),
        out=out,
    )
    print_record(imported)


@app.command()
def sockets(
    file: Annotated[Path, typer.Argument(metavar="TOUCHES.csv", help="Joint positions, and the socket, row by row.")],
    apart: Annotated[
        str, typer.Option(metavar="DISTANCE,SIGMA", help="How far apart the sockets are, with units: 200mm,0.02mm.")
    ],
    ball: Annotated[str, typer.Option(metavar="DIAMETER", help="Of the ball, with its unit: 25mm.")],
    out: Annotated[Path, typer.Option("--out", metavar="DATA.csv", help="File to write.")],
    sigma: Annotated[
        float | None,
        typer.Option(
            metavar="MM", help="How well the ball comes to rest in a socket, a deviation.", show_default="not declared"
        ),
    ] = None,
) -> None:
    """Joint positions of a ball on the flange that was put into two sockets, without any instrument."""
    from truearm.jobs.import_sockets import import_sockets
    from truearm.units import sized_si

    imported = import_sockets(
        file,
        apart=apart,
        ball=ball,
        sigma=None if sigma is None else sized_si(sigma, "mm", parameter="sigma", deviation=True),
        out=out,
    )
    print_record(imported)


@app.command("hand-eye")
def hand_eye(
    file: Annotated[
        Path, typer.Argument(metavar="VIEWS.csv", help="Joint positions, and poses or pictures of the board.")
    ],
    on_flange: Annotated[
        str, typer.Option(metavar="camera|board", help="What moves with the robot; the other one stands beside it.")
    ],
    out: Annotated[Path, typer.Option("--out", metavar="DATA.csv", help="File to write.")],
    board: Annotated[
        str | None,
        typer.Option(
            metavar="SQUARES,SIDE,MARKER,DICTIONARY",
            help="The ChArUco board in the pictures: 14x10,25mm,18mm,5X5_250.",
            show_default="the table holds poses",
        ),
    ] = None,
    scale_sigma: Annotated[
        float | None,
        typer.Option(
            metavar="PPM", help="How well the size of the board is known, a deviation.", show_default="taken as exact"
        ),
    ] = None,
    ahead: Annotated[
        float | None,
        typer.Option(
            metavar="MM",
            help="How far before the camera the target is; that of the first session for every later one.",
            show_default="where the board was on average",
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Poses of a board in a camera, one of them on the flange, or pictures that show it."""
    from truearm.jobs.import_hand_eye import import_hand_eye
    from truearm.units import sized_si, to_si

    imported = import_hand_eye(
        file,
        on_flange=on_flange,  # type: ignore[arg-type]
        board=board,
        scale_sigma=None if scale_sigma is None else to_si(scale_sigma, "ppm"),
        ahead=None if ahead is None else sized_si(ahead, "mm", parameter="ahead"),
        out=out,
    )
    if json:
        print_json(imported.summary())
    else:
        print_record(imported)


@app.command("ur-kinematics")
def ur_kinematics(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="calibration.conf of the controller, or the ROS driver's file.")
    ],
    robot: Annotated[
        str, typer.Option("--robot", metavar="ROBOT", help="The arm's type: a library id such as ur5e, or a file.")
    ],
    out: Annotated[Path, typer.Option("--out", metavar="ROBOT.yaml", help="File to write; nothing is overwritten.")],
    json: Json = False,
) -> None:
    """Write what the controller of a Universal Robots arm computes with as a robot file."""
    from truearm.jobs.import_ur_kinematics import import_ur_kinematics

    imported = import_ur_kinematics(file, robot, out=out)
    if json:
        print_json(imported.summary())
    else:
        print_record(imported)


@app.command()
def ros(
    file: Annotated[Path, typer.Argument(metavar="BAG", help="A .bag file of ROS 1, or the folder of a bag of ROS 2.")],
    out: Annotated[Path, typer.Option("--out", metavar="DATA.csv", help="File to write, and DATA.html beside it.")],
    targets: Annotated[
        list[str] | None,
        typer.Option(
            "--target",
            metavar="NAME=TOPIC",
            help="Topic of points or poses of a target; repeat for each.",
            show_default="the only one",
        ),
    ] = None,
    references: Annotated[
        list[str] | None,
        typer.Option("--reference", metavar="NAME=TOPIC", help="Topic of a point beside the robot; repeat for each."),
    ] = None,
    joint_topic: Annotated[
        str | None,
        typer.Option(metavar="TOPIC", help="Topic of the joint positions.", show_default="the only one"),
    ] = None,
    joint_names: Annotated[
        str | None,
        typer.Option(
            "--joints",
            metavar="NAME,NAME,...",
            help="The robot's joints from base to flange, as the messages call them.",
            show_default="by the numbers at their ends",
        ),
    ] = None,
    prismatic: Annotated[
        str | None, typer.Option(metavar="NAME,...", help="Joints that slide.", show_default="none")
    ] = None,
    joints_are: JointsAreText = None,
    times: Annotated[
        str, typer.Option(metavar="stamp|bag", help="When a message was: by its header, or by the recorder.")
    ] = "stamp",
    still: Annotated[
        float,
        typer.Option(metavar="DEG", help="How far a joint may move in a standstill; one that slides 1 m per rad."),
    ] = 0.02,
    hold: Annotated[float, typer.Option(metavar="S", help="The shortest standstill.")] = 1.0,
    settle: Annotated[
        float, typer.Option(metavar="S", help="What is left out at the beginning and end of a standstill.")
    ] = 0.3,
    json: Json = False,
) -> None:
    """Standstills in a bag of ROS: joint positions, and points or poses of targets. ROS is not needed."""
    from truearm.jobs.import_ros import import_ros
    from truearm.units import sized_si

    with progress() as say:
        imported = import_ros(
            file,
            targets={name: str(topic) for name, topic in _named(targets or [], "targets", "TOPIC").items()} or None,
            references={name: str(t) for name, t in _named(references or [], "references", "TOPIC").items()} or None,
            joint_topic=joint_topic,
            joint_names=_names(joint_names),
            prismatic=_names(prismatic) or (),
            joints_are=joints_are or "model",  # type: ignore[arg-type]
            times=times,  # type: ignore[arg-type]
            still=sized_si(still, "deg", parameter="still"),
            hold=hold,
            settle=settle,
            out=out,
            command=command_line(),
            progress=say,
        )
    if json:
        print_json(imported.summary())
    else:
        print_record(imported)
        print_line(f"Written: {out}, {out.with_suffix('.html')}")


def _names(text: str | None) -> list[str] | None:
    return None if text is None else [name.strip() for name in text.split(",")]


def _dots(text: str | None) -> float | tuple[float, float] | None:
    if text is None:
        return None
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 2):
        raise InputError("a resolution belongs here", parameter="dpi", came=text, allowed="a number, or X,Y")
    return numbers[0] if len(numbers) == 1 else (numbers[0], numbers[1])


def _named(entries: list[str], parameter: str, what: str = "FILE") -> dict[str, Path]:
    named: dict[str, Path] = {}
    for entry in entries:
        name, separator, file = entry.partition("=")
        if not separator or not name or not file:
            raise InputError(
                f"a name and a {what.lower()} belong here", parameter=parameter, came=entry, allowed=f"NAME={what}"
            )
        if name in named:
            raise InputError("this name is given twice", parameter=parameter, came=name)
        named[name] = Path(file)
    return named
