"""The split into training and held-out configurations, and what a calibration says against its use."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Integral
from pathlib import Path
from typing import TYPE_CHECKING, Final

from truearm.engine.base.errors import (
    InputError,
    Notice,
    Rule,
    counted,
    did_you_mean,
    listed,
    nearest_names,
    wrong_kind,
)
from truearm.engine.base.files import exists
from truearm.engine.base.manifest import written_differently
from truearm.engine.command.arguments import choices_argument
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.thinning import readings_digest
from truearm.engine.robot.controller import OTHER_ARM
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.seal import arm_is_known, is_intact

if TYPE_CHECKING:
    from truearm.engine.programs.program import Language


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
    indices = [i for i, label in enumerate(data.labels) if label not in set(labels)]
    if not indices:
        raise InputError(
            "no configuration would be left", parameter="without", where=data.source, cure="Leave out fewer."
        )
    return data.of_configurations(indices)


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


TRAINING_DATA: Final = Rule(
    "training-data",
    "warning",
    "the robot was calibrated with these readings before, in this file or another order: the fit has seen what is "
    "held out now",
    gravity=2,
)


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
        TRAINING_DATA(
            f"The robot to begin with was calibrated with these readings already, on {count} of its {of} "
            f"configurations (seed {seed}): what is held out now was partly seen then, and the held-out errors "
            "flatter it. Begin with the nominal robot, or with the same `train` and `seed`."
        )
    ]


NOTHING_HELD_OUT: Final = Rule(
    "nothing-held-out",
    "warning",
    "there is a fit, and no evidence of how good it is elsewhere",
    cure="Leave `train` out to see the error on configurations the fit has not seen.",
    gravity=2,
)


def nothing_held_out() -> Notice:
    """Say that there is no proof."""
    return NOTHING_HELD_OUT(
        "Nothing was held out: the errors are those of the training readings and flatter the model."
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
        match = _TRAINED.search(line)
        if match is None:
            continue
        same_file = match[3] is not None and digest is not None and match[3] == digest[: len(match[3])]
        if same_file or (match[4] is not None and match[4] == readings[: len(match[4])]):
            return Training((int(match[1]), int(match[2]), int(match[5])), int(match[6] or 0), line)
    return None


#: Ends of a fit of which no program is corrected.
_UNSOUND: Final = ("rank-loss", "not-converged", "implausible")
#: Speaks against other regions than those that were measured. Programs need not be refused for it: every target is
#: judged by what is known of the robot there, if that is known.
_ELSEWHERE: Final = "narrow-data"
#: The calibration is of another robot than the file says.
_WRONG: Final = "wrong-robot"
MAKER: Final = Rule(
    "maker",
    "warning",
    "the programs are in the language of another maker than the robot's; `compensate` asks for it to be accepted",
)
#: Targets that would rather get worse, see :mod:`truearm.engine.programs.correction`.
NOT_BETTER: Final = "not-better-here"
#: Programs that compute with the numbers of targets that are corrected.
NUMBERS_READ: Final = Rule(
    "numbers-read", "warning", "the program computes with numbers of corrected targets, which was accepted"
)
#: Programs of which some targets cannot be corrected.
SKIPPED: Final = "skipped"


def accept_argument(accept: object, robot: Robot) -> tuple[str, ...]:
    """Return the names of what is accepted although it speaks against a correction."""
    of_programs = (MAKER.code, OTHER_ARM, NUMBERS_READ.code, SKIPPED, NOT_BETTER)
    known = dict.fromkeys((*_UNSOUND, _ELSEWHERE, _WRONG, *_against(robot), *of_programs))
    return choices_argument(accept, "accept", list(known), "status or notice")


def refuse_unaccepted(robot: Robot, accept: tuple[str, ...]) -> None:
    """Refuse a robot whose calibration ended badly, or with an error, that is not accepted.

    Raises:
        InputError: With what the calibration said.
    """
    judged = (_ELSEWHERE,) if arm_is_known(robot) else ()
    against = {name: reason for name, reason in _against(robot).items() if name not in (*accept, *judged)}
    if against:
        name, message = next(iter(against.items()))
        others = f" It also ended with {', '.join([*against][1:])}." if len(against) > 1 else ""
        words = " and ".join(f"`accept={code}`" for code in against)
        raise InputError(
            "the calibration of this robot does not hold well enough to correct programs with it",
            parameter="robot",
            where=robot.name,
            came=name,
            cure=f"{message}{others} To correct programs all the same, give {words}.",
        )


def check_maker(robot: Robot, language: Language, accept: tuple[str, ...]) -> list[Notice]:
    """Return what is to be said of programs in the language of another maker's robots, if that is accepted.

    Raises:
        InputError: If it is not. A robot whose maker is not known may be anyone's.
    """
    if not robot.maker or language.runs_on(robot.maker):
        return []
    theirs = f"{language.name} runs on controllers of {language.makers[0]}"
    if MAKER.code in accept:
        return [MAKER(f"{theirs}, and {robot.name} is of {robot.maker}. It was accepted.")]
    raise InputError(
        "the programs are for robots of another maker",
        parameter="robot",
        where=robot.name,
        came=f"a robot of {robot.maker} and programs in {language.name}",
        cure=f"{theirs}: give the calibration of the robot that runs them. If it is this one, fix the entry maker of "
        f"its file, or give `accept={MAKER.code}`.",
    )


UNPROVEN: Final = Rule(
    "unproven",
    "note",
    "nothing is known of how the robot was calibrated",
    cure="Calibrate it anew to have that in its file.",
)


def known_of(robot: Robot) -> list[Notice]:
    """Return what is to be said of a calibration before programs are corrected with it."""
    if robot.proof is None:
        return [
            UNPROVEN(
                "Nothing is known of how this robot was calibrated and of how well it is known, so the errors of its "
                "targets cannot be predicted."
            )
        ]
    return faults_of(robot)


CHANGED_SINCE_WRITTEN: Final = Rule(
    "changed-since-written",
    "warning",
    "the robot's file was changed or exchanged since it was written together with others",
    gravity=2,
)


def changed_since(robot: object) -> list[Notice]:
    """Say if the file of a robot is not as it was written together with others, which then do not describe it."""
    if not isinstance(robot, str | Path) or not exists(Path(robot)) or Path(robot).is_dir():
        return []
    others = written_differently(Path(robot))
    if not others:
        return []
    return [
        CHANGED_SINCE_WRITTEN(
            f"{Path(robot).name} was changed or exchanged after it was written together with {', '.join(others)}: "
            "what they say is not about it."
        )
    ]


def calibration_errors(robot: Robot) -> list[Notice]:
    """Return what speaks against the calibration of a robot wherever it is judged."""
    return [Notice(name, message) for name, message in _against(robot).items() if name != _ELSEWHERE]


def faults_of(robot: Robot) -> list[Notice]:
    """Return what speaks against the calibration of a robot that is used all the same."""
    return [
        *(Notice(name, message) for name, message in _against(robot).items()),
        *(() if robot.proof is None else robot.proof.warnings),
        *_edited(robot),
    ]


EDITED_BY_HAND: Final = Rule(
    "edited-by-hand",
    "warning",
    "the robot's values were changed after its calibration",
    cure="Take the file that calibration wrote, or calibrate again.",
    gravity=2,
)


def _edited(robot: Robot) -> list[Notice]:
    if robot.proof is None or is_intact(robot):
        return []
    return [
        EDITED_BY_HAND(
            "The values of this robot were changed after its calibration, so what is known of its accuracy is not "
            "about them: the errors of targets cannot be predicted."
        )
    ]


def _against(robot: Robot) -> dict[str, str]:
    """Return what speaks against a calibration, by the name of a status or notice."""
    if robot.proof is None:
        return {}
    status = robot.proof.status
    messages = {error.code: error.message for error in robot.proof.errors}
    return ({status: f"The fit ended as {status}."} if status in _UNSOUND else {}) | messages
