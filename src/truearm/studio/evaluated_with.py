"""What a result of tests by ISO 9283 is of, as it says itself, and what of that is not what is chosen now."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

from truearm.engine.base.errors import InputError, Notice, Rule
from truearm.engine.base.files import read_bytes
from truearm.engine.base.manifest import hash_of
from truearm.engine.robot.robot import Robot, fitted_from
from truearm.iso9283.evaluating.comparison import ReadFile, ResultFile
from truearm.iso9283.planning.criteria import PerformancePlan
from truearm.iso9283.planning.plan_file import read_plan
from truearm.studio.cube_in_space import is_of_plan
from truearm.studio.project import Project, stamp_of

#: What was measured, and how it was evaluated.
_MEASURED: Final = ("poses", "paths", "settling", "forces")
_HOW: Final = ("alignment", "compare")
#: Deviations that a file holds in other units come back within this share.
_SAME: Final = 1e-9


def evaluated_with(result: ResultFile) -> str:
    """Return what a result is of, in one line."""
    inputs = result.inputs or {}
    told = [result.robot, *(f"{name} {inputs[name].file}" for name in ("plan", *_MEASURED, *_HOW) if name in inputs)]
    if result.instrument is not None:
        told.append(_noise(result.instrument.sigma_mm, result.instrument.sigma_rot_deg))
    return f"Of {', '.join(told)}."


OTHER_ROBOT: Final = Rule(
    "other-robot",
    "warning",
    "the result is of [another robot](studio.md#what-a-result-is-of) than the one that is chosen; programs are not "
    "corrected with it, and the page Jog does not draw it",
)
OTHER_SETTINGS: Final = Rule(
    "other-settings",
    "warning",
    "the result or the plan that stands there was made with other settings, measurements or files than are chosen, "
    "such as another model, seed, payload or plan of tests; or files have changed since, or it does not tell",
)


def other_evaluations(result: ResultFile | None, project: Project, robot: Robot) -> list[Notice]:
    """Return what a result is not of, though it is chosen now; of no result, whether the plan is of the robot.

    Args:
        robot: The one that is chosen.
    """
    files = project.settings.performance
    plan = None if files.plan is None else _plan(project, files.plan)
    notices = _other_robot(result, plan, project, robot)
    if result is None:
        return notices
    pairs: list[tuple[str, str]] = []
    if result.inputs is None:
        text = (
            "This result does not say which files it is of, as it was written by an older version: whether they are "
            "those that are chosen cannot be told. Evaluate them again."
        )
        notices.append(OTHER_SETTINGS(text))
        if plan is not None and not is_of_plan(result, plan):
            notices.append(OTHER_SETTINGS("This result is of another plan than the one that is chosen."))
    else:
        plans = [*_other_files(("plan",), result.inputs, project)] or [*_other_robot_file(result.inputs, project)]
        notices += _told("was evaluated by", plans)
        notices += _told("is of", [*_other_files(_MEASURED, result.inputs, project)])
        pairs += _other_files(_HOW, result.inputs, project)
    instrument = result.instrument
    if instrument is not None and not (
        _near(instrument.sigma_mm, files.noise_mm) and _near(instrument.sigma_rot_deg, files.noise_rot_deg)
    ):
        then = _noise(instrument.sigma_mm, instrument.sigma_rot_deg)
        pairs.append((then, _noise(files.noise_mm, files.noise_rot_deg)))
    return [*notices, *_told("was made with", pairs)]


def stamps_of(project: Project) -> tuple[Any, ...]:
    """Return what changes where a file of the tests that is chosen does, or the robot's."""
    files = project.settings.performance
    plan = () if files.plan is None else sorted(project.path(files.plan).parent.glob("*.y*ml"))
    chosen = [project.path(name) for name in (getattr(files, one) for one in (*_MEASURED, *_HOW)) if name is not None]
    robot = project.robot_file()  # no file for a robot of the library
    return tuple(map(stamp_of, (*plan, *chosen, robot)))


def _other_robot(
    result: ResultFile | None, plan: PerformancePlan | None, project: Project, robot: Robot
) -> list[Notice]:
    """Say which robot plan and result are of, where that is not the one that is chosen."""
    source = project.settings.robot
    now = robot.name if source == robot.name else f"{robot.name} ({source})"
    of: dict[str, list[str]] = {}
    if plan is not None and plan.robot.name != robot.name:
        of.setdefault(plan.robot.name, []).append("the plan that is chosen")
    elif plan is not None and not (fitted_from(plan.robot, robot) or fitted_from(robot, plan.robot)):
        of.setdefault(f"{plan.robot.name} with other kinematics", []).append("the plan that is chosen")
    if result is not None and result.robot != robot.name:
        of.setdefault(result.robot, []).append("this result")
    found = []
    for name, things in of.items():
        are = "are" if len(things) > 1 else "is"
        text = f"{' and '.join(things)} {are} of the robot {name}, and {now} is chosen."
        found.append(OTHER_SETTINGS(text[0].upper() + text[1:]))
    return found


def _other_files(names: tuple[str, ...], inputs: dict[str, ReadFile], project: Project) -> Iterator[tuple[str, str]]:
    """Return each file that is another one now, or has changed: what it was, and what it is."""
    for name in names:
        then, now = inputs.get(name), getattr(project.settings.performance, name)
        if then is None and now is None:
            continue
        if then is None:
            yield f"no {name}", f"{name} {now}"
        elif now is None:
            yield f"{name} {then.file}", f"no {name}"
        else:
            yield from _changed(name, then, now, project.path(now), project.folder)


def _other_robot_file(inputs: dict[str, ReadFile], project: Project) -> Iterator[tuple[str, str]]:
    """Return the robot file beside the plan, where it has changed."""
    then, plan = inputs.get("robot"), project.settings.performance.plan
    if then is not None and plan is not None and Path(then.file).name:
        path = project.path(plan).with_name(Path(then.file).name)
        yield from _changed("robot", then, project.relative(path), path, project.folder)


def _changed(name: str, then: ReadFile, now: str, path: Path, folder: Path) -> Iterator[tuple[str, str]]:
    """Return a file as it was and as it is, where the two differ."""
    content = _hash(path)
    if content == then.sha256:
        return
    if content is None:
        yield f"{name} {then.file}", f"{name} {now}, which cannot be read"
    elif folder / then.file == path:
        yield f"{name} {then.file} as it was then", f"{name} {now} as it is now"
    else:
        yield f"{name} {then.file}", f"{name} {now}"


def _told(verb: str, pairs: list[tuple[str, str]]) -> list[Notice]:
    if not pairs:
        return []
    was, is_now = ("; ".join(pair[k] for pair in pairs) for k in (0, 1))
    return [OTHER_SETTINGS(f"This result {verb} {was}. Chosen now: {is_now}. Evaluate again.")]


def _plan(project: Project, name: str) -> PerformancePlan | None:
    """Return a plan; None for one that cannot be read, which is refused where it is used."""
    try:
        return read_plan(project.path(name))
    except InputError:
        return None


def _noise(sigma_mm: float, sigma_rot_deg: float | None) -> str:
    return f"noise {sigma_mm:.6g} mm" + ("" if sigma_rot_deg is None else f" and {sigma_rot_deg:.6g} deg")


def _near(one: float | None, other: float) -> bool:
    return one is not None and math.isclose(one, other, rel_tol=_SAME)


def _hash(path: Path) -> str | None:
    """Return the hash of a file as it is now; None if it cannot be read."""
    stamp = stamp_of(path)
    try:
        return None if stamp is None else _hash_at(path, stamp)
    except InputError:
        return None


@lru_cache(maxsize=64)
def _hash_at(path: Path, stamp: tuple[str, int, int]) -> str:
    """Return the hash of a file as it is with a stamp: large ones are not read anew at every edit."""
    return hash_of(read_bytes(path, "samples_size"))
