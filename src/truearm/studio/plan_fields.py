"""What a plan of measurements is asked for: the fields of the page Plan, as options of the command say them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Final

from pydantic import BaseModel, ConfigDict, Field

from truearm.engine.base.units import sized_si
from truearm.engine.command.texts import read_region, read_speed
from truearm.planning.plan import PlanPoses

_Text = Annotated[str, Field(min_length=1)]
_Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
#: What the job takes where nothing is said.
UNSAID: Final[dict[str, Any]] = {
    **{name: PlanPoses.default(name) for name in ("model", "candidates", "seed")},
    "noise": float(PlanPoses.typed_default("noise")),
}


class PlanFields(BaseModel):
    """The entry ``plan`` of a project file: names are parameters of :func:`truearm.plan`.

    Texts and lengths are as the command takes them, in mm, deg, percent and s. What is None is not said.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    poses: _Text = "60"
    candidates_from: _Text | None = None
    objective: _Text | None = None
    accurate_at: _Text | None = None
    region: _Text | None = None
    model: _Text = UNSAID["model"]
    candidates: Annotated[int, Field(strict=True, ge=1)] = UNSAID["candidates"]
    device: _Text | None = None
    noise: _Number = UNSAID["noise"]
    seed: Annotated[int, Field(strict=True, ge=0)] = UNSAID["seed"]
    floor: _Number | None = None
    no_floor: bool = False
    clearance: _Number | None = None
    home: _Text | None = None
    program: _Text | None = None
    approach: bool = False
    speed: _Text | None = None
    dwell: _Number | None = None
    wait: _Text | None = None
    out: _Text | None = None

    @property
    def place(self) -> str:
        """Where the plan is written in the project: a file, or a folder where a program drives it."""
        return self.out or ("plan.csv" if self.program is None else "plan")

    @property
    def at_program(self) -> bool:
        """Whether the robot shall be accurate at the targets of a program."""
        return self.accurate_at is not None and not self.accurate_at.lower().endswith(".csv")

    def said(self, places: Mapping[str, str], constraints: str | None, payload: str | None) -> dict[str, Any]:
        """Return what is given to the command beside robot and poses, by the names of parameters, in its order.

        Args:
            places: Files of tools and frames, by the names of these parameters.
            constraints, payload: As the job takes them.
        """
        given = {
            "candidates_from": self.candidates_from,
            "objective": self.objective,
            "accurate_at": self.accurate_at,
            "region": self.region,
            "tools": places.get("tools"),
            "frames": places.get("frames"),
            "model": self.model,
            "candidates": self.candidates if self.candidates_from is None else None,
            "device": self.device,
            "constraints": constraints,
            "noise": self.noise,
            "seed": self.seed,
            "payload": payload,
            "floor": self.floor,
            "no_floor": self.no_floor or None,
            "clearance": self.clearance,
            "home": self.home,
            "program": self.program,
            "approach": self.approach or None,
            "speed": self.speed,
            "dwell": self.dwell,
            "wait": self.wait,
        }
        return {name: value for name, value in given.items() if value is not None and value != UNSAID.get(name)}


def plan_arguments(said: dict[str, Any]) -> dict[str, Any]:
    """Return what :func:`truearm.plan` takes of what its command is given: lengths in m.

    Raises:
        InputError: If a text or a length is none, with the parameter.
    """
    given = dict(said)
    for name in ("noise", "floor", "clearance"):
        if name in given:
            given[name] = sized_si(given[name], "mm", parameter=name, deviation=name == "noise")
    if "region" in given:
        given["region"] = read_region(given["region"])
    if "speed" in given:
        given["speed"] = read_speed(given["speed"])
    return given
