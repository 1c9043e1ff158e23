"""Patel, sections 3.3, 3.7, 4.5 and 5.5: what a Katana is measured with, and what a calibration makes of it.

A twin is calibrated with one instrument after the other, compared elsewhere, and draws a circle.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from papers import Progress
from papers.katana.robot import TIP, katana, published
from papers.katana.tilting import tilting_from_inclinometers, twin
from papers.katana_devices import setup
from papers.katana_devices.page import OnPage, drawn_pages
from papers.katana_devices.setup import LOW_COST, OPTOTRAK, STARTS, USED, Counts, Start
from papers.seeds import Figures, Seed, gathered, over_seeds
from papers.study import Study
from papers.texts import Rows, told
from papers.traces import scatter
from truearm.engine.base.errors import InputError
from truearm.engine.data.dataset import Dataset
from truearm.engine.document.drawing import AFTER, BEFORE, Figure, axis, figure, logarithmic_axis, rounded
from truearm.engine.fit.fit import Fit, identify
from truearm.engine.fit.models import FRAMES, named_model
from truearm.engine.fit.problem import gauge_freedoms
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import rigid_motion
from truearm.engine.twin.devices.device import Device, measured_with
from truearm.engine.twin.devices.lengths import TOUCH_UP
from truearm.engine.twin.devices.pencil import DRAWN_CIRCLE, PencilCircle
from truearm.engine.twin.devices.touching import MARKERS
from truearm.engine.twin.twin import Twin

_DRAWN_AT_RANDOM: Final = 10_000
_TRIES: Final = 10
#: By name: every device of the registry that is used, and both of the low-cost set-up together.
_INSTRUMENTS: Final = (*(device.name for device in USED), LOW_COST)
#: What nobody measured: in words, and how many directions it is.
_GAUGES: Final = {"base": ("where the robot stands", 6), "size": ("how large it is", 1)}
#: The tables of what every device reaches, by start.
_TABLES: Final[Mapping[Start, str]] = {"geometry alone": "alone", "tilting first": "first"}
_TRUE: Final = "true mean distance"
_SHOWN: Final = "as the page shows it"
_COLOURS: Final = dict(zip(STARTS, ("#b3261e", AFTER), strict=True))


@dataclass(frozen=True, eq=False)
class _Reached:
    """What a calibration with one instrument reaches; errors in m, ``(n,)``."""

    own: Array  #: On unseen configurations in the instrument's own frame; NaN where it has none.
    moved: Array  #: Likewise after the best rigid motion of all predictions.
    size: float  #: By how much predicted lengths are too long [1].
    gauge: tuple[str, ...]  #: What nobody measured: the base, the size.
    unobservable: tuple[str, ...]  #: Parameters that predictions need and the instrument does not determine.


#: Of one seed: what is not seen, in words by row, and the circle by what is told of it.
_Drawn = tuple[dict[str, str], dict[str, OnPage]]


def study(
    seeds: int, progress: Progress, registry: int = 48, touched: int = 24, drawn: int = 72, unseen: int = 100
) -> Study:
    """Calibrate a twin with every instrument, compare it elsewhere and on the circle, once a seed.

    Args:
        seeds: How many: of the configurations, of the noise, and of the posture in which the circle is drawn.
        progress: Called with a few words at each step.
        registry: Configurations of each device of the registry but the two of the low-cost set-up.
        touched: Contacts of the touch-up.
        drawn: Points of the drawn circles.
        unseen: Configurations to judge by.
    """
    counts = Counts(registry, touched, drawn, unseen)
    found, seen = gathered(over_seeds(seeds, progress, partial(_one, counts=counts)))
    not_seen, pages = seen[0]
    tables: dict[str, Rows] = {**found, "own": {row: of for row, of in found["own"].items() if np.isfinite(of).all()}}
    left = {
        (name, start): float(np.median(found[_TABLES[start]][_measured_row(name, counts)]))
        for name in _INSTRUMENTS
        for start in STARTS
    }
    alone, first = STARTS
    circle = {what: float(np.median(found["page"][f"{LOW_COST}, {first}: {what}"])) for what in (_TRUE, _SHOWN)}
    figures = {"devices": _devices_figure(left), "page": _page_figure(pages)}
    texts: dict[str, object] = {"alone_markers": left[MARKERS.name, alone], "alone_spheres": left["two-spheres", alone]}
    texts |= {"markers": left[MARKERS.name, first], "spheres": left["two-spheres", first]}
    texts |= {"low_cost": left[LOW_COST, first], "point": left["point", first], "plane": left["plane", first]}
    texts |= {"shown": circle[_SHOWN], "true": circle[_TRUE], "registry": counts.registry, "touched": counts.touched}
    texts |= {"drawn": counts.drawn, "both": counts.of(LOW_COST), "largest_of": counts.unseen}
    return told(__file__, seeds, tables, figures, texts, why={"unobservable": not_seen})


def _measured_row(name: str, counts: Counts) -> str:
    return f"{name}, {counts.of(name)} configurations, mean"


def _one(seed: Seed, counts: Counts) -> tuple[Figures, _Drawn]:
    rng = seed.generator()
    nominal = katana()
    fit = tilting_from_inclinometers(nominal, twin(published("standard")), rng)
    starts: dict[Start, Robot] = {"geometry alone": nominal, "tilting first": fit.robot}
    others = nominal.random_configurations(counts.unseen, rng)
    at_end, with_pencil = (
        _placed(published("standard"), places) for places in (setup.ATTACHMENT.targets, setup.REFLECTORS)
    )
    end, tip = (twin_at.frames(others)[TIP][:, :3, 3] for twin_at in (at_end, with_pencil))

    def before(data: Dataset, true: Array) -> _Reached:
        data = _without_deviations(data)
        return _reached(identify(nominal, data, FRAMES), data, others, true)

    def fitted(data: Dataset) -> dict[Start, Fit]:
        model = named_model("geometric")
        return {name: identify(start, _without_deviations(data), model) for name, start in starts.items()}

    printed = {name: _measured(device, nominal, at_end, count, rng) for name, (device, count) in setup.DOCUMENT.items()}
    of_document = {
        (name, start): _reached(found, data, others, end)
        for name, data in printed.items()
        for start, found in fitted(data).items()
    }
    campaigns = {}
    for device in USED:
        led = device if device.tool is None else replace(device, tool=setup.POINT)
        if isinstance(led, PencilCircle):
            led = replace(led, centre=setup.MIDDLE, radius=setup.RADIUS)
        campaigns[device.name] = _measured(led, nominal, with_pencil, counts.of(device.name), rng)
    campaigns[LOW_COST] = together(campaigns[TOUCH_UP.name], campaigns[DRAWN_CIRCLE.name])
    fits = {(name, start): found for name, data in campaigns.items() for start, found in fitted(data).items()}
    reached = {key: _reached(found, campaigns[key[0]], others, tip) for key, found in fits.items()}
    views = _views(nominal, nominal.random_configurations(_DRAWN_AT_RANDOM, rng))
    correctors = {f"{name}, {start}": fits[name, start] for name in (MARKERS.name, LOW_COST) for start in STARTS}
    pages = drawn_pages(correctors, rng)
    in_place = nominal.with_frames(setup.PLACE, setup.ATTACHMENT.targets)
    own = "before, base and tool fitted"
    first: Start = "tilting first"
    seen, unseen = _closed_loops({name: reached[name, first] for name in _INSTRUMENTS})
    figures: Figures = {
        "document": _document(before(printed[OPTOTRAK], end), of_document),
        "own": {},
        "unobservable": seen,
        "page": {row: value for words, page in pages.items() for row, value in _page(words, page).items()},
        "views": views,
    }
    for name, data in printed.items():
        away = np.linalg.norm(data.position - in_place.world_poses(data.joints, TIP)[0], axis=1)
        figures["document"][f"{name}: largest distance from the nominal robot where it stands"] = 1e3 * float(
            away.max()
        )
    nothing = 1e3 * float(before(campaigns[MARKERS.name], tip).moved.mean())
    for start, table in _TABLES.items():
        left = {_measured_row(name, counts): 1e3 * float(reached[name, start].moved.mean()) for name in _INSTRUMENTS}
        figures[table] = {own: nothing, **left}
    for device in USED:
        errors = reached[device.name, first].own
        figures["own"] |= {
            f"{device.name}, mean": 1e3 * float(errors.mean()),
            f"{device.name}, largest": 1e3 * float(errors.max()),
        }
    return figures, (unseen, pages)


def _document(before: _Reached, reached: Mapping[tuple[str, Start], _Reached]) -> dict[str, float]:
    """Return what the document's three instruments reach [mm]."""
    stages = {"before": before} | {start: reached[OPTOTRAK, start] for start in STARTS}
    rows = {}
    for stage, of in stages.items():
        rows[f"{OPTOTRAK}, 118 poses, {stage}, mean"] = 1e3 * float(of.own.mean())
        rows[f"{OPTOTRAK}, 118 poses, {stage}, largest"] = 1e3 * float(of.own.max())
    few = {key: of for key, of in reached.items() if key[0] != OPTOTRAK}
    return rows | {f"{name}, {start}, mean": 1e3 * float(of.own.mean()) for (name, start), of in few.items()}


def _closed_loops(reached: Mapping[str, _Reached]) -> tuple[dict[str, float], dict[str, str]]:
    """Return which directions instruments that close a loop do not determine, and by row what that is."""
    rows, why = {}, {}
    for name, of in reached.items():
        if of.gauge:
            row = f"{name}: directions that it does not see"
            rows[row] = float(sum(_GAUGES[gauge][1] for gauge in of.gauge) + bool(of.unobservable))
            rows[f"{name}: predicted lengths too long by [%]"] = 100 * of.size
            words = [_GAUGES[gauge][0] for gauge in of.gauge]
            words += [f"a direction of {', '.join(of.unobservable)}"] if of.unobservable else []
            why[row] = f"It does not see {' and '.join(words)}."
    return rows, why


def _page(words: str, page: OnPage) -> dict[str, float]:
    return {
        f"{words}: {_TRUE}": float(page.distance.mean()),
        f"{words}: after the best rigid motion": float(page.moved.mean()),
        f"{words}: {_SHOWN}": page.shown,
    }


def _without_deviations(data: Dataset) -> Dataset:
    """Return data whose deviations are estimated from what the fit leaves."""
    return replace(data, sigma=None, sigma_rot=None)


def together(first: Dataset, second: Dataset) -> Dataset:
    """Return two campaigns with the same robot and target and with fixtures of their own as one."""
    k, n = first.configurations, len(first.target)

    def stacked(a: Array | None, b: Array | None) -> Array:
        whole = [np.full(size, np.nan) if v is None else v for v, size in ((a, n), (b, len(second.target)))]
        return np.concatenate(whole)

    return replace(
        first,
        source=f"{first.source} and {second.source}",
        labels=tuple(str(i + 1) for i in range(k + second.configurations)),
        joints=np.concatenate([first.joints, second.joints]),
        configuration=np.concatenate([first.configuration, k + second.configuration]),
        target=np.concatenate([first.target, second.target]),
        position=np.concatenate([first.position, second.position]),
        distance=stacked(first.distance, second.distance),
        height=stacked(first.height, second.height),
        fixtures=(*first.fixtures, *second.fixtures),
        fixture=np.concatenate([first.against, len(first.fixtures) + second.against]),
        setup=second.setup,
        sigma=stacked(first.sigma, second.sigma),
        approach=None,
        number=None,
    )


def _measured(device: Device, nominal: Robot, truth: Twin, count: int, rng: np.random.Generator) -> Dataset:
    """Return a campaign; where an arm cannot be jogged to a place because a joint falls to and fro there, another."""
    for _ in range(_TRIES - 1):
        try:
            return measured_with(device, nominal, truth, count, rng)
        except InputError:
            continue
    return measured_with(device, nominal, truth, count, rng)


def _placed(robot: Robot, places: Mapping[str, tuple[float, float, float]]) -> Twin:
    return twin(robot.with_frames(setup.PLACE, places))


def _views(nominal: Robot, joints: Array) -> dict[str, float]:
    """Return what share of configurations instruments see [%]."""
    return {
        words: 100 * float(device.visible(nominal.with_frames(setup.PLACE, places), joints).any(axis=1).mean())
        for words, (device, places) in setup.VIEWS.items()
    }


def _reached(fit: Fit, data: Dataset, joints: Array, true: Array) -> _Reached:
    """Compare a robot with the true places ``(n, 3)`` of its tip in the world."""
    predicted = fit.robot.world_poses(joints, TIP)[0]
    R, p = rigid_motion(predicted, true)
    own = np.linalg.norm(predicted - true, axis=1) if data.anchored else np.full(len(true), np.nan)
    spread, truly = (places - places.mean(axis=0) for places in (predicted @ R.T, true))
    return _Reached(
        own=own,
        moved=np.linalg.norm(predicted @ R.T + p - true, axis=1),
        size=float(np.sum(spread * truly) / np.sum(truly * truly)) - 1.0,
        gauge=gauge_freedoms(data),
        unobservable=fit.unobservable,
    )


def _devices_figure(left: Mapping[tuple[str, Start], float]) -> Figure:
    """Draw the error on unseen configurations by device, median over the seeds."""
    values = {start: np.array([left[name, start] for name in _INSTRUMENTS]) for start in STARTS}
    order = np.argsort(values["tilting first"])[::-1]
    names = [_INSTRUMENTS[k].partition(":")[0] for k in order.tolist()]
    traces = [
        scatter(
            start,
            "markers",
            rounded(values[start][order], 3),
            names,
            marker={"color": _COLOURS[start], "size": 9},
            hovertemplate=f"{start}<br>%{{y}}: %{{x:.3g}} mm<extra></extra>",
        )
        for start in STARTS
    ]
    return figure(traces, 480, xaxis=logarithmic_axis("mean error [mm]", 0.01, 5.0), yaxis={"automargin": True})


def _page_figure(pages: Mapping[str, OnPage]) -> Figure:
    """Draw what the page shows."""
    shown = {"before": pages["before"]} | {f"low-cost, {s}": pages[f"{LOW_COST}, {s}"] for s in STARTS}
    traces = []
    for (words, page), colour in zip(shown.items(), (BEFORE, *_COLOURS.values()), strict=True):
        for values, part, dash in ((page.outward, "outward", "solid"), (page.height, "height", "dot")):
            name, look = f"{words}: {part}", {"color": colour, "width": 1.8, "dash": dash}
            said = f"{name} %{{y:.3g}} mm at %{{x:.0f}} deg<extra></extra>"
            x, y = rounded(page.along, 4), rounded(values, 4)
            traces.append(scatter(name, "lines", x, y, line=look, hovertemplate=said))
    return figure(traces, 420, xaxis=axis("round the circle [deg]"), yaxis=axis("beside the circle [mm]"))
