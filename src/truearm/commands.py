"""The command ``truearm``: every command of every feature, each of them thin."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from contextlib import suppress
from copy import copy
from typing import Annotated, NoReturn, TextIO

import typer
from typer.main import get_command_name
from typer.models import CommandInfo

from truearm.axis_circles.axes import Axes
from truearm.bags.import_ros import ImportRos
from truearm.board.import_hand_eye import ImportHandEye
from truearm.calibration.calibrate import Calibrate
from truearm.checking.check import Check
from truearm.compensation.jobs import Compensate, FollowPath
from truearm.drawn_circle.import_circle import ImportCircle
from truearm.engine.base.errors import InputError, is_one_line, printable
from truearm.engine.base.version import __version__
from truearm.engine.command.options import CommandError, Commands, add, command_of
from truearm.fleets.fleet import CalibrateFleet
from truearm.hexapod.command import app as hexapod
from truearm.importing.jobs import GuessMapping, ImportMatrices, ImportRoboDK, ImportSockets, ImportTable
from truearm.inclinometers.jobs import FindTilting, PlanInclinometers, SimulateInclinometers
from truearm.iso9283.command import app as iso9283
from truearm.measuring.measure import Measure
from truearm.planning.plan import PlanPoses
from truearm.planning.poses import PosesOfSet
from truearm.robot_files.jobs import (
    ConvertRobot,
    ExportRobot,
    ExportToRobodk,
    FindJoints,
    ImportUrKinematics,
    ListRobots,
    ShowRobot,
)
from truearm.simulation.jobs import FindInfluence, ListDevices, Simulate
from truearm.starting.command import study_help
from truearm.starting.jobs import Demonstrate, NewRobot, WriteExample
from truearm.starting.study import MakeStudy
from truearm.studio.command import studio
from truearm.validation.jobs import JudgeDistances, JudgeSphere, JudgeTolerance, TestLines, Validate

# A calibration's matrices are small: a second BLAS thread gains nothing on a quiet machine and waits for its turn on
# a busy one. NumPy reads this when it is first imported, which is after here.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

app = Commands(
    name="truearm",
    help="Make a serial robot accurate: identify the real robot from measurements and prove how good it is.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"truearm {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and stop.")
    ] = False,
) -> None:
    pass


importing = Commands(
    help="Turn measurement files into the canonical CSV, and a controller's kinematics into a robot file.",
    no_args_is_help=True,
)
add(importing, ImportMatrices)
add(importing, ImportTable)
add(importing, GuessMapping)
add(importing, ImportRoboDK)
add(importing, ImportCircle)
add(importing, ImportSockets)
add(importing, ImportHandEye)
add(importing, ImportUrKinematics)
add(importing, ImportRos)

add(app, Check)
add(app, Calibrate)
add(app, FindTilting)
add(app, Validate)
add(app, JudgeDistances)
add(app, Compensate)
add(app, FindJoints)
app.command()(command_of(PlanPoses, PlanInclinometers))
add(app, Measure)
add(app, PosesOfSet)
add(app, FollowPath)
add(app, Axes)
add(app, JudgeTolerance)
add(app, TestLines)
add(app, FindInfluence)
add(app, JudgeSphere)
app.command()(command_of(Simulate, SimulateInclinometers))
add(app, ListDevices)
app.add_typer(importing, name="import")
app.add_typer(hexapod, name="hexapod")
app.add_typer(iso9283, name="iso9283")
add(app, ListRobots)
add(app, ShowRobot)
add(app, ConvertRobot)
add(app, ExportRobot)
add(app, ExportToRobodk)
add(app, NewRobot)
app.command(help=study_help())(command_of(MakeStudy))
add(app, CalibrateFleet)
add(app, WriteExample)
add(app, Demonstrate)
app.command()(studio)


def main() -> None:
    """Run the command; what cannot be used ends with one message and exit code 2."""
    try:
        _refuse_unprintable(sys.argv[1:])
        try:
            _asked_for(sys.argv[1:])(prog_name="truearm")
        finally:
            sys.stdout.flush()
    except (InputError, CommandError) as error:
        _end(f"{error}")
    except BrokenPipeError:
        _end_of_pipe()
    except SystemExit as stop:
        if isinstance(stop.__context__, BrokenPipeError):  # Typer has its own exit code for it
            _end_of_pipe()
        _say_of_stop(stop)
        raise
    except OSError as error:
        _drop(sys.stdout)
        _end(f"{error.filename or 'output'}: {error.strerror or error}.")
    except UnicodeError as error:
        _end(f"a text cannot be written ({error}).")
    except KeyboardInterrupt:
        sys.exit(130)
    except MemoryError:
        _end("there is not enough memory for this. Take less data at a time, or a larger computer.")
    except RecursionError:
        _end("something in the input is nested too deep. Look for very many brackets in its files.")
    except ValueError as error:
        from numpy.linalg import LinAlgError

        if not isinstance(error, LinAlgError):
            raise
        _end(f"the equations cannot be solved ({error}). Look at the data with 'truearm check'.")


def _asked_for(words: Sequence[str]) -> typer.Typer:
    """Return the command with the one part that is asked for: to make all of them takes longer than many run."""
    part = copy(app)
    for name in words[:1]:
        part.registered_commands = [c for c in app.registered_commands if (c.name or _spelled(c)) == name]
        part.registered_groups = [g for g in app.registered_groups if g.name == name]
    return part if part.registered_commands or part.registered_groups else app


def _spelled(command: CommandInfo) -> str:
    return get_command_name(command.callback.__name__ if command.callback else "")


def _refuse_unprintable(words: Sequence[str]) -> None:
    """Refuse what could not be written into results, before any long work, nor shown in messages."""
    for word in filter(None, words):
        if not is_one_line(word.replace(" ", "x")):
            halved = any("\ud800" <= character <= "\udfff" for character in word)
            raise InputError(
                "this is not UTF-8 text" if halved else "this holds a control character",
                where="command line",
                came=word,
                allowed="text that can be shown and written",
                cure="Rename the file, or correct the word.",
            )


def _say_of_stop(stop: SystemExit) -> None:
    """Print what a job says where it was stopped by Ctrl-C, of which Typer keeps the exit code alone."""
    cause: BaseException | None = stop
    while cause is not None and not isinstance(cause, KeyboardInterrupt):
        cause = cause.__context__
    if cause is not None and cause.args:
        _print_error(f"{cause}")


def _end(message: str) -> NoReturn:
    _print_error(f"truearm: {message}")
    sys.exit(2)


def _print_error(message: str) -> None:
    try:
        print(printable(message), file=sys.stderr, flush=True)  # noqa: T201
    except OSError:  # a pipe that nobody reads, a full disk: the exit code is all that is left
        _drop(sys.stderr)


def _end_of_pipe() -> NoReturn:
    """End as a program does whose reader has seen enough: quietly, with the exit code that shells have for it."""
    _drop(sys.stdout)
    _drop(sys.stderr)
    sys.exit(141)


def _drop(stream: TextIO) -> None:
    """Let go of output that could not be written: Python would try, and fail, once more when it ends."""
    with suppress(OSError, ValueError):  # where it is no file, or closed
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
