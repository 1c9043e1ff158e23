"""All that a fleet says: which robots to look at first, and figures that count each machine once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.fleets.simulated_series import campaign, rows

from truearm.engine.document.document import held_by, lines_of
from truearm.fleets.analysis import Analysis, analysed
from truearm.fleets.series import Accuracy, FoundParameters, Row
from truearm.fleets.words import analysis_blocks, analysis_notices

COUNT = len(campaign().own)


def analysis_lines(found: Analysis) -> list[str]:
    return lines_of(analysis_blocks(found))


def series(robots: int, seed: int = 1, error: float = 5e-5) -> list[Row]:
    rng = np.random.default_rng(seed)
    judged = []
    for row in rows(rng.standard_normal((robots, COUNT)), rng):
        mean = error * float(np.exp(0.1 * rng.standard_normal()))
        accuracy = Accuracy(mean, 1.1 * mean, 2.0 * mean, 20)
        judged.append(replace(row, held_out=accuracy, nominal=Accuracy(2e-3, 2.2e-3, 4e-3, 20)))
    return judged


def test_robots_are_looked_at_in_the_order_of_their_reasons() -> None:
    fleet = series(20)
    worse = Accuracy(4e-4, 5e-4, 9e-4, 20)
    fleet[2] = replace(fleet[2], held_out=worse)
    fleet[4] = replace(fleet[4], errors=("wrong-robot",))
    fleet[6] = replace(fleet[6], fit_status="rank-loss")
    fleet[8] = replace(fleet[8], held_out=Accuracy(3e-3, 3e-3, 3e-3, 20))
    fleet[9] = Row("robot-10", "failed", "there is no reading", robot="")
    zero = fleet[11].parameters["theta_offset_3"]
    fleet[11] = replace(
        fleet[11],
        parameters=FoundParameters.of(
            {**fleet[11].parameters, "theta_offset_3": replace(zero, value=zero.value + np.radians(2.0))}
        ),
    )
    found = analysed(fleet)
    why = {look.robot: [reason.why for reason in look.reasons] for look in found.looks}
    assert why == {
        "robot-10": ["failed"],
        "robot-5": ["error"],
        "robot-7": ["unsound"],
        "robot-9": ["not better", "inaccurate", "largest error"],
        "robot-3": ["inaccurate"],
        "robot-12": ["differs"],
    }
    assert list(why) == ["robot-10", "robot-5", "robot-7", "robot-9", "robot-3", "robot-12"]
    assert found.failed == (("robot-10", "there is no reading"),)
    text = "\n".join(analysis_lines(found))
    for words in (
        "not calibrated: there is no reading",
        "should not be used as it is (wrong-robot)",
        "the fit ended with rank-loss",
        "is more than before",
        "more than those of the others allow",
        "theta_offset_3 +",
        "Not calibrated: 1 of 20",
    ):
        assert words in text


def test_robots_that_are_all_alike_give_only_the_largest_error() -> None:
    alarms = sum(
        [reason.why for look in analysed(series(30, seed)).looks for reason in look.reasons] != ["largest error"]
        for seed in range(20)
    )
    assert alarms <= 5  # two questions of 5 % each


def test_a_machine_counts_once_with_its_last_measurement() -> None:
    first, second, other = series(3)
    first = replace(first, of="m", date="2026-05-01", held_out=Accuracy(1.0, 1.0, 1.0, 5))
    second = replace(second, of="m", date="2026-01-01", held_out=Accuracy(2.0, 2.0, 2.0, 5))
    found = analysed([first, second, other])
    assert (found.measurements, found.machines) == (3, 2)
    assert sorted(found.errors["held_out"].mean.tolist())[-1] == 1.0
    assert [found.kinds[0].kind.names[i] for i in found.kinds[0].kind.latest] == ["robot-1", "robot-3"]


def test_kinds_of_robots_are_compared_among_themselves() -> None:
    fleet = series(12) + [replace(row, name=f"{row.name}-b", robot="other") for row in series(4, 2)]
    found = analysed(fleet)
    assert [(kind.kind.robot, len(kind.kind.names)) for kind in found.kinds] == [("irb120", 12), ("other", 4)]
    assert any(
        line.startswith("other: Parameters of 4 robots compared with their priors") for line in analysis_lines(found)
    )


def test_notices_say_what_figures_do_not() -> None:
    rng = np.random.default_rng(5)
    truth = 0.2 * rng.standard_normal((6, COUNT))
    truth[2, campaign().names.index("theta_offset_3")] = 20.0
    drifted = truth.copy()
    drifted[:, campaign().names.index("a_3")] += 1.0
    fleet = []
    for i in range(6):
        fleet += rows(truth[i : i + 1], rng, names=[f"r{i}"], of=f"m{i}", date="2026-01-01")
        fleet += rows(drifted[i : i + 1], rng, names=[f"r{i}-again"], of=f"m{i}", date="2026-07-01")
    fleet += rows(truth[:1], rng, names=["x"], of="u") + rows(truth[:1], rng, names=["y"], of="u")
    notices = {notice.code: notice for notice in analysis_notices(analysed(fleet))}
    assert {code: notice.level for code, notice in notices.items()} == {
        "robots-differ": "warning",
        "robots-drift": "warning",
        "drift-alike": "warning",
        "drift-undated": "note",
    }
    assert "r2-again" in notices["robots-differ"].message
    assert "6 machines" in notices["robots-drift"].message
    assert "a_3" in notices["drift-alike"].message
    assert "Correct the dates" in notices["drift-undated"].message


def test_json_holds_figures_in_mm_and_deg() -> None:
    said = held_by(analysis_blocks(analysed(series(12))))
    (kind,) = said["kinds"]
    told = {row["name"]: row for row in kind["parameters"]}
    assert told["a_3"]["unit"] == "mm"
    assert told["a_3"]["prior"] == pytest.approx(1.0)
    assert 0.3 < told["a_3"]["spread"] < 3.0
    assert told["theta_offset_3"]["prior"] == pytest.approx(0.1)
    assert told["d_2"]["spread"] is None
    assert said["errors_mm"]["held_out"]["of_means"][0]["value"] == pytest.approx(0.05, rel=0.2)
    assert said["errors_mm"]["held_out"]["of_means"][3]["value"] is None


def test_a_fleet_in_which_nothing_was_calibrated_says_so() -> None:
    found = analysed([Row("a", "failed", "no"), Row("b", "failed", "no")])
    assert not found.kinds
    assert not found.errors
    assert analysis_lines(found)[0].startswith("Not calibrated: 2 of 2; of such a series 15.8 to 100 %")


def test_a_series_beside_nominal_is_told() -> None:
    rng = np.random.default_rng(6)
    truth = 0.3 * rng.standard_normal((20, COUNT))
    truth[:, campaign().names.index("d_4")] += 2.0
    (line,) = [each for each in analysis_lines(analysed(rows(truth, rng))) if "beside nominal" in each]
    assert line.startswith("  The whole series lies beside nominal: d_4 +")


def test_results_that_end_with_an_error_are_in_no_figure() -> None:
    fleet = series(12)
    whole = analysed([row for number, row in enumerate(fleet) if number != 4])
    wrong = {name: replace(one, value=one.value + 50.0 * one.prior) for name, one in fleet[4].parameters.items()}
    fleet[4] = replace(
        fleet[4],
        errors=("wrong-units",),
        parameters=FoundParameters.of(wrong),
        held_out=Accuracy(1.0, 1.0, 2.0, 20),
        nominal=Accuracy(2.0, 2.0, 3.0, 20),
    )
    found = analysed(fleet)
    assert (found.left_out, found.measurements, whole.left_out) == (("robot-5",), 12, ())
    for name, errors in whole.errors.items():
        assert found.errors[name].mean.tolist() == errors.mean.tolist()
    assert found.kinds[0].spreads == whole.kinds[0].spreads
    assert found.kinds[0].differences == whole.kinds[0].differences
    assert [(look.robot, [reason.why for reason in look.reasons]) for look in found.looks[:1]] == [
        ("robot-5", ["error"])
    ]
    assert "Left out of all figures, because their results end with an error: 1 robot (robot-5)." in analysis_lines(
        found
    )
    assert held_by(analysis_blocks(found))["left_out"] == ["robot-5"]


def test_of_a_machine_the_last_campaign_without_an_error_counts() -> None:
    first, second = series(2)
    first = replace(first, of="m", date="2026-01-01")
    second = replace(second, of="m", date="2026-07-01", errors=("wrong-units",))
    assert first.held_out is not None
    assert analysed([first, second]).errors["held_out"].mean.tolist() == [first.held_out.mean]
