"""Nubiola, section 2.6: the calibration of an IRB 120 in simulation, without noise and with it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from truearm.identification.solving.bounds import Bounds
from truearm.identification.solving.fit import Redundant, identify
from truearm.identification.solving.models import MODELS
from truearm.library import load_robot
from truearm.measurement.dataset import Dataset
from truearm.measurement.statistics import Spread, errors_of
from truearm.modeling.chain import Array
from truearm.modeling.parts import Payload
from truearm.modeling.robot import Robot
from truearm.reporting.drawing import AFTER, BEFORE, axis, figure, logarithmic_axis
from truearm.reporting.numbers import rounded
from truearm.simulation.truths import STATION, truth_twin
from truearm.simulation.twin import Twin, measure
from truearm.simulation.twin_joint import JointTruth
from truearm.studies.parallel_axes import without_beta
from truearm.studies.study import Picture, Row, Study, Table

_ELASTIC: Final = next(model for model in MODELS if model.name == "elastic")
#: Lowest and highest joint readings [deg]: section 2.5; upper ends of joints 2 and 3 are the robot's own limits.
_REGION: Final = ((-90, 0, -80, -150, -90, -180), (90, 110, 70, 150, 90, 180))
_TRAINING: Final = 38  # section 2.5.3
_UNSEEN: Final = 1000  # section 2.6
_NOISE: Final = 0.070e-3
_WRONG: Final = 0.10
#: Standard deviations of drawn errors of links 2 to 6 [m, rad]; they leave about 5 mm, as the document forces.
_DRAWN: Final = {"m": 0.20e-3, "rad": math.radians(0.07)}


@dataclass(frozen=True)
class _Run:
    """Errors [mm] of one seed on unseen configurations, by what was done."""

    spread: Mapping[str, Spread]
    before: Array
    after: Array


def study(seeds: int, progress: Callable[[str], None], unseen: int = _UNSEEN) -> Study:
    """Run the study.

    Parameters
    ----------
    seeds
        How many: of configurations, noise, wrong masses and drawn errors.
    progress
        Called with a few words at each step.
    unseen
        Configurations to judge by.
    """
    runs = []
    for seed in range(seeds):
        progress(f"seed {seed + 1} of {seeds}")
        runs.append(_run(seed, unseen))

    def of(name: str, figure: str) -> tuple[float, ...]:
        return tuple(float(getattr(run.spread[name], figure)) * 1e3 for run in runs)

    exact = Table(
        "No noise, masses known",
        "Largest position error of the three reflectors over unseen configurations: of the nominal robot where it"
        " nominally stands, and of the elastic model identified from 38 configurations without priors (redundant"
        " parameters dropped).",
        (
            Row(
                "before, errors of Tables 2.6 and 2.7",
                "mm",
                of("before", "max"),
                5.0,
                "section 2.6",
                relative=0.2,
                explanation="The document forces errors that leave 5 mm and does not print them. These are the errors"
                " that it identified on the real robot, in nominal frames.",
            ),
            Row(
                "before, errors drawn anew for each seed",
                "mm",
                of("drawn before", "max"),
                5.0,
                "section 2.6",
                relative=0.5,
                explanation="Links 2 to 6, beta included: normal, 0.20 mm and 0.07 deg, chosen to leave about 5 mm.",
            ),
            Row(
                "after, errors of Tables 2.6 and 2.7",
                "mm",
                of("exact", "max"),
                0.004,
                "section 2.6",
                absolute=0.004,
                explanation="Rounding alone is left. The document leaves 0.004 mm, see the last row.",
            ),
            Row("after, drawn errors", "mm", of("drawn exact", "max"), 0.004, "section 2.6", absolute=0.004),
            Row(
                "after, payload told in the true flange frame",
                "mm",
                of("payload as printed", "max"),
                0.004,
                "section 2.6",
                absolute=0.004,
                explanation="With free targets, theta 6 and d 6 are redundant and held at nominal, so the flange frame"
                " of the model is not the true one. A payload whose centre of gravity is known in the true frame is"
                " then some 0.1 mm off, and that alone leaves about 0.001 mm.",
            ),
            Row(
                "after, drawn errors without beta, d 3 held",
                "mm",
                of("d_3 held", "max"),
                0.004,
                "section 2.6",
                absolute=0.004,
                explanation="The document explains its 0.004 mm by d 3, dropped as redundant though axis 3 leans a"
                " little. Dropping it costs next to nothing here: a 3 and the joint zeros take it up. The frame of the"
                " payload above, or stopping after four iterations, is of the right size.",
            ),
            Row(
                "after, drawn errors with beta, model without",
                "mm",
                of("no beta", "max"),
                explanation="What a real robot would leave that the document's model cannot follow: axis 3 leans to the"
                " side as well. The document's simulated robot cannot, so it could not see this.",
            ),
        ),
    )
    noisy = Table(
        "Noise of 0.070 mm, masses and centres of gravity 10 % off",
        "Error of the identified robot against the true positions, without noise. Each mass and centre of gravity,"
        " payload included, is 10 % too large or too small, by chance.",
        (
            Row(
                "mean",
                "mm",
                of("noisy", "mean"),
                0.050,
                "section 2.6",
                relative=0.5,
                explanation='The document prints "in the order of 0.050 mm to 0.100 mm" for mean and maximum, so half'
                " is allowed either way.",
            ),
            Row("maximum", "mm", of("noisy", "max"), 0.100, "section 2.6", relative=0.5),
            Row(
                "mean, masses known",
                "mm",
                of("noisy, masses known", "mean"),
                explanation="Wrong masses cost little: the compliances take up what is common to all configurations.",
            ),
            Row("mean, no noise", "mm", of("masses wrong", "mean")),
            Row(
                "mean, one reflector a configuration",
                "mm",
                of("one reflector", "mean"),
                explanation="As in the document's first set-up: a third of the readings.",
            ),
            Row(
                "mean, if 0.070 mm is the length of the error",
                "mm",
                of("noise as length", "mean"),
                explanation="The document does not say whether 0.070 mm is the deviation of a coordinate, as assumed"
                " above, or the length of the whole error.",
            ),
            Row(
                "mean against noisy readings",
                "mm",
                of("noisy readings", "mean"),
                explanation="What a real validation would show; most of it is the noise of the validation itself.",
            ),
        ),
    )
    return Study(
        name="irb120-simulation",
        title="Calibration of a simulated ABB IRB 120",
        source="A. Nubiola, doctoral thesis, ETS Montreal, section 2.6; truth from Tables 2.4, 2.6 and 2.7",
        answer=f"Without noise the elastic model comes back to the truth: {np.median(of('before', 'max')):.1f} mm at"
        f" most before, {np.median(of('exact', 'max')):.1g} mm after, where the document leaves 0.004 mm. With its"
        f" noise and wrong masses {np.median(of('noisy', 'mean')):.3f} mm are left on average, where it has 0.050 to"
        " 0.100 mm.",
        seeds=seeds,
        tables=(exact, noisy),
        pictures=(_histogram(runs),),
        notes=(
            "The twin computes with 4x4 matrices and lets the arm sag until moments and deflections agree;"
            " identification sees only its readings.",
            "The elastic model has Hayati's beta at joint 3, which the document leaves out.",
            "Base and targets are unknown to identification and found with the robot; the document measures the"
            " targets beforehand.",
            f"38 training and {unseen} unseen configurations are drawn evenly from the region of section 2.5; the"
            " document chooses its 38 by observability.",
        ),
    )


def _run(seed: int, unseen: int) -> _Run:
    rng = np.random.default_rng(seed)
    nominal = load_robot("irb120")
    low, high = np.radians(_REGION)
    joints = rng.uniform(low, high, (_TRAINING, 6))
    others = rng.uniform(low, high, (unseen, 6))
    published = truth_twin(nominal, "tracker-triangular", rng)
    there = nominal.with_frames(STATION, nominal.tools["triangular"].targets)
    spread = {}

    truth = measure(published, others, 0.0, rng)
    clean = measure(published, joints, 0.0, rng)
    spread["before"], before = _judged(there, truth)
    spread["exact"], _ = _identified(_told(nominal, published), clean, truth, "drop")
    spread["payload as printed"], _ = _identified(nominal.with_payload(published.robot.payload), clean, truth, "drop")

    drawn = _drawn(published, nominal, rng)
    drawn_truth = measure(drawn, others, 0.0, rng)
    spread["drawn before"], _ = _judged(there, drawn_truth)
    drawn_clean = measure(drawn, joints, 0.0, rng)
    told = _told(nominal, drawn)
    spread["drawn exact"], _ = _identified(told, drawn_clean, drawn_truth, "drop")
    spread["no beta"], _ = _identified(without_beta(told), drawn_clean, drawn_truth, "drop")
    parallel = replace(drawn, robot=drawn.robot.with_values({"beta_3": 0.0}))
    clean_parallel, truth_parallel = (measure(parallel, at, 0.0, rng) for at in (joints, others))
    spread["d_3 held"], _ = _identified(without_beta(told), clean_parallel, truth_parallel, within={"d_3": 0.0})

    wrong = _wrong(nominal.with_payload(published.robot.payload), rng)
    noisy = _with_noise(clean, _NOISE, rng)
    fitted = identify(wrong, noisy, _ELASTIC).robot
    spread["noisy"], after = _judged(fitted, truth)
    spread["noisy readings"], _ = _judged(fitted, _with_noise(truth, _NOISE, rng))
    spread["noisy, masses known"], _ = _identified(_told(nominal, published), noisy, truth)
    spread["masses wrong"], _ = _identified(wrong, clean, truth)
    spread["one reflector"], _ = _identified(wrong, _one_reflector(noisy, rng), truth)
    spread["noise as length"], _ = _identified(wrong, _with_noise(clean, _NOISE / math.sqrt(3), rng), truth)
    return _Run(spread, before, after)


def _identified(
    robot: Robot,
    training: Dataset,
    truth: Dataset,
    redundancy: Redundant = "prior",
    within: Mapping[str, float] | None = None,
) -> tuple[Spread, Array]:
    bounds = None
    if within is not None:
        bounds = Bounds.model_validate(
            {"truearm": "truearm-bounds/1", "units": {"length": "mm", "angle": "deg"}, "within": within}
        )
    return _judged(identify(robot, training, _ELASTIC, redundancy=redundancy, bounds=bounds).robot, truth)


def _judged(robot: Robot, truth: Dataset) -> tuple[Spread, Array]:
    norms = errors_of(robot, truth).position_norms
    return Spread.of(norms), norms * 1e3


def _told(nominal: Robot, twin: Twin) -> Robot:
    """Return the nominal robot with the twin's payload where it is in the flange frame that identification holds.

    Identification drops errors of ``theta_offset_6`` and ``d_6``, which free targets take up. The true flange is
    turned and shifted by them along axis 6, and the payload with it.
    """
    errors = {name: twin.robot.values[name] - nominal.values[name] for name in ("theta_offset_6", "d_6")}
    c, s = math.cos(errors["theta_offset_6"]), math.sin(errors["theta_offset_6"])
    x, y, z = twin.robot.payload.cog
    return nominal.with_payload(Payload(twin.robot.payload.mass, (c * x - s * y, s * x + c * y, z + errors["d_6"])))


def _drawn(twin: Twin, nominal: Robot, rng: np.random.Generator) -> Twin:
    """Return the twin with errors of links 2 to 6 drawn anew, and compliances half to one and a half times its own."""
    values = {
        p.name: p.value + _DRAWN[p.unit] * float(rng.standard_normal())
        for p in nominal.parameters.values()
        if p.group in ("geometry", "joint zero") and not p.name.endswith("_1")
    }
    joints = {number: JointTruth(truth.compliance * rng.uniform(0.5, 1.5)) for number, truth in twin.joints.items()}
    return replace(twin, robot=twin.robot.with_values(values), joints=joints)


def _wrong(robot: Robot, rng: np.random.Generator) -> Robot:
    """Return the robot with every mass and centre of gravity 10 % too large or too small."""

    def off() -> float:
        return 1.0 + _WRONG * float(rng.choice((-1.0, 1.0)))

    def moved(cog: tuple[float, float, float]) -> tuple[float, float, float]:
        factor = off()
        return (cog[0] * factor, cog[1] * factor, cog[2] * factor)

    masses = tuple(replace(mass, mass=mass.mass * off(), cog=moved(mass.cog)) for mass in robot.masses)
    payload = Payload(robot.payload.mass * off(), moved(robot.payload.cog))
    return replace(robot, masses=masses, payload=payload)


def _with_noise(data: Dataset, noise: float, rng: np.random.Generator) -> Dataset:
    position = data.position + rng.normal(0.0, noise, data.position.shape)
    return replace(data, position=position, sigma=np.full(len(position), noise))


def _one_reflector(data: Dataset, rng: np.random.Generator) -> Dataset:
    """Return the data with one reading a configuration, of a target drawn for it."""
    seen = rng.integers(len(data.targets), size=data.configurations)
    missing = data.target != seen[data.configuration]
    return replace(data, position=np.where(missing[:, None], np.nan, data.position))


def _histogram(runs: list[_Run]) -> Picture:
    low, high = 1e-3, 10.0
    edges = np.geomspace(low, high, 61)
    traces = [
        {
            "type": "bar",
            "name": name,
            "x": rounded(np.sqrt(edges[:-1] * edges[1:]), 6),
            "width": rounded(np.diff(edges), 6),
            "y": np.histogram(np.clip(errors, low, high), edges)[0].tolist(),
            "marker": {"color": colour, "line": {"width": 0}},
            "hovertemplate": f"{name}<br>%{{x:.3g}} mm: %{{y}} readings<extra></extra>",
        }
        for name, colour, errors in (
            ("nominal, before", BEFORE, np.concatenate([run.before for run in runs])),
            ("0.070 mm noise, masses 10 % off, after", AFTER, np.concatenate([run.after for run in runs])),
        )
    ]
    drawn = figure(
        traces,
        340,
        xaxis=logarithmic_axis("position error [mm]", low, high),
        yaxis=axis("readings"),
        barmode="overlay",
        bargap=0,
    )
    return Picture(
        "errors",
        "Errors on unseen configurations",
        "All seeds together, truth of Tables 2.6 and 2.7, against the true positions.",
        drawn,
    )
