"""Every instrument of the list calibrating the same IRB 120, and a tool calibrated alone."""

from __future__ import annotations

import numpy as np

from papers.irb120 import ELASTIC
from papers.irb120_devices.setups import Truth
from papers.seeds import Figures
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.observations import OBSERVATIONS
from truearm.engine.fit.fit import Fit, identify, place
from truearm.engine.fit.models import FRAMES
from truearm.engine.fit.problem import Problem, find_redundancies, gauge_freedoms
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import rigid_motion
from truearm.engine.twin.devices import named_device
from truearm.engine.twin.devices.device import Device, measured_with
from truearm.engine.twin.twin import Twin

#: What no instrument sees: base against joint 1, tool against joint 6, slides along parallel axes, sag of joint 1.
_CONVENTIONS = frozenset(
    {"alpha_1", "a_1", "d_1", "theta_offset_1", "theta_offset_6", "d_6", "d_2", "d_3", "compliance_1"}
)
#: What a target on axis 6 alone does not separate either.
_ON_AXIS_6 = frozenset({"alpha_6", "a_6", "compliance_6"})


#: Ours by table and row, and what is to be said of it.
Said = tuple[Figures, dict[str, dict[str, str]]]


def accuracy(
    table: str, device: Device, nominal: Robot, twin: Twin, truth: Truth, count: int, rng: np.random.Generator
) -> Said:
    """Calibrate a twin with an instrument and judge the robot at configurations that it has not seen [mm].

    Where the instrument does not say where the robot stands, errors are those left by the best rigid motion, and the
    table ``loops`` has what its readings leave open of the arm itself, beside what no instrument sees.

    Args:
        table: Of the errors.
        nominal: With the payload of the twin.
        count: Number of configurations.
    """
    data = measured_with(device, nominal, twin, count, rng)
    fit = identify(nominal, data, ELASTIC)
    points = _targets(device, twin)
    truly = np.concatenate([truth.places(points[name]) for name in data.targets])
    after = _predicted(fit.robot, data, truth)
    if not data.anchored:
        after = _moved(after, truly)
    read = [v for v in (data.position, data.distance, data.height) if v is not None]
    numbers = sum(int(np.isfinite(v).sum()) for v in read) + 3 * int(data.has_orientation.sum())
    errors, name = _lengths(after - truly), device.name
    rows = {f"{name}: mean": 1e3 * float(errors.mean()), f"{name}: maximum": 1e3 * float(errors.max())}
    where = "in the world" if data.anchored else "up to a rigid motion"
    said = {table: {f"{name}: mean": f"{numbers} numbers of {device.sigma * 1e3:g} mm, {where}."}}
    if data.anchored:
        return {table: rows}, said
    row, unobservable = f"{name}: directions not seen", _unobservable(fit, data)
    unseen = "; ".join(["where the base stands and how it is turned (6)", *unobservable])
    said["loops"] = {row: unseen + (". The last is the size of all." if "size" in gauge_freedoms(data) else ".")}
    sized = 1e3 * float(_lengths(_resized(after, truly) - truly).mean())
    loops = {row: float(6 + len(unobservable)), f"{name}: mean but for a change of size [mm]": sized}
    return {table: rows, "loops": loops}, said


def tool_alone(
    nominal: Robot, twin: Twin, truth: Truth, touches: tuple[int, ...], rng: np.random.Generator
) -> dict[str, float]:
    """Return how far off a tool centre point is that was found by touching one point [mm], by robot and touches.

    On the nominal robot, on one that a tracker calibrated, and on the true one.

    The right answer for a robot that errs is the tool centre point with which it errs least: the mean of where the true
    tip is, seen from the flange that the robot believes in.
    """
    with_tracker = measured_with(named_device("tracker"), nominal, twin, max(touches), rng)
    point = named_device("point")
    data = measured_with(point, nominal, twin, max(touches), rng)
    tip = _targets(point, twin)["tip"]
    compliance = {f"compliance_{number}": joint.compliance for number, joint in twin.joints.items()}

    def errors(robot: Robot) -> dict[int, float]:
        origin, rotation = robot.world_poses(truth.joints)
        right = np.einsum("nji,nj->ni", rotation, truth.places(tip) - origin).mean(axis=0)
        found = {
            count: _points(identify(robot, data.of_configurations(range(count)), FRAMES).robot)["tip"]
            for count in touches
        }
        return {count: float(np.linalg.norm(place - right)) for count, place in found.items()}

    true = twin.robot.with_effects(("compliance",)).with_values(compliance)
    robots = {
        "nominal": place(nominal, with_tracker),
        "calibrated": identify(nominal, with_tracker, ELASTIC).robot,
        "true": true,
    }
    return {
        f"{name} robot, {count} touches": 1e3 * error
        for name, robot in robots.items()
        for count, error in errors(robot).items()
    }


def _targets(device: Device, twin: Twin) -> dict[str, tuple[float, ...]]:
    return _points(twin.robot) if device.tool is None else dict(device.tool.targets)


def _points(robot: Robot) -> dict[str, tuple[float, ...]]:
    return {t.name: tuple(robot.values[t.parameter(axis)] for axis in "xyz") for t in robot.targets}


def _predicted(robot: Robot, data: Dataset, truth: Truth) -> Array:
    return np.concatenate([robot.world_poses(truth.joints, name)[0] for name in data.targets])


def _lengths(errors: Array) -> Array:
    return np.asarray(np.linalg.norm(errors, axis=1))


def _moved(points: Array, places: Array) -> Array:
    R, p = rigid_motion(points, places)
    return np.asarray(points @ R.T + p)


def _resized(points: Array, places: Array) -> Array:
    """Return points moved, turned and scaled to be nearest to their places."""
    moved = _moved(points, places)
    centre, x = places.mean(axis=0), moved - moved.mean(axis=0)
    return np.asarray(centre + x * float(np.sum(x * (places - centre)) / np.sum(x * x)))


def _unobservable(fit: Fit, data: Dataset) -> tuple[str, ...]:
    found = np.array([fit.robot.values[name] for name in fit.free.names])
    # The deviations are declared; the others are never asked for.
    noise = {observation.name: 1.0 for observation in OBSERVATIONS}
    held = find_redundancies(Problem(fit.robot, data, fit.free, noise, priors=False), found)
    return tuple(r.combination for r in held if r.dropped not in _CONVENTIONS | _ON_AXIS_6)
