"""Where robot, targets and fixtures stand before anything is identified, from readings of any kind.

Positions in the instrument's frame give base and targets at once (:mod:`truearm.engine.fit.frames`).
Where the only anchor is a few fixtures whose places are known, distances to them give such positions. Without an anchor
the world is the robot's base. Fixtures follow from the places of the targets in closed form; a target that only touches
or is held at a distance is looked for around the flange.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError, nearest_names
from truearm.engine.data.dataset import Dataset, IntArray
from truearm.engine.data.observations import OBSERVATIONS
from truearm.engine.fit.fixed_places import NOTHING_FIXED, FixedPlaces
from truearm.engine.fit.frames import initial_frames
from truearm.engine.fit.problem import Problem
from truearm.engine.fit.solver import solve
from truearm.engine.robot.chain import Array
from truearm.engine.robot.parameters import FreeParameters
from truearm.engine.robot.parts import FixtureKind
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform

# Places in closed form: points from distances, centres from points about them, planes under points.

#: Heights that fit worse than this on one side of a plane belong to the other [m].
_WRONG_SIDE_ERROR: Final = 5e-3


def point_at_distances(anchors: Array, lengths: Array, side: float) -> Array:
    """Return the point at these distances from known points, on one side of them if they lie in a plane.

    Args:
        anchors: Known points [m], ``(n, 3)``, three or more.
        lengths: Distances from them [m], ``(n,)``.
        side: 1 or -1: on which side of three points, or of points in a plane.
    """
    centre = anchors.mean(axis=0)
    a = anchors - centre
    _, s, Vt = np.linalg.svd(a)
    flat = len(anchors) < 4 or s[2] < 1e-3 * s[0]
    axes = Vt[:2] if flat else Vt
    rows = np.column_stack([2.0 * a @ axes.T, -np.ones(len(a))])
    solved = np.linalg.lstsq(rows, np.sum(a * a, axis=1) - lengths**2, rcond=None)[0]
    inside = solved[:-1] @ axes
    if not flat:
        return np.asarray(centre + inside)
    above = np.sqrt(max(float(solved[-1] - inside @ inside), 0.0))
    return np.asarray(centre + inside + side * above * np.cross(Vt[0], Vt[1]))


def plane_under(points: Array, heights: Array, flange: Array) -> Transform:
    """Return a frame in the plane over which points ``(n, 3)`` have these heights.

    The flange is on its upper side, unless the heights clearly say otherwise: where the robot was led along the plane
    they are its own errors, which an uncalibrated robot explains on either side.
    """
    middle = points.mean(axis=0)
    h = heights - heights.mean()
    normal = normals_of((points - middle)[None], h)[0]
    off = (points - middle) @ -normal - h
    if float(normal @ (flange - points).mean(axis=0)) < 0.0 and float(np.sqrt(np.mean(off**2))) < _WRONG_SIDE_ERROR:
        normal = -normal
    x = np.cross(np.eye(3)[np.argmin(np.abs(normal))], normal)
    x /= np.linalg.norm(x)
    return Transform.from_matrix(np.column_stack([x, np.cross(normal, x), normal]), middle - heights.mean() * normal)


def normals_of(points: Array, heights: Array) -> Array:
    """Return for sets of points about their middle ``(g, n, 3)`` the normals ``(g, 3)`` along which they rise so."""
    _, _, Vt = np.linalg.svd(points, full_matrices=False)
    flat = Vt[:, -1]
    if not heights.any():
        return flat
    gram = np.swapaxes(points, 1, 2) @ points
    lift = np.swapaxes(points, 1, 2) @ heights
    ridge = 1e-12 * np.trace(gram, axis1=1, axis2=2) + 1e-30  # readings may be of one place
    steep = np.linalg.solve(gram + ridge[:, None, None] * np.eye(3), lift[..., None])[..., 0]
    steep = steep / np.maximum(np.linalg.norm(steep, axis=1, keepdims=True), 1e-300)
    choices = np.stack([flat, -flat, steep], axis=1)
    off = np.einsum("gni,gci->gcn", points, choices) - heights
    chosen = np.argmin(np.sum(off**2, axis=2), axis=1)
    return np.asarray(choices[np.arange(len(choices)), chosen])


def centres_of(points: Array, distances: Array) -> Array:
    """Return for sets of points ``(g, n, 3)`` the centres ``(g, 3)`` from which they lie at these distances.

    ``|x|^2 - d^2 = 2 c x - |c|^2`` is linear in the centre and in its square, which is left free. Points that nearly
    lie in a plane say so only within it; the square then tells how far from it the centre is, on either side. Of the
    three centres the one that fits best is returned.
    """
    middle = points.mean(axis=1, keepdims=True)
    x = points - middle
    right = np.sum(x * x, axis=2) - distances**2
    _, axes = np.linalg.eigh(np.swapaxes(x, 1, 2) @ x)
    choices = [_solved(x, right)[:, :3]]
    flat = _solved(x @ axes[:, :, 1:], right)
    beside = np.sqrt(np.maximum(flat[:, 2] - np.sum(flat[:, :2] ** 2, axis=1), 0.0))
    for side in (1.0, -1.0):
        choices.append(np.einsum("gij,gj->gi", axes, np.column_stack([side * beside, flat[:, :2]])))
    centres = np.stack(choices, axis=1)
    off = np.linalg.norm(x[:, None] - centres[:, :, None], axis=3) - distances
    chosen = np.argmin(np.sum(off**2, axis=2), axis=1)
    return np.asarray(middle[:, 0] + centres[np.arange(len(centres)), chosen])


def _solved(x: Array, right: Array) -> Array:
    """Return what solves ``2 c x - s = right`` best, for sets of points ``(g, n, k)``: c and s, ``(g, k + 1)``."""
    rows = np.concatenate([2.0 * x, -np.ones((*x.shape[:2], 1))], axis=2)
    gram = np.swapaxes(rows, 1, 2) @ rows
    gram = gram + 1e-9 * np.trace(gram, axis1=1, axis2=2)[:, None, None] * np.diag([*np.ones(x.shape[2]), 0.0])
    return np.asarray(np.linalg.solve(gram, np.swapaxes(rows, 1, 2) @ right[..., None])[..., 0])


Place = tuple[FixtureKind, Transform]

#: How far from the flange a target is looked for, and in what steps [m].
_SEARCH_REACH: Final = 0.45
_SEARCH_STEP: Final = 0.09
#: How many of the places tried are gone on from.
_MOST_PLACES: Final = 6
#: Deviation that readings are weighed with while targets are looked for [m or rad].
_SEARCH_DEVIATION: Final = 1e-3
#: Step that is the last there, in priors; what is found is a start.
_SEARCH_SMALL: Final = 1e-2
#: How many readings are used for that.
_READINGS_USED: Final = 120
#: How many of one fixture, at least.
_LEAST_OF_A_FIXTURE: Final = 12
#: So alike a fixture's name that was read a few times must be to another for a misspelling.
_ALIKE: Final = 0.8
#: Singular values below this share of the largest belong to unknowns that are not determined.
_LEAST_SINGULAR_VALUE: Final = 1e-5


def start_from_readings(robot: Robot, data: Dataset, fixed: FixedPlaces = NOTHING_FIXED) -> Robot:
    """Return the robot placed where the data say it stands, with the data's targets and fixtures.

    Args:
        robot: Its kinematic parameters are used as they are. Its own base and targets are left out of account where the
            data place them.
        fixed: Places that are known: the robot, its targets and the fixtures are there.

    Raises:
        InputError: If readings contradict each other about what a fixture is, or are too few or too much alike to place
            target and fixture.
    """
    if data.fixture is None:
        return initial_frames(robot, data, fixed).with_scale(data.scale_sigma)
    kinds = _kinds(data)
    _refuse_few(data, kinds, fixed)
    placed = _placed(robot, data, kinds, fixed)
    have = {target.name for target in placed.targets}
    for target in dict.fromkeys(data.target[data.has_reading & (data.against >= 0)].tolist()):
        if data.targets[target] not in have:
            placed = _with_target(placed, data, target, kinds, fixed)
    placed = placed.with_fixtures(_fixture_places(placed, data, kinds, fixed))
    _refuse_alike(placed, data, fixed)
    return placed.with_scale(data.scale_sigma)


def with_fixtures_of(robot: Robot, data: Dataset) -> Robot:
    """Return a robot that stands where it says, with its own targets, and with the fixtures of readings of these."""
    return robot if data.fixture is None else robot.with_fixtures(_fixture_places(robot, data, _kinds(data)))


def unanchored(free: FreeParameters, data: Dataset) -> FreeParameters:
    """Return the parameters without those of the base, where nothing says how it stands: the world is the base."""
    if data.anchored:
        return free
    return free.without(p.name for p in free.parameters if p.group == "base")


def _kinds(data: Dataset) -> dict[str, FixtureKind]:
    """Return what each fixture is, from what is measured against it."""
    kinds: dict[str, FixtureKind] = {}
    for index, name in enumerate(data.fixtures):
        of_fixture = data.against == index
        seen: list[FixtureKind] = []
        if data.height is not None and np.isfinite(data.height[of_fixture]).any():
            seen.append("plane")
        if data.distance is not None and np.isfinite(data.distance[of_fixture]).any():
            seen.append("point")
        counted = data.position[of_fixture][np.isfinite(data.position[of_fixture]).all(axis=1)]
        turned = data.quaternion is not None and bool(np.isfinite(data.quaternion[of_fixture]).any())
        if len(counted) or turned:
            seen.append("frame" if turned or np.ptp(counted, axis=0).any() else "point")
        if len(set(seen)) > 1:
            raise InputError(
                "the readings disagree about what a fixture is",
                where=f"{data.source}, fixture {name}",
                came=" and ".join(dict.fromkeys(seen)),
                allowed="heights over a plane, distances from a point, or positions counted from a point or in a frame",
                cure="Give them fixtures of different names.",
            )
        kinds[name] = seen[0] if seen else "point"
    if data.setup is not None:
        apart = np.isfinite(data.setup.distance) if data.setup.distance is not None else np.zeros(0, dtype=bool)
        others = data.setup.against[apart] if len(apart) else np.zeros(0, dtype=np.intp)
        for name in dict.fromkeys((*data.setup.targets, *(data.fixtures[f] for f in others.tolist() if f >= 0))):
            if kinds.setdefault(name, "point") == "plane":
                raise InputError(
                    "a plane has no place and no distance from another fixture",
                    where=f"{data.source}, fixture {name}",
                    allowed="heights over it, and nothing known of itself",
                    cure="Remove its row of the role fixture.",
                )
    return kinds


def _placed(robot: Robot, data: Dataset, kinds: Mapping[str, FixtureKind], fixed: FixedPlaces) -> Robot:
    """Return the robot with its base and with those targets that are known, or that positions give."""
    setup = data.setup
    if data.has_position.any():
        placed = initial_frames(robot, data, fixed)
    elif fixed.base is not None:
        placed = robot.with_frames(fixed.base, {})
    elif setup is not None and setup.has_position.any():
        sides = [initial_frames(robot, seen, fixed) for seen in _triangulated(data, setup)]
        placed = min(sides, key=lambda candidate: _misfit(candidate, data, setup))
    else:
        placed = robot.with_frames(robot.base, {})
    for index, name in enumerate(data.fixtures):
        if kinds[name] == "frame":
            seen = initial_frames(robot, _as_instrument(data, index), fixed.seen_from(name))
            placed = _also(placed, {**_targets(seen), **_targets(placed)})
    have = {target.name for target in placed.targets}
    known = {n: np.array(p.translation) for n, p in fixed.targets.items() if n in data.targets and n not in have}
    return _at_points(_also(placed, known) if known else placed, data, kinds)


def _targets(robot: Robot) -> dict[str, Transform | Array]:
    """Return where the targets of a robot are on its flange."""
    places: dict[str, Transform | Array] = {}
    for target in robot.targets:
        x, y, z = (robot.values[target.parameter(axis)] for axis in "xyz")
        turned = target.quaternion
        places[target.name] = np.array([x, y, z]) if turned is None else Transform((x, y, z), turned)
    return places


def _as_instrument(data: Dataset, fixture: int) -> Dataset:
    """Return the readings in a fixture's frame as if that were the instrument's."""
    return replace(data.of_readings(data.against == fixture), fixture=None, fixtures=(), setup=None)


def _triangulated(data: Dataset, setup: Dataset) -> Iterator[Dataset]:
    """Return positions from distances to known points; two sets where these lie in a plane, one on either side."""
    known = {setup.targets[setup.target[r]]: setup.position[r] for r in np.flatnonzero(setup.has_position).tolist()}
    places = [known.get(name, np.full(3, np.nan)) for name in data.fixtures]
    anchors = np.array(places)
    useful = np.isfinite(anchors).all(axis=1)
    lengths = np.full((data.configurations, len(data.targets), len(anchors)), np.nan)
    if data.distance is not None:
        read = np.flatnonzero(np.isfinite(data.distance) & (data.against >= 0))
        lengths[data.configuration[read], data.target[read], data.against[read]] = data.distance[read]
    for side in (1.0, -1.0):
        configurations, targets, points = [], [], []
        for c, t in np.argwhere((np.isfinite(lengths) & useful).sum(axis=2) >= 3).tolist():
            seen = np.isfinite(lengths[c, t]) & useful
            configurations.append(c)
            targets.append(t)
            points.append(point_at_distances(anchors[seen], lengths[c, t, seen], side))
        if not points:
            raise InputError(
                "no target was measured from enough known points",
                where=data.source,
                allowed="distances from three known fixtures or more at a configuration",
                cure="Say where the fixtures stand, or measure the robot's targets with another device first.",
            )
        yield replace(
            data,
            configuration=np.array(configurations, dtype=np.intp),
            target=np.array(targets, dtype=np.intp),
            position=np.array(points),
            quaternion=None,
            distance=None,
            height=None,
            fixture=None,
            fixtures=(),
            setup=None,
            sigma=None,
            sigma_rot=None,
            visit=None,
        )


def _at_points(robot: Robot, data: Dataset, kinds: Mapping[str, FixtureKind]) -> Robot:
    """Return the robot with the targets that are held at points: ``R_i t + p_i = c + y_i`` is linear in t and c."""
    points = [f for f, name in enumerate(data.fixtures) if kinds[name] == "point"]
    read = np.flatnonzero(np.isin(data.against, points) & np.isfinite(data.position).all(axis=1))
    have = {t.name for t in robot.targets}
    targets = [t for t in dict.fromkeys(data.target[read].tolist()) if data.targets[t] not in have]
    read = read[np.isin(data.target[read], targets)]
    if len(read) == 0:
        return robot
    p, R = robot.world_poses(data.postures)
    rows = np.zeros((len(read), 3, 3 * (len(targets) + len(points))))
    for k, reading in enumerate(read.tolist()):
        t, f = targets.index(int(data.target[reading])), points.index(int(data.against[reading]))
        rows[k, :, 3 * t : 3 * t + 3] = R[data.configuration[reading]]
        rows[k, :, 3 * (len(targets) + f) :][:, :3] = -np.eye(3)
    right = data.position[read] - p[data.configuration[read]]
    solved = np.linalg.lstsq(rows.reshape(-1, rows.shape[2]), right.reshape(-1), rcond=1e-6)[0]
    places = {data.targets[t]: np.asarray(solved[3 * k : 3 * k + 3], float) for k, t in enumerate(targets)}
    return _also(robot, places)


def _also(robot: Robot, places: Mapping[str, Transform | Array]) -> Robot:
    """Return the robot with some targets more."""
    return robot.with_frames(robot.base, {**_targets(robot), **places})  # type: ignore[dict-item]


def _with_target(
    robot: Robot, data: Dataset, target: int, kinds: Mapping[str, FixtureKind], fixed: FixedPlaces
) -> Robot:
    """Return the robot with a target whose place follows from distances and heights alone."""
    readings = data.of_readings(data.has_reading & (data.target == target) & (data.against >= 0))
    readings = _some_of_each_fixture(readings)
    touched = np.unique(readings.against)
    readings = replace(
        readings,
        fixtures=tuple(data.fixtures[f] for f in touched.tolist()),
        fixture=np.searchsorted(touched, readings.against),
        setup=None,
        sigma=None,
        sigma_rot=None,
    )
    name = data.targets[target]
    p, R = robot.world_poses(readings.postures)
    p, R = p[readings.configuration], R[readings.configuration]
    steps = np.arange(-_SEARCH_REACH, _SEARCH_REACH + 1e-9, _SEARCH_STEP)
    grid = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    tips = p + np.einsum("nij,gj->gni", R, grid)
    cost = np.zeros(len(grid))
    for index in range(len(readings.fixtures)):
        of = readings.against == index
        points = tips[:, of]
        if readings.distance is not None and np.isfinite(readings.distance[of]).any():
            centre = centres_of(points, readings.distance[of])
            off = np.linalg.norm(points - centre[:, None], axis=2) - readings.distance[of]
        elif readings.height is not None and np.isfinite(readings.height[of]).any():
            spread = points - points.mean(axis=1, keepdims=True)
            h = readings.height[of] - readings.height[of].mean()
            normal = normals_of(spread, h)
            off = np.einsum("gni,gi->gn", spread, normal) - h
        else:
            continue
        cost += np.sum(off**2, axis=1)
    candidates = []
    for start in np.argsort(cost)[:_MOST_PLACES].tolist():
        tried = _also(robot, {name: grid[start]})
        tried = tried.with_fixtures(_fixture_places(tried, readings, kinds, fixed))
        own = tried.target(name).chain.parameters
        free = FreeParameters(tuple(q for q in tried.parameters.values() if q.group == "fixture" or q.name in own))
        free = free.without(FixedPlaces(fixtures=fixed.fixtures).names(tried))
        problem = Problem(tried, readings, free, dict.fromkeys(_names(), _SEARCH_DEVIATION))
        solution = solve(problem, small=_SEARCH_SMALL)
        point = solution.vector[[free.names.index(tried.target(name).parameter(axis)) for axis in "xyz"]]
        candidates.append((float(solution.residual @ solution.residual), point))
    return _also(robot, {name: min(candidates, key=lambda candidate: candidate[0])[1]})


def _some_of_each_fixture(data: Dataset) -> Dataset:
    """Return readings that are enough to look for a target, as many of each fixture as of the others."""
    if len(data.target) <= _READINGS_USED:
        return data
    fixtures = np.unique(data.against)
    some = np.zeros(len(data.target), dtype=bool)
    for fixture in fixtures.tolist():
        readings = np.flatnonzero(data.against == fixture)
        count = min(len(readings), max(_LEAST_OF_A_FIXTURE, _READINGS_USED // len(fixtures)))
        some[readings[np.linspace(0, len(readings) - 1, count).astype(np.intp)]] = True
    return data.of_readings(some)


def _refuse_few(data: Dataset, kinds: Mapping[str, FixtureKind], fixed: FixedPlaces) -> None:
    """Refuse fixtures that stand nowhere, for want of readings."""
    known = {*fixed.fixtures, *({} if data.setup is None else _known(data.setup))}
    least = {"point": 4, "plane": 3, "frame": 1}
    for index, name in enumerate(data.fixtures):
        of_fixture = (data.against == index) & data.has_reading
        has_position = np.isfinite(data.position[of_fixture]).all(axis=1).any()
        count = int(of_fixture.sum())
        if name not in known and count < (1 if has_position else least[kinds[name]]):
            near = nearest_names(name, [other for other in data.fixtures if _may_be(name, other)], 1, _ALIKE)
            raise InputError(
                "a fixture was measured too few times to locate it",
                where=f"{data.source}, fixture {name}",
                came=f"{count} reading{'' if count == 1 else 's'} among {data.configurations} configurations",
                allowed=f"{least[kinds[name]]} or more",
                cure=f"Did you mean {near[0]}? Else measure it at more configurations, or leave its readings out."
                if near
                else "Measure it at more configurations, or leave its readings out.",
            )


def _may_be(name: str, other: str) -> bool:
    """Return whether a name may be another's, misspelt: those of a row of fixtures differ in digits or at the end."""
    return (
        name != other
        and re.findall("[0-9]", name) == re.findall("[0-9]", other)
        and name[-1:].lower() == other[-1:].lower()
    )


def _fixture_places(
    robot: Robot, data: Dataset, kinds: Mapping[str, FixtureKind], fixed: FixedPlaces = NOTHING_FIXED
) -> dict[str, Place]:
    """Return where the fixtures stand, from the places of the targets; known places as they are known."""
    at = robot.loaded(data.postures)
    tips = {t.name: robot.world_poses(at, t.name)[0] for t in robot.targets if t.name in data.targets}
    flange = robot.world_poses(at)[0]
    known = {} if data.setup is None else _known(data.setup)
    places: dict[str, Place] = {}
    for index, name in enumerate(data.fixtures):
        read = np.flatnonzero((data.against == index) & data.has_reading)
        points = np.array([tips[data.targets[data.target[r]]][data.configuration[r]] for r in read.tolist()])
        if name in fixed.fixtures:
            place = fixed.fixtures[name]
        elif kinds[name] == "frame":
            place = _frame(robot, data, index, fixed)
            place = Transform(known[name], place.quaternion) if name in known else place
        elif name in known:
            place = Transform(known[name])
        elif data.height is not None and kinds[name] == "plane":
            place = plane_under(points, data.height[read], flange[data.configuration[read]])
        else:
            place = Transform(_point(points, data, read, f"{data.source}, fixture {name}"))
        places[name] = kinds[name], place
    for name in known:
        places.setdefault(name, (kinds[name], Transform(known[name])))
    return places


def _known(setup: Dataset) -> dict[str, tuple[float, float, float]]:
    points = {}
    for reading in np.flatnonzero(setup.has_position).tolist():
        x, y, z = setup.position[reading].tolist()
        points[setup.targets[setup.target[reading]]] = (x, y, z)
    return points


def _frame(robot: Robot, data: Dataset, index: int, fixed: FixedPlaces) -> Transform:
    """Return where a frame stands: the robot's base, seen from it, the other way round."""
    from_it = initial_frames(robot, _as_instrument(data, index), FixedPlaces(targets=fixed.targets)).base
    turned = robot.base.rotation @ from_it.rotation.T
    return Transform.from_matrix(turned, np.array(robot.base.translation) - turned @ np.array(from_it.translation))


def _point(points: Array, data: Dataset, read: IntArray, where: str) -> tuple[float, float, float]:
    counted = np.isfinite(data.position[read]).all(axis=1)
    if counted.any():
        x, y, z = (points[counted] - data.position[read][counted]).mean(axis=0).tolist()
        return x, y, z
    if data.distance is None:
        raise InputError("nothing was measured from this fixture", where=where)
    x, y, z = centres_of(points[None], data.distance[read])[0].tolist()
    return x, y, z


def _start_parameters(robot: Robot, data: Dataset, groups: Iterable[str]) -> FreeParameters:
    return unanchored(FreeParameters(tuple(p for p in robot.parameters.values() if p.group in groups)), data)


def _misfit(robot: Robot, data: Dataset, setup: Dataset) -> float:
    """Return how badly a placed robot fits its targets' distances from known points, summed squares [m^2]."""
    known = _known(setup)
    off = 0.0
    for target in robot.targets:
        tips = robot.world_poses(data.postures, target.name)[0]
        of_target = data.target == data.targets.index(target.name)
        for index, name in enumerate(data.fixtures):
            if data.distance is not None and name in known:
                read = of_target & (data.against == index) & np.isfinite(data.distance)
                far = np.linalg.norm(tips[data.configuration[read]] - np.array(known[name]), axis=1)
                off += float(np.sum((far - data.distance[read]) ** 2))
    return off


def _names() -> tuple[str, ...]:
    return tuple(observation.name for observation in OBSERVATIONS)


def _refuse_alike(robot: Robot, data: Dataset, fixed: FixedPlaces) -> None:
    """Refuse readings that do not even determine where base, targets and fixtures are."""
    free = fixed.free_of(_start_parameters(robot, data, ("base", "target", "fixture")), robot)
    if not free.names:
        return
    noise = dict.fromkeys(_names(), _SEARCH_DEVIATION)
    J = Problem(robot, data, free, noise, priors=False).linearised(free.start)[1]
    s = np.linalg.svd(np.linalg.qr(J, mode="r"), compute_uv=False)
    determined = int((s > _LEAST_SINGULAR_VALUE * s[0]).sum())
    if determined < len(free.names):
        raise InputError(
            "the readings do not determine where targets and fixtures are: the postures are too few or too much alike",
            where=data.source,
            came=f"{data.configurations} postures that determine {determined} of {len(free.names)} unknowns",
            cure="Measure more postures, with the tool turned to different sides.",
        )
