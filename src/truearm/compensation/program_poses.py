"""From the numbers of a program's targets to poses and joints, and back."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from truearm.compensation.programs.numbers import rewritten
from truearm.compensation.programs.program import Edit, Form, Program, ProgramTarget
from truearm.errors import InputError
from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot
from truearm.modeling.transform import homogeneous


def poses_of(program: Program) -> Array:
    """Return the poses of targets in their frames, ``(n, 4, 4)`` [m]; NaN where a target is given by joints."""
    targets = program.targets
    poses = np.full((len(targets), 4, 4), np.nan)
    for form, rows in _by_form(targets):
        if form.kind == "pose":
            poses[rows] = _poses(form, np.array([targets[row].values for row in rows]))
    for generation in _generations(targets):
        for row in generation:
            target, offset = targets[row], poses[row].copy()
            parent = poses[target.parent]
            poses[row] = parent @ offset
            if not target.turned:
                poses[row, :3, 3] = parent[:3, 3] + offset[:3, 3]
    return poses


def joints_of(robot: Robot, program: Program) -> Array:
    """Return the joint positions of the model for targets given by joints, ``(n, joints)`` [rad or m]; else NaN.

    Raises:
        InputError: If a target has not as many joints as the robot, or its pulses are not known.
    """
    targets = program.targets
    joints = np.full((len(targets), len(robot.joints)), np.nan)
    for form, rows in _by_form(targets):
        if form.kind == "pose":
            continue
        for row in rows:
            if len(targets[row].values) != len(robot.joints):
                raise InputError(
                    "the target has not as many joints as the robot",
                    where=place(program, targets[row]),
                    came=f"{len(targets[row].values)} joints",
                    allowed=f"{len(robot.joints)} for {robot.name}",
                )
        values = np.array([targets[row].values for row in rows])
        if form.kind == "pulses":
            counted = robot.controller.from_pulses(values)
        else:
            counted = values * _joint_units(robot, form)
        joints[rows] = robot.controller.to_model(counted)
    return joints


def offsets_in_order(program: Program) -> Iterator[int]:
    """Go through the targets that are offsets, each after the one that it is an offset from."""
    for generation in _generations(program.targets):
        yield from generation


def place(program: Program, target: ProgramTarget) -> str:
    """Return where a target stands, for a message."""
    return program.sources[target.source].where(target.line)


def pose_numbers(program: Program, before: Array, after: Array, rows: NDArray[np.intp]) -> dict[int, Array]:
    """Return new numbers of some targets given by poses, by their index, in the units of their forms.

    Args:
        before, after: Poses of all targets in their frames, ``(n, 4, 4)`` [m], as the program has them and as it shall.
        rows: Which targets.
    """
    targets = program.targets
    offsets = after.copy()
    for row in rows:
        target = targets[row]
        if target.parent is not None:
            parent = after[target.parent]
            offsets[row] = np.linalg.inv(parent) @ after[row]
            if not target.turned:
                offsets[row, :3, 3] = after[row, :3, 3] - parent[:3, 3]
    made: dict[int, Array] = {}
    for form, members in _by_form(targets, rows):
        if form.kind == "pose":
            numbers = numbers_of(form, offsets[members], np.array([targets[row].values for row in members]))
            made |= dict(zip(members.tolist(), numbers, strict=True))
    return made


def joint_numbers(robot: Robot, program: Program, joints: Array, rows: NDArray[np.intp]) -> dict[int, Array]:
    """Return new numbers of some targets given by joints, as :func:`pose_numbers`; `joints` are those of all."""
    made: dict[int, Array] = {}
    for form, members in _by_form(program.targets, rows):
        if form.kind == "pose":
            continue
        counted = robot.controller.from_model(joints[members])
        if form.kind == "pulses":
            numbers = robot.controller.to_pulses(counted)
        else:
            numbers = counted / _joint_units(robot, form)
        made |= dict(zip(members.tolist(), numbers, strict=True))
    return made


def numbers_of(form: Form, poses: Array, near: Array) -> Array:
    """Return the numbers of poses ``(n, 4, 4)``, of all the writings of an orientation the one nearest to `near`."""
    position = poses[:, :3, 3] / form.length
    if form.orientation is None:
        return np.asarray(position)
    turned = form.orientation.numbers(poses[:, :3, :3], near[:, 3:] * form.angle) / form.angle
    return np.concatenate([position, turned], axis=1)


def edits_of(program: Program, numbers: dict[int, Array]) -> list[Edit]:
    """Return what changes in the text when targets get new numbers; a number that stays the same is not among it."""
    edits = []
    for index, new in numbers.items():
        target = program.targets[index]
        text, (lengths, others) = program.sources[target.source].text, target.form.decimals
        fewest = [lengths] * 3 + [others] * (len(new) - 3) if target.form.kind == "pose" else [others] * len(new)
        for number, (span, value, decimals) in enumerate(zip(target.places, new.tolist(), fewest, strict=True)):
            if span is not None:
                old = text[span[0] : span[1]] or "0"
                made = rewritten(old, value, decimals)
                if made != old:
                    absent = span[0] == span[1]
                    edits.append(
                        Edit(target.source, *span, target.form.absent[number].format(made) if absent else made)
                    )
    return edits


def _poses(form: Form, values: Array) -> Array:
    turned = np.eye(3) if form.orientation is None else form.orientation.matrices(values[:, 3:] * form.angle)
    return homogeneous(turned, values[:, :3] * form.length)


def _joint_units(robot: Robot, form: Form) -> Array:
    return np.array([form.angle if joint.kind == "revolute" else form.length for joint in robot.joints])


def _by_form(
    targets: Sequence[ProgramTarget], rows: NDArray[np.intp] | None = None
) -> Iterator[tuple[Form, NDArray[np.intp]]]:
    groups: dict[int, tuple[Form, list[int]]] = {}
    for row in range(len(targets)) if rows is None else rows.tolist():
        form = targets[row].form
        groups.setdefault(id(form), (form, []))[1].append(row)
    for form, members in groups.values():
        yield form, np.array(members)


def _generations(targets: Sequence[ProgramTarget]) -> Iterator[list[int]]:
    """Return the targets that are offsets, those of offsets after these."""
    known = {row for row, target in enumerate(targets) if target.parent is None}
    left = [row for row in range(len(targets)) if row not in known]
    while left:
        ready = [row for row in left if targets[row].parent in known]
        if not ready:  # an offset from itself
            raise ValueError("offsets in a circle")
        yield ready
        known.update(ready)
        left = [row for row in left if row not in known]
