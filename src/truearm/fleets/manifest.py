"""What is asked of a fleet: robots that were measured, or an experiment with simulated ones."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

import numpy as np
from pydantic import BaseModel, Field, PlainValidator

from truearm.calibration.calibrate import Calibrate
from truearm.engine.base.errors import InputError, name_parameter, name_place, refusals_at
from truearm.engine.base.files import read_bytes, read_yaml
from truearm.engine.base.limits import refuse_beyond
from truearm.engine.base.manifest import hash_of
from truearm.engine.base.units import sized_si
from truearm.engine.command.groups import OfModel
from truearm.engine.data.controller_joints import in_model_joints
from truearm.engine.data.readers.canonical import read_csv
from truearm.engine.fit.models import named_model
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.robot_file.entries import STRICT, NotNegative
from truearm.engine.twin.truths import carrying_targets
from truearm.fleets.series import Experiment, ExperimentEntry

if TYPE_CHECKING:
    from truearm.fleets.entries import RobotEntry


def experiment(asked: ExperimentEntry, place: str = "experiment") -> Experiment:
    """Prepare an experiment; refusals name the `place` where it stands.

    Raises:
        InputError: For a robot or configurations that cannot be read, a model that is not known, and targets that are
            not there.
    """
    with _refusals_at(f"{place}.robot"):
        nominal = load_robot(asked.robot)
    with _refusals_at(f"{place}.model"):
        model = named_model(asked.model)
    known = carrying_targets(nominal)
    places = {target.name: tuple(known.values[target.parameter(axis)] for axis in "xyz") for target in known.targets}
    if asked.targets > len(places):
        raise InputError(
            f"{nominal.name} has fewer targets",
            parameter="manifest",
            where=f"{place}.targets",
            came=asked.targets,
            allowed=f"1 to {len(places)}",
        )
    robot = known.with_frames(known.base, dict([*places.items()][: asked.targets]))
    rng = np.random.default_rng(np.random.SeedSequence(asked.seed, spawn_key=(0,)))
    held_out = robot.random_configurations(asked.held_out, rng)
    if isinstance(asked.configurations, int):
        joints = robot.random_configurations(asked.configurations, rng)
    else:
        with _refusals_at(f"{place}.configurations"):
            joints = in_model_joints(robot, read_csv(asked.configurations)).joints
    with _refusals_at(f"{place}.model"):
        model.free(model.prepared(robot))
    return Experiment(asked, robot, joints, held_out)


@contextmanager
def _refusals_at(place: str) -> Iterator[None]:
    """Let refusals of what an entry of the manifest holds name it."""
    try:
        yield
    except InputError as error:
        name_parameter(error, "manifest")
        if error.where is None:
            name_place(error, place)
        raise


# Robots that were measured, in the file or in a table with one row each::
#
#     truearm: truearm-fleet/1
#     robots:
#       - {name: cell-1, robot: ur5, data: cell-1.csv, options: {model: geometric, train: 40}}
#       - {name: cell-2, robot: ur5, data: cell-2.csv, of: "20195500123", date: 2026-03-01}
#     chunk: 4
#
# An experiment::
#
#     truearm: truearm-fleet/1
#     units: {length: mm}
#     experiment: {robot: irb120, count: 10000, configurations: 20, targets: 1, noise: 0.05, seed: 1}
#
# Files are named from the folder that the manifest is in.
SCHEMA: Final = "truearm-fleet/1"

#: Robots of a part, where the manifest does not say: a part shall take seconds.
SIMULATED_TOGETHER: Final = 250
MEASURED_TOGETHER: Final = 8

Count = Annotated[int, Field(ge=1, strict=True)]


def _configurations(stated: object) -> int | str:
    if (isinstance(stated, str) and stated) or (type(stated) is int and stated >= 1):
        return stated
    raise InputError(
        "a number of configurations or a file of them belongs here", allowed="1 or more, or a file such as plan.csv"
    )


Configurations = Annotated[int | str, PlainValidator(_configurations)]


class _Units(BaseModel):
    model_config = STRICT

    length: Literal["mm", "m", "um"]


class ExperimentFile(BaseModel):
    """The experiment in a manifest."""

    model_config = STRICT

    robot: str
    count: Count
    configurations: Configurations = 20
    targets: Annotated[int, Field(ge=1, le=8, strict=True)] = 1
    model: str = OfModel.default("model")
    noise: NotNegative
    held_out: Count = 50
    seed: Annotated[int, Field(ge=0, strict=True)] = Calibrate.default("seed")


class ManifestFile(BaseModel):
    """Schema ``truearm-fleet/1``."""

    model_config = STRICT

    truearm: Literal["truearm-fleet/1"]
    units: _Units | None = None
    experiment: ExperimentFile | None = None
    robots: list[Any] | str | None = None
    options: dict[str, Any] = {}
    chunk: Count | None = None


@dataclass(frozen=True)
class Manifest:
    """What is asked of a fleet."""

    file: Path  #: Where it stands.
    experiment: ExperimentEntry | None  #: The experiment; None where robots were measured.
    robots: tuple[RobotEntry, ...]  #: The robots that were measured; empty for an experiment.
    chunk: int  #: Robots of a part.
    content: Mapping[str, Any] = field(repr=False)  #: What it says, as JSON holds it.
    hashes: Mapping[str, str] = field(repr=False)  #: SHA-256 of the files that it names, by their names there.

    @property
    def count(self) -> int:
        """How many robots there are."""
        return len(self.robots) if self.experiment is None else self.experiment.count

    @property
    def inputs(self) -> tuple[Path, ...]:
        """The files that are read: itself, and those that it names."""
        return (self.file, *(self.file.parent / name for name in self.hashes))

    @property
    def parts(self) -> int:
        """How many parts they are computed in."""
        return -(-self.count // self.chunk)

    @property
    def digest(self) -> str:
        """Hash of what is asked, and of the files that it names."""
        text = json.dumps([self.content, self.hashes], sort_keys=True, default=str)
        return hash_of(text.encode())

    def key(self, part: int) -> str:
        """Return the hash of what is asked of a part, counted from 0: robots beside it change nothing of it."""
        if self.experiment is not None:
            return self.digest
        robots = [self.content["robots"][number] for number in self.numbers(part)]
        files = [[*self.robots[number].hashes.values()] for number in self.numbers(part)]
        return hash_of(json.dumps([robots, files], sort_keys=True, default=str).encode())

    def numbers(self, part: int) -> range:
        """Return which robots are in a part; both are counted from 0."""
        return range(part * self.chunk, min((part + 1) * self.chunk, self.count))

    def names(self, part: int) -> list[str]:
        """Return the names of the robots in a part, counted from 0."""
        if self.experiment is not None:
            return [self.experiment.name(number) for number in self.numbers(part)]
        return [self.robots[number].name for number in self.numbers(part)]

    def identities(self, part: int) -> list[tuple[str, str | None, str | None]]:
        """Return name, machine and date of the robots in a part, as its rows repeat them."""
        if self.experiment is not None:
            return [(name, None, None) for name in self.names(part)]
        return [(robot.name, robot.of, robot.date) for robot in (self.robots[number] for number in self.numbers(part))]


def read_manifest(path: Path) -> Manifest:
    """Read a manifest, and look whether the files that it names are there.

    Raises:
        InputError: For what cannot be meant, naming the entry: no robots or both kinds, two robots of one name, a
            missing file.
    """
    entries = read_yaml(path, ManifestFile)
    if (entries.experiment is None) == (entries.robots is None):
        raise InputError(
            "robots that were measured or an experiment belong here, one of them",
            where=str(path),
            came="both" if entries.robots is not None else "neither",
            allowed="robots, experiment",
        )
    content = entries.model_dump(mode="json")
    if entries.experiment is not None:
        experiment, hashes = _experiment(entries, path)
        return Manifest(path, experiment, (), entries.chunk or SIMULATED_TOGETHER, content, hashes)
    if entries.units is not None:
        raise InputError("nothing here has a unit", where=f"{path}, units", cure="Remove it.")
    from truearm.fleets.entries import refuse_respelled, robots_of

    if isinstance(entries.robots, list):
        refuse_respelled(entries.robots, path)
    named = robots_of(entries.robots or [], entries.options, path)
    content |= {"robots": named.content}
    return Manifest(path, None, named.entries, entries.chunk or MEASURED_TOGETHER, content, named.hashes)


def _experiment(entries: ManifestFile, path: Path) -> tuple[ExperimentEntry, dict[str, str]]:
    """Return the experiment, and the SHA-256 of the files that it names."""
    asked = entries.experiment
    assert asked is not None
    if entries.units is None:
        raise InputError(
            "the noise has a unit, and it is not said",
            where=f"{path}, units",
            allowed="{length: mm}, {length: m} or {length: um}",
            cure="Add it.",
        )
    if entries.options:
        raise InputError("only robots that were measured have options", where=f"{path}, options", cure="Remove it.")
    for name, entry, value in (
        ("robots", "count", asked.count),
        ("poses", "held_out", asked.held_out),
        ("poses", "configurations", asked.configurations if isinstance(asked.configurations, int) else 0),
    ):
        refuse_beyond(name, value, where=f"{path}, experiment.{entry}")
    hashes = {}
    robot = asked.robot
    if Path(robot).suffix:
        hashes[robot] = _hash(robot, path, "robot")
        robot = str(path.parent / robot)
    configurations: int | Path = asked.configurations if isinstance(asked.configurations, int) else Path()
    if isinstance(asked.configurations, str):
        hashes[asked.configurations] = _hash(asked.configurations, path, "configurations")
        configurations = path.parent / asked.configurations
    with refusals_at(f"{path}, experiment.noise"):
        noise = sized_si(asked.noise, entries.units.length, deviation=True)
    return (
        ExperimentEntry(
            robot, asked.count, configurations, asked.targets, asked.model, noise, asked.held_out, asked.seed
        ),
        hashes,
    )


def _hash(name: str, manifest: Path, entry: str) -> str:
    """Return the SHA-256 of a file that an entry of the experiment names, or refuse it there."""
    try:
        return hash_of(read_bytes(manifest.parent / name))
    except InputError as error:
        error.came = name
        name_place(error, f"{manifest}, experiment.{entry}")
        raise
