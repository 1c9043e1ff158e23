"""What to know of payloads and of external forces on the tool."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from truearm.engine.base.errors import Notice, Rule
from truearm.engine.diagnose.unmodelled import PAYLOAD, LeftOver, explanation
from truearm.engine.robot.chain import Array
from truearm.engine.robot.loads import joint_efforts
from truearm.engine.robot.parameters import Parameter
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY, Transform
from truearm.engine.robot.wrench import STANDARD_GRAVITY

#: Payload over the cube of the reach that no arm carries [kg/m^3]. Strong ones carry 45 (2300 kg at 3.7 m), the IRB 120
#: 15 (3 kg at 0.58 m).
_MOST: Final = 450.0
#: Rated loads that no arm is made to carry.
_OVERLOAD: Final = 2.0
#: Configurations at which the reach is looked for.
_PLACES: Final = 200


PAYLOAD_UNLIKELY: Final = Rule(
    "payload-unlikely",
    "warning",
    "the payload is more than twice the rated load, or, where that is not known, ten times what the strongest arms of "
    "this reach carry (450 kg times the cube of the reach in metres): grams called kilograms? Or its centre of gravity "
    "is farther from the flange than the arm reaches, or another payload explains the readings of a fit of `auto`",
    gravity=2,
)


RATED_LOAD_EXCEEDED: Final = Rule(
    "rated-load-exceeded", "warning", "the payload, or payload and force together, are more than the rated load"
)


def check_payload(robot: Robot) -> list[Notice]:
    """Return a notice if the payload is too heavy for this arm or one like it, or lies beyond its reach.

    Where a force acts on the tool, :func:`check_force` holds both against the rated load.
    """
    mass = robot.payload.mass
    if mass <= 0.0:
        return []
    joints = robot.random_configurations(_PLACES, np.random.default_rng(0))
    reach = float(np.linalg.norm(robot.with_frames(Transform(), {}).world_poses(joints)[0], axis=1).max())
    away = math.hypot(*robot.payload.cog)
    if away > reach:
        return [
            PAYLOAD_UNLIKELY(
                f"The centre of gravity of the payload lies {away:.3g} m from the flange, and {robot.name} reaches "
                f"{reach:.2g} m. Were millimetres called metres? What loads the joints follows from it."
            )
        ]
    rated = robot.rated_load
    most = _MOST * reach**3 if rated is None else _OVERLOAD * rated
    if rated is not None and rated < mass <= most and robot.wrench is None:
        return [RATED_LOAD_EXCEEDED(f"The payload is {mass:.4g} kg, and {robot.name} is rated for {rated:g} kg.")]
    if mass <= most:
        return []
    beside = (
        f"{robot.name} reaches {reach:.2g} m: no arm of that size carries more than {most:.2g} kg"
        if rated is None
        else f"{robot.name} is rated for {rated:g} kg"
    )
    return [
        PAYLOAD_UNLIKELY(
            f"The payload is {mass:.4g} kg, and {beside}. Were grams called kilograms? What loads the joints follows "
            "from it."
        )
    ]


def check_payload_read(left: LeftOver) -> list[Notice]:
    """Return a notice if another payload than the one given explains what a fit leaves whose joints give way at most.

    Args:
        left: Of a fit of every effect, see :attr:`truearm.engine.diagnose.case.Case.left_by_few`.
    """
    found = explanation(left)
    if found is None or found.cause != PAYLOAD:
        return []
    mass = f"{found.mass:.2g} kg" if found.mass else "another load"
    payload = left.fit.robot.payload
    stated = f"{payload.mass:g} kg" if payload.mass else "none"
    return [
        PAYLOAD_UNLIKELY(
            f"Either the payload is wrong or masses in the robot file are: the readings look like {mass} on the flange "
            f"instead of {stated}. With that, joints that give way leave {1.0 - found.left:.0%} less. Other effects "
            "make up for it here, and predictions with another payload will be wrong. Check what the robot carried "
            "(`payload`), then the masses."
        )
    ]


#: Configurations that are looked at of each robot.
_MOST_EXTERNAL_FORCE: Final = 300
#: A parameter of which the data told less than this share is taken from its prior.
_INFORMED: Final = 0.5
#: What moves a tip by less does not matter [m].
_NOTHING: Final = 1e-5
#: How far beyond the loads of the calibration is taken for known, in widths of their range.
_BEYOND: Final = 0.5
_LISTED: Final = 4


@dataclass(frozen=True)
class _Bending:
    """What a force does at the worst of some configurations."""

    moved: float  #: moved, uncertain: of the tip, and its standard deviation [m].
    uncertain: float | None
    #: How uncertain the tip is by each parameter that the data did not determine [m], the most first.
    unseen: dict[str, float]
    efforts: Array  #: Load that the force adds on each joint [N m or N].
    #: Joints that are loaded beyond what they carried in calibration, from 0: with the load that reaches farthest.
    beyond: dict[int, float]
    rigid: bool  #: Whether no joint gives way although the force loads some.


FORCE_TAKEN: Final = Rule("force-taken", "note", "how far the force moves the tip at most, and how well that is known")
FORCE_ON_RIGID_MODEL: Final = Rule(
    "force-on-rigid-model",
    "warning",
    "the model has no joints that give way, so the force changes nothing",
    cure="Calibrate with a model that has compliance, for instance elastic.",
    gravity=2,
)


# Gravity loads the joints of a calibration, and nothing else does: it never turns the upright axis of joint 1, so its
# compliance stays what the prior said, and no prediction at rest depends on it. A sideways force at the tool turns that
# joint. What each parameter of the joints' elasticity does to the tip is compared with and without the force; with the
# deviations that the calibration found, the difference says how well the bending is known.
def check_force(cases: Sequence[tuple[Robot, Array | Postures]]) -> list[Notice]:
    """Return what is to be said of forces at the tool, or at the flange.

    Args:
        cases: Robots, with what acts on their tools, and the joint positions ``(n, joints)``, or postures with what
            acts on the flange, at which it does; those where nothing acts are left out. They are one robot with several
            forces.
    """
    acting = [(robot, at) for robot, q in cases if len(at := _some(Postures.of(q))) and _pushed(robot, at)]
    if not acting:
        return []
    robot = acting[0][0]
    bendings = [_bending(arm, at) for arm, at in acting]
    notices = [*_turned([arm for arm, _ in acting]), *_rated([arm for arm, _ in acting])]
    if all(bending.rigid for bending in bendings):
        return [
            FORCE_ON_RIGID_MODEL(
                "The model has no joints that give way, so the force at the tool changes nothing in it, and the real "
                "arm bends."
            ),
            *notices,
        ]
    worst = max(bendings, key=lambda bending: bending.moved)
    known = [bending.uncertain for bending in bendings if bending.uncertain is not None]
    well = f", which is known to {max(known) * 1e3:.2g} mm (standard deviation)" if known else ""
    notices.insert(
        0,
        FORCE_TAKEN(f"The force at the tool moves its tip by up to {worst.moved * 1e3:.3g} mm{well}."),
    )
    return [*_unseen(robot, bendings), *_beyond(robot, bendings), *notices]


def _pushed(robot: Robot, at: Postures) -> bool:
    return robot.wrench is not None or (at.wrench is not None and bool(at.wrench.any()))


def _some(at: Postures) -> Postures:
    known = np.flatnonzero(np.isfinite(at.joints).all(axis=1))
    evenly = np.linspace(0, len(known) - 1, min(len(known), _MOST_EXTERNAL_FORCE)).astype(int)
    return at.at(known[np.unique(evenly)])


def _bending(robot: Robot, at: Postures) -> _Bending:
    at = robot.loaded(at)
    free, at_rest = robot.with_wrench(None), replace(at, wrench=None, loads=None)
    with_force, without = joint_efforts(robot, at), joint_efforts(free, at_rest)
    tip = np.array(IDENTITY.translation if robot.wrench is None else robot.wrench.tool.translation)
    (places, by_parameter), (before, before_by) = (_tips(*case, tip) for case in ((robot, at), (free, at_rest)))
    moved = float(np.linalg.norm(places - before, axis=1).max())
    change = by_parameter - before_by
    names = [p.name for p in _elastic(robot)]
    size = np.linalg.norm(change, axis=1).max(axis=1)  # (parameters,) per unit
    unseen, uncertain = {}, None
    if robot.proof is not None:
        for name, per_unit in zip(names, size.tolist(), strict=True):
            parameter = robot.parameters[name]
            deviation = parameter.prior if parameter.deviation is None else parameter.deviation
            if (parameter.informed or 0.0) < _INFORMED and per_unit * deviation > _NOTHING:
                unseen[name] = per_unit * deviation
        rows = [robot.proof.names.index(name) if name in robot.proof.names else -1 for name in names]
        known = np.array([row >= 0 for row in rows], dtype=bool)
        root = robot.proof.root[[row for row in rows if row >= 0]]
        spread = np.einsum("pcn,pk->ckn", change[known], root)
        square = np.sum(spread**2, axis=(0, 1))
        priors = np.array([robot.parameters[name].prior for name in names])[~known]
        square = square + np.sum((change[~known] * priors[:, None, None]) ** 2, axis=(0, 1))
        uncertain = float(np.sqrt(square.max(initial=0.0)))
    loaded = np.abs(with_force - without).max(axis=0)
    return _Bending(
        moved,
        uncertain,
        dict(sorted(unseen.items(), key=lambda item: -item[1])),
        loaded,
        _loaded_beyond(robot, at, tip, with_force),
        rigid=not names and bool(loaded.any()),
    )


def _elastic(robot: Robot) -> list[Parameter]:
    """Return the parameters of effects that depend on loads."""
    return [parameter for effect in robot.effects if effect.loaded for parameter in effect.parameters]


def _tips(robot: Robot, q: Postures, tip: Array) -> tuple[Array, Array]:
    """Return tips ``(n, 3)``, and how they follow the elastic parameters ``(parameters, 3, n)``, in the world."""
    at = robot.loaded(q)
    kinematics = robot.forward_kinematics(at)
    linear, angular = robot.jacobians(kinematics, at, [parameter.name for parameter in _elastic(robot)])
    arm = kinematics.matrix() @ tip
    return kinematics.position.T + arm, linear + np.cross(angular, arm.T[None], axis=1)


def _loaded_beyond(robot: Robot, q: Postures, tip: Array, efforts: Array) -> dict[int, float]:
    """Return the loads beyond those of the calibration by so much that the tip follows [N m or N], by joint."""
    if robot.proof is None or not robot.proof.loads:
        return {}
    low, high = np.array(robot.proof.loads).T
    excess = np.maximum(np.maximum(efforts - high, low - efforts) - _BEYOND * (high - low), 0.0)
    count = len(robot.joints)
    turned = (robot.variables(q, robot.values)[:count] - robot.rigid.variables(q, robot.values)[:count]).T
    rates = robot.joint_jacobian(q)
    arm = robot.forward_kinematics(q).matrix() @ tip
    lever = np.linalg.norm(rates[:, :3] + np.cross(rates[:, 3:], arm[:, :, None], axis=1), axis=1)
    moved = np.abs(turned) * lever * excess / np.maximum(np.abs(efforts), 1e-12)
    worst = moved.argmax(axis=0)
    return {i: float(efforts[worst[i], i]) for i in range(count) if moved[worst[i], i] > _NOTHING}


COMPLIANCE_UNSEEN: Final = Rule(
    "compliance-unseen",
    "warning",
    "the force leans on parameters of which the data told less than half; so much is the tip uncertain by each",
    cure="Measure with a force across it as well (columns force_x to moment_z), or with the robot mounted another "
    "way, and calibrate again.",
)


def _unseen(robot: Robot, bendings: Sequence[_Bending]) -> list[Notice]:
    largest: dict[str, float] = {}
    for bending in bendings:
        for name, size in bending.unseen.items():
            largest[name] = max(size, largest.get(name, 0.0))
    if not largest:
        return []
    names = sorted(largest, key=lambda name: -largest[name])
    words = ", ".join(f"{name} ({largest[name] * 1e3:.2g} mm)" for name in names[:_LISTED])
    more = f" and {len(names) - _LISTED} more" if len(names) > _LISTED else ""
    loads = np.max([case.efforts for case in bendings], axis=0)
    joints = [i for i in range(len(robot.joints)) if any(name.split("_")[-1] == str(i + 1) for name in names)]
    carried = ", ".join(_load(robot, i, float(loads[i])) for i in joints)
    on_joints = f" It loads {carried}." if carried else ""
    return [
        COMPLIANCE_UNSEEN(
            f"The force leans on what the calibration's data did not determine: {words}{more}; so uncertain is the tip "
            f"by it (standard deviation).{on_joints} Gravity does not load a joint whose axis is upright."
        )
    ]


LOADS_BEYOND_DATA: Final = Rule(
    "loads-beyond-data",
    "warning",
    "joints are loaded farther beyond what they carried in calibration than half of that range, or with another "
    "payload where the robot file has no masses of links",
    cure="Calibrate with that load to know it.",
    gravity=2,
)


def _beyond(robot: Robot, bendings: Sequence[_Bending]) -> list[Notice]:
    unseen = {name for case in bendings for name in case.unseen}
    beyond: dict[int, float] = {}
    for bending in bendings:
        for joint, load in bending.beyond.items():
            if f"compliance_{joint + 1}" not in unseen and abs(load) > abs(beyond.get(joint, 0.0)):
                beyond[joint] = load
    if not beyond or robot.proof is None:
        return []
    ranges = robot.proof.loads
    words = ", ".join(
        f"{_load(robot, i, load)} (measured with {ranges[i][0]:.3g} to {ranges[i][1]:.3g})"
        for i, load in sorted(beyond.items())
    )
    return [
        LOADS_BEYOND_DATA(
            f"The force loads joints beyond what they carried while they were measured: {words}. That they give way in "
            "proportion up to there is assumed."
        )
    ]


def check_other_payload(calibrated: Robot, carried: Sequence[Payload]) -> list[Notice]:
    """Return a notice if another payload than in calibration is carried, and nobody knows what the arm itself weighs.

    What its own weight bends was taken for the payload's work then, or for geometry.

    Args:
        calibrated: The robot with what it carried in calibration.
        carried: What it carries now.
    """
    if calibrated.proof is None or calibrated.masses or calibrated.balancers:
        return []
    other = next((payload for payload in carried if payload != calibrated.payload), None)
    if other is None:
        return []
    before, now = (f"{load.mass:g} kg" if load.mass else "nothing" for load in (calibrated.payload, other))
    if before == now:
        now = "as much elsewhere"
    return [
        LOADS_BEYOND_DATA(
            f"The robot was calibrated with {before} on the flange, and carries {now} here. Its file has no masses of "
            "links, so what the arm's own weight bends was not told from what the payload bends. How this load bends "
            "it is not known, and is not in the expected errors."
        )
    ]


def _load(robot: Robot, joint: int, load: float) -> str:
    unit = "N m" if robot.joints[joint].kind == "revolute" else "N"
    return f"{robot.joints[joint].name} with {load:.3g} {unit}"


FORCE_IN_MODEL_BASE: Final = Rule(
    "force-in-model-base",
    "warning",
    "the force was taken in the model's base frame, and the controller's is turned against it",
)


def _turned(arms: Sequence[Robot]) -> list[Notice]:
    """Say if a force was taken in the model's base frame, and the controller's has other axes."""
    own = arms[0].controller.base.quaternion == IDENTITY.quaternion
    if own or not any(arm.wrench is not None and arm.wrench.frame == "base" for arm in arms):
        return []
    return [
        FORCE_IN_MODEL_BASE(
            "The force was taken in the axes of the model's base frame, and the base of the controller is turned "
            "against it ('truearm show' says how): for a force in the axes of the pendant use "
            "`wrench_frame=controller`."
        )
    ]


RATING_UNKNOWN: Final = Rule(
    "rating-unknown",
    "note",
    "the flange carries something or is pushed, and the robot file has no `rated_load`",
    gravity=0,
)


def _rated(arms: Sequence[Robot]) -> list[Notice]:
    """Say if what is carried and pushed is more than the arm is rated for, or if nobody knows; measured it was."""
    arms = [arm for arm in arms if arm.wrench is not None]
    if not arms:
        return []
    robot = arms[0]
    if robot.rated_load is None:
        return [
            RATING_UNKNOWN(
                "The robot file does not say what the arm is rated for (rated_load), so nothing tells whether it may "
                "be pushed so."
            )
        ]
    sizes = [
        float(np.linalg.norm(arm.wrench.force)) + arm.payload.mass * STANDARD_GRAVITY for arm in arms if arm.wrench
    ]
    weight = robot.rated_load * STANDARD_GRAVITY
    if max(sizes) <= weight * (1.0 + 1e-9):
        return []
    return [
        RATED_LOAD_EXCEEDED(
            f"Payload and force together make up to {max(sizes):.3g} N, and {robot.name} is rated for {weight:.3g} N "
            f"({robot.rated_load:g} kg). Makers count the forces of a process to the load."
        )
    ]
