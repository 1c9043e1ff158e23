"""What measuring a plan is asked for: the fields of the page Measure, as options of the command say them."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field

from truearm.engine.base.errors import InputError
from truearm.engine.base.units import sized_si, to_si
from truearm.measuring.measure import Measure
from truearm.measuring.session import LONGEST_ROUND, MOST_SAMPLES

_Text = Annotated[str, Field(min_length=1)]
_Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
_Whole = Annotated[int, Field(strict=True)]

Source = Literal["virtual instrument", "watched folder", "port of this machine"]
#: Where readings come from: the parameter of the job that says it, and those that belong to it.
SOURCES: Final[dict[Source, tuple[str, ...]]] = {
    "virtual instrument": ("device", "truth", "noise", "seed", "disturbed", "drift", "constraints"),
    "watched folder": ("watch", "mapping"),
    "port of this machine": ("listen",),
}
_LENGTHS: Final = ("noise", "drift", "most_deviation", "most_settling")


class MeasureFields(BaseModel):
    """The entry ``measure`` of a project file: names are parameters of :func:`truearm.measure`.

    Lengths are in mm, and names of points stand in one text with commas between them. What is None is not said; of
    the parameters of the sources those of the chosen one count.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    plan: _Text | None = None
    source: Source = "virtual instrument"
    device: _Text = "tracker"
    truth: _Text | None = None
    noise: _Number | None = None
    seed: Annotated[_Whole, Field(ge=0)] = 0
    disturbed: _Number | None = None
    drift: _Number | None = None
    constraints: _Text | None = None
    watch: _Text | None = None
    mapping: _Text | None = None
    listen: Annotated[_Whole, Field(ge=0, le=65535)] = 0
    targets: _Text | None = None
    nests: _Text | None = None
    every: Annotated[_Whole, Field(ge=1, le=LONGEST_ROUND)] = Measure.default("every")
    most_deviation: _Number | None = None
    most_settling: _Number | None = None
    fewest_samples: Annotated[_Whole, Field(ge=1, le=MOST_SAMPLES)] | None = None
    about: _Text | None = None
    out: _Text = "measured"

    def planned(self) -> str:
        """Return the name of the plan.

        Raises:
            InputError: If none is chosen.
        """
        if self.plan is None:
            raise InputError(
                "no plan is chosen", parameter="plan", cure="Choose a CSV file; the page Plan writes one: plan.csv."
            )
        return self.plan

    def said(self, payload: str | None) -> dict[str, Any]:
        """Return what is given to the command beside plan, robot and folder, by names of parameters, in its order.

        Args:
            payload: What a virtual robot carries, as the job takes it.

        Raises:
            InputError: If a folder shall be watched, and none is named.
        """
        if self.source == "watched folder" and self.watch is None:
            raise InputError(
                "no folder is given",
                parameter="watch",
                cure="Write into the field Folder the name of the project's folder into which software writes rows.",
            )
        virtual = self.source == "virtual instrument"
        given = {
            **{name: getattr(self, name) for name in SOURCES[self.source]},
            "payload": payload if virtual else None,
            "targets": names_of(self.targets),
            "nests": names_of(self.nests),
            "every": None if self.every == Measure.default("every") else self.every,
            "most_deviation": self.most_deviation,
            "most_settling": self.most_settling,
            "fewest_samples": self.fewest_samples,
            "about": self.about,
        }
        if virtual:
            given["seed"] = self.seed or None
        return {name: value for name, value in given.items() if value is not None}


def names_of(text: str | None) -> tuple[str, ...] | None:
    """Return the names in a text with commas between them; None if it says nothing."""
    names = tuple(name.strip() for name in (text or "").split(",") if name.strip())
    return names or None


def measure_arguments(said: dict[str, Any]) -> dict[str, Any]:
    """Return what :func:`truearm.measure` takes of what its command is given: lengths in m.

    Raises:
        InputError: If a length is none, with the parameter.
    """
    given = dict(said)
    for name in _LENGTHS:
        if name in given:
            deviation = name == "noise" and bool(given[name])
            given[name] = (
                sized_si(given[name], "mm", parameter=name, deviation=True) if deviation else to_si(given[name], "mm")
            )
    return given


def measure_command(plan: str, robot: str, said: dict[str, Any]) -> str:
    """Return the command that does the same in the project's folder, as the report shows it."""
    return Measure(plan, robot, out="DIR", **measure_arguments(said)).as_command()
