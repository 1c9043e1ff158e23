"""Which configurations train and which judge, and what speaks against the split."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Integral
from typing import Final

from truearm.errors import InputError, did_you_mean, nearest_names, wrong_kind
from truearm.measurement.dataset import Dataset, IntArray
from truearm.measurement.repeats import copies, readings_digest, revisits
from truearm.modeling.robot import Robot
from truearm.notices import Notice
from truearm.shown import counted, listed

#: How a calibration says in the robot's history which configurations of which data it was trained on: by the hash of
#: the file, of the readings, or of both; and how many it left out.
_TRAINED: Final = re.compile(
    r"(\d+) of (\d+) configurations of .*?\((?:sha256 ([0-9a-f]+))?(?:, )?(?:readings ([0-9a-f]+))?\), seed (\d+)"
    r"(?:.*? without (\d+) configuration)?"
)


#: The hash by which the history tells which configurations were left out.
_LEFT_OUT: Final = re.compile(r"; ([0-9a-f]{8})\),")


def left_out(data: Dataset, labels: Sequence[str]) -> Dataset:
    """Return the data without some configurations.

    Raises:
        InputError: For a configuration that the data do not have, or if none would be left.
    """
    if not labels:
        return data
    known = set(data.labels)
    for label in labels:
        if label not in known:
            raise InputError(
                "there is no configuration of this name",
                parameter="without",
                where=data.source,
                came=label,
                cure=did_you_mean(label, data.labels) or "Name configurations of the data.",
            )
    kept = [i for i, label in enumerate(data.labels) if label not in set(labels)]
    if not kept:
        raise InputError(
            "no configuration would be left", parameter="without", where=data.source, cure="Leave out fewer."
        )
    return data.of_configurations(kept)


def without_words(labels: Sequence[str]) -> str:
    """Return how the history says which configurations were left out: the first few by name, all of them by a hash."""
    if not labels:
        return ""
    digest = hashlib.sha256("\n".join(sorted(labels)).encode()).hexdigest()[:8]
    return f" without {counted(len(labels), 'configuration')} ({listed(labels)}; {digest}),"


def check_split(training: Dataset, held_out: Dataset) -> None:
    """Refuse a held-out part that holds nothing, or readings of targets that the training part does not place."""
    if held_out.configurations and not held_out.has_reading.any():
        raise InputError(
            "the held-out part has no reading",
            where=held_out.source,
            cure="Lower `train`, change `seed`, or measure again where readings are missing.",
        )
    places = training.has_position if training.fixture is None else training.has_reading
    placed = set(training.target[places].tolist())
    fixtures = set(training.against[training.has_reading].tolist())
    for part, name in ((training, "training"), (held_out, "held-out")):
        for index in dict.fromkeys(part.against[part.has_reading].tolist()):
            if index not in fixtures:
                alone = training.fixtures[index] if index >= 0 else ""
                near = nearest_names(alone, [n for n in training.fixtures if n != alone], 1) if alone else []
                raise InputError(
                    f"a fixture of the {name} part was not measured in the training part",
                    where=training.source,
                    came=alone or "the instrument's own frame",
                    cure=f"Did you mean {near[0]}?" if near else "Raise `train`, change `seed`, or leave it out.",
                )
        for index in dict.fromkeys(part.target[part.has_reading].tolist()):
            if index not in placed:
                raise InputError(
                    f"a target of the {name} part has no position in the training part",
                    where=training.source,
                    came=training.targets[index],
                    cure="Raise `train`, change `seed`, or leave the target out.",
                )


def train_count(train: object, n: int, where: str) -> int:
    """Return how many of n configurations train.

    Raises:
        InputError: For a number that leaves none to train on or none to judge by.
    """
    if isinstance(train, str) and train == "all":
        return n
    if n < 2:
        raise InputError(
            "one configuration cannot be split into training and held-out parts",
            parameter="data",
            where=where,
            cure="Measure more, or use `train=all`.",
        )
    if train is None:
        return round(0.7 * n)
    if isinstance(train, bool) or not isinstance(train, Integral):
        raise wrong_kind("a number of configurations belongs here", train, "train", "a whole number, or all")
    if not 1 <= int(train) < n:
        raise InputError(
            "the number of training configurations must leave some held out",
            parameter="train",
            came=int(train),
            allowed=f"1 to {n - 1}, or all ({where} has {n} configurations)",
        )
    return int(train)


def check_copies(data: Dataset, training: IntArray, held_out: IntArray) -> list[Notice]:
    """Say if the fit has seen what was held out: copies, or other readings at the same joint positions."""
    seen = copies(data, held_out, training)
    known = set(seen)
    again = [label for label in revisits(data, held_out, training) if label not in known]
    if not seen and not again:
        return []
    told = []
    if seen:
        told.append(f"{len(seen)} {'is a copy' if len(seen) == 1 else 'are copies'} of training ones ({listed(seen)})")
    if again:
        told.append(
            f"{len(again)} {'has' if len(again) == 1 else 'have'} the same joint positions as training ones "
            f"({listed(again)})"
        )
    cures = ["Leave copies out; for a bootstrap, draw from the training configurations alone and use `train=all`."]
    return [
        Notice(
            "held-out-seen",
            f"Of {counted(len(held_out), 'held-out configuration')} {' and '.join(told)}: the fit has seen them, and "
            f"the errors flatter it. "
            + " ".join(
                [
                    *(cures if seen else []),
                    *(["Judge it at other joint positions with 'truearm validate'."] if again else []),
                ]
            ),
        )
    ]


def check_trained_before(
    robot: Robot, data: Dataset, sha256: str | None, split: tuple[int, int, int], without: str
) -> list[Notice]:
    """Say if the robot to begin with has been trained on what is held out now.

    Args:
        data: As they were read.
        sha256: Of their file; None if they are in none.
        split: How many configurations are trained on, of how many, and the seed.
        without: What the history says of those left out.
    """
    before = training_of(robot, data, sha256)
    if before is None or split[0] == split[1]:
        return []
    if before.split == split and _LEFT_OUT.findall(before.line) == _LEFT_OUT.findall(without):
        return []
    count, of, seed = before.split
    return [
        Notice(
            "training-data",
            f"The robot to begin with was calibrated with these readings already, on {count} of its {of} "
            f"configurations (seed {seed}): what is held out now was partly seen then, and the held-out errors "
            "flatter it. Begin with the nominal robot, or with the same `train` and `seed`.",
        )
    ]


def nothing_held_out() -> Notice:
    """Say that there is no proof."""
    return Notice(
        "nothing-held-out",
        "Nothing was held out: the errors are those of the training readings and flatter the model. "
        "Leave `train` out to see the error on configurations the fit has not seen.",
    )


@dataclass(frozen=True)
class Training:
    """What the history of a robot says of a calibration."""

    split: tuple[int, int, int]  #: How many configurations it was trained on, of how many, and the seed.
    left_out: int  #: How many were left out before.
    line: str  #: The line of the history.


def training_of(robot: Robot, data: Dataset, digest: str | None) -> Training | None:
    """Return how a robot was trained on data; None if it was not.

    Args:
        data: As they were read.
        digest: SHA-256 of their file, by which older calibrations know them; None if they are in none.
    """
    readings = readings_digest(data)
    for line in robot.history:
        found = _TRAINED.search(line)
        if found is None:
            continue
        same_file = found[3] is not None and digest is not None and found[3] == digest[: len(found[3])]
        if same_file or (found[4] is not None and found[4] == readings[: len(found[4])]):
            return Training((int(found[1]), int(found[2]), int(found[5])), int(found[6] or 0), line)
    return None
