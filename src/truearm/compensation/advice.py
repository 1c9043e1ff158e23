"""What to know about corrected programs before they run."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from typing import Final

import numpy as np

from truearm.compensation.limit import beyond_measured
from truearm.compensation.program_correction import MOST_SEGMENTS, CorrectedPrograms, ProgramSplit
from truearm.engine.base.errors import Notice, Rule, counted, listed
from truearm.engine.programs.chosen_targets import ALONE
from truearm.engine.programs.correction import LARGEST_STEP, LIKELY, Correction
from truearm.engine.programs.gauge import turns_between
from truearm.engine.robot.chain import Array
from truearm.engine.robot.parts import NO_PAYLOAD
from truearm.engine.robot.robot import Robot

#: Orientations are alike that differ by less [rad].
_TURNED: Final = 0.01
#: With so few targets and no frame, a correction without a mean is no correction.
_FEW_TARGETS: Final = 3
_LISTED: Final = 5
NOTHING_CORRECTED: Final = Rule(
    "nothing-corrected",
    "warning",
    "all targets stay, or only one is left to correct and nothing says where its frame is",
    gravity=2,
)
#: Share by which masses differ that are the same load.
_SAME_MASS: Final = 0.1
#: A tool is measured where the program has it, within what a calibration cannot know of the flange [m].
_TOOL_APART: Final = 0.004


TARGETS_SKIPPED: Final = Rule(
    "targets-skipped", "warning", "targets that could not be corrected, which was accepted, with the reason", gravity=2
)
INSTRUCTIONS_UNKNOWN: Final = Rule("instructions-unknown", "warning", "instructions that truearm does not know")
CONFIGURATION_ON_EDGE: Final = Rule(
    "configuration-on-edge", "warning", "targets that moved across the edge of their configuration"
)
POSTURE_GUESSED: Final = Rule(
    "posture-guessed", "warning", "nothing says in which posture the robot reaches its first pose"
)
MOVES_NOT_DIVIDED: Final = Rule("moves-not-divided", "warning", "moves that `split` could not divide")
LOAD_CHANGES: Final = Rule(
    "load-changes", "warning", "the program changes what the robot carries, and the correction does not"
)
CARRIES_NOTHING: Final = Rule("no-payload", "warning", "the arm bends, and the robot carries nothing")


def check_correction(
    robot: Robot, result: CorrectedPrograms, splits: Sequence[ProgramSplit] = ()
) -> tuple[Notice, ...]:
    """Say what is to be known about corrected programs before they run.

    Args:
        robot: Calibrated, with the payload that holds.
        result: The corrected programs.
        splits: How their moves are split, one a program; empty if they are not.
    """
    corrections = result.corrections
    notices = _corrected(result)
    skipped = sum(len(correction.skipped) for correction in corrections)
    if skipped:
        notices.append(TARGETS_SKIPPED(f"{_counted(skipped, 'target')} left unchanged, as listed with the reason."))
    notices += [*_not_better(robot, result), *_beyond(robot, result)]
    unknown: Counter[str] = sum((Counter(correction.program.unknown) for correction in corrections), Counter())
    if unknown:
        words = ", ".join(f"{word} ({number})" for word, number in unknown.most_common(_LISTED))
        notices.append(
            INSTRUCTIONS_UNKNOWN(
                f"{_counted(sum(unknown.values()), 'unknown instruction')} left alone: {words}"
                f"{', ..' if len(unknown) > _LISTED else ''}. If one of them moves the robot, its targets stay."
            )
        )
    edges = [(correction, row) for correction in corrections for row in correction.on_edge]
    if edges:
        notices.append(
            CONFIGURATION_ON_EDGE(
                f"{_counted(len(edges), 'target')} moved across the edge of a quadrant or turn of the configuration "
                f"by a joint that stands on it, as at 0: {_lines(edges)}. Controllers "
                "take the nearest posture there, but step through these first."
            )
        )
    if result.guessed:
        notices.append(
            POSTURE_GUESSED(
                f"Nothing says in which posture the robot reaches its first pose ({'; '.join(result.guessed)}): it was "
                "taken as the first that can be reached of front-up-noflip and so on, and the next as near as can be."
            )
        )
    unsplit = sum(len(split.unsplit) for split in splits)
    if unsplit:
        notices.append(
            MOVES_NOT_DIVIDED(
                f"{_counted(unsplit, 'straight or circular move')} not split: the start of such a move is not sure; or "
                "a target was not corrected, is given by joints or is an offset; or the posture changes on the way; or "
                f"{MOST_SEGMENTS} segments are not enough; or its instruction has options that segments cannot have."
            )
        )
    notices += _loads(robot, result)
    notices += _apart(result)
    if any(correction.program.load_changes for correction in corrections) and any(
        effect.loaded for effect in robot.effects
    ):
        notices.append(
            LOAD_CHANGES(
                "The programs change what the robot carries (GripLoad, TLoad, tload). Targets were corrected for the "
                "load of the tool alone; where the robot carries more, the arm bends further than is expected here."
            )
        )
    unweighed = not result.loads or None in result.loads.values()
    if robot.payload == NO_PAYLOAD and unweighed and any(effect.loaded for effect in robot.effects):
        notices.append(
            CARRIES_NOTHING(
                "The robot carries nothing in this correction. If its tool weighs something, give it with `payload`."
            )
        )
    return tuple(notices)


NO_TARGETS: Final = Rule("no-targets", "warning", "the programs hold nothing to correct", gravity=2)


def _corrected(result: CorrectedPrograms) -> list[Notice]:
    """Say what the correction rests on, or that there is none."""
    corrections = result.corrections
    if not any(correction.program.targets for correction in corrections):
        return [NO_TARGETS("There is no target in the programs that could be corrected.")]
    alone = sum(why == ALONE for correction in corrections for why in correction.kept.values())
    notices = _assumed(result) if any(correction.corrected.any() for correction in corrections) else _nothing(alone)
    return notices + _by_joints(corrections)


NOT_BETTER_HERE: Final = Rule(
    "not-better-here", "warning", "targets that would rather get worse, and what became of them", gravity=2
)


def _not_better(robot: Robot, result: CorrectedPrograms) -> list[Notice]:
    """Say which targets are rather worse off with their correction, and what became of them."""
    every = [(correction, row) for correction in result.corrections for row in correction.not_better]
    if not every:
        return []
    alone = [
        (correction, row)
        for correction, row in every
        if correction.expected is not None and correction.expected.worse[row] > LIKELY
    ]
    unchanged = [(correction, row) for correction, row in every if not correction.corrected[row]]
    corrected = len(every) - len(unchanged)
    share = f"{LIKELY:.0%}".replace("%", " %")
    words = (
        f"For {counted(len(alone), 'target')} the correction makes the real error larger with a probability above "
        f"{share}: {_lines(alone)}. "
    )
    if unchanged:
        joined = len(unchanged) + corrected - len(alone)
        words += f"{counted(len(unchanged), 'target')} {'stays' if len(unchanged) == 1 else 'stay'} as before"
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
        else "The corrections are small beside what is known of them: "
        f"{'give `tools`, or ' * _flange_counts(result)}measure more configurations near the program."
    )
    return [NOT_BETTER_HERE(words)]


def _flange_counts(result: CorrectedPrograms) -> bool:
    """Return whether it counts in programs where on the flange tools are that were not measured."""
    judged = [
        (correction, np.isfinite(correction.expected.before))
        for correction in result.corrections
        if correction.expected is not None
    ]
    turns = np.concatenate([correction.before[rows, :3, :3] for correction, rows in judged])
    alike = result.frames.frames == "assumed" and np.allclose(turns, turns[0], atol=_TURNED)
    return result.frames.tools == "assumed" and not alike


BEYOND_MEASURED: Final = Rule(
    "beyond-measured",
    "warning",
    "targets that were corrected although a joint stands there beyond what was measured, by more than a tenth of its "
    "range",
    gravity=2,
)


def _beyond(robot: Robot, result: CorrectedPrograms) -> list[Notice]:
    """Say which targets are reached with joint positions that calibration has not seen."""
    beyond = [
        (correction, row)
        for correction in result.corrections
        for row in np.flatnonzero(correction.corrected & beyond_measured(robot, correction.joints).any(axis=1)).tolist()
    ]
    if not beyond:
        return []
    return [
        BEYOND_MEASURED(
            f"{_counted(len(beyond), 'target')} corrected although {_joints_beyond(robot, beyond)} stood well outside "
            f"the range measured in calibration: {_lines(beyond)}. What the model leaves out counts more there than "
            "where it was measured."
        )
    ]


def _joints_beyond(robot: Robot, targets: Sequence[tuple[Correction, int]]) -> str:
    """Return the joints that are at some targets well beyond what was measured."""
    beyond = beyond_measured(robot, np.array([correction.joints[row] for correction, row in targets]))
    return listed([robot.joints[number].name for number in np.flatnonzero(beyond.any(axis=0)).tolist()])


def _lines(targets: Sequence[tuple[Correction, int]]) -> str:
    shown = [(correction.program.sources, correction.program.targets[row]) for correction, row in targets[:_LISTED]]
    lines = ", ".join(f"{sources[target.source].path.name} line {target.line}" for sources, target in shown)
    return f"{lines}{', ..' if len(targets) > _LISTED else ''}"


def _nothing(alone: int) -> list[Notice]:
    """Say that no target was corrected, and why not if single ones were without a frame whose place is known."""
    if not alone:
        return [NOTHING_CORRECTED("Nothing was corrected: the programs are as they were.")]
    left = "only one target is left to correct" if alone == 1 else f"{alone} targets are left, each alone in its frame"
    return [
        NOTHING_CORRECTED(
            f"Nothing can be corrected: {left}, and `frames` is not given. The error of a single target could as well "
            f"be that of its frame. {'It stays as it is' if alone == 1 else 'They stay as they are'}: give `frames`."
        )
    ]


JOINT_TARGETS_KEPT: Final = Rule("joint-targets-kept", "note", "targets given by joints, which stay")


def _by_joints(corrections: Sequence[Correction]) -> list[Notice]:
    unchanged = sum(why == "given by joints" for correction in corrections for why in correction.kept.values())
    if not unchanged:
        return []
    stay = "is given by joints and stays as it is" if unchanged == 1 else "are given by joints and stay as they are"
    return [
        JOINT_TARGETS_KEPT(
            f"{counted(unchanged, 'target')} {stay}, as home positions should. Where one was computed from a place in "
            "space, `joint_targets=correct` corrects it too."
        )
    ]


LOADS_TAKEN: Final = Rule(
    "loads-taken",
    ("warning", "note"),
    "what the arm carries with each tool, by the program or as in calibration (note); or that a tool weighs "
    "otherwise than what the robot carried then (warning)",
)


def _loads(robot: Robot, result: CorrectedPrograms) -> list[Notice]:
    """Say by what load the arm was bent with each tool, where the programs or nobody says it."""
    if not result.loads or not any(effect.loaded for effect in robot.effects):
        return []
    weighed = [f"{tool or 'the flange'} {load.mass:g} kg" for tool, load in result.loads.items() if load is not None]
    others = [tool or "the flange" for tool, load in result.loads.items() if load is None]
    own = robot.payload.mass
    other = any(abs(load.mass - own) > _SAME_MASS * max(load.mass, own) for load in result.loads.values() if load)
    sentences = [f"The programs say what their tools weigh: {', '.join(weighed)}."] if weighed else []
    if others:
        sentences.append(
            f"No mass is known of {listed(others)}: there the {robot.payload.mass:g} kg of the calibration are kept."
        )
    sentences.append("`payload` says it for all of them.")
    if not other:
        return [LOADS_TAKEN(" ".join(sentences), "note")]
    sentences.append(
        f"In its calibration the robot carried {own:g} kg. If it carried one of these tools then, that payload was "
        "wrong: calibration and programs are off by what it bends, and the errors to expect do not contain that."
    )
    return [LOADS_TAKEN(" ".join(sentences))]


TOOL_APART: Final = Rule(
    "tool-apart",
    "warning",
    "a tool that was measured is more than 4 mm from where the program has it",
    cure="Check that the target is the tip of that tool, and that the last joint has its zero where the controller "
    "has it.",
)


def _apart(result: CorrectedPrograms) -> list[Notice]:
    """Say which tools are not where the program has them."""
    far = {tool: apart for tool, apart in result.tools_apart.items() if apart > _TOOL_APART}
    if not far:
        return []
    words = ", ".join(f"{tool or 'the flange'} by {apart * 1e3:.1f} mm" for tool, apart in far.items())
    return [
        TOOL_APART(
            f"Tools are not where the program has them on the flange: {words}. A flange that calibration cannot place "
            "explains one or two millimetres."
        )
    ]


TOOLS_ASSUMED: Final = Rule("tools-assumed", "warning", "where base and flange were put, because the files do not say")
FRAMES_ASSUMED: Final = Rule(
    "frames-assumed", "warning", "where base and flange were put, because the files do not say", gravity=2
)


def _assumed(result: CorrectedPrograms) -> list[Notice]:
    notices = []
    frames, words = result.frames, frame_words(result)
    if frames.frames == "assumed" and not result.choice.was_taught("points"):
        few = [number for number in _targets_by_shift(result) if number <= _FEW_TARGETS]
        if few:
            words[0] += f" With so few targets ({min(few)}) little or nothing of the correction is left: give `frames`."
        if few or not result.choice.was_taught("frames"):
            notices.append(FRAMES_ASSUMED(words[0]))
    if frames.tools == "assumed" and not result.choice.was_taught("tools"):
        notices.append(TOOLS_ASSUMED(words[-1]))
    return notices


def _targets_by_shift(result: CorrectedPrograms) -> list[int]:
    """Return how many targets each shift of the base was found from."""
    apart = result.choice.was_taught("frames")
    number: Counter[str] = Counter()
    for correction in result.corrections:
        for row, target in enumerate(correction.program.targets):
            if correction.corrected[row] or row in correction.not_better:
                number[target.frame.lower() if apart else ""] += 1
    return list(number.values())


def frame_words(result: CorrectedPrograms) -> list[str]:
    """Return what was taken for the real base and flange, in words: first of the frames, then of the tools."""
    frames = result.frames

    def size(shift: Array) -> str:
        turned = math.degrees(float(np.linalg.norm(turns_between(np.eye(4)[None], shift[None])[0])))
        return f"{np.linalg.norm(shift[:3, 3]) * 1e3:.3f} mm and {turned:.4f} deg"

    if frames.frames == "held":
        sentences = [
            "The calibration held the base, so it is known where the program's frames are: where the controller has "
            "them. Targets are corrected in them, and may all move together."
        ]
    elif frames.frames == "identified":
        sentences = [
            "The program's frames are where `frames` places them; targets are corrected in them, and may all move "
            "together."
        ]
    elif result.choice.was_taught("points"):
        sentences = ["The points were taught, and stay. Offsets from them are corrected to be as long as they say."]
    elif result.choice.was_taught("frames"):
        sentences = [
            "The frames were taught with this robot. So in each of them the base was shifted until the corrections of "
            "its targets have no shift and no turn in common: they are right to each other, and their pattern stays "
            "where it was taught."
        ]
    else:
        sentences = [
            "The targets are right relative to each other. Where the whole pattern lies is not known: give the frames "
            f"a measured place (`frames`). The base was shifted by {size(frames.base)}, so that the corrections have "
            "no shift and no turn in common."
        ]
    if frames.tools == "identified":
        sentences.append("The program's tools are where `tools` places them, on the identified flange.")
    elif frames.tools == "held":
        sentences.append(
            "The calibration held targets on the flange, so the program's tools are where the controller has them."
        )
    else:
        assumption = (
            "The tools were taught with this robot"
            if result.choice.was_taught("tools")
            else "No tool has a measured place (`tools`)"
        )
        sentences.append(
            f"{assumption}. The flange is taken to be where it agrees best with the nominal one over the workspace, "
            f"{size(frames.flange)} from the identified one."
        )
        if any(correction.expected is not None for correction in result.corrections):
            sentences[-1] += " The errors to expect contain that."
    return sentences


def _counted(number: int, noun: str) -> str:
    """Return that so many were: ``1 target was``, ``2 targets were``."""
    return f"{number} {noun}{' was' if number == 1 else 's were'}"
