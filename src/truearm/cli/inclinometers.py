"""``--device inclinometers`` of ``truearm plan`` and ``truearm simulate``: other jobs, other words on some options."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from truearm.cli.loading import number_or, read_gravity
from truearm.cli.options import command_line
from truearm.cli.output import print_json, print_line, print_record, progress
from truearm.errors import InputError

#: Options that say nothing for inclinometers.
_NOT_PLANNED: Final = (
    *("objective", "accurate_at", "region", "tools", "frames", "candidates_from", "constraints"),
    *("program", "approach", "speed", "dwell", "wait"),
)
_NOT_SIMULATED: Final = ("noise", "wrench", "wrench_frame", "wrench_at")


def plan_pairs(
    robot: str, poses: str, out: Path, *, model: str, noise: float, pull: float | None, json: bool, **given: Any
) -> None:
    """Plan what inclinometers read: ``truearm plan --device inclinometers``."""
    from truearm.jobs.plan_inclinometers import plan_inclinometers
    from truearm.jobs.texts import read_seed
    from truearm.units import sized_si

    deviation = sized_si(noise, "mm", parameter="noise", deviation=True)
    beside = {name: None if given[name] is False else given[name] for name in _NOT_PLANNED}
    _refuse_beside(beside | {"model": None if model in ("geometric", "tilting") else model})
    lengths = [name for name in ("floor", "clearance") if given[name] is not None]
    more: dict[str, Any] = {name: sized_si(given[name], "mm", parameter=name) for name in lengths}
    with progress() as say:
        pairs = plan_inclinometers(
            robot,
            poses=_even(poses),
            out=out,
            pull=20.0 if pull is None else pull,
            noise=deviation,
            gravity=read_gravity(given["gravity"]),
            home=read_seed(robot, given["home"], given["joints"], "home"),
            command=command_line(),
            progress=say,
            **{name: given[name] for name in ("candidates", "seed", "payload", "joints", "no_floor")},
            **more,
        )
    if json:
        print_json(pairs.summary())
    else:
        print_record(pairs)
        print_line(f"Written: {out}, {out.with_name(f'{out.stem}-ways.csv')}")


def simulate_readings(robot: str, poses: str, *, pull: float | None, gravity: str | None, **given: Any) -> None:
    """Simulate what inclinometers read: ``truearm simulate --device inclinometers``."""
    from truearm.jobs.simulate_inclinometers import simulate_inclinometers

    _refuse_beside({name: given[name] for name in _NOT_SIMULATED})
    with progress() as say:
        read = simulate_inclinometers(
            robot,
            poses=number_or(poses),
            pull=20.0 if pull is None else pull,
            gravity=read_gravity(gravity),
            progress=say,
            **{name: given[name] for name in ("truth", "out", "seed", "payload", "joints")},
        )
    print_record(read)


def _refuse_beside(given: Mapping[str, object]) -> None:
    """Refuse what says nothing for inclinometers; None was not given."""
    for name, came in given.items():
        if came is not None:
            raise InputError(
                "this says nothing for inclinometers", parameter=name, came=str(came), cure=f"Leave `{name}` out."
            )


def _even(text: str) -> int:
    """Return how many configurations a text names."""
    try:
        return int(text)
    except ValueError:
        raise InputError(
            "for inclinometers a number of configurations belongs here",
            parameter="poses",
            came=text,
            allowed="an even number",
        ) from None
