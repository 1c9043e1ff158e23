"""Options as texts: what a robot carries and how it is mounted (``--payload``, ``--gravity``), and notes."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from truearm.errors import InputError

PayloadText = Annotated[
    str | None,
    typer.Option(
        "--payload",
        metavar="MASS,X,Y,Z",
        help='What the flange carries, with its centre of gravity in the flange frame: "2.7kg,50mm,25mm,100mm".',
        show_default="as the robot file says",
    ),
]
GravityText = Annotated[
    str | None,
    typer.Option(
        "--gravity",
        metavar="X,Y,Z",
        help="Free fall in the robot's base frame \\[m/s^2], 0,0,9.81 for a robot that hangs.",
        show_default="as the robot file says",
    ),
]
WrenchText = Annotated[
    str | None,
    typer.Option(
        "--wrench",
        metavar="FX,FY,FZ,MX,MY,MZ",
        help="What acts on the tool besides weight: a force \\[N] at its point and a moment \\[N m], or with units: "
        '"0N,0N,80N,0Nm,0Nm,1.5Nm".',
        show_default="nothing",
    ),
]
WrenchFrameText = Annotated[
    str | None,
    typer.Option(
        "--wrench-frame",
        metavar="base|tool|world|controller",
        help="Whose axes --wrench is given in.",
        show_default="base",
    ),
]
WrenchAtText = Annotated[
    str | None,
    typer.Option(
        "--wrench-at",
        metavar="NAME",
        help="The target on which --wrench acts, or flange.",
        show_default="the only target",
    ),
]
NoteTexts = Annotated[
    list[str] | None,
    typer.Option(
        "--note",
        metavar="KEY=VALUE",
        help="What the result shall say beside the figures: date, serial, operator, instrument, ...; repeatable.",
        show_default=False,
    ),
]

Pull = Annotated[
    float | None,
    typer.Option(
        metavar="N",
        min=0.0,
        help="Of a string or weight on the flange under which inclinometers are read; 0: gravity alone.",
        show_default="20",
    ),
]
JointsText = Annotated[
    str | None,
    typer.Option(
        "--joints",
        metavar="controller|model",
        help="Whose joint positions to write: as the controller shows them (axis_i), or the model's (joint_i).",
        show_default="the controller's where the robot file says that they differ",
    ),
]


def read_notes(texts: list[str] | None) -> dict[str, str] | None:
    """Return the notes that texts such as ``serial=1234`` hold, None for None."""
    if not texts:
        return None
    notes: dict[str, str] = {}
    for text in texts:
        name, given, said = text.partition("=")
        if not given or name.strip() in notes:
            what = "a note was given twice" if given else "a note is a name and a text"
            raise InputError(what, parameter="notes", came=text, allowed="NAME=TEXT, such as serial=1234")
        notes[name.strip()] = said
    return notes


def read_gravity(text: str | None) -> tuple[float, float, float] | None:
    """Return the acceleration of free fall that a text names, None for None."""
    from truearm.units import as_number

    if text is None:
        return None
    numbers = [as_number(part.strip()) for part in text.split(",")]
    if len(numbers) != 3 or any(number is None for number in numbers):
        raise InputError(
            "three numbers belong here", parameter="gravity", came=text, allowed="0,0,-9.81 for a robot that stands"
        )
    x, y, z = (float(number) for number in numbers if number is not None)
    return x, y, z


def number_or(text: str | None) -> Any:
    """Return a number where the text is one, else the text."""
    try:
        return text if text is None else int(text)
    except ValueError:
        return text


def read_train(text: str | None) -> Any:
    """Return a number where the text is one; the job refuses what is neither that nor all."""
    return number_or(text)


def refuse_pull(pull: float | None) -> None:
    """Refuse a pull for devices that are not read under one."""
    if pull is not None:
        raise InputError(
            "only inclinometers are read under a pull",
            parameter="pull",
            came=pull,
            cure="Leave `pull` out, or use `device=inclinometers`.",
        )
