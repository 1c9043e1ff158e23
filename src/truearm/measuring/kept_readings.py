"""What a session has kept, as measurements that a calibration takes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from truearm.engine.base.errors import counted
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.rows import Configurations, in_order, places_after_stops
from truearm.engine.robot.chain import Array
from truearm.measuring.campaign import nest_drift
from truearm.measuring.session import Entry, Session


@dataclass(frozen=True)
class StatedSigma:
    """The standard deviation that measurements are written with."""

    value: float | None  #: For all readings [m]; None where every reading has its own, or none is stated.
    words: str  #: Where it comes from.
    own: bool = False  #: Whether every reading has its own.


def stated_sigma(session: Session) -> StatedSigma:
    """Return with which standard deviation the kept readings are written.

    What the instrument states comes first. Otherwise that with which the nests repeat: it holds what differs from one
    visit to the next, the drift included. The scatter of a dwell does not: it says how still it was for seconds, and is
    too small by far. So without either none is stated, and the calibration finds it from its residuals.
    """
    readings = [entry.reading for entry in session.kept if entry.reading is not None]
    if readings and all(reading.sigma is not None for reading in readings):
        return StatedSigma(None, "as the instrument states it", own=True)
    drift = nest_drift(session)
    if drift is not None and drift.sigma is not None:
        return StatedSigma(drift.sigma, f"with which the nests repeat, {counted(drift.freedoms, 'degree')} of freedom")
    return StatedSigma(None, "none is stated: the scatter of a dwell does not say how well a place is found again")


def kept_readings(
    session: Session, configurations: Configurations, source: str, simulated: bool = False
) -> Dataset | None:
    """Return the readings that are kept, as a dataset; None if there is none of a target.

    Configurations come in the order in which the robot came to them. One to which it came again has visits. A target
    that was left out at a configuration is a missing reading there. Configurations to which it never came are left out.
    Nests are reference points, at the configuration at which they were measured. Where the plan has stops right before
    the configurations, these count in the order, so that nobody takes it that a joint came from the configuration
    before.

    Args:
        configurations: Those of the plan.
        source: What messages call the data.
        simulated: Whether a virtual instrument reads.
    """
    targets = [entry for entry in session.kept if not entry.is_nest]
    if not targets:
        return None
    visits = _visits(session)
    index = {session.labels.index(label): number for number, label in enumerate(visits.order)}
    places = [*index]
    names = [name for name in session.targets if any(entry.name == name for entry in targets)]
    entries = {(entry.label, entry.name): entry for entry in targets}
    asked = dict(zip(session.labels, session.asked, strict=True))
    rows = []
    for label in visits.order:  # what nobody asked for is not missing
        of = [name for name in names if name in asked[label] or (label, name) in entries]
        rows += [(label, name, entries.get((label, name))) for name in of or names]
    sigma = stated_sigma(session)
    common: dict[str, Any] = {
        "source": source,
        "labels": visits.order,
        "joints": configurations.joints[places],
        "joint_kinds": configurations.kinds,
        "joints_are": configurations.joints_are,
        "simulated": simulated,
    }
    nests = [entry for entry in session.kept if entry.is_nest]
    references = None
    if nests:
        labels = [entry.label if entry.label in visits.order else visits.order[0] for entry in nests]
        references = Dataset(
            **common,
            **_fields([(label, entry.name, entry) for label, entry in zip(labels, nests, strict=True)], visits, sigma),
        )
    data = Dataset(**common, **_fields(rows, visits, sigma), references=references)
    count = len(places)
    return in_order(data, np.arange(1, count + 1) if configurations.before is None else places_after_stops(count))


@dataclass(frozen=True)
class _Visits:
    """When the robot was where."""

    order: tuple[str, ...]  #: Configurations in the order in which the robot came to them first.
    of: dict[int, int]  #: On which visit of its configuration each reading was taken, by its number.

    @property
    def several(self) -> bool:
        """Whether the robot came to a configuration again."""
        return any(number > 1 for number in self.of.values())


def _visits(session: Session) -> _Visits:
    known = {*session.labels}
    visits: dict[str, int] = {}
    of: dict[int, int] = {}
    at = ""
    for entry in session.entries:
        if entry.event == "aside" or entry.label not in known:
            continue
        if entry.is_nest or (entry.event == "left" and entry.label != at and entry.label in visits):
            of[entry.number] = 1
            continue
        if entry.label != at:
            at = entry.label
            visits[at] = visits.get(at, 0) + 1
        of[entry.number] = visits[at]
    return _Visits(tuple(visits), of)


def _fields(rows: list[tuple[str, str, Entry | None]], visits: _Visits, sigma: StatedSigma) -> dict[str, Any]:
    """Return the fields of a dataset that belong to its readings."""
    names = tuple(dict.fromkeys(name for _, name, _ in rows))
    entries = [entry for _, _, entry in rows]
    readings = [None if entry is None else entry.reading for entry in entries]

    def each(name: str, width: int) -> Array:
        missing = np.full(width, np.nan)
        values = [None if reading is None else getattr(reading, name) for reading in readings]
        return np.array([missing if value is None else np.reshape(value, width) for value in values], float)

    turned = any(reading is not None and reading.quaternion is not None for reading in readings)
    deviations: dict[str, Array | None] = {"sigma": None, "sigma_rot": None}
    if sigma.own:
        deviations["sigma"] = each("sigma", 1)[:, 0]
    elif sigma.value is not None:
        deviations["sigma"] = np.full(len(rows), sigma.value)
    if turned:
        about = each("sigma_rot", 1)[:, 0]
        whole = np.isfinite(each("quaternion", 4)).all(axis=1)
        deviations["sigma_rot"] = about if np.isfinite(about[whole]).all() else None
    if visits.several:
        visit = [1 if entry is None else visits.of[entry.number] for entry in entries]
        deviations["visit"] = np.array(visit, dtype=np.intp)
    return {
        "targets": names,
        "configuration": np.array([visits.order.index(label) for label, _, _ in rows], dtype=np.intp),
        "target": np.array([names.index(name) for _, name, _ in rows], dtype=np.intp),
        "position": each("position", 3),
        "quaternion": each("quaternion", 4) if turned else None,
        **deviations,
    }
