"""Every option by its declaration: what it refuses, how it is typed, and that no option is declared twice."""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import fields
from typing import Any

import numpy as np
import pytest
from tests.expecting import refused
from typer.testing import CliRunner

import truearm
from truearm import JOBS
from truearm.engine.base.errors import InputError
from truearm.engine.base.units import from_si, to_si
from truearm.engine.command.kinds import Choice, Number, Whole
from truearm.engine.command.options import Commands, command_of
from truearm.engine.command.request import Option, Request, flag_of
from truearm.engine.command.texts import read_region

REQUESTS: dict[str, type[Request]] = {
    job: getattr(truearm, job).request for job in JOBS if hasattr(getattr(truearm, job), "request")
}


def declared(job: str, name: str) -> Option:
    return dict(REQUESTS[job].options())[name]


def beyond(kind: Number | Whole) -> list[float]:
    """Return numbers at the edges that are just not allowed."""
    if isinstance(kind, Whole):
        return [kind.low - 1, *([] if kind.high is None else [kind.high + 1])]
    low = [kind.low - 1e-6 * max(1.0, abs(kind.low))] if math.isfinite(kind.low) else []
    return [*low, *([kind.low] if kind.above else []), *([kind.high * 1.001] if math.isfinite(kind.high) else [])]


def in_si(kind: Number | Whole, number: float) -> float:
    return to_si(number, kind.at_edges.partition("/")[0]) if kind.is_converted else number


@pytest.mark.parametrize("job", REQUESTS)
def test_what_is_out_of_range_is_refused_with_what_is_allowed(job: str) -> None:
    for name, one in REQUESTS[job].options():
        wrong: list[Any] = ["nothing-of-this-name"] if isinstance(one.kind, Choice) else []
        if isinstance(one.kind, Number | Whole):
            wrong = [in_si(one.kind, n) if isinstance(one.kind, Number) else int(n) for n in beyond(one.kind)]
        for value in wrong:
            with pytest.raises(InputError) as refusal:
                one.kind.check(value, name)
            assert (refusal.value.parameter, bool(refusal.value.allowed)) == (name, True), (job, name, value)
            if isinstance(one.kind, Number) and value:
                shown = from_si(value, one.kind.at_edges.partition("/")[0]) if one.kind.is_converted else value
                assert f"{shown:g}" in str(refusal.value.came), (job, name, value)
        assert one.kind.metavar or one.word == "" or one.kind.typed is bool, (job, name)


@pytest.mark.parametrize("job", REQUESTS)
def test_a_default_is_typed_and_read_again(job: str) -> None:
    for name, one in REQUESTS[job].options():
        default = REQUESTS[job].default(name)
        assert one.help.endswith(".") or not one.in_command, (job, name)
        if default in (None, ()) or callable(default) or not one.in_command or one.kind.typed is bool or one.needed:
            continue
        (text,) = one.kind.typed_again(default)
        again = one.kind.check(one.kind.read(one.kind.typed(text), name), name)
        same = pytest.approx(default, rel=1e-15) if isinstance(default, float) else type(again)(default)
        assert again == same, (job, name)


def declared_apart() -> tuple[dict[str, set[Any]], dict[str, set[str]]]:
    """Return the kinds and sentences of options by their names, and these names by words of the command."""
    names: dict[str, set[Any]] = defaultdict(set)
    words: dict[str, set[str]] = defaultdict(set)
    for request in REQUESTS.values():
        for name, one in request.options():
            names[name].add((id(one.kind), one.help))
            if not one.is_argument:
                words[flag_of(name, one)].add(name)
    return names, words


def test_an_option_is_declared_once() -> None:
    """Requests inherit it from a group; a name that means two things is two names."""
    for request in REQUESTS.values():
        assert {one.name for one in fields(request)} == {name for name, _ in request.options()}
    for declared in declared_apart():
        assert {name: found for name, found in declared.items() if len(found) > 1 and name not in TWICE} == {}


#: Names and words of the command that are declared several times, and why.
TWICE = dict(  # noqa: C408 - a name in quotes goes with the job of that name, where a feature is deleted
    data="what was measured: lines need names in it, a study a folder of it",
    file="the file that is read or written: each format has its own",
    model="the same models; of these each job takes what it can",
    noise="plans divide by it, and count what a model leaves",
    out="a file or a folder, as the job writes",
    plan="what the plan of the same kind has written",
    poses="how many, or a file of them",
    references="read from files, or from topics",
    targets="read from files or topics, or named alone",
    wrench="programs may have a file of them",
) | {"--program": "a path is written in several languages", "--target": "one target, or several"}


OLD = [(job, name, one.formerly) for job in REQUESTS for name, one in REQUESTS[job].options() if one.formerly]


@pytest.mark.parametrize(("job", "name", "old"), OLD)
def test_an_older_name_still_works_and_says_the_new_one(job: str, name: str, old: str) -> None:
    request, one = REQUESTS[job], declared(job, name)
    assert old not in dict(request.options())
    with pytest.warns(DeprecationWarning, match=f"`{old}` of {job} is `{name}` now"):
        assert request.renamed({old: 1}) == {name: 1}
    with pytest.warns(DeprecationWarning, match=old), pytest.raises(TypeError, match=f"both {name} and {old}"):
        getattr(truearm, job)(**{old: 1, name: 1})
    if not one.is_argument:
        app = Commands()
        app.command(request.job)(command_of(request))
        told = CliRunner().invoke(app, [f"--{old}=x", "--no-such-option"]).stderr
        assert told.startswith(f"--{old} is {flag_of(name, one)} now; the old word will go.\n")
        assert "No such option: --no-such-option" in told
        refused = CliRunner().invoke(app, [f"--{old}=x", flag_of(name, one), "x"]).exception
        assert str(refused) == f"--{old} is {flag_of(name, one)} now: give one of them."
        assert f"--{old} " not in CliRunner().invoke(app, ["--help"]).stdout


def test_units_are_those_at_the_edges() -> None:
    assert Number("mm").read(5.0, "x") == 0.005
    assert Number("mm").typed_again(0.005) == ["5"]
    assert from_si(Number("deg").read(90.0, "x"), "deg") == 90.0
    assert Number("%").read(50.0, "x") == 50.0
    assert np.ravel(read_region("300..600, -200..200,100..400") or []) == pytest.approx([0.3, 0.6, -0.2, 0.2, 0.1, 0.4])
    for text in ("300..600", "300..600,1..2,3", "300..x,1..2,3..4"):
        refused("region", "three ranges in mm belong here", read_region, text)


def test_a_result_keeps_what_was_asked_for_whatever_becomes_of_it() -> None:
    leans = np.full(6, 1e-5)
    result = truearm.tolerance("kr5", 0.05, lean=leans)  # type: ignore[arg-type]
    leans[:] = 1.0
    assert result.request.as_command() == "truearm tolerance kr5 --depth 50 --lean 0.01,0.01,0.01,0.01,0.01,0.01"
    assert truearm.show(truearm.load_robot("irb120")).request.as_command() == "truearm show ROBOT"
