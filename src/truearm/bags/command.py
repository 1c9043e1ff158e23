"""``truearm import ros``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truearm.engine.command.options import (
    JointsAreText,
    Json,
    _named,
    command_line,
    print_json,
    print_line,
    print_record,
    progress,
)


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
        str | None, typer.Option(metavar="TOPIC", help="Topic of the joint positions.", show_default="the only one")
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
    from truearm.bags.import_ros import import_ros
    from truearm.engine.base.units import sized_si

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
