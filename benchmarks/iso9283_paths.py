"""How well path criteria of ISO 9283 are read from samples of a tip whose motion is known.

- streams: 30 streams of whole tests (25 to 1000 Hz, dwells of 0.3 to 3 s, 0.02 mm noise, 5 % lost samples): cycles and
  motions found, AT against the truth.
- coverage: 95 % intervals of AV and RV over 1000 campaigns of 10 cycles whose velocities are Gaussian, uniform,
  Student's t with 5 degrees or exponential; width beside that of who knows the distribution to be Gaussian.
- paths: intervals of AT and RT over campaigns of 10 cycles whose deviations are Gaussian along the path.
- size: time and memory of reading and judging a million samples.

Arguments: streams, coverage, paths, size (all of them).
"""

from __future__ import annotations

import json
import resource
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from tests.moving_tip import (
    ALONG,
    HERE,
    NORMAL,
    TRACKER,
    along,
    duration_of,
    plan_of,
    ramp,
    samples_of,
    stream_of,
    the,
    times,
)

from truearm.iso9283.criteria.corners import corner_values, weaving_values
from truearm.iso9283.criteria.paths import path_values
from truearm.iso9283.criteria.velocity import velocity_values
from truearm.iso9283.evaluating.samples import read_path_samples
from truearm.iso9283.planning.criteria import Way

PATHS = ("line", "rectangle", "large-circle", "small-circle")
RATES = (25.0, 50.0, 100.0, 250.0, 1000.0)


def say(text: str) -> None:
    sys.stdout.write(f"{text}\n")


def streams(count: int = 30) -> dict[str, object]:
    rows = []
    for seed in range(count):
        rng = np.random.default_rng(seed)
        rate, name, velocity = float(rng.choice(RATES)), str(rng.choice(PATHS)), float(rng.choice([0.25, 0.125]))
        plan = plan_of(velocity=velocity)
        length = Way(plan.paths[name]).length
        size, waves, phase = rng.uniform(0.2e-3, 0.5e-3), int(rng.integers(1, 4)), rng.uniform(0.0, 6.0)

        def aside(s: np.ndarray) -> np.ndarray:
            swing = 0.6 + 0.4 * np.sin(2 * np.pi * waves * s / length + phase)  # noqa: B023
            return np.outer(size * swing, NORMAL)  # noqa: B023

        t, p, truth = stream_of(plan, name, rate, rng, cycles=10, offset=aside, velocity=velocity)
        values, (record,) = path_values(plan, samples_of("AT", name, [(0, t, p)]), HERE, TRACKER)
        found = record.run.stream
        assert found is not None
        at = the(values, "AT").value / np.linalg.norm(aside(np.linspace(0, length, 1001)), axis=1).max() - 1
        off = [max(abs(t[a] - b), abs(t[c] - d)) for (a, c), (b, d) in zip(found.cycles, truth, strict=False)]
        there = 20 if name == "line" else 10
        rows.append(
            {
                "rate": rate,
                "path": name,
                "cycles": len(found.cycles) == 10,
                "motions": len(found.motions) == there and len(found.dwells) == there + 1,
                "ends_s": round(max(off), 4),
                "AT": round(float(at), 4),
            }
        )
    worst = max(abs(float(str(row["AT"]))) for row in rows)
    cycles, motions = (sum(bool(row[name]) for row in rows) for name in ("cycles", "motions"))
    say(f"{cycles} of {count} cycles, {motions} motions, largest error of AT {worst}")
    return {"rows": rows, "largest_error_of_AT": worst}


def coverage(count: int = 1000) -> dict[str, object]:
    """The samples of a campaign are those of the middle half of the line alone, at 100 Hz, for speed."""
    plan, v, spread = plan_of(), 0.25, 0.002
    length = Way(plan.paths["line"]).length
    laws = {
        "gaussian": lambda rng: rng.normal(0, 1, 10),
        "uniform": lambda rng: rng.uniform(-1, 1, 10) * np.sqrt(3),
        "t5": lambda rng: rng.standard_t(5, 10) / np.sqrt(5 / 3),
        "exponential": lambda rng: rng.exponential(1, 10) - 1,
    }
    told: dict[str, object] = {}
    for law, draw in laws.items():
        rng = np.random.default_rng(1)
        inside = np.zeros((count, 2), bool)
        width = np.zeros((count, 2))
        for trial in range(count):
            rows = []
            for number, d in enumerate(draw(rng), 1):
                t = times(length / v * 1.05, 100.0)
                p = along(plan, "line", v * (1.01 + spread * d) * t) + rng.normal(0, 0.02e-3, (len(t), 3))
                rows.append((number, t, p))
            values, _ = velocity_values(plan, samples_of("AV", "line", rows), HERE, TRACKER)
            for k, (id_, true) in enumerate((("AV", 0.01), ("RV", 3 * spread))):
                interval = the(values, id_).interval
                assert interval is not None
                inside[trial, k] = interval[0] <= true <= interval[1]
                width[trial, k] = interval[1] - interval[0]
        from scipy import stats

        # with the standard deviation of each sample, Gaussian cycles: the same t and chi-square on the true velocities
        c4 = np.sqrt(2 / 9) * _gamma_ratio(10)
        oracle = (2 * stats.t.ppf(0.975, 9) * spread * c4 / np.sqrt(10), _rv_width(10) * 3 * spread * c4)
        told[law] = {
            "AV": float(inside[:, 0].mean()),
            "RV": float(inside[:, 1].mean()),
            "width over oracle": [round(float(w / o), 3) for w, o in zip(width.mean(axis=0), oracle, strict=True)],
        }
        say(f"{law} {told[law]}")
    return told


def _gamma_ratio(n: int) -> float:
    from scipy.special import gammaln

    return float(np.exp(gammaln(n / 2) - gammaln((n - 1) / 2)))


def _rv_width(n: int) -> float:
    from scipy import stats

    low, high = (np.sqrt((n - 1) / stats.chi2.ppf(p, n - 1)) for p in (0.975, 0.025))
    return float(high - low)


def paths(count: int = 300) -> dict[str, object]:
    """Deviations are a mean swing plus Gaussian swings of three wavelengths, new in each cycle, plus noise."""
    plan = plan_of()
    length = Way(plan.paths["line"]).length
    t = times(length / 0.25 * 1.02, 250.0)
    s = 0.25 * t
    shapes = np.array([np.sin(2 * np.pi * k * s / length + k) for k in (1, 2, 3)])
    told: dict[str, object] = {}
    for size in (0.3e-3, 0.05e-3, 0.0):
        rng = np.random.default_rng(2)
        mean = np.outer(size * (0.7 + 0.3 * np.sin(2 * np.pi * s / length)), NORMAL)
        dense = np.linspace(0, length, 1000)
        true = float((size * (0.7 + 0.3 * np.sin(2 * np.pi * dense / length))).max())
        each = 0.02e-3
        variance = each**2 * sum(np.sin(2 * np.pi * k * dense / length + k) ** 2 for k in (1, 2, 3))
        # two axes of this variance: distances are Rayleigh's; the noise of samples is smoothed and small
        rayleigh = np.sqrt(variance.max()) * (np.sqrt(np.pi / 2) + 3 * np.sqrt(2 - np.pi / 2))
        inside = np.zeros((count, 2), bool)
        for trial in range(count):
            rows = []
            for number in range(1, 11):
                swing = np.outer(each * rng.normal(size=3) @ shapes, NORMAL)
                swing += np.outer(each * rng.normal(size=3) @ shapes, np.cross(NORMAL, _direction(plan)))
                p = along(plan, "line", s) + mean + swing + rng.normal(0, 0.002e-3, (len(t), 3))
                rows.append((number, t, p))
            values, _ = path_values(plan, samples_of("AT", "line", rows), HERE, TRACKER)
            for k, (id_, truth) in enumerate((("AT", true), ("RT", float(rayleigh)))):
                interval = the(values, id_).interval
                assert interval is not None
                inside[trial, k] = interval[0] <= truth <= interval[1]
        told[f"AT {1e3 * size:g} mm"] = {"AT": float(inside[:, 0].mean()), "RT": float(inside[:, 1].mean())}
        say(f"{size} {told[f'AT {1e3 * size:g} mm']}")
    return told


def _direction(plan: object) -> np.ndarray:
    line = plan.paths["line"].points  # type: ignore[attr-defined]
    return np.asarray((line[1] - line[0]) / np.linalg.norm(line[1] - line[0]))


def size(rows: int = 1_000_000) -> dict[str, object]:
    """AT on four paths, AV, CR and WS at three velocities, 10 cycles of each, with orientations."""
    plan, rng = plan_of(), np.random.default_rng(0)
    folder = Path(tempfile.mkdtemp())
    file = folder / "paths.csv"
    tests = [("AT", name) for name in PATHS]
    tests += [("AT-reorientation", "line"), ("AV", "line"), ("CR", "rectangle"), ("WS", "weave")]
    each = rows // (len(tests) * 3 * 10)
    written = 0
    with file.open("w") as text:
        text.write("criterion,path,cycle,velocity [%],load [%],time [s],x [mm],y [mm],z [mm],qw,qx,qy,qz\n")
        for test, name in tests:
            way = Way(plan.paths[name], reoriented=test == "AT-reorientation")
            for share in (100, 50, 10):
                velocity = plan.rated_velocity * share / 100
                for cycle in range(1, 11):
                    t = np.linspace(0, duration_of(way.length, velocity), each)
                    at = ramp(t, way.length, velocity)
                    p = 1e3 * (way.position(at) + rng.normal(0, 1e-5, (each, 3)))
                    if name == "weave":
                        p += 1e3 * np.outer(0.01 * np.sin(2 * np.pi * at / 0.04), np.cross(NORMAL, ALONG))
                    from truearm.engine.robot.transform import quaternion_from_rotation

                    q = quaternion_from_rotation(way.rotation(at))
                    for k in range(each):
                        text.write(
                            f"{test},{name},{cycle},{share},100,{t[k]:.5f},{p[k, 0]:.5f},{p[k, 1]:.5f},{p[k, 2]:.5f},"
                            f"{q[k, 0]:.6f},{q[k, 1]:.6f},{q[k, 2]:.6f},{q[k, 3]:.6f}\n"
                        )
                    written += each
    begin, cpu = time.perf_counter(), time.process_time()
    samples = read_path_samples(file)
    read = time.process_time() - cpu
    values = []
    values += path_values(plan, samples, HERE, TRACKER)[0]
    values += path_values(plan, samples, HERE, TRACKER, "AT-reorientation")[0]
    values += velocity_values(plan, samples, HERE, TRACKER)[0]
    values += corner_values(plan, samples, HERE, TRACKER)[0]
    values += weaving_values(plan, samples, HERE, TRACKER)[0]
    told = {
        "samples": written,
        "bytes": file.stat().st_size,
        "values": len(values),
        "read, s of the processor": round(read, 2),
        "all, s of the processor": round(time.process_time() - cpu, 2),
        "all, s": round(time.perf_counter() - begin, 2),
        "memory, MB": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024),
    }
    file.unlink()
    folder.rmdir()
    say(str(told))
    return told


if __name__ == "__main__":
    parts = {"size": size, "streams": streams, "coverage": coverage, "paths": paths}
    asked = sys.argv[1:] or list(parts)
    results = Path(__file__).with_suffix(".json")
    known = json.loads(results.read_text()) if results.exists() else {}
    for part in asked:
        known[part] = parts[part]()
    results.write_text(json.dumps(known, indent=1) + "\n")
