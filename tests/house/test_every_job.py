"""What holds for every job: it refuses what it cannot use, naming the parameter, and its result speaks for itself."""

from __future__ import annotations

import ast
import inspect
import json
import math
import pkgutil
import re
import typing
from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields, is_dataclass
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from itertools import product
from pathlib import Path
from typing import Any, get_args, get_type_hints

import numpy as np
import pytest
from tests.arms import ARMS
from tests.expecting import refused
from tests.house.examples import EXAMPLES

import truearm
from truearm import JOBS
from truearm.engine.base.errors import InputError
from truearm.engine.command.request import SPACES
from truearm.engine.data.dataset import Dataset
from truearm.engine.document.records import Record
from truearm.engine.robot.effects import EFFECTS
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.robot import Robot
from truearm.engine.twin.devices import DEVICES

ROOT = Path(__file__).parents[2]
#: Jobs that take numbers, and are fast.
COUNTING = ("calibrate", "plan", "simulate", "lines", "tolerance", "hexapod_uncertainty", "hexapod_solve", "compensate")


class Odd:
    """Nothing that a job knows."""


def function(job: str) -> Any:
    return getattr(truearm, job)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("contract")


@cache
def parameters(job: str) -> dict[str, inspect.Parameter]:
    return dict(inspect.signature(function(job)).parameters)


@cache
def hints_of(job: str) -> dict[str, Any]:
    """Return the types of a job's parameters and result, those that its requests import for types alone included."""
    names = dict(vars(import_module(JOBS[job]))) | {"np": np}
    request = getattr(function(job), "request", None)
    for module in {owner.__module__ for owner in request.__mro__[:-1]} if request else ():
        tree = ast.parse(Path(import_module(module).__file__ or "").read_text())
        typed = [node.body for node in tree.body if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test)]
        exec(compile(ast.Module([line for body in typed for line in body], []), module, "exec"), names)
        names = dict(vars(import_module(module))) | names
    return get_type_hints(function(job), names)


def kinds(job: str, name: str) -> set[Any]:
    """Return the types that a parameter takes, unions opened."""
    hint = hints_of(job)[name]

    def opened(hint: Any) -> Iterator[Any]:
        origin = typing.get_origin(hint)
        if hint is Any or origin is None:
            yield hint
        elif origin is typing.Literal:
            yield str
        elif str(origin).endswith(("Union'>", "UnionType'>")) or origin is typing.Union:
            for part in get_args(hint):
                yield from opened(part)
        else:
            yield origin

    return set(opened(hint))


def misspelt(text: str) -> str:
    return text[:-1] + ("x" if text[-1] != "x" else "y")


def bad_values(job: str, name: str, good: Any) -> Iterator[tuple[str, Any]]:
    """Give what a parameter must refuse, from the types it takes and a value that works."""
    takes = kinds(job, name)
    yield "wrong type", Odd()
    if type(None) not in takes and parameters(job)[name].default is not None:
        yield "None", None
    texts = takes & {str, Path}
    if not texts:
        yield "a text", "twelve"
    if int in takes or float in takes:
        yield "True", True
        for text in ("nan", "inf", "-inf"):
            yield text, float(text)
        if name == "seed":
            yield "negative", -1
        if float in takes or name != "seed":  # a seed may have any number of digits
            yield "beyond floats", 10**400
        if float not in takes:
            yield "a fraction", 1.5
            if name != "seed":
                yield "beyond memory", 10**13
    elif bool in takes:
        yield "1", 1
    else:
        yield "a number", 12.5
    if str in takes and isinstance(good, str) and re.fullmatch(r"[a-zA-Z][-a-z0-9]*", good):
        yield "misspelt", misspelt(good)
    yield "a dict", {0: 1.0, 1: 2.0, 2: 3.0}
    yield "a set", {0.0, 1.0, -9.81}
    yield "a zero-dimensional array", np.array(1.0)
    yield "an array of objects", np.full(3, None)
    if not takes & {np.ndarray, Sequence}:
        yield "an array", np.array([1.0, 2.0, 3.0])
    if texts:
        yield "empty", ""
    if Path in takes:
        yield "half a character", "\ud800"
        yield "a zero byte", "a\0b"
    if np.ndarray in takes:
        for number in (math.nan, math.inf):
            yield f"holds {number}", np.full(np.shape(good) if isinstance(good, np.ndarray) else (3, 6), number)
        yield "wrong shape", np.zeros((2, 2, 2, 2))
    if isinstance(good, list | tuple) and good and not isinstance(good[0], str):
        yield "too short", good[:-1]
        yield "holds nan", [math.nan, *good[1:]]
    elif isinstance(good, list | tuple) and good:
        yield "a plain text", good[0] if str not in takes else Odd()
        yield "misspelt within", [misspelt(str(good[0]))]


def test_every_job_is_exported_and_has_an_example() -> None:
    assert set(JOBS) == set(EXAMPLES)
    for job in JOBS:
        assert job in {*dir(truearm)} & {*truearm.__all__}
        assert (function(job).__module__, function(job).__name__) == (JOBS[job], job)


def test_every_parameter_and_the_result_have_a_type_and_a_word() -> None:
    page = (ROOT / "docs" / "api.md").read_text()
    for job in JOBS:
        assert re.search(rf"\b{job}\b", page), job
        named = set(inspect.signature(function(job)).parameters)
        assert set(hints_of(job)) == {*named, "return"}, job
        told = re.search(r"Parameters\n-+\n(.*?)(?:\n\n[A-Z]\w+\n-+|\Z)", inspect.getdoc(function(job)) or "", re.S)
        lines = re.findall(r"^(?=\S)(.+)$", told[1] if told else "", re.M)
        assert {name.strip() for line in lines for name in line.split(",")} == named, job


@cache
def done(job: str, folder: Path) -> Any:
    return function(job)(**EXAMPLES[job](folder))


@pytest.mark.parametrize("job", JOBS)
def test_the_result_is_frozen_and_speaks_for_itself(job: str, folder: Path) -> None:
    result = done(job, folder)
    assert isinstance(result, Record | Robot | Dataset)
    assert is_dataclass(result)
    assert 0 < len(repr(result)) <= 2000
    with pytest.raises(AttributeError):
        setattr(result, fields(result)[0].name, None)
    if isinstance(result, Record):
        assert repr(result) == "\n".join(result.lines())[: len(repr(result))] or repr(result).endswith("...")
        assert result._repr_html_().startswith("<pre>")
        assert json.loads(json.dumps(result.summary(), allow_nan=False))
        assert (type(result.request).job, type(result.request)) == (job, function(job).request)
        space, _, short = job.partition("_")
        name = f"{SPACES[space]}.{short}" if space in SPACES else job
        assert result.request.as_python().startswith(f"truearm.{name}(")
    if hasattr(result, "save"):
        refuses_bad_places(result.save)


def refuses_bad_places(save: Callable[[Any], object]) -> None:
    (parameter, *_) = inspect.signature(save).parameters
    assert parameter in ("folder", "file")
    for place in (None, 5, b"x", "", "a\0b", "\ud800", "/dev/null/x", "/proc/x"):
        assert ".truearm." not in refused(parameter, "", save, place)


@pytest.mark.parametrize("job", JOBS)
def test_what_cannot_be_used_is_refused_naming_the_parameter(job: str, folder: Path) -> None:
    good = EXAMPLES[job](folder)
    for name, parameter in parameters(job).items():
        tried = 0
        for what, bad in bad_values(job, name, good.get(name, parameter.default)):
            with pytest.raises(InputError) as refusal:
                function(job)(**{**good, name: bad})
            said = f"{job}({name}: {what}): {refusal.value}"
            assert name in (refusal.value.parameter or "").split(", "), said
            assert "--" not in said
            if what.startswith("misspelt") and isinstance(good.get(name), str):
                assert "Did you mean" in said
            tried += 1
        assert tried >= 2, (job, name)


def as_numpy(value: Any) -> Any:
    if isinstance(value, list | tuple):
        return type(value)(map(as_numpy, value))
    kind = {bool: np.bool_, int: np.int64, float: np.float64, str: np.str_}.get(type(value))
    return value if kind is None else kind(value)


@pytest.mark.parametrize("job", COUNTING)
def test_numbers_and_names_of_numpy_are_as_good(job: str, folder: Path) -> None:
    good = EXAMPLES[job](folder)
    plain, given = done(job, folder), {name: as_numpy(value) for name, value in good.items()}
    result = function(job)(**given)
    assert result.lines() == plain.lines()
    if hasattr(result, "command"):
        assert result.command == plain.command


def test_no_text_outside_the_command_names_an_option() -> None:
    """The studio alone writes commands: those that give the same as what was clicked."""
    commands = {ROOT / "src" / "truearm" / "studio" / name for name in ("measure_fields.py", "planned.py", "tasks.py")}
    option = re.compile(r"(?<![\w-])(?<!var\()--[a-z][a-z-]+")
    found = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()}"
        for path in sorted((ROOT / "src" / "truearm").rglob("*"))
        if path.suffix in (".py", ".jinja", ".yaml")
        and path.name not in ("command.py", "commands.py", "options.py", "request.py", "style.css.jinja")
        if path not in commands
        for number, line in enumerate(path.read_text().splitlines(), 1)
        if option.search(line)
    ]
    assert found == []


def test_misspelt_effects_and_devices_are_refused_and_offered(folder: Path) -> None:
    robot, data = truearm.load_robot("irb120"), EXAMPLES["load_data"](folder)["data"]
    for effect in EFFECTS:
        refused("effects", effect.name, robot.with_effects, [misspelt(effect.name)])
    for device in DEVICES:
        refused("device", f"Did you mean.*{device.name}", truearm.check, None, data, device=misspelt(device.name))
    for mass in (math.nan, math.inf, -1.0):
        refused("mass", "", Payload, mass)


def records() -> list[type[Record]]:
    for module in pkgutil.walk_packages(truearm.__path__, "truearm."):
        if not module.name.endswith(("__main__", "python_template")):
            import_module(module.name)
    if find_spec("papers"):
        import_module("papers.study")

    found, left = list[type[Record]](), [Record]
    while left:
        kinds = left.pop().__subclasses__()
        left += kinds
        found += [kind for kind in kinds if not inspect.isabstract(kind) and not kind.__module__.startswith("tests")]
    return sorted(found, key=lambda kind: kind.__name__)


def test_every_result_is_frozen_typed_and_on_the_page() -> None:
    page = (ROOT / "docs" / "api.md").read_text()
    for record in records():
        assert is_dataclass(record), record
        assert record.__dataclass_params__.frozen, record
        assert record.__repr__ is Record.__repr__, record
        assert get_type_hints(record.lines)["return"] == list[str], record
        assert re.search(rf"\b{record.__name__}\b", page), record


def test_every_robot_refuses_what_it_cannot_use() -> None:
    for name in ARMS:
        robot = truearm.load_robot(name)
        count = len(robot.joints)
        assert len(repr(robot)) <= 2000, name
        wrong = (np.full(count, math.nan), np.full(count, math.inf), np.zeros((2, count + 1)), np.zeros((2, 2, count)))
        for joints, answer in product((*wrong, [], "joints", None, Odd()), (robot.forward, robot.jacobian)):
            refused("joints", "", answer, joints)
        at = np.zeros(count)
        for parameter, wrongly in (("frame", "bas"), ("frame", 1), ("target", "nothing"), ("target", 1)):
            refused(parameter, "", robot.forward, at, **{parameter: wrongly})
        position, rotation = robot.forward(at)
        refused("positions", "", robot.inverse, position * math.nan, rotation)
        refused("positions", "", robot.inverse, position[:, :2], rotation)
        refused("rotations", "", robot.inverse, position, 2.0 * rotation)
        refused("rotations", "", robot.inverse, position, rotation[:, :2])
        refused("seed", "", robot.inverse, position, rotation, seed=np.zeros(count + 1))
        refused("frame", "", robot.inverse, position, rotation, frame="bas")


def test_every_device_refuses_what_it_cannot_use() -> None:
    wrong = (("poses", 0), ("noise", math.nan), ("noise", -1.0), ("seed", -1))
    for device, (parameter, wrongly) in product(DEVICES, wrong):
        arguments = {"truth": "nominal", "poses": 3, "device": device.name, parameter: wrongly}
        refused(parameter, "", truearm.simulate, "irb120", **arguments)
