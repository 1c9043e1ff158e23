"""Did something move during the campaign: the instrument, a target, a joint's zero, or all slowly.

What a fit leaves over is explained, in the order of measurement, by a change that happened after some configuration:
another place of the instrument against the robot (six parameters), another place of one target on the flange (three, or
six where its orientation is measured), another zero of one joint; or by a motion of the instrument that grows evenly.
Each is a regression of the residuals on columns of the fit's own Jacobian, kept from that configuration on. The sums
over all configurations from one on come from one pass, so every change point costs a small system of equations.

The best of many is found by chance too. The chance of one alone, that of chi squared, is multiplied by the number of
changes tried (Bonferroni), which for neighbouring change points is too careful, never too bold. The targets of a
configuration share what the model leaves, so it counts as one reading of three coordinates. Between changes that differ
in their parameters the one with the least Bayesian information criterion is named (Schwarz 1978).

Where configurations are not numbered the order of the file is tried, unless it follows a joint: then parts of the
workspace were measured after each other, and what the model lacks there looks like a change.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import Notice, Rule
from truearm.engine.diagnose.off_configurations import Off, off_configurations
from truearm.engine.diagnose.unmodelled import LeftOver, chi_squared_tail, without_bending
from truearm.engine.robot.chain import Array

Kind = Literal["instrument-moved", "target-moved", "joint-zero-jumped", "drift"]

#: Configurations that a change must leave on either side.
LEAST_VISITS: Final = 10
#: A change is believed if chance would show one as large anywhere less often than this.
_LARGEST_CHANCE: Final = 1e-4
#: Share of the squared residuals that a change must explain to be told, and to spoil the result. What a model cannot
#: follow looks like a change too where configurations that are alike were measured after each other, but explains less.
_LEAST_SHARE: Final = 0.15
_SPOILING_SHARE: Final = 0.5
#: Correlation of the ranks of rows and positions from which the rows are sorted by a joint.
_SORTED: Final = 0.6
#: Change points tried first; those between the best of them and its neighbours are tried then.
_COARSE: Final = 64


@dataclass(frozen=True)
class Change:
    """What happened during a campaign."""

    kind: Kind  #: Code of the notice.
    subject: str  #: Name of the target or number of the joint; empty for the others.
    #: Index of the first configuration, in the dataset, at which it had happened; of the first measured for a drift.
    first: int
    share: float  #: Of the squared residuals that it explains.
    values: tuple[float, ...]  #: What changed, in the parameters of its columns [SI].
    chance: float  #: Probability that noise alone shows one as large anywhere.
    or_else: Literal["", "earlier", "later"] = ""  #: When it may have been too, where too few configurations tell it.
    by_file: bool = False  #: Whether the order of measurement is not known, and that of the file was taken.
    follows: int = 0  #: Number of the joint that moved on with the order of measurement; 0 if none did.


@dataclass(frozen=True, eq=False)
class _Sums:
    """Sums over the equations of configurations from a change point on, for all columns at once."""

    #: pull, inner, taken: columns times residual ``(k, m)``, columns times columns ``(k, m, m)``, and what the free
    #: parameters take of the columns ``(k, rank, m)``.
    pull: Array
    inner: Array
    taken: Array


def find_change(left: LeftOver) -> Change | None:
    """Return what best explains what a fit leaves, None if nothing does by more than chance.

    None too where neither the order of measurement is known nor that of the file may be it, readings are against
    fixtures, or there are fewer than twenty configurations.
    """
    data = left.problem.data
    n = data.configurations
    if data.fixture is not None or n < 2 * LEAST_VISITS:
        return None
    hypotheses = list(_hypotheses(left))
    residual = left.without_parameters(left.residual)
    total = float(residual @ residual)
    effective = 3 * n - left.basis.shape[1]
    if total <= 0.0 or effective < n or not hypotheses:
        return None
    order = np.arange(n) if data.number is None else np.argsort(data.number, kind="stable")
    follows = _followed_joint(data.joints[order])
    if data.number is None and follows:
        return None
    place = np.empty(n, dtype=np.intp)
    place[order] = np.arange(n)
    rows = np.argsort(place[left.configuration], kind="stable")
    at = place[left.configuration][rows]
    every = np.arange(LEAST_VISITS, n - LEAST_VISITS + 1)
    used = sorted({column for _, _, columns in hypotheses for column in columns})
    places = {column: i for i, column in enumerate(used)}
    C, r, Q = left.jacobian[rows][:, used], residual[rows], left.basis[rows]
    tests = len(every) * len(hypotheses)

    coarse = every if len(every) <= _COARSE else every[np.linspace(0, len(every) - 1, _COARSE).astype(np.intp)]
    sums = _sums(C, r, Q, at, coarse)
    judged: list[tuple[float, Change]] = []
    for kind, subject, columns in hypotheses:
        chosen = [places[column] for column in columns]
        explained, values = _explained(sums, chosen)
        best = int(np.argmax(explained))
        low, high = coarse[max(best - 1, 0)], coarse[min(best + 1, len(coarse) - 1)]
        k, gain, value = int(coarse[best]), float(explained[best]), values[best]
        if high - low > 2 and gain > 0.5 * _LEAST_SHARE * total:
            fine = np.arange(low, high + 1)
            explained, values = _explained(_sums(C[:, chosen], r, Q, at, fine), list(range(len(chosen))))
            best = int(np.argmax(explained))
            k, gain, value = int(fine[best]), float(explained[best]), values[best]
        judged.append(_judged(kind, subject, int(order[k]), gain / total, value, effective, tests))
    base = next((columns for kind, _, columns in hypotheses if kind == "instrument-moved"), ())
    if base:
        grown = C[:, [places[column] for column in base]] * (at / (n - 1.0) - 0.5)[:, None]
        grown -= Q @ (Q.T @ grown)
        value = np.asarray(np.linalg.lstsq(grown, r, rcond=1e-10)[0], dtype=np.float64)
        gain = float(r @ grown @ value)
        judged.append(_judged("drift", "", int(order[0]), gain / total, value, effective, tests))
    _, change = min(judged, key=lambda entry: entry[0])
    if change.chance >= _LARGEST_CHANCE or change.share <= _LEAST_SHARE:
        return None
    or_else: Literal["", "earlier", "later"] = ""
    if change.kind != "drift" and place[change.first] in (every[0], every[-1]):
        or_else = "earlier" if place[change.first] == every[0] else "later"
    return replace(change, or_else=or_else, by_file=data.number is None, follows=follows)


def _followed_joint(joints: Array) -> int:
    """Return the number of a joint whose positions the rows are sorted by, by the correlation of ranks; 0 if none."""
    at = np.arange(len(joints)) - 0.5 * (len(joints) - 1)
    for number, positions in enumerate(joints.T, 1):
        _, rank, times = np.unique(positions, return_inverse=True, return_counts=True)
        ranks = (np.cumsum(times) - 0.5 * times)[rank.reshape(-1)]
        ranks = ranks - ranks.mean()
        size = float(np.linalg.norm(ranks) * np.linalg.norm(at))
        if size > 0.0 and abs(float(ranks @ at)) > _SORTED * size:
            return number
    return 0


def _hypotheses(left: LeftOver) -> Iterator[tuple[Kind, str, tuple[int, ...]]]:
    """Go through what can change, with the columns of the Jacobian that say how residuals follow."""
    free = left.fit.free
    of_group: dict[str, list[int]] = {}
    for i, p in enumerate(free.parameters):
        of_group.setdefault(p.group, []).append(i)
    if len(of_group.get("base", ())) == 6:
        yield "instrument-moved", "", tuple(of_group["base"])
    if len(left.fit.robot.targets) > 1:
        for target in left.fit.robot.targets:
            names = {target.parameter(axis) for axis in "xyz"}
            columns = tuple(i for i in of_group.get("target", ()) if free.names[i] in names)
            if columns:
                yield "target-moved", target.name, columns
    for i in of_group.get("joint zero", ()):
        yield "joint-zero-jumped", free.names[i].rsplit("_", 1)[-1], (i,)


def _sums(C: Array, r: Array, Q: Array, at: NDArray[np.intp], points: NDArray[np.intp]) -> _Sums:
    """Return the sums of rows from each change point on.

    Args:
        at: Place of each row's configuration in the order of measurement, ascending, ``(rows,)``.
        points: Change points, ascending, ``(k,)``.
    """
    edges = [*np.searchsorted(at, points).tolist(), len(at)]
    parts = [slice(a, b) for a, b in pairwise(edges)]
    pull = np.array([C[part].T @ r[part] for part in parts])
    inner = np.array([C[part].T @ C[part] for part in parts])
    taken = np.array([Q[part].T @ C[part] for part in parts])

    def from_here_on(values: Array) -> Array:
        return np.asarray(np.cumsum(values[::-1], axis=0)[::-1])

    return _Sums(from_here_on(pull), from_here_on(inner), from_here_on(taken))


def _explained(sums: _Sums, columns: list[int]) -> tuple[Array, Array]:
    """Return what a change explains of the squared residuals ``(k,)``, and its parameters ``(k, columns)``."""
    g = sums.pull[:, columns]
    taken = sums.taken[:, :, columns]
    G = sums.inner[:, columns][:, :, columns] - np.swapaxes(taken, 1, 2) @ taken
    size = np.sqrt(np.maximum(np.einsum("kii->ki", sums.inner[:, columns][:, :, columns]), 1e-300))
    scaled = G / (size[:, :, None] * size[:, None, :])
    values, turns = np.linalg.eigh(scaled)
    along = np.einsum("kji,kj->ki", turns, g / size)
    inverse = np.where(values > _LEAST_SEEN, 1.0 / np.maximum(values, _LEAST_SEEN), 0.0)
    shifts = np.einsum("kij,kj->ki", turns, inverse * along) / size
    return np.sum(inverse * along**2, axis=1), shifts


#: Share of a change that the free parameters may not take, or else it is not looked for.
_LEAST_SEEN: Final = 1e-4


def _judged(
    kind: Kind, subject: str, first: int, share: float, values: Array, effective: int, tests: int
) -> tuple[float, Change]:
    """Return the Bayesian information criterion of a change, and the change."""
    share = min(max(share, 0.0), 1.0 - 1e-12)
    points = 0.0 if kind == "drift" else 1.0
    criterion = effective * math.log(1.0 - share) + (len(values) + points) * math.log(effective)
    chance = min(1.0, tests * chi_squared_tail(effective * share, len(values)))
    # Residuals of a moved fit are prediction minus reading: the columns, times minus these values, lead back.
    return criterion, Change(kind, subject, first, share, tuple((-values).tolist()), chance)


def what_moved(left: LeftOver) -> tuple[LeftOver, Change] | None:
    """Return what a fit leaves without configurations that are off one by one, and what moved during the others.

    What the geometry and joints that give way could take up is taken out first, whatever the fit had of it: it hides
    what moved. A single configuration that is far off looks like something that moved. Nothing is returned where
    nothing moved.
    """
    wider = without_bending(left)
    off = off_configurations(wider)
    remaining = wider.without(() if is_a_part(off) else off.indices)
    change = find_change(remaining)
    return None if change is None else (remaining, change)


def is_a_part(off: Off) -> bool:
    """Return whether what is off is a part of the campaign, so long that its beginning can be found."""
    return off.in_a_row and len(off.configurations) >= LEAST_VISITS


INSTRUMENT_MOVED: Final = Rule(
    "instrument-moved",
    ("warning", "error"),
    "all readings stand elsewhere from a configuration on: [what moved](check.md#what-moved-during-the-campaign)",
    gravity=2,
)
TARGET_MOVED: Final = Rule(
    "target-moved",
    ("warning", "error"),
    "one target stands elsewhere from a configuration on: [what moved](check.md#what-moved-during-the-campaign)",
    gravity=2,
)
JOINT_ZERO_JUMPED: Final = Rule(
    "joint-zero-jumped",
    ("warning", "error"),
    "a joint's zero is another from a configuration on: [what moved](check.md#what-moved-during-the-campaign)",
    gravity=2,
)
DRIFT: Final = Rule(
    "drift",
    "warning",
    "all readings moved evenly during the campaign: [what moved](check.md#what-moved-during-the-campaign)",
    gravity=2,
)
_RULES: Final = {rule.code: rule for rule in (INSTRUMENT_MOVED, TARGET_MOVED, JOINT_ZERO_JUMPED, DRIFT)}
#: Codes of what moved during a campaign.
OF_CHANGES: Final = frozenset(_RULES)


def notices_of_change(left: LeftOver, change: Change) -> list[Notice]:
    """Return a notice of what moved during the campaign."""
    data = left.problem.data
    label = data.labels[change.first]
    spoils = change.share > _SPOILING_SHARE and change.kind != "drift"  # a drift is slow: its mean is in the result
    level: Literal["error", "warning"] = "error" if spoils and not change.by_file else "warning"
    size = _size(left, change)
    explains = f"That explains {change.share:.0%} of the squared residuals."
    words = {
        "instrument-moved": f"From configuration {label} on, all readings stand {size}: the instrument or "
        f"the robot's base moved. {explains} Measure again from there, calibrate the parts apart, or name {label} in "
        "`base_changes`.",
        "target-moved": f"From configuration {label} on, target {change.subject} stands {size} on the flange: it was "
        f"touched or seated anew. {explains} Give it another name from there on.",
        "joint-zero-jumped": f"From configuration {label} on, joint {change.subject} stands {size}: its zero jumped, "
        f"as after a collision, a slipped belt or a new mastering. {explains} Measure again from there, or calibrate "
        "the parts apart.",
        "drift": f"All readings moved evenly during the campaign, by {size} in all: the instrument, the robot's base "
        f"or its temperature drifted. {explains} Measure reference points beside the robot along with the targets, or "
        "let the arm warm up first.",
    }
    if change.follows:
        words[change.kind] += (
            f" Joint {change.follows} moved on with the order of measurement, so what the model lacks at some of its "
            "positions, as the periodic error of a gear, looks like that too."
        )
    if change.or_else:
        words[change.kind] += (
            f" It may have been {change.or_else}: less than {LEAST_VISITS} configurations before or after it do not "
            "tell where it was."
        )
    taken = (
        " The configurations are not numbered, so the order of the file was taken for that of measurement. If it is, "
        "number them so."
        if change.by_file
        else ""
    )
    return [_RULES[change.kind](words[change.kind] + taken, level)]


def _size(left: LeftOver, change: Change) -> str:
    """Return in words how far things moved."""
    if change.kind == "joint-zero-jumped":
        joint = left.fit.robot.joints[int(change.subject) - 1]
        value = abs(change.values[0])
        return f"{math.degrees(value):.3g} deg off" if joint.kind == "revolute" else f"{value * 1e3:.3g} mm off"
    if change.kind == "target-moved":
        return f"{float(np.linalg.norm(change.values)) * 1e3:.3g} mm elsewhere"
    data = left.problem.data
    base = [i for i, p in enumerate(left.fit.free.parameters) if p.group == "base"]
    rows = np.concatenate([[block.observation.name == "position"] * block.rows for block in left.problem.blocks])
    sigma = np.concatenate([np.repeat(block.sigma, block.observation.components) for block in left.problem.blocks])
    moved = (left.jacobian[:, base] @ np.array(change.values) * sigma)[np.asarray(rows, dtype=bool)].reshape(-1, 3)
    shift = float(np.sqrt(np.mean(np.sum(moved**2, axis=1)))) if len(moved) else 0.0
    turned = float(np.linalg.norm(change.values[3:]))
    about = f" and turned by {math.degrees(turned):.2g} deg" if turned * _reach_of(data.position) > 0.2 * shift else ""
    return f"{shift * 1e3:.3g} mm{about}" if change.kind == "drift" else f"{shift * 1e3:.3g} mm elsewhere{about}"


def _reach_of(position: Array) -> float:
    """Return how far positions lie from their middle [m]."""
    return float(np.sqrt(np.nansum(np.nanvar(position, axis=0))))
