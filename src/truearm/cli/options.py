"""How the command names what jobs call by their parameters."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping
from contextvars import ContextVar
from functools import wraps
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, TypeVar, cast

import typer
from typer.core import TyperArgument, TyperCommand

from truearm.errors import InputError, with_parameters

JointsAreText = Annotated[
    str | None,
    typer.Option(
        "--joints-are",
        metavar="controller|model",
        help="Whose joint positions they are: as the robot's controller shows them, or its model's.",
        show_default="the model's",
    ),
]


C = TypeVar("C", bound=Callable[..., Any])

#: The command that runs.
_running: ContextVar[typer.Context | None] = ContextVar("_running", default=None)

#: Parameters that say where results go or how they are printed: running again elsewhere is the same run.
_OUTPUT = ("out", "replace", "json", "token")


class CommandError(Exception):
    """What a command ends with: a message that names its options."""


class Command(TyperCommand):
    """A command whose refusals name its options, where those of jobs name their parameters.

    The parameters of a command's function are called like those of its job.
    """

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """Return the arguments as their metavar has them: [ROBOT] may be left out."""
        named = [str(p.metavar) for p in self.params if isinstance(p, TyperArgument) and p.metavar]
        return ["[OPTIONS]", *named]

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Return what is left of the words; a value that is no number is told as jobs tell it."""
        if "--out=" in args or ("--out", "") in pairwise(args):  # a variable of the shell that is not set
            raise CommandError("--out: no file or folder is given; got ''.")
        try:
            return super().parse_args(ctx, args)
        except typer.BadParameter as error:
            faults = getattr(error.__cause__, "errors", None)  # of pydantic, by which Typer checks values
            if faults is None or error.param is None:
                raise
            from truearm.schemas import refused_value

            option = error.param.metavar if isinstance(error.param, TyperArgument) else max(error.param.opts, key=len)
            raise CommandError(str(refused_value(faults()[0], str(option)))) from error

    def invoke(self, ctx: Any) -> Any:
        """Run the command; a refusal of the job is told in the words of the command line."""
        mark = _running.set(ctx)
        try:
            return super().invoke(ctx)
        except InputError as error:
            raise CommandError(spelled(error.message(_option))) from error
        finally:
            _running.reset(mark)


class Commands(typer.Typer):
    """A group of commands that are all a :class:`Command`."""

    def command(self, name: str | None = None, **how: Any) -> Callable[[C], C]:
        """Add a command."""
        return super().command(name, cls=Command, **how)


def spelled(text: str) -> str:
    """Return a text of the library with options of the running command instead of parameters in backticks."""

    def one(name: str, value: str | None) -> str:
        if value is None:
            return _option(name)
        return _flag(f"{name}_{value}") or f"{_option(name)} {value}"

    return with_parameters(text, one)


def command_line() -> str:
    """Return the running command as it can be typed again: what was given, and a place for where results go."""
    context = _running.get()
    if context is None:
        return ""
    words, end = context.command_path.split(), list[str]()
    for parameter in context.command.params:
        name, value = parameter.name or "", context.params.get(parameter.name or "")
        if isinstance(parameter, TyperArgument):
            words += map(str, value if isinstance(value, list | tuple) else [value])
        elif name in _OUTPUT:
            end = [max(parameter.opts, key=len), str(parameter.metavar)] if name == "out" else end
        elif value is True and _given(context, name):
            words.append(max(parameter.opts, key=len))
        elif value is not None and value is not False and _given(context, name):
            for entry in value if isinstance(value, list | tuple) else [value]:
                words += [max(parameter.opts, key=len), str(entry)]
    return shlex.join([*words, *end])


def _given(context: typer.Context, name: str) -> bool:
    source = context.get_parameter_source(name)
    return source is not None and source.name != "DEFAULT"


def _flag(name: str) -> str | None:
    """Return the option that stands for one value of a parameter, where the running command has one."""
    context = _running.get()
    known = {} if context is None else {parameter.name: parameter for parameter in context.command.params}
    return max(known[name].opts, key=len) if name in known else None


def _option(name: str) -> str:
    """Return how the running command calls a parameter of a job."""
    context = _running.get()
    for parameter in context.command.params if context is not None else ():
        if parameter.name == name and isinstance(parameter, TyperArgument):
            return str(parameter.metavar or name).strip("[]")
        if parameter.name == name:
            return max(parameter.opts, key=len)
    return f"--{name.replace('_', '-')}"


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


def by_device(command: C, others: Mapping[str, Callable[..., None]]) -> C:
    """Return a command that leaves some devices, by their names, to other functions with the same parameters."""

    @wraps(command)
    def chosen(**given: Any) -> None:
        others.get(given["device"], command)(**given)

    return cast("C", chosen)
