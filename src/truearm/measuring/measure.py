"""What the measuring of a plan is asked for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

from truearm.engine.base.errors import InputError, is_one_line
from truearm.engine.command.groups import (
    ByMapping,
    Carrying,
    Constrained,
    Drawn,
    Instrument,
    Long,
    OfPlan,
    OfRobot,
    OfTruth,
    Repeatable,
    SeenBy,
)
from truearm.engine.command.kinds import Callback, File, Names, Number, Text, Whole
from truearm.engine.command.request import as_in, job, option, required

if TYPE_CHECKING:
    from truearm.engine.motion.constraints import Constraints
    from truearm.engine.robot.robot import Robot
    from truearm.measuring.open_campaign import OpenCampaign
    from truearm.measuring.result import Measured

Source = Literal["device", "watch", "listen"]
#: What belongs to each source.
_OF: Final[Mapping[Source, tuple[str, ...]]] = {
    "device": ("truth", "noise", "seed", "disturbed", "drift", "payload", "constraints"),
    "watch": ("mapping",),
    "listen": ("token",),
}
#: What each source is, where it is not given.
_CALLED: Final[Mapping[Source, str]] = {"device": "virtual device", "watch": "folder", "listen": "port"}
_VIRTUAL: Final = "Virtual instrument"
_REAL: Final = "Real instrument"
_LONGEST_NAME: Final = 100
_FEWEST_AND_MOST_OF_A_TOKEN: Final = (16, 200)


def _silent(line: str) -> None:
    """Tell nobody."""


class _Points(Names):
    """Names of points, each once."""

    def check(self, value: Any, name: str) -> Any:
        """Refuse what are no names, or one twice."""
        names = super().check(value, name)
        typed = [str(text) for text in value]
        if len(typed) > len(names):
            twice = next(text for text in names if typed.count(text) > 1)
            raise InputError("a point is named twice", parameter=name, came=twice, cure="Name each once.")
        for point in names:
            if not is_one_line(point) or len(point) > _LONGEST_NAME or point != point.strip():
                raise InputError(
                    "a name belongs here",
                    parameter=name,
                    came=point,
                    allowed=f"one line of up to {_LONGEST_NAME} characters",
                )
        return names


class _Folder(File):
    def check(self, value: Any, name: str) -> Any:
        """Refuse what is none."""
        if isinstance(value, str) and not value:  # a variable of the shell that is not set
            raise InputError("no folder is given", parameter=name, came=value)
        return super().check(value, name)


class _Token(Text):
    """What a program sends first."""

    def check(self, value: Any, name: str) -> Any:
        """Refuse what keeps nobody out."""
        text = super().check(value, name)
        fewest, most = _FEWEST_AND_MOST_OF_A_TOKEN
        if not fewest <= len(text) <= most or not all(c.isascii() and (c.isalnum() or c in "-_") for c in text):
            raise InputError(
                "this is no token that keeps others out",
                parameter=name,
                allowed=f"{fewest} to {most} letters, digits, - and _",
                cure="Leave it out: then one is made.",
            )
        return text


class Measure(OfRobot, OfPlan, Carrying, Repeatable, Long):
    """Go through a plan with an instrument, reading by reading; run again, it goes on where it stopped.

    Every reading is on disk before the next one is asked for, in the log readings.csv. It is kept or set aside for
    reasons of the instrument alone: nothing here knows how well it fits. Ctrl-C stops it, and the result says what is
    there, whether the plan was finished or not.
    """

    job = "measure"
    judged = False
    refuses = (
        "If anything cannot be used, the folder holds the measuring of another plan, or the log cannot be written."
    )
    out: str | Path = required(File("DIR"), "Folder for log, measurements and report.", kw_only=True, word="out")
    device: str | None = as_in(
        SeenBy, "device", default=None, panel=_VIRTUAL, shown=False, more="A plan that shows it nothing is refused."
    )
    truth: Robot | str | Path | None = as_in(OfTruth, "truth", default=None, shown="random", panel=_VIRTUAL)
    noise: float | None = as_in(Instrument, "noise", default=None, shown="the deviation of the device", panel=_VIRTUAL)
    seed: int | None = as_in(Drawn, "seed", default=None, shown="0", panel=_VIRTUAL)
    disturbed: float | None = option(
        Number(metavar="SHARE", low=0.0, high=0.9),
        "Of readings that go wrong, up to 0.9.",
        default=None,
        shown="0",
        panel=_VIRTUAL,
        more="A share of them has a broken beam, an arm that still moves, or too much scatter.",
    )
    drift: float | None = option(
        Number("mm", low=0.0), "How far the instrument moves till the end.", default=None, shown="0", panel=_VIRTUAL
    )
    constraints: Constraints | str | Path | None = as_in(Constrained, "constraints", default=None, panel=_VIRTUAL)
    watch: str | Path | None = option(
        _Folder("DIR"),
        "Readings from a folder into which software writes.",
        default=None,
        shown=False,
        panel=_REAL,
        more="It writes files, or rows at the end of files.",
    )
    mapping: str | Path | None = as_in(
        ByMapping,
        "mapping",
        default=None,
        panel=_REAL,
        more="As for :func:`truearm.import_table`; the joint positions are the plan's, so that the entry ``joints`` "
        "may be left out.",
    )
    listen: int | None = option(
        Whole("PORT", high=65535),
        "Readings from programs of this machine; 0: any free port.",
        default=None,
        shown=False,
        panel=_REAL,
        more="They send them to this port of 127.0.0.1.",
    )
    token: str | None = option(
        _Token("TOKEN"),
        "Which they send first.",
        default=None,
        shown="a new one",
        panel=_REAL,
        repeated=False,
        more="That is told once.",
    )
    targets: Sequence[str] | None = option(
        _Points(example="names of points", commas=False),
        "Measured at each configuration.",
        default=None,
        word="target",
        shown=False,
        more="None: those of the device or robot, else those that the mapping fixes. A plan that says in its column "
        "``reads`` which of them the instrument sees is followed.",
    )
    nests: Sequence[str] | None = option(
        _Points(example="names of points", commas=False),
        "Fixed point beside the robot.",
        default=None,
        word="nest",
        shown=False,
        more="They are measured at the start, along the way and at the end. None: the mapping's ``references``, or "
        "none.",
    )
    every: int = option(Whole(low=1, high=10_000), "Configurations between two rounds of the nests.", default=10)
    most_deviation: float | None = option(
        Number("mm", low=0.0),
        "Largest scatter of a sample.",
        default=None,
        shown="by the virtual device",
        more="A real one is asked for nothing.",
    )
    most_settling: float | None = option(
        Number("mm", low=0.0),
        "Between the halves of a dwell.",
        default=None,
        shown="by the virtual device",
        more="A real one is asked for nothing.",
    )
    fewest_samples: int | None = option(
        Whole(low=1, high=1_000_000),
        "Of a dwell.",
        default=None,
        shown="by the virtual device",
        more="A real one is asked for nothing.",
    )
    about: str | Path | None = option(
        File("ABOUT.yaml"),
        "Serial numbers, reflector, air.",
        default=None,
        shown=False,
        more="Of the schema ``truearm-about/1``.",
    )
    timeout: float | None = option(
        Number("s", metavar="SECONDS", low=0.0),
        "End after so long without a reading.",
        default=None,
        shown="never",
        formerly="wait",
        more="None waits until all is measured, or Ctrl-C.",
    )
    tell: Callable[[str], None] = option(
        Callback(),
        "Called with a line for each reading, and for what could not be read",
        default=_silent,
        word="",
        repeated=False,
    )

    @property
    def source(self) -> Source:
        """Where readings come from."""
        return next(source for source in _OF if getattr(self, source) is not None)

    def check(self) -> None:
        """Refuse no source or several, and what belongs to another one."""
        sources = [source for source in _OF if getattr(self, source) is not None]
        belonging = [(of, name) for of, names in _OF.items() for name in names if getattr(self, name) is not None]
        if belonging and not sources:
            of, name = belonging[0]
            raise InputError(f"no {_CALLED[of]} is given, and `{name}` belongs to one", parameter=of, cure="Name it.")
        if len(sources) != 1:
            raise InputError(
                "readings come from one source" if sources else "nobody says where readings come from",
                parameter=", ".join(sources) or "device, watch, listen",
                allowed="a virtual device, a folder to watch, or a port to listen on",
                cure="Keep one of them." if sources else "Give one of them.",
            )
        for of, name in belonging:
            if of != sources[0]:
                raise InputError(
                    f"this belongs to `{of}`, and readings come from `{sources[0]}`",
                    parameter=name,
                    cure="Leave it out.",
                )

    def run(self) -> Measured:
        """Measure."""
        from truearm.measuring.measuring import measured

        return measured(self)


measure = job(Measure)


def open_campaign(plan: str | Path, robot: Robot | str | Path, out: str | Path, **asked: Any) -> OpenCampaign:
    """Open the measuring of a plan; keywords as for :func:`truearm.measure`, and refusals."""
    from truearm.measuring.open_campaign import opened

    return opened(Measure(plan, robot, out=out, **Measure.renamed(asked)))
