"""Options that commands share, how refusals name them, and what commands print."""

from __future__ import annotations

import inspect
import json
import typing
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext, suppress
from contextvars import ContextVar
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer
from typer.core import TyperArgument, TyperCommand

from truearm.engine.base.errors import InputError, listed, printable, with_parameters, with_short_words
from truearm.engine.command.kinds import ByFlags
from truearm.engine.command.request import Option, Request, flag_of

if TYPE_CHECKING:
    from truearm.engine.document.records import Record


C = TypeVar("C", bound=Callable[..., Any])

#: The command that runs.
_running: ContextVar[typer.Context | None] = ContextVar("_running", default=None)


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
        today: Mapping[str, str] = getattr(self.callback, "today", {})
        words = {arg.partition("=")[0] for arg in args}
        for old in [word for word in today if word in words]:
            if today[old] in words:
                raise CommandError(f"{old} is {today[old]} now: give one of them.")
            with suppress(OSError):  # a closed or full stream costs the note alone
                print_line(f"{old} is {today[old]} now; the old word will go.", err=True)
        args = [today.get(word, word) + sign + value for word, sign, value in (arg.partition("=") for arg in args)]
        try:
            return super().parse_args(ctx, args)
        except typer.BadParameter as error:
            faults = getattr(error.__cause__, "errors", None)  # of pydantic, by which Typer checks values
            if faults is None or error.param is None:
                raise
            from truearm.engine.base.schemas import refused_value

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

    def command(self, name: str | None = None, **settings: Any) -> Callable[[C], C]:
        """Add a command."""
        return super().command(name, cls=Command, **settings)


def spelled(text: str) -> str:
    """Return a text of the library with options of the running command instead of parameters in backticks."""

    def spell(name: str, value: str | None) -> str:
        if value is None:
            return _option(name)
        return _flag(f"{name}_{value}") or f"{_option(name)} {value}"

    return with_parameters(text, spell)


def _is_typed(context: typer.Context, name: str) -> bool:
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


# What commands print: results on standard output, progress on standard error.
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on standard output and nothing else there.")]

Details = Annotated[bool, typer.Option("--details", help="Print all that is to be known, not only the gravest.")]


def print_json(content: Any) -> None:
    """Print one JSON object."""
    typer.echo(json.dumps(content, indent=2, allow_nan=False))


@contextmanager
def progress() -> Iterator[Callable[[str], None]]:
    """Show on standard error what is being done, where somebody is looking."""
    from rich.console import Console
    from rich.text import Text

    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda _: None
        return
    with console.status("starting") as status:
        yield lambda words: status.update(Text(with_short_words(printable(words))))


def print_record(record: Record, *, details: bool = True) -> None:
    """Print a result in words and figures: all of it, or what fits a first screen."""
    from truearm.engine.document.records import first_screen

    for line in record.lines() if details else first_screen(record):
        print_line(spelled(line))


def print_line(line: str, *, err: bool = False) -> None:
    """Print one line, whatever names of files and targets are in it."""
    typer.echo(with_short_words(printable(line)), err=err)


# The command of a request: its options are made from their declarations.


def command_of(request: type[Request], *of_devices: type[Request]) -> Callable[..., None]:
    """Return the command of a request as Typer takes it: a function with an argument for each option.

    Args:
        of_devices: Requests that are made instead for their devices. The command has the options of all.
    """
    instead, others = request.instead, {device.of_device: device for device in of_devices}
    declared, owners = dict[str, Option](), dict[str, type[Request]]()
    for source in (request, *others.values()):
        for name, option in source.options():
            declared.setdefault(name, option)
            owners.setdefault(name, source)

    def run(**typed: Any) -> None:
        as_json, details = typed.pop("json", False), typed.pop("details", True)
        wanted, typed = others.get(typed.get("device", ""), request), _with_flags(typed, declared)
        if instead is not None and typed.pop(instead.job):
            wanted, typed = instead, _only_those(typed, instead, declared)
        own = dict(wanted.options())
        values = {name: own[name].kind.read(value, name) for name, value in _values_of(wanted, others, typed).items()}
        with (
            progress() if "progress" in own else nullcontext() as say,
            _shown_if_refused(as_json=as_json, details=details),
        ):
            asked = wanted(**values)
            context = {"command": asked.as_command(), "progress": say, "tell": partial(print_line, err=as_json)}
            result = replace(asked, **{name: value for name, value in context.items() if name in own}).result()
        _show(result, as_json=as_json, details=details)
        out = getattr(asked, "out", None)
        written = "" if out is None else result.written_at(str(out))
        if written and not as_json:
            print_line(written)
        if wanted.judged and not result.finished:
            raise typer.Exit(3)

    asked = [parameter for name in declared for parameter in _parameters(name, declared, owners[name].default(name))]
    flags = []
    if instead is not None:
        flags.append(_flag_parameter(instead.job, instead.job, instead.help_text().partition("\n")[0]))
    flags += [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=False, annotation=kind)
        for name, kind in (("details", Details), ("json", Json))
    ]
    every = [*sorted(asked, key=lambda parameter: parameter.default is not inspect.Parameter.empty), *flags]
    run.__signature__ = inspect.Signature(every)  # type: ignore[attr-defined]
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in every}
    run.__doc__ = spelled_by(request.help_text(), declared)
    run.__name__ = request.job
    words = {
        f"--{option.formerly}": flag_of(name, option)
        for name, option in declared.items()
        if option.formerly and not option.is_argument
    }
    run.today = words  # type: ignore[attr-defined]
    return run


def _with_flags(typed: Mapping[str, Any], declared: Mapping[str, Option]) -> dict[str, Any]:
    """Return what was typed, with the values of options that have flags for them."""
    values = dict(typed)
    for name, option in declared.items():
        if isinstance(option.kind, ByFlags):
            chosen = [value for value in option.kind.flags if values.pop(f"{name}_{value}")]
            if len(chosen) > 1:
                named = ", ".join(f"{name}_{value}" for value in chosen)
                raise InputError("only one of them can hold", parameter=named, cure="Leave one out.")
            if chosen:
                values[name] = chosen[0]
    return values


def _only_those(values: Mapping[str, Any], instead: type[Request], declared: Mapping[str, Option]) -> dict[str, Any]:
    """Return what was given of the options that another request takes, or refuse what it does not take."""
    own, context = dict(instead.options()), _running.get()
    for name in values:
        if name not in own and not declared[name].is_argument and context is not None and _is_typed(context, name):
            raise InputError("only one of them can hold", parameter=f"{instead.job}, {name}", cure="Leave one out.")
    return {name: value for name, value in values.items() if name in own}


def _flag_parameter(name: str, word: str, help: str) -> inspect.Parameter:
    annotation = Annotated[bool, typer.Option(f"--{word}", help=help)]
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=False, annotation=annotation)


def _parameters(name: str, declared: Mapping[str, Option], default: Any) -> Iterator[inspect.Parameter]:
    """Yield what the command takes of an option: nothing, the option, or a flag for each value."""
    option = declared[name]
    if not option.in_command:
        return
    if isinstance(option.kind, ByFlags):
        for value, (word, text) in option.kind.flags.items():
            yield _flag_parameter(f"{name}_{value}", word, text)
    else:
        yield _parameter(name, option, default, declared)


def _values_of(request: type[Request], others: Mapping[str, type[Request]], typed: Mapping[str, Any]) -> dict[str, Any]:
    """Return what was typed, by option; refuse options of the requests for other devices."""
    context, own, device = _running.get(), dict(request.options()), typed.get("device")
    values = {
        name: value
        for name, value in typed.items()
        if value is not None
        and (context is None or name not in context.params or _is_typed(context, name))
        and (name != "device" or name in own)
    }
    for name, value in values.items():
        if name in own:
            continue
        if "device" not in own:
            raise InputError(f"this says nothing for {device}", parameter=name, came=value, cure=f"Leave `{name}` out.")
        of = [device for device, other in others.items() if name in dict(other.options())]
        raise InputError(
            f"this is said of {listed(of)} alone",
            parameter=name,
            came=value,
            cure=f"Leave `{name}` out, or use `device={of[0]}`.",
        )
    return values


def _parameter(name: str, declared: Option, default: Any, others: Mapping[str, Option]) -> inspect.Parameter:
    """Return an option as an argument of a function that Typer reads."""
    kind, flag = declared.kind, flag_of(name, declared)
    metavar = declared.metavar or kind.metavar
    text = spelled_by(declared.help, others).replace("[", "\\[")
    if typing.get_origin(kind.typed) is list and not declared.is_argument:
        text = f"{text if text.endswith('...') else text.removesuffix('.')}; repeatable."
    if kind.at_edges and kind.at_edges.upper() not in metavar:
        text = f"{text.removesuffix('.')} \\[{kind.at_edges}]."
    typed = kind.typed
    if declared.is_argument:
        shown: Any = declared.shown if isinstance(declared.shown, str) else False
        info: Any = typer.Argument(metavar=metavar, help=text, show_default=shown)
    else:
        is_shown = isinstance(declared.shown, str) or (declared.shown and default not in (None, ()))
        shown = declared.shown if is_shown and not declared.needed else False
        shown = spelled_by(shown, others) if isinstance(shown, str) else shown
        only: dict[str, Any] = {} if typed is bool else {"metavar": metavar, "show_default": shown}
        info = typer.Option(flag, help=text, rich_help_panel=declared.panel, **only)
    preset: Any
    if declared.needed:
        preset = inspect.Parameter.empty
    elif default in (None, ()):
        typed, preset = typed | None, None
    else:
        (preset,) = (default,) if typed is bool else kind.typed_again(default)
        preset = typed(preset) if typed in (int, float) else preset
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=preset, annotation=Annotated[typed, info])


def spelled_by(text: str, declared: Mapping[str, Option]) -> str:
    """Return a text with the words of the command instead of parameters in backticks."""

    def spell(name: str, value: str | None) -> str:
        flag = flag_of(name, declared[name]) if name in declared else f"--{name.replace('_', '-')}"
        return flag if value is None else f"{flag} {value}"

    return with_parameters(text, spell)


@contextmanager
def _shown_if_refused(*, as_json: bool, details: bool) -> Iterator[None]:
    """Show a result also where it is not written, because a better one stays."""
    try:
        yield
    except InputError as refusal:
        if refusal.result is not None:
            _show(refusal.result, as_json=as_json, details=details)
        raise


def _show(result: Any, *, as_json: bool, details: bool) -> None:
    if as_json:
        print_json(result.as_json())
    else:
        print_record(result, details=details)
