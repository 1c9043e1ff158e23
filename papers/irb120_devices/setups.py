"""The set-ups of chapter 2, tracker and optical CMM with a plate or a spatial artefact, and the arm that they see."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from papers.irb120 import BETA, ELASTIC, REGION, without_beta
from truearm.engine.data.dataset import Dataset
from truearm.engine.fit.design import O1, most_informative, most_informative_number
from truearm.engine.fit.fit import identify
from truearm.engine.fit.models import Model
from truearm.engine.robot.chain import Array
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY, Transform, rigid_motion, rotation_from_vector
from truearm.engine.twin.devices.device import TRACKER, Tracker, positions, shown
from truearm.engine.twin.devices.jogging import postures_at, site
from truearm.engine.twin.devices.touching import PLANAR_ARTEFACT, SPATIAL_ARTEFACT, Artefact
from truearm.engine.twin.truths import STATION, truth_twin
from truearm.engine.twin.twin import Twin
from truearm.engine.twin.twin_joint import PERFECT
from truearm.planning.accuracy import sensitivity

#: Sine a turn of each joint, amplitude and phase [deg]: the smallest that with the compliances of Table 2.7 leaves the
#: angular errors of Table 2.3 (study irb120-axes).
_RUN_OUT: Final = {1: (0.004, 150), 2: (0.032, 0), 3: (0.028, 195), 4: (0.044, 315), 5: (0.049, 270), 6: (0.061, 210)}
#: The least that Table 2.3 allows, by compliances between those that the document's three set-ups found: the same sines
#: [deg], and these compliances [rad/(N m)] (study irb120-axes).
_LEAST: Final = {1: (0.004, 150), 2: (0.024, 0), 3: (0.017, 180), 4: (0.010, 315), 5: (0.009, 240), 6: (0.024, 210)}
_BETWEEN: Final = {2: 37e-6, 3: 112e-6, 4: 462e-6, 5: 301e-6, 6: 243e-6}


@dataclass(frozen=True, eq=False)
class Truth:
    """Where a twin truly is at configurations that no calibration has seen."""

    joints: Array  #: ``(n, joints)``.
    flange: Array  #: ``T_world_flange``, ``(n, 4, 4)``.

    @classmethod
    def of(cls, twin: Twin, joints: Array) -> Truth:
        """Ask the twin."""
        bare = replace(twin, robot=twin.robot.with_frames(twin.robot.base, {"flange": (0.0, 0.0, 0.0)}))
        return cls(joints, np.asarray(bare.frames(joints)["flange"]))

    def places(self, point: tuple[float, ...]) -> Array:
        """Return where a point of the flange frame is in the world [m], ``(n, 3)``."""
        return np.asarray(self.flange[:, :3, 3] + self.flange[:, :3, :3] @ np.array(point))


@cache
def driven() -> Robot:
    """Return the nominal IRB 120 with the limits within which the document drives it."""
    robot = load_robot("irb120")
    low, high = (limits.tolist() for limits in REGION.limits)
    joints = zip(robot.joints, low, high, strict=True)
    return replace(robot, joints=tuple(replace(joint, limits=(a, b)) for joint, a, b in joints))


Gears = Literal["Table 2.7", "least", "true"]


def running_out(twin: Twin, gears: Gears = "Table 2.7") -> Twin:
    """Return the twin with gears that run out as Table 2.3 needs beside Table 2.7, as little as it allows, or not."""
    if gears == "true":
        return twin
    least = gears == "least"
    sines = _LEAST if least else _RUN_OUT
    joints = {
        number: replace(twin.joints.get(number, PERFECT), gear=((1, math.radians(amplitude), math.radians(phase)),))
        for number, (amplitude, phase) in sines.items()
    }
    if least:
        joints |= {number: replace(joints[number], compliance=of_joint) for number, of_joint in _BETWEEN.items()}
    return replace(twin, joints=joints)


Point = tuple[float, float, float]

_TRIANGULAR: Final = load_robot("irb120").tools["triangular"]
#: Nests of the spatial artefact, invented: about 150 mm out of the flange plane, 45 mm off axis 6 (section 2.2.2) [m].
_SPATIAL: Final = {"1": (0.045, 0.0, 0.15), "2": (-0.0225, 0.039, 0.15), "3": (-0.0225, -0.039, 0.15)}
#: Of a coordinate about a well identified model, for the choice of configurations [m].
_ABOUT: Final = 1e-4
_RADIUS: Final = 0.3  # of the ballbar's sphere [m], section 2.6.3
_ROUNDS: Final = 6


@dataclass(frozen=True)
class Setup:
    """What the document did with one instrument."""

    name: str  #: In our words.
    device: Tracker | Artefact  #: The instrument.
    truth: str  #: Which of the robot file's truths it came to.
    #: payload, nests: what hung on the flange, and where positions were judged, in the flange frame [m].
    payload: Payload
    nests: dict[str, Point]
    configurations: int  #: How many it calibrated with (sections 2.5.3 to 2.5.5).


_TRIANGULAR_SETUP: Final = (Payload(_TRIANGULAR.mass, _TRIANGULAR.cog), dict(_TRIANGULAR.targets))
_SPATIAL_SETUP: Final = (Payload(2.6, (-0.023, 0.0, 0.1)), _SPATIAL)
SETUPS: Final = (
    Setup("tracker", TRACKER, "tracker-triangular", *_TRIANGULAR_SETUP, 38),
    Setup("planar artefact", PLANAR_ARTEFACT, "ctrack-triangular", *_TRIANGULAR_SETUP, 36),
    Setup("spatial artefact", SPATIAL_ARTEFACT, "ctrack-spatial", *_SPATIAL_SETUP, 35),
)


@dataclass(frozen=True, eq=False)
class Calibrated:
    """A robot that was calibrated in a set-up."""

    setup: Setup  #: The set-up.
    robot: Robot  #: As identified; its targets are those of the instrument.
    joints: Array  #: At which it was measured, ``(n, joints)``.

    def places(self, joints: Array, nest: str) -> Array:
        """Return where it says a nest is in the world [m], ``(n, 3)``."""
        return _nest(self.robot, self.setup, joints, nest)

    def errors(self, truth: Truth) -> Array:
        """Return the position errors of all nests [m], ``(3 n,)``."""
        return _errors(self.robot, self.setup, truth)


def twin_of(setup: Setup, truth: str, gears: Gears = "Table 2.7", beta: float = BETA) -> Twin:
    """Return the twin with one of the robot file's truths, carrying what the set-up does.

    Args:
        gears: How they run out.
        beta: How far axis 3 leans sideways against axis 2 [rad].
    """
    twin = running_out(truth_twin(driven(), truth, np.random.default_rng(0)), gears)
    robot = twin.robot.with_frames(twin.robot.base, setup.nests).with_payload(setup.payload)
    return replace(twin, robot=robot.with_values({"beta_3": beta}))


def uncalibrated(setup: Setup, truth: Truth) -> Array:
    """Return the errors of the nominal robot where it nominally stands [m], ``(3 n,)``."""
    return _errors(driven().with_frames(STATION, setup.nests), setup, truth)


def visible_configurations(setup: Setup, count: int, rng: np.random.Generator) -> tuple[Array, NDArray[np.bool_]]:
    """Return configurations that the instrument sees ``(count, joints)``, and which targets ``(count, targets)``."""
    return shown(_seen_by(setup), count, rng, setup.device.visible, setup.device.name)


def shares(setup: Setup, count: int, rng: np.random.Generator) -> dict[str, float]:
    """Return of how many of random configurations something is seen, and of these what [%], in words."""
    robot = _seen_by(setup)
    joints = robot.random_configurations(count, rng)
    seen = setup.device.visible(robot, joints)
    found = {"of all configurations": 100.0 * float(seen.any(axis=1).mean())}
    if isinstance(setup.device, Tracker):
        several = 100.0 * float((seen.sum(axis=1) > 1).sum() / seen.any(axis=1).sum())
        found["of these, with two reflectors or more"] = several
    elif setup.device is PLANAR_ARTEFACT:
        joints = joints[seen[:, 0]]
        place, rotation = robot.world_poses(joints, robot.targets[0].name)
        share = float((np.einsum("ni,ni->n", rotation[:, :, 1], place) < 0.0).mean())
        found["of these, the side seen less often"] = 100.0 * min(share, 1.0 - share)
    return found


def calibrate(
    setup: Setup, twin: Twin, candidates: int, rng: np.random.Generator, model: Model = ELASTIC, *, chosen: bool = True
) -> Calibrated:
    """Measure a twin at configurations that O1 chooses and identify the document's model.

    Args:
        candidates: How many visible configurations there are to choose from.
        chosen: Whether they are chosen by O1; by chance if not.
    """
    joints, seen = visible_configurations(setup, candidates, rng)
    rows, known = _rows(setup, joints, seen)
    kept = most_informative(rows, setup.configurations, known, O1()) if chosen else list(range(setup.configurations))
    data = _read(setup, twin, joints[kept], seen[kept], rng)
    robot = without_beta(driven()).with_payload(setup.payload)
    return Calibrated(setup, identify(robot, data, model).robot, joints[kept])


def number_by_o1(setup: Setup, candidates: int, rng: np.random.Generator, *, tool_known: bool) -> int:
    """Return how many configurations make O1 largest.

    Args:
        tool_known: Whether the nests were measured on the tool beforehand, as in the document, or are found with the
            robot.
    """
    joints, seen = visible_configurations(setup, candidates, rng)
    return len(most_informative_number(*_rows(setup, joints, seen, tool_known=tool_known)))


def sphere_test(robot: Calibrated, twin: Twin, nest: str, points: int, rng: np.random.Generator) -> Array:
    """Return by how much a ballbar misses its length on a sphere that a calibrated robot is sent to [m], ``(points,)``.

    Nest 1 touches the centre, by hand, and the robot's model says where that is. The ball in a nest is then sent to
    places on the upper half of a sphere about it, without the way back into range.
    """
    setup = robot.setup
    nominal = driven().with_frames(STATION, setup.nests)
    middle = site(nominal)
    _, taught = postures_at(nominal, "1", middle[None], 1, rng, "ballbar")
    centre = robot.places(taught, "1")[0]
    up = rng.standard_normal((3 * points, 3))
    up *= np.sign(up @ nominal.base.rotation[:, 2])[:, None]
    goals = middle + _RADIUS * up / np.linalg.norm(up, axis=1, keepdims=True)
    kept, joints = postures_at(nominal, nest, goals, points, rng, "ballbar")
    wanted = goals[kept] - middle + centre
    for _ in range(_ROUNDS):
        inverse = np.linalg.pinv(nominal.joint_jacobian(joints, nest)[:, :3])
        joints = joints + (inverse @ (wanted - robot.places(joints, nest))[..., None])[..., 0]
    there = Truth.of(twin, np.concatenate([taught, joints]))
    bar = there.places(setup.nests[nest])[1:] - there.places(setup.nests["1"])[0]
    return np.asarray(np.linalg.norm(bar, axis=1) - _RADIUS)


def _seen_by(setup: Setup) -> Robot:
    tool = setup.device.tool
    return driven().with_frames(STATION, setup.nests if tool is None else tool.targets)


def _rows(setup: Setup, joints: Array, seen: NDArray[np.bool_], *, tool_known: bool = False) -> tuple[Array, Array]:
    """Return the rows of the nests that are seen at each configuration, and what is known beforehand."""
    robot = ELASTIC.prepared(without_beta(driven()).with_payload(setup.payload).with_frames(STATION, setup.nests))
    rows = sensitivity(robot, Postures(joints), ELASTIC.free(robot), _ABOUT)
    counted = np.repeat(np.broadcast_to(seen, (len(joints), len(setup.nests))), 3, axis=1)
    rows = replace(rows, rows=rows.rows * counted[..., None])
    free = rows.free.parameters
    among = [k for k in rows.identifiable(setup.configurations) if not (tool_known and free[k].group == "target")]
    return np.ascontiguousarray(rows.rows[..., among]), rows.known[np.ix_(among, among)]


def _read(setup: Setup, twin: Twin, joints: Array, seen: NDArray[np.bool_], rng: np.random.Generator) -> Dataset:
    device, robot = setup.device, _seen_by(setup)
    if isinstance(device, Tracker):
        return positions(robot, twin, joints, seen, device.sigma, rng, setup.name)
    loaded = replace(twin, robot=twin.robot.with_frames(twin.robot.base, device.tool.targets if device.tool else {}))
    return device.read(robot, loaded, joints, device.sigma, rng)


def _nest(robot: Robot, setup: Setup, joints: Array, nest: str) -> Array:
    if nest in {target.name for target in robot.targets}:
        return robot.world_poses(joints, nest)[0]
    # The artefact's own frame is read; where the nests are in it was measured beforehand.
    artefact = robot.targets[0].name
    place, rotation = robot.world_poses(joints, artefact)
    tool = setup.device.tool
    origin = np.array(tool.targets[artefact] if tool else (0.0, 0.0, 0.0))
    return np.asarray(place + rotation @ (np.array(setup.nests[nest]) - origin))


def _errors(robot: Robot, setup: Setup, truth: Truth) -> Array:
    apart = [_nest(robot, setup, truth.joints, nest) - truth.places(setup.nests[nest]) for nest in setup.nests]
    return np.asarray(np.linalg.norm(np.concatenate(apart), axis=1))


#: The four nests on the granite, the last of which is not in the common frame, and where the artefact stood among them
#: [m]: invented, no distance is printed.
_GRANITE: Final = np.array([[-0.2, -0.2, 0.0], [0.2, -0.2, 0.0], [0.2, 0.2, 0.0], [-0.2, 0.2, 0.0]])
_ARTEFACT: Final = np.array([0.0, 0.0, 0.1])


def nest_errors(setup: Setup, sigma: float, size: float | None, rng: np.random.Generator) -> Array:
    """Return how far the nests 1 to 4 are from where the measuring machine has them [m], ``(4,)``.

    Args:
        setup: Gives the nests on the artefact.
        sigma: Standard deviation of a coordinate that is read [m].
        size: What turns it into one of the artefact's turns [m]; None where each nest is read for itself.
        rng: Of the readings.
    """
    true = np.concatenate([np.array([*setup.nests.values()]) + _ARTEFACT, _GRANITE])
    if size is None:
        read = true + rng.normal(0.0, sigma, true.shape)
    else:
        turn = rotation_from_vector(rng.normal(0.0, sigma / size, 3))
        on_artefact = true[:3] @ turn.T + rng.normal(0.0, sigma, 3)
        read = np.concatenate([on_artefact, true[3:] + rng.normal(0.0, sigma, (4, 3))])
    R, t = rigid_motion(read[3:6], true[3:6])
    apart = read @ R.T + t - true
    return np.asarray(np.linalg.norm(apart[[0, 1, 2, 6]], axis=1))


#: Kinds of parameters, with the document's units and what one of them is in ours.
_KINDS: Final = {
    "alpha": ("deg", math.degrees(1.0)),
    "a": ("mm", 1e3),
    "theta_offset": ("deg", math.degrees(1.0)),
    "compliance": ("1e-6 rad/(N mm)", 1e3),
    "d": ("mm", 1e3),
}
#: Parameters of links 2 to 6; of joints 2 and 3, whose axes are parallel, d_2 and d_3 count as one.
_LINKS: Final = tuple(f"{kind}_{i}" for i in range(2, 7) for kind in _KINDS if (kind, i) != ("d", 3))
#: The base, Rot(x, alpha) Rot(y, beta) Rot(z, gamma) behind Trans(x, y, z).
_BASE: Final = {"x": "mm", "y": "mm", "z": "mm", "alpha": "deg", "beta": "deg", "gamma": "deg"}
#: Units by name.
_UNITS: Final[Mapping[str, str]] = {
    **{f"base {name}": unit for name, unit in _BASE.items()},
    **{name: _KINDS[name.rpartition("_")[0]][0] for name in _LINKS},
}


def deviations(robot: Robot) -> dict[str, float]:
    """Return how far an identified robot is from the nominal one, by name and unit of the document.

    Args:
        robot: As identified, in the frame of an instrument that sees the robot at :data:`STATION`.
    """
    found = _deviations(robot.values, robot.base, STATION)
    return {f"{name} [{_UNITS[name]}]": off for name, off in found.items()}


def printed(truth: str) -> dict[str, str]:
    """Return the same of a set-up's printed parameters, with three digits behind the point as in the document."""
    robot = load_robot("irb120")
    found = robot.truths[truth]
    values = {**robot.values, **found.values, **{f"compliance_{i}": c for i, c in found.compliance.items()}}
    base = robot.with_values({name: value for name, value in found.values.items() if name.startswith("base")}).base
    return {name: f"{value:.3f}" for name, value in _deviations(values, base, IDENTITY).items()}


def _deviations(values: Mapping[str, float], base: Transform, place: Transform) -> dict[str, float]:
    nominal = load_robot("irb120").values
    R = place.rotation.T @ base.rotation
    # The document's base holds d_1, along its own z before it is turned; ours is turned before d_1.
    x, y, z = place.rotation.T @ (np.array(base.translation) - np.array(place.translation)) + R[:, 2] * values["d_1"]
    turns = (math.atan2(-R[1, 2], R[2, 2]), math.asin(R[0, 2]), math.atan2(-R[0, 1], R[0, 0]))
    places = (x, y, z - nominal["d_1"])
    found = dict(zip(_UNITS, (*(1e3 * p for p in places), *map(math.degrees, turns)), strict=False))
    for name in _LINKS:
        off = values.get(name, 0.0) - nominal.get(name, 0.0)
        if name == "d_2":
            off += values["d_3"] - nominal["d_3"]
        found[name] = _KINDS[name.rpartition("_")[0]][1] * off
    return {name: float(value) for name, value in found.items()}
