"""What a job is asked for: one frozen object, whose options are declared once.

The declaration of an option makes its check, the option of the command, its help, and its entry in the docstring. So
Python, command, browser and fleets ask in the same way, and a default cannot differ between them. A group of options
that several jobs have is a class that their requests inherit. Modules with requests import nothing heavy.
"""

from __future__ import annotations

import inspect
import shlex
import sys
import textwrap
import warnings
from collections.abc import Callable, Iterator, Mapping
from copy import copy, deepcopy
from dataclasses import MISSING, Field, dataclass, field, fields, replace
from typing import Any, ClassVar, Final, ParamSpec, Protocol, TypeVar, dataclass_transform

from truearm.engine.command.kinds import ByFlags, Kind

#: Namespaces of jobs, by how their names begin.
SPACES: Final = {"hexapod": "hexapod", "import": "read", "iso9283": "iso9283"}
#: What a default is that is compared with what was given.
_PLAIN: Final = (bool, int, float, str, tuple)

R = TypeVar("R", covariant=True)
P = ParamSpec("P")


@dataclass(frozen=True)
class Option:
    """The declaration of an option, beside its name, type and default."""

    kind: Kind  #: What it holds.
    help: str  #: What it is for; other options are named in backticks, by their names in Python.
    metavar: str | None  #: What stands for its value in the help; None for that of the kind.
    word: str | None  #: Of the command line; None for the name, empty for what the command does not have.
    shown: str | bool  #: The default in words, or whether it is shown as it is.
    more: str  #: What only the docstring says.
    needed: bool  #: Whether the command needs it.
    is_argument: bool  #: Whether it is an argument of the command, and no option.
    repeated: bool  #: Whether it belongs to how a result was made, so that it is said again with the command.
    panel: str | None = None  #: Heading under which the help shows it.
    formerly: str = ""  #: An older name, which still works in Python and as a word of the command.

    @property
    def in_command(self) -> bool:
        """Whether the command line has it."""
        return self.word != ""


def option(
    kind: Kind,
    help: str,
    metavar: str | None = None,
    *,
    default: Any,
    word: str | None = None,
    shown: str | bool = True,
    more: str = "",
    needed: bool = False,
    repeated: bool = True,
    kw_only: bool = True,
    is_argument: bool = False,
    panel: str | None = None,
    formerly: str = "",
) -> Any:
    """Declare an option with a default; arguments as in :class:`Option`.

    Args:
        kw_only: Whether Python takes it by its name alone; the command has another as an argument if it has no word.
    """
    argument = is_argument or (not kw_only and word is None)
    declaration = Option(kind, help, metavar, word, shown, more, needed, argument, repeated, panel, formerly)
    return field(default=default, kw_only=kw_only, metadata={"option": declaration})


def required(
    kind: Kind,
    help: str,
    metavar: str | None = None,
    *,
    kw_only: bool,
    word: str | None = None,
    more: str = "",
    repeated: bool = True,
    formerly: str = "",
) -> Any:
    """Declare what a job needs: the command has it as an argument, or as an option if it has a word.

    Args:
        kw_only: Whether Python takes it by its name alone.
    """
    declaration = Option(kind, help, metavar, word, False, more, True, not word, repeated, formerly=formerly)
    return field(kw_only=kw_only, metadata={"option": declaration})


def as_in(group: type[Request], name: str, *, default: Any = MISSING, kw_only: bool = True, **other: Any) -> Any:
    """Declare an option as a group does, but with another default or none, or otherwise shown."""
    declaration: Option = replace(group.__dataclass_fields__[name].metadata["option"], needed=default is MISSING)
    declaration = replace(declaration, is_argument=not kw_only and other.get("word", declaration.word) is None)
    return field(default=default, kw_only=kw_only, metadata={"option": replace(declaration, **other)})


@dataclass_transform(frozen_default=True, kw_only_default=True, field_specifiers=(option, required, as_in))
class Request:
    """What a job is asked for; the method ``run`` of a subclass does it, and its docstring is that of the job."""

    #: Name of the job in Python; empty for a group of options.
    job: ClassVar[str] = ""
    #: Words of the command; None for the name of the job.
    words: ClassVar[str | None] = None
    #: What is done where its job is a flag of the command; it takes some of the same options alone.
    instead: ClassVar[type[Request] | None] = None
    #: The device for which this is asked instead of the request that the command has else; empty for none.
    of_device: ClassVar[str] = ""
    #: Whether the command ends with exit code 3 where its result is not finished.
    judged: ClassVar[bool] = True
    #: What the docstring says under Raises.
    refuses: ClassVar[str] = "For anything that cannot be used, with a message that says what to do."
    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    def __init_subclass__(cls, **settings: Any) -> None:
        super().__init_subclass__(**settings)
        dataclass(frozen=True, eq=False, repr=False)(cls)

    def __post_init__(self) -> None:
        for name, declared in self.options():
            object.__setattr__(self, name, declared.kind.checked(getattr(self, name), name, self.default(name)))
        self.check()

    def check(self) -> None:
        """Refuse what does not go together."""

    def run(self) -> Any:
        """Do what is asked for."""
        raise NotImplementedError

    def result(self) -> Any:
        """Do what is asked for; the result keeps the request, without what only this run needed."""
        result = self.run()
        if hasattr(result, "request"):
            request = copy(self)
            for name, declared in self.options():
                value = getattr(self, name)
                if not (declared.in_command or declared.repeated):
                    object.__setattr__(request, name, self.default(name))
                elif isinstance(value, list | dict) or hasattr(value, "shape"):  # whoever gave it may change it
                    object.__setattr__(request, name, deepcopy(value))
            object.__setattr__(result, "request", request)
        return result

    @classmethod
    def options(cls) -> Iterator[tuple[str, Option]]:
        """Yield the options by their names: what Python takes by position, those of the class, those of its groups."""
        every = {entry.name: entry for entry in fields(cls)}
        first = [name for name, entry in every.items() if not entry.kw_only]
        own = [name for owner in cls.__mro__ for name in vars(owner).get("__annotations__", ()) if name in every]
        for name in dict.fromkeys([*first, *own]):
            yield name, every[name].metadata["option"]

    @classmethod
    def default(cls, name: str) -> Any:
        """Return the default of an option."""
        return cls.__dataclass_fields__[name].default

    @classmethod
    def typed_default(cls, name: str) -> str:
        """Return the default of an option as it is typed."""
        (text,) = dict(cls.options())[name].kind.typed_again(cls.default(name))
        return text

    @classmethod
    def help_text(cls) -> str:
        """Return what the help of the command begins with."""
        return inspect.cleandoc(cls.__doc__ or "")

    @classmethod
    def renamed(cls, named: Mapping[str, Any]) -> dict[str, Any]:
        """Return arguments of the job by the names of today, and warn of older ones."""
        today = {declared.formerly: name for name, declared in cls.options() if declared.formerly}
        for old in [name for name in named if name in today]:
            warnings.warn(f"`{old}` of {cls.job} is `{today[old]}` now.", DeprecationWarning, stacklevel=3)
            if today[old] in named:
                raise TypeError(f"{cls.job}() got both {today[old]} and {old}, its older name")
        return {today.get(name, name): value for name, value in named.items()}

    @classmethod
    def command_words(cls) -> str:
        """Return the words of the command."""
        return cls.words or cls.job.replace("_", "-")

    def given(self) -> Iterator[tuple[str, Option, Any]]:
        """Yield the options that have another value than their default."""
        for name, declared in self.options():
            value, default = getattr(self, name), self.default(name)
            if declared.repeated and value is not default and not (isinstance(default, _PLAIN) and value == default):
                yield name, declared, value

    def as_python(self) -> str:
        """Return the call in Python."""
        from truearm.engine.command.arguments import written_in_python

        words = []
        for name, _, value in self.given():
            text = written_in_python(value)
            words.append(text if not self.__dataclass_fields__[name].kw_only else f"{name}={text}")
        space, _, short = self.job.partition("_")
        name = f"{SPACES[space]}.{short}" if space in SPACES else self.job
        return f"truearm.{name}({', '.join(words)})"

    def as_command(self) -> str:
        """Return the command as it can be typed again: what was given, and a place for where results go."""
        arguments, words = list[str](), list[str]()
        for name, declared, value in self.given():
            flag = flag_of(name, declared)
            if name == "out":
                continue
            if declared.is_argument:
                arguments += declared.kind.typed_again(value)
            elif isinstance(declared.kind, ByFlags):
                words.append(f"--{declared.kind.flags[value][0]}")
            elif value is True:
                words.append(flag)
            else:
                for text in declared.kind.typed_again(value):
                    words += [flag, text]
        out = dict(self.options()).get("out")
        writes = out is not None and (out.needed or getattr(self, "out", None) is not None)
        words += [flag_of("out", out), metavar_of(out)] if out is not None and writes else []
        device = ["--device", self.of_device] if self.of_device else []
        return shlex.join(["truearm", *self.command_words().split(), *arguments, *device, *words])

    def __repr__(self) -> str:
        return self.as_python()


def metavar_of(declared: Option) -> str:
    """Return what stands for a value in the help."""
    return declared.metavar or declared.kind.metavar


def flag_of(name: str, declared: Option) -> str:
    """Return how the command line calls an option, or an argument by its metavar."""
    if declared.is_argument:
        return metavar_of(declared).strip("[]")
    return f"--{(declared.word or name).replace('_', '-')}"


class Runs(Protocol[R]):
    """A request that does what is asked for."""

    def run(self) -> R:
        """Do it."""


def job(request: Callable[P, Runs[R]]) -> Callable[P, R]:
    """Return the function that makes a request and runs it."""
    request_class: Any = request

    def run(*values: P.args, **named: P.kwargs) -> R:
        result: R = request_class(*values, **request_class.renamed(named)).result()
        return result

    frame = sys._getframe(1)
    run.__name__ = run.__qualname__ = request_class.job
    run.__module__ = frame.f_globals["__name__"]
    taken = inspect.signature(request_class).parameters
    ordered = [taken[name] for name, _ in request_class.options()]
    signature = inspect.Signature(ordered, return_annotation=request_class.run.__annotations__["return"])
    run.__signature__ = signature  # type: ignore[attr-defined]
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in signature.parameters.values()}
    run.__annotations__["return"] = signature.return_annotation
    run.__doc__ = docstring(request_class)
    run.request = request_class  # type: ignore[attr-defined]
    return run


def docstring(request: type[Request]) -> str:
    """Return the docstring of a job, in the style of NumPy."""
    parts, options = [inspect.cleandoc(request.__doc__ or "")], [*request.options()]
    parts += ["", "Parameters", "----------"] if options else []
    for name, declared in options:
        parts += [name, _indented(_entry(declared, request.default(name)))]
    parts += ["", "Raises", "------", "InputError", _indented(request.refuses)] if request.refuses else []
    return "\n".join(parts)


def _indented(text: str) -> str:
    return textwrap.fill(text, 116, initial_indent="    ", subsequent_indent="    ", break_on_hyphens=False)


def _entry(declared: Option, default: Any) -> str:
    """Return what the docstring says of an option."""
    unit = f" [{declared.kind.unit}]" if declared.kind.unit else ""
    text = f"{declared.help.removesuffix('.')}{unit}."
    if allowed := declared.kind.allowed:
        text += f" {allowed[0].upper()}{allowed[1:]}."
    if default is None and isinstance(declared.shown, str):
        text += f" None: {declared.shown}."
    return f"{text} {declared.more}".strip()
