"""What a simulated instrument has read in tests by ISO 9283, gathered into records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from truearm.measurement.performance.records import AttainedPoses, Names, Pushes, Samples
from truearm.modeling.chain import Array
from truearm.modeling.transform import rotation_from_quaternion, rotation_from_vector


@dataclass(frozen=True)
class Tracker:
    """What reads the tip."""

    sigma: float  #: Standard deviation of each coordinate [m].
    sigma_rot: float  #: Of each angle [rad].
    rate: float  #: Readings in a second [Hz].


@dataclass(frozen=True, eq=False)
class SimulatedCampaign:
    """What was read; None of what no test needs."""

    poses: AttainedPoses | None  #: poses, paths, settling, forces: in the instrument's frame.
    paths: Samples | None
    settling: Samples | None
    forces: Pushes | None
    duration: float  #: How long the campaign would take in the cell [s].


@dataclass(frozen=True, eq=False)
class Stand:
    """A pose at which the arm stands to be read."""

    criterion: str
    robot: int
    pose: str
    cycle: int
    approach: str
    velocity: float
    load: float
    time: float
    working: float
    joints: Array
    came: Array


@dataclass(frozen=True, eq=False)
class Stream:
    """Samples of one cycle."""

    criterion: str
    place: str
    cycle: int
    velocity: float
    load: float
    time: Array
    position: Array
    quaternion: Array | None
    turn: Array | None


@dataclass(frozen=True, eq=False)
class Pushed:
    """Where the tip was in one direction and cycle, force by force."""

    direction: str
    cycle: int
    force: Array
    position: Array


def poses_of(stands: Sequence[Stand], frames: Array, tracker: Tracker, rng: np.random.Generator) -> AttainedPoses:
    """Return attained poses, as they are read where the tip stands ``(n, 4, 4)`` [m]."""
    n = len(stands)
    turned = rotation_from_vector(rng.normal(0.0, tracker.sigma_rot, (n, 3)))
    return AttainedPoses(
        Names.of(s.criterion for s in stands),
        Names.of(f"r{s.robot + 1}" if s.criterion == "E" else "" for s in stands),
        Names.of(s.pose for s in stands),
        Names.of(s.approach for s in stands),
        np.array([s.cycle for s in stands], dtype=np.intp),
        np.array([s.velocity for s in stands]),
        np.array([s.load for s in stands]),
        np.array([s.time for s in stands]),
        frames[:, :3, 3] + rng.normal(0.0, tracker.sigma, (n, 3)),
        turned @ frames[:, :3, :3],
        np.arange(2, n + 2),
        "simulated poses",
        simulated=True,
    )


def samples_of(streams: Sequence[Stream], source: str) -> Samples:
    """Return the samples of all cycles."""
    counts = [len(s.time) for s in streams]
    n = sum(counts)

    def named(texts: Sequence[str]) -> Names:
        each = Names.of(texts)
        return Names(each.names, np.repeat(each.code, counts))

    quaternions = [s.quaternion for s in streams if s.quaternion is not None]
    rotation = None
    if quaternions:
        turned = rotation_from_vector(np.concatenate([s.turn for s in streams if s.turn is not None]))
        rotation = turned @ rotation_from_quaternion(np.concatenate(quaternions))
    return Samples(
        named([s.criterion for s in streams]),
        named([s.place for s in streams]),
        np.repeat(np.array([s.cycle for s in streams], dtype=np.intp), counts),
        np.repeat([s.velocity for s in streams], counts),
        np.repeat([s.load for s in streams], counts),
        np.concatenate([s.time for s in streams]),
        np.concatenate([s.position for s in streams]),
        rotation,
        np.arange(2, n + 2),
        source,
        simulated=True,
    )


def pushes_of(pushed: Sequence[Pushed]) -> Pushes:
    """Return the readings under all pushes."""
    counts = [len(p.force) for p in pushed]
    ways = Names.of(p.direction for p in pushed)
    return Pushes(
        Names(ways.names, np.repeat(ways.code, counts)),
        np.concatenate([p.force for p in pushed]),
        np.repeat(np.array([p.cycle for p in pushed], dtype=np.intp), counts),
        np.concatenate([p.position for p in pushed]),
        np.arange(2, sum(counts) + 2),
        "simulated forces",
        simulated=True,
    )
