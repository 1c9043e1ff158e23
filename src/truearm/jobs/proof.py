"""What a robot's calibration says against its use: refused for programs unless accepted, told otherwise."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from truearm.errors import InputError
from truearm.files import exists
from truearm.jobs.arguments import choices_argument
from truearm.manifest import written_differently
from truearm.modeling.controller import OTHER_ARM
from truearm.modeling.formats.robot_file import arm_is_known, is_intact
from truearm.modeling.robot import Robot
from truearm.notices import Notice

if TYPE_CHECKING:  # the readers of all languages take long to import
    from truearm.compensation.programs.program import Language

#: Ends of a fit of which no program is corrected.
_UNSOUND: Final = ("rank-loss", "not-converged", "implausible")
#: Speaks against other regions than those that were measured. Programs need not be refused for it: every target is
#: judged by what is known of the robot there, if that is known.
_ELSEWHERE: Final = "narrow-data"
#: The calibration is of another robot than the file says.
_WRONG: Final = "wrong-robot"
#: Programs of another maker's robots.
OTHER_MAKER: Final = "maker"
#: Targets that would rather get worse, see :mod:`truearm.compensation.kept_targets`.
NOT_BETTER: Final = "not-better-here"
#: Programs that compute with the numbers of targets that are corrected.
NUMBERS_READ: Final = "numbers-read"
#: Programs of which some targets cannot be corrected.
SKIPPED: Final = "skipped"


def accept_argument(accept: object, robot: Robot) -> tuple[str, ...]:
    """Return the names of what is accepted although it speaks against a correction."""
    of_programs = (OTHER_MAKER, OTHER_ARM, NUMBERS_READ, SKIPPED, NOT_BETTER)
    known = dict.fromkeys((*_UNSOUND, _ELSEWHERE, _WRONG, *_against(robot), *of_programs))
    return choices_argument(accept, "accept", list(known), "status or notice")


def refuse_unaccepted(robot: Robot, accept: tuple[str, ...]) -> None:
    """Refuse a robot whose calibration ended badly, or with an error, that is not accepted.

    Raises:
        InputError: With what the calibration said.
    """
    judged = (_ELSEWHERE,) if arm_is_known(robot) else ()
    against = {name: said for name, said in _against(robot).items() if name not in (*accept, *judged)}
    if against:
        name, message = next(iter(against.items()))
        others = f" It also ended with {', '.join([*against][1:])}." if len(against) > 1 else ""
        words = " and ".join(f"`accept={one}`" for one in against)
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
    if OTHER_MAKER in accept:
        return [Notice(OTHER_MAKER, f"{theirs}, and {robot.name} is of {robot.maker}. It was accepted.")]
    raise InputError(
        "the programs are for robots of another maker",
        parameter="robot",
        where=robot.name,
        came=f"a robot of {robot.maker} and programs in {language.name}",
        cure=f"{theirs}: give the calibration of the robot that runs them. If it is this one, mend the entry maker of "
        f"its file, or give `accept={OTHER_MAKER}`.",
    )


def known_of(robot: Robot) -> list[Notice]:
    """Return what is to be said of a calibration before programs are corrected with it."""
    if robot.proof is None:
        return [
            Notice(
                "unproven",
                "Nothing is known of how this robot was calibrated and of how well it is known, so the errors of its "
                "targets cannot be predicted. Calibrate it anew to have that in its file.",
                "note",
            )
        ]
    return told_of(robot)


def changed_since(robot: object) -> list[Notice]:
    """Say if the file of a robot is not as it was written together with others, which then do not describe it."""
    if not isinstance(robot, str | Path) or not exists(Path(robot)) or Path(robot).is_dir():
        return []
    others = written_differently(Path(robot))
    if not others:
        return []
    return [
        Notice(
            "changed-since-written",
            f"{Path(robot).name} was changed or exchanged after it was written together with {', '.join(others)}: "
            "what they say is not about it.",
        )
    ]


def told_of(robot: Robot) -> list[Notice]:
    """Return what speaks against the calibration of a robot that is used all the same."""
    return [
        *(Notice(name, message) for name, message in _against(robot).items()),
        *(() if robot.proof is None else robot.proof.warnings),
        *_edited(robot),
    ]


def _edited(robot: Robot) -> list[Notice]:
    if robot.proof is None or is_intact(robot):
        return []
    return [
        Notice(
            "edited-by-hand",
            "The values of this robot were changed after its calibration, so what is known of its accuracy is not "
            "about them: the errors of targets cannot be predicted. Take the file that calibration wrote, or calibrate "
            "again.",
        )
    ]


def _against(robot: Robot) -> dict[str, str]:
    """Return what speaks against a calibration, by the name of a status or notice."""
    if robot.proof is None:
        return {}
    status = robot.proof.status
    said = {error.code: error.message for error in robot.proof.errors}
    return ({status: f"The fit ended as {status}."} if status in _UNSOUND else {}) | said
