"""An experiment prepared: its robot with targets, and the configurations at which robots are measured and judged."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from truearm.errors import InputError, name_parameter, name_place
from truearm.fleets.series import Experiment, ExperimentEntry
from truearm.identification.solving.models import named_model
from truearm.library import load_robot
from truearm.measurement.controller_joints import in_model_joints
from truearm.measurement.readers.canonical import read_csv
from truearm.simulation.truths import carrying_targets


def experiment(asked: ExperimentEntry, where: str = "experiment") -> Experiment:
    """Prepare an experiment; refusals name `where` it stands.

    Raises:
        InputError: For a robot or configurations that cannot be read, a model that is not known, and targets that are
            not there.
    """
    with _refusals_at(f"{where}.robot"):
        nominal = load_robot(asked.robot)
    with _refusals_at(f"{where}.model"):
        model = named_model(asked.model)
    known = carrying_targets(nominal)
    places = {target.name: tuple(known.values[target.parameter(axis)] for axis in "xyz") for target in known.targets}
    if asked.targets > len(places):
        raise InputError(
            f"{nominal.name} has fewer targets",
            parameter="manifest",
            where=f"{where}.targets",
            came=asked.targets,
            allowed=f"1 to {len(places)}",
        )
    robot = known.with_frames(known.base, dict([*places.items()][: asked.targets]))
    rng = np.random.default_rng(np.random.SeedSequence(asked.seed, spawn_key=(0,)))
    held_out = robot.random_configurations(asked.held_out, rng)
    if isinstance(asked.configurations, int):
        joints = robot.random_configurations(asked.configurations, rng)
    else:
        with _refusals_at(f"{where}.configurations"):
            joints = in_model_joints(robot, read_csv(asked.configurations)).joints
    with _refusals_at(f"{where}.model"):
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
