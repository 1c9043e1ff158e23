"""The command ``truearm``: its commands by their words, and how it ends."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from importlib import import_module
from typing import Annotated, Any, Final, NoReturn, TextIO

import typer

from truearm.engine.base.errors import InputError, is_one_line, printable
from truearm.engine.base.version import __version__
from truearm.engine.command.options import CommandError, Commands, command_of

#: Every command by its words, in the order of the help, and the job that it runs.
COMMANDS: Final = {
    "check": "truearm.checking.check.check",
    "calibrate": "truearm.calibration.calibrate.calibrate",
    "tilting": "truearm.inclinometers.jobs.tilting",
    "validate": "truearm.validation.jobs.validate",
    "distances": "truearm.validation.jobs.distances",
    "compensate": "truearm.compensation.jobs.compensate",
    "ik": "truearm.robot_files.jobs.inverse",
    "plan": "truearm.planning.plan.plan",
    "measure": "truearm.measuring.measure.measure",
    "poses": "truearm.planning.poses.poses",
    "path": "truearm.compensation.jobs.path",
    "axes": "truearm.axis_circles.axes.axes",
    "tolerance": "truearm.validation.jobs.tolerance",
    "lines": "truearm.validation.jobs.lines",
    "influence": "truearm.simulation.jobs.influence",
    "sphere": "truearm.validation.jobs.sphere",
    "simulate": "truearm.simulation.jobs.simulate",
    "devices": "truearm.simulation.jobs.devices",
    "import matrices": "truearm.importing.jobs.import_matrices",
    "import table": "truearm.importing.jobs.import_table",
    "import guess": "truearm.importing.jobs.import_guess",
    "import robodk": "truearm.importing.jobs.import_robodk",
    "import circle": "truearm.drawn_circle.import_circle.import_circle",
    "import sockets": "truearm.importing.jobs.import_sockets",
    "import hand-eye": "truearm.board.import_hand_eye.import_hand_eye",
    "import ur-kinematics": "truearm.robot_files.jobs.import_ur_kinematics",
    "import ros": "truearm.bags.import_ros.import_ros",
    "hexapod enumerate": "truearm.hexapod.jobs.hexapod_enumerate",
    "hexapod uncertainty": "truearm.hexapod.jobs.hexapod_uncertainty",
    "hexapod solve": "truearm.hexapod.jobs.hexapod_solve",
    "hexapod plan": "truearm.hexapod.jobs.hexapod_plan",
    "hexapod world-frame": "truearm.hexapod.jobs.hexapod_world_frame",
    "iso9283 plan": "truearm.iso9283.jobs.iso9283_plan",
    "iso9283 simulate": "truearm.iso9283.jobs.iso9283_simulate",
    "iso9283 evaluate": "truearm.iso9283.jobs.iso9283_evaluate",
    "robots": "truearm.robot_files.jobs.robots",
    "show": "truearm.robot_files.jobs.show",
    "convert": "truearm.robot_files.jobs.convert",
    "export": "truearm.robot_files.jobs.export",
    "export-robodk": "truearm.robot_files.jobs.export_robodk",
    "new-robot": "truearm.starting.jobs.new_robot",
    "study": "truearm.starting.study.study",
    "fleet": "truearm.fleets.fleet.fleet",
    "example": "truearm.starting.jobs.example",
    "demo": "truearm.starting.jobs.demo",
    "studio": "truearm.studio.command.studio",
}
#: Jobs that a command runs instead for devices of their own.
OF_DEVICES: Final[Mapping[str, tuple[str, ...]]] = {
    "plan": ("truearm.inclinometers.jobs.plan_inclinometers",),
    "simulate": ("truearm.inclinometers.jobs.simulate_inclinometers",),
}
#: What groups of commands are for, by their word.
GROUPS: Final = {
    "import": "Turn measurement files into the canonical CSV, and a controller's kinematics into a robot file.",
    "hexapod": "Measure poses with one ballbar between three cups on the tool and three on the base.",
    "iso9283": "Test a robot by the criteria of ISO 9283: plan, simulate, evaluate.",
}

# A calibration's matrices are small: a second BLAS thread gains nothing on a quiet machine and waits for its turn on
# a busy one. NumPy reads this when it is first imported, which is after here.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"truearm {__version__}")
        raise typer.Exit


def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and stop.")
    ] = False,
) -> None:
    pass


def program(*asked: str) -> Commands:
    """Return the program with the command, or the group of commands, that some words ask for.

    It has all where they ask for none: to load all takes longer than many of them run.
    """
    app = Commands(
        name="truearm",
        help="Make a serial robot accurate: identify the real robot from measurements and prove how good it is.",
        callback=_root,
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    groups = dict[str, Commands]()
    of_word = [words for words in COMMANDS if words.split()[:1] == [*asked[:1]]]
    for words in [words for words in of_word if words.split() == [*asked[:2]]] or of_word or COMMANDS:
        group, _, name = words.rpartition(" ")
        if group and group not in groups:
            groups[group] = Commands(help=GROUPS[group], no_args_is_help=True)
            app.add_typer(groups[group], name=group)
        groups.get(group, app).command(name)(_function(words))
    return app


def _function(words: str) -> Callable[..., None]:
    first, *others = (_named(dotted) for dotted in (COMMANDS[words], *OF_DEVICES.get(words, ())))
    return command_of(first.request, *(other.request for other in others)) if hasattr(first, "request") else first


def _named(dotted: str) -> Any:
    module, _, name = dotted.rpartition(".")
    return getattr(import_module(module), name)


def main() -> None:
    """Run the command; what cannot be used ends with one message and exit code 2."""
    try:
        _refuse_unprintable(sys.argv[1:])
        try:
            program(*sys.argv[1:])(prog_name="truearm")
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
