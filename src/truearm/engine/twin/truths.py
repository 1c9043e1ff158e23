"""Where the truth of a simulated robot comes from."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from truearm.engine.base.errors import InputError, counted, did_you_mean
from truearm.engine.base.files import exists
from truearm.engine.robot.chain import Array
from truearm.engine.robot.effects.fourier import HARMONICS
from truearm.engine.robot.effects.joint_curve import HIGHEST
from truearm.engine.robot.effects.linear_contact import LinearContactClearance
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import NO_PAYLOAD, Payload, Tool
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform, rotation_from_quaternion
from truearm.engine.twin.gear_errors import DRAWN, with_errors_drawn
from truearm.engine.twin.twin import Twin
from truearm.engine.twin.twin_joint import PERFECT, Contact, JointTruth

#: Three reflectors about 150 mm apart, like the triangular artefact of Nubiola, section 2.2.1.
DEFAULT_TOOL = Tool({"1": (0.0, 0.0, 0.125), "2": (0.075, 0.0937, 0.215), "3": (0.150, 0.0, 0.125)})

#: Where a simulated instrument sees the robot stand: 2.6 m away, a little lower, turned by a third of a turn.
STATION = Transform((2.4, 0.9, -0.5), (math.cos(math.pi / 3), 0.0, 0.0, math.sin(math.pi / 3)))


def truth_names(robot: Robot) -> tuple[str, ...]:
    """Return the truths a robot can be simulated with by name."""
    return ("nominal", "random", *DRAWN, *robot.truths)


def truth_twin(robot: Robot, truth: Robot | str | Path, rng: np.random.Generator) -> Twin:
    """Return the twin of a robot.

    Args:
        robot: The nominal robot.
        truth: ``nominal``; ``random``, geometry and joint zeros drawn from their priors; ``gear-errors`` and
            ``tooth-errors``, the same with errors of encoders and gears (:mod:`truearm.engine.twin.twin_joint`); the
            name of one of the robot file's truths; or a robot or its file, whose own base and targets are used if it
            has any.
        rng: For what is drawn.

    Raises:
        InputError: If there is no such truth, or the file is of another kind of robot.
    """
    tool = next(iter(robot.tools.values()), DEFAULT_TOOL)
    if isinstance(truth, Robot):
        return _twin_of(robot, truth, truth.name)
    if truth in robot.truths:
        published = robot.truths[str(truth)]
        true = robot.with_values(published.values)
        joints = joint_truths(true)
        for kind in ("compliance", "backlash", "clearance"):
            for number, value in getattr(published, kind).items():
                joints[number] = replace(joints.get(number, PERFECT), **{kind: value})
        return Twin(at_station(true, tool), joints, _contact(true))
    if truth == "nominal":
        return Twin(at_station(robot, tool), joint_truths(robot), _contact(robot))
    if truth == "random" or truth in DRAWN:
        drawn = {
            p.name: p.value + p.prior * float(rng.standard_normal())
            for p in robot.parameters.values()
            if p.group in ("geometry", "joint zero")
        }
        joints = joint_truths(robot)
        if truth in DRAWN:
            joints = with_errors_drawn(robot, joints, DRAWN[str(truth)], rng)
        return Twin(at_station(robot.with_values(drawn), tool), joints, _contact(robot))
    if not Path(truth).suffix and not exists(Path(truth)):
        known = truth_names(robot)
        raise InputError(
            f"{robot.name} has no truth of this name",
            parameter="truth",
            came=str(truth),
            allowed=f"{', '.join(known)}, or a robot file",
            cure=did_you_mean(str(truth), known),
        )
    return _twin_of(robot, load_robot(truth), str(truth))


def _twin_of(robot: Robot, other: Robot, where: str) -> Twin:
    """Return the twin that another robot describes, of the same kind as the nominal one."""
    if [j.kind for j in other.joints] != [j.kind for j in robot.joints]:
        raise InputError(
            f"this robot has other joints than {robot.name}",
            where=where,
            came=counted(len(other.joints), "joint"),
            allowed=f"{len(robot.joints)}, of the same kinds",
        )
    tool = next(iter(robot.tools.values()), DEFAULT_TOOL)
    return Twin(other if other.targets else at_station(other, tool), joint_truths(other), _contact(other))


def joint_truths(robot: Robot) -> dict[int, JointTruth]:
    """Return what the joint effects of a robot file say about each joint.

    The twin computes every effect a second time, on a path of its own, so that one can be held against the other. What
    it knows is therefore named here parameter by parameter, and not taken from the effects.

    Raises:
        InputError: If the robot has an effect that the twin does not compute.
    """
    values = robot.values
    known = {
        "warm_up_rate",
        "warm_up_left",
        *(f"gain_{number}" for number in range(1, len(robot.joints) + 1)),
        *(f"balancer_{number}" for number in range(1, len(robot.balancers) + 1)),
    }  # read by the twin itself

    def of(name: str, number: int) -> float:
        known.add(f"{name}_{number}")
        return values.get(f"{name}_{number}", 0.0)

    def sines(number: int) -> tuple[tuple[int, float, float], ...]:
        parts = ((k, of(f"fourier_sin{k}", number), of(f"fourier_cos{k}", number)) for k in HARMONICS)
        curve = ((k, of(f"curve_sin{k}", number), of(f"curve_cos{k}", number)) for k in range(1, HIGHEST + 1))
        first, *further = robot.joints[number - 1].periods or (0,)
        gear = (first, of("transmission_sin", number), of("transmission_cos", number))
        lines = ((k, of(f"transmission_sin{k}", number), of(f"transmission_cos{k}", number)) for k in further)
        return tuple((k, math.hypot(s, c), math.atan2(c, s)) for k, s, c in (*parts, *curve, gear, *lines) if s or c)

    def bending(number: int) -> tuple[tuple[float, float, float], ...]:
        rows = tuple(
            (of(f"bending_{a}x", number), of(f"bending_{a}y", number), of(f"bending_{a}z", number)) for a in "xyz"
        )
        return rows if any(map(any, rows)) else ()

    def moments(number: int) -> tuple[tuple[int, float, float, float], ...]:
        links = range(number + 1, len(robot.joints) + 1)
        rows = ((k, of(f"moment_x{k}", number), of(f"moment_y{k}", number), of(f"moment_z{k}", number)) for k in links)
        return tuple(row for row in rows if any(row[1:]))

    def run_out(number: int) -> tuple[tuple[float, float], ...]:
        pairs = tuple((of(f"run_out_{a}_sin", number), of(f"run_out_{a}_cos", number)) for a in "xyz")
        return pairs if any(map(any, pairs)) else ()

    truths = {
        number: JointTruth(
            compliance=of("compliance", number),
            quadratic=of("compliance_quadratic", number),
            cubic=of("compliance_cubic", number),
            backlash=of("backlash", number),
            clearance=of("clearance", number),
            bearing=of("bearing_compliance", number),
            gear=sines(number),
            hysteresis=of("approach", number),
            bending=bending(number),
            moments=moments(number),
            run_out=run_out(number),
            growth=of("thermal_growth", number),
            warm_up=of("warm_up", number),
        )
        for number in range(1, len(robot.joints) + 1)
    }
    unknown = [p.name for effect in robot.effects for p in effect.parameters if p.name not in known]
    if unknown:
        raise InputError(
            "the digital twin does not compute this joint effect",
            parameter="truth",
            where=robot.name,
            came=unknown[0],
            cure="Take it out of the robot file; a simulation would leave it out without a word.",
        )
    return truths


def _contact(robot: Robot) -> Contact:
    return "document" if any(isinstance(effect, LinearContactClearance) for effect in robot.effects) else "exact"


def carrying_targets(robot: Robot) -> Robot:
    """Return a robot with its own targets, else with those of its tool: the file's first, or three reflectors."""
    if robot.targets:
        return robot
    tool = next(iter(robot.tools.values()), DEFAULT_TOOL)
    carrying = robot.with_payload(Payload(tool.mass, tool.cog)) if robot.payload == NO_PAYLOAD else robot
    return carrying.with_frames(robot.base, tool.targets)


def at_station(robot: Robot, tool: Tool) -> Robot:
    """Return a robot with its base as it is, seen from the station, carrying a tool.

    A payload that the robot has already includes the tool's mass.
    """
    base, R = robot.base, rotation_from_quaternion(np.array(STATION.quaternion))
    moved: Array = R @ np.array(base.translation) + np.array(STATION.translation)
    placed = robot.with_frames(Transform.from_matrix(R @ base.rotation, moved), tool.targets)
    payload = Payload(tool.mass, tool.cog) if robot.payload == NO_PAYLOAD else robot.payload
    return replace(placed, payload=payload, history=(*robot.history, "simulated truth"), proof=None)
