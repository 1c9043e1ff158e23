"""What to know about corrected programs before they run."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from typing import Final

import numpy as np

from truearm.compensation.gauge import turns_between
from truearm.compensation.kept_targets import LARGEST_STEP, LIKELY
from truearm.compensation.measured_region import beyond_measured
from truearm.compensation.program_correction import CorrectedPrograms, Correction, Frames
from truearm.compensation.split import MOST_SEGMENTS, ProgramSplit
from truearm.modeling.chain import Array
from truearm.modeling.parts import NO_PAYLOAD
from truearm.modeling.robot import Robot
from truearm.notices import Notice
from truearm.shown import counted, listed

#: Corrections of calibration errors are smaller [m]; a larger mean comes of a wrong tool, frame or robot.
_LARGE_MEAN: Final = 0.02
#: With so few targets and no frame, a correction without a mean is no correction.
_FEW_TARGETS: Final = 3
_LISTED: Final = 5


def check_correction(
    robot: Robot, result: CorrectedPrograms, splits: Sequence[ProgramSplit] = ()
) -> tuple[Notice, ...]:
    """Say what is to be known about corrected programs before they run.

    Parameters
    ----------
    robot
        Calibrated, with the payload that holds.
    result
        The corrected programs.
    splits
        How their moves are split, one a program; empty if they are not.
    """
    corrections = result.corrections
    count = sum(int(one.corrected.sum()) for one in corrections)
    if any(one.program.targets for one in corrections):
        kept = sum(not one.corrected[row] for one in corrections for row in one.not_better)
        made = _assumed(result.frames, count + int(kept))
    else:
        made = [Notice("no-targets", "There is no target in the programs that could be corrected.")]
    skipped = sum(len(one.skipped) for one in corrections)
    if skipped:
        made.append(
            Notice("targets-skipped", f"{_counted(skipped, 'target')} left unchanged, as listed with the reason.")
        )
    made += [*_not_better(robot, result), *_beyond(robot, result)]
    unknown: Counter[str] = sum((Counter(one.program.unknown) for one in corrections), Counter())
    if unknown:
        words = ", ".join(f"{word} ({number})" for word, number in unknown.most_common(_LISTED))
        made.append(
            Notice(
                "instructions-unknown",
                f"{_counted(sum(unknown.values()), 'unknown instruction')} left alone: {words}"
                f"{', ..' if len(unknown) > _LISTED else ''}. If one of them moves the robot, its targets stay.",
            )
        )
    edges = [(one, row) for one in corrections for row in one.on_edge]
    if edges:
        made.append(
            Notice(
                "configuration-on-edge",
                f"{_counted(len(edges), 'target')} moved across the edge of a quadrant or turn of the configuration "
                f"by a joint that stands on it, as at 0: {_lines(edges)}. Controllers "
                "take the nearest posture there, but step through these first.",
            )
        )
    if result.guessed:
        made.append(
            Notice(
                "posture-guessed",
                f"Nothing says in which posture the robot reaches its first pose ({'; '.join(result.guessed)}): it was "
                "taken as the first that can be reached of front-up-noflip and so on, and the next as near as can be.",
            )
        )
    moved = np.concatenate([one.moved[one.corrected] for one in corrections]) if count else np.zeros(0)
    if count and float(moved.mean()) > _LARGE_MEAN:
        made.append(
            Notice(
                "corrections-large",
                f"Targets move by {moved.mean() * 1e3:.1f} mm on average, more than calibration errors do: check that "
                "tools, frames and robot belong together, and the convention of their angles.",
            )
        )
    unsplit = sum(len(one.unsplit) for one in splits)
    if unsplit:
        made.append(
            Notice(
                "moves-not-divided",
                f"{_counted(unsplit, 'straight or circular move')} not split: the start of such a move is not sure; or "
                "a target was not corrected, is given by joints or is an offset; or the posture changes on the way; or "
                f"{MOST_SEGMENTS} segments are not enough; or its instruction has options that segments cannot have.",
            )
        )
    if robot.payload == NO_PAYLOAD and any(effect.loaded for effect in robot.effects):
        made.append(
            Notice(
                "no-payload",
                "The robot carries nothing in this correction. If its tool weighs something, give it with `payload`.",
            )
        )
    return tuple(made)


def _not_better(robot: Robot, result: CorrectedPrograms) -> list[Notice]:
    """Say which targets are rather worse off with their correction, and what became of them."""
    every = [(one, row) for one in result.corrections for row in one.not_better]
    if not every:
        return []
    alone = [(one, row) for one, row in every if one.expected is not None and one.expected.worse[row] > LIKELY]
    kept = [(one, row) for one, row in every if not one.corrected[row]]
    corrected = len(every) - len(kept)
    share = f"{LIKELY:.0%}".replace("%", " %")
    words = (
        f"For {counted(len(alone), 'target')} the correction makes the real error larger with a probability above "
        f"{share}: {_lines(alone)}. "
    )
    if kept:
        joined = len(kept) + corrected - len(alone)
        words += f"{counted(len(kept), 'target')} {'stays' if len(kept) == 1 else 'stay'} as before"
        words += f", {joined} of them because straight moves join them to the others" if joined else ""
        words += f"; a path may have a step of up to {LARGEST_STEP * 1e3:g} mm there. "
    if corrected:
        words += (
            f"{counted(corrected, 'target')} {'is' if corrected == 1 else 'are'} corrected nevertheless, because the "
            "path as a whole is rather better for it or `accept=not-better-here` asks for it. "
        )
    beyond = _joints_beyond(robot, every)
    words += (
        f"They need {beyond} outside of what was measured: measure there."
        if beyond
        else "The corrections are small beside what is known of them: measure more configurations near the program."
    )
    return [Notice("not-better-here", words)]


def _beyond(robot: Robot, result: CorrectedPrograms) -> list[Notice]:
    """Say which targets are reached with joint positions that calibration has not seen."""
    found = [
        (one, row)
        for one in result.corrections
        for row in np.flatnonzero(one.corrected & beyond_measured(robot, one.joints).any(axis=1)).tolist()
    ]
    if not found:
        return []
    return [
        Notice(
            "beyond-measured",
            f"{_counted(len(found), 'target')} corrected although {_joints_beyond(robot, found)} stood well outside "
            f"the range measured in calibration: {_lines(found)}. What the model leaves out counts more there than "
            "where it was measured.",
        )
    ]


def _joints_beyond(robot: Robot, targets: Sequence[tuple[Correction, int]]) -> str:
    """Return the joints that are at some targets well beyond what was measured."""
    beyond = beyond_measured(robot, np.array([one.joints[row] for one, row in targets]))
    return listed([robot.joints[number].name for number in np.flatnonzero(beyond.any(axis=0)).tolist()])


def _lines(targets: Sequence[tuple[Correction, int]]) -> str:
    shown = [(one.program.sources, one.program.targets[row]) for one, row in targets[:_LISTED]]
    lines = ", ".join(f"{sources[target.source].path.name} line {target.line}" for sources, target in shown)
    return f"{lines}{', ..' if len(targets) > _LISTED else ''}"


def _assumed(frames: Frames, count: int) -> list[Notice]:
    made = []
    if frames.frames == "assumed":
        few = f" With so few targets ({count}) little or nothing of the correction is left: give `frames`."
        made.append(Notice("frames-assumed", f"{frame_words(frames)[0]}{few if count <= _FEW_TARGETS else ''}"))
    if frames.tools == "assumed":
        made.append(Notice("tools-assumed", frame_words(frames)[-1]))
    return made


def frame_words(frames: Frames) -> list[str]:
    """Return what was taken for the real base and flange, in words: first of the frames, then of the tools."""

    def size(shift: Array) -> str:
        turned = math.degrees(float(np.linalg.norm(turns_between(np.eye(4)[None], shift[None])[0])))
        return f"{np.linalg.norm(shift[:3, 3]) * 1e3:.3f} mm and {turned:.4f} deg"

    if frames.frames == "identified":
        said = [
            "The program's frames are where `frames` places them; targets are corrected in them, and may all move "
            "together."
        ]
    else:
        said = [
            "`frames` is not given. Calibration cannot know where a program's frames really are, so the base was "
            f"shifted by {size(frames.base)} until the corrections of all targets have no shift and no turn in common: "
            "targets are right to each other, and the pattern of their positions stays where it was. A work object "
            "that was located elsewhere than at its targets may be off by what the uncorrected robot missed there: "
            "give `frames`."
        ]
    if frames.tools == "identified":
        said.append("The program's tools are where `tools` places them, on the identified flange.")
    else:
        said.append(
            "`tools` is not given. The program's tools are taken to sit on a flange that agrees best with the nominal "
            f"one all over the workspace, {size(frames.flange)} from the identified one."
        )
    return said


def _counted(number: int, what: str) -> str:
    """Return that so many were: ``1 target was``, ``2 targets were``."""
    return f"{number} {what}{' was' if number == 1 else 's were'}"
