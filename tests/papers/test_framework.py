"""Rows are judged as stated, reports need nothing but themselves, and what cannot be used is refused."""

from __future__ import annotations

import ast
import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields, replace
from functools import partial
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from tests.papers.small import SETTINGS, small

import papers
import truearm
from papers import STUDIES, Entry, run_study
from papers.irb120 import REGION
from papers.seeds import Figures, Seed, gathered, over_seeds, seeds_done_by
from papers.study import Picture, Row, Study, Table, number
from papers.texts import Rows, told
from papers.verdicts import VERDICTS, Comparison
from truearm.engine.base.errors import InputError
from truearm.engine.base.workers import Given
from truearm.engine.document.drawing import axis, figure

HOSTILE = "</script><b>"


def of_three_rows() -> Study:
    rows = (
        Row("near", "mm", [0.95, 1.05, 1.0], "1.0", "Table 1"),
        Row("far", "mm", [1.3, 1.31, 1.32], "1.00", "Table 1", explanation=HOSTILE),
        Row("alone", "deg", [2.0, 4.0]),
    )
    drawn = figure([{"type": "scatter", "x": [0, 1], "y": [1, 2]}], 200, xaxis=axis("x"), yaxis=axis("y"))
    return Study(
        name="small",
        title=f"A study {HOSTILE}",
        source="nobody",
        answer="It is small.",
        seeds=3,
        tables=(Table("A table", "Words.", rows), Table("Another", "No figures printed.", rows[2:])),
        pictures=(Picture("line", "A line", "Words.", drawn),),
        notes=("A note.",),
        command=f"again {HOSTILE}",
    )


def test_a_row_has_the_verdict_of_its_figures() -> None:
    near, far, alone = of_three_rows().tables[0].rows
    assert (near.median, near.lowest, near.highest) == (1.0, 0.95, 1.05)
    assert [row.verdict for row in (near, far, alone)] == ["agrees", "differs", None]


def test_no_study_can_say_how_far_off_a_figure_may_be() -> None:
    assert [field.name for field in fields(Row)] == [
        "what",
        "unit",
        "ours",
        "published",
        "source",
        "claim",
        "explanation",
    ]
    assert [field.name for field in fields(Comparison)] == ["ours", "printed", "claim"]


def test_every_row_is_counted_and_the_counts_are_printed() -> None:
    study = of_three_rows()
    assert study.counts == dict.fromkeys(VERDICTS, 0) | {"agrees": 1, "differs": 1}
    assert study.lines()[-1] == (
        "Verdicts: agrees 1, same order 0, not worse 0, by construction 0, undecided 0, differs 1."
    )
    assert study.lines()[3] == "  agrees          near: 1, published 1.0 mm, within 0.1"


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (1e-14, "0"), (3.68e-10, "3.68e-10"), (0.05, "0.0500"), (-1.5, "-1.50"), (674.8, "675")],
)
def test_numbers_have_three_digits(value: float, text: str) -> None:
    assert number(value) == text


def test_a_study_is_written_whole(tmp_path: Path) -> None:
    files = of_three_rows().save(tmp_path / "new")
    assert [path.name for path in files] == ["report.html", "study.json"]
    content = json.loads(files[1].read_text())
    assert {*content} == {
        "truearm",
        "simulated",
        "simulated_parts",
        "name",
        "title",
        "source",
        "answer",
        "seeds",
        "counts",
        "tables",
        "pictures",
        "notes",
    }
    assert content["truearm"] == "truearm-study/2"
    assert content["tables"][0]["rows"][1] == {
        "what": "far",
        "unit": "mm",
        "ours": [1.3, 1.31, 1.32],
        "median": 1.31,
        "lowest": 1.3,
        "highest": 1.32,
        "published": 1.0,
        "printed": "1.00",
        "source": "Table 1",
        "claim": "equal",
        "tolerance": pytest.approx(0.02),
        "verdict": "differs",
        "explanation": HOSTILE,
    }


def test_the_report_is_one_page_that_trusts_no_text() -> None:
    page = of_three_rows().html()
    assert HOSTILE not in page
    assert "http-equiv" in page
    assert "<link" not in page
    assert '<div class="figure" id="line"' in page
    assert "<pre>again &lt;/script&gt;" in page
    assert "Beside published figures: agrees 1, differs 1; 3 seeds." in page


def test_a_report_without_a_command_shows_none() -> None:
    assert "<pre>" not in replace(of_three_rows(), command="").html()


def test_every_seed_has_its_own_numbers_and_says_what_it_does() -> None:
    said: list[str] = []

    def one(seed: Seed) -> float:
        seed.step("drawing")
        return float(seed.generator().standard_normal())

    outcomes = over_seeds(2, said.append, one, "robot")
    assert outcomes == tuple(float(np.random.default_rng(seed).standard_normal()) for seed in (0, 1))
    assert said == ["robot 1 of 2", "robot 1 of 2: drawing", "robot 2 of 2", "robot 2 of 2: drawing"]


def _drawn(scale: float, seed: Seed) -> float:
    seed.step("drawing")
    return scale * float(seed.generator().standard_normal())


def test_workers_do_the_seeds_with_the_same_outcomes() -> None:
    said: list[str] = []
    here = over_seeds(5, said.append, partial(_drawn, 2.0))
    with ThreadPoolExecutor(2) as pool, seeds_done_by(Given(pool)):
        there = over_seeds(5, said.append, partial(_drawn, 2.0), "robot")
    assert there == here
    assert said[-6:] == [f"robot {done} of 5 done" for done in range(6)]
    with pytest.raises(InputError) as caught:
        truearm.study("li-table", seeds=1, workers=2, executor=pool)
    assert caught.value.parameter == "workers, executor"


def test_what_studies_do_once_a_seed_can_go_to_another_process() -> None:
    seen = set[str]()
    for file in (Path(truearm.__file__).parents[2] / "papers").rglob("*.py"):
        tree = ast.parse(file.read_text())
        functions = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
        functions |= {alias.name for node in tree.body if isinstance(node, ast.ImportFrom) for alias in node.names}
        partials = {
            target.id: node.value
            for node in ast.walk(tree)
            if isinstance(node, ast.Assign)
            for target in node.targets
            if isinstance(target, ast.Name)
        }
        for call in ast.walk(tree):
            if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "over_seeds":
                one: ast.AST = call.args[2]
                one = partials.get(one.id, one) if isinstance(one, ast.Name) else one
                assert isinstance(one, ast.Call), file
                assert ast.unparse(one.func) == "partial", file
                assert ast.unparse(one.args[0]) in functions, file
                seen.add(file.parent.name)
    assert seen == {entry.module.rpartition(".")[2] for entry in STUDIES}


def test_figures_of_seeds_are_gathered_by_table_and_row() -> None:
    outcomes: list[tuple[Figures, str]] = [({"t": {"a": 1, "b": 2.0}}, "x"), ({"t": {"a": 3}, "u": {"c": 4.0}}, "y")]
    assert gathered(outcomes) == ({"t": {"a": [1.0, 3.0], "b": [2.0]}, "u": {"c": [4.0]}}, ("x", "y"))


def test_a_region_is_drawn_from_evenly() -> None:
    drawn = REGION.draw(4000, np.random.default_rng(0))
    low, high = REGION.limits
    assert drawn.shape == (4000, 6)
    assert drawn.min(axis=0) == pytest.approx(low, abs=0.01)
    assert drawn.max(axis=0) == pytest.approx(high, abs=0.01)
    assert drawn.mean(axis=0) == pytest.approx((low + high) / 2, abs=0.1)


@pytest.mark.parametrize("entry", STUDIES, ids=[entry.name for entry in STUDIES])
def test_every_study_is_a_folder_with_its_words(entry: Entry) -> None:
    module = import_module(entry.module)
    assert callable(module.study)
    assert Path(str(module.__file__)).with_name("study.yaml").is_file()


@pytest.mark.parametrize("name", [entry.name for entry in STUDIES if entry.name in SETTINGS])
def test_a_study_shows_all_that_its_file_tells(name: str) -> None:
    study = small(name)
    assert {row.verdict for row in study.rows} - {None}
    told = [study.answer, *study.notes, *(t.words for t in study.tables), *(row.explanation for row in study.rows)]
    assert not any("{" in text or "}" in text for text in told)
    page = study.html()
    assert all(f'id="{picture.name}"' in page for picture in study.pictures)


def test_studies_are_listed_by_name() -> None:
    names = [entry.name for entry in STUDIES]
    assert names == sorted(names)


def test_an_unknown_study_is_refused_with_the_nearest_names() -> None:
    with pytest.raises(InputError, match=r"there is no study of this name.*Did you mean irb120-simulation"):
        run_study("irb120-simulations")


def test_no_seed_is_refused() -> None:
    with pytest.raises(InputError, match=r"seeds: the number is out of range; got 0; allowed: 1 to") as refusal:
        truearm.study("li-table", seeds=0)
    assert refusal.value.parameter == "seeds"


def test_data_for_a_simulation_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="simulates its data"):
        run_study("li-table", data=tmp_path)


def test_missing_data_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(papers, "STUDIES", (Entry("li-table", "needs data", ("joints.txt", "target_1.txt")),))
    with pytest.raises(InputError, match=r"data: this study needs measured data.*joints\.txt"):
        run_study("li-table")
    (tmp_path / "joints.txt").write_text("0 0 0 0 0 0\n")
    with pytest.raises(InputError, match=r"target_1\.txt: a file of the measured data is missing"):
        run_study("li-table", data=tmp_path)


def test_a_file_that_speaks_of_a_row_that_is_not_there_is_refused(tmp_path: Path) -> None:
    (tmp_path / "study.yaml").write_text(
        "{title: t, source: s, answer: 'of {seeds}: {first[a]:.1f}', pictures: {}, notes: ['{n}'],"
        " tables: {first: {title: T, words: W, unit: mm, source: Table 1, printed: {a: 0.50, 'b, ': {c: 2}}}}}"
    )
    ours: Rows = {"a": [0.4, 0.5], "b, c [deg]": 2.0, "d": []}
    study = told(tmp_path / "it.py", 2, {"first": ours}, {}, {"n": 7})
    assert (study.answer, study.notes) == ("of 2: 0.5", ("7",))
    assert [(row.what, row.unit, row.published, row.source) for row in study.rows] == [
        ("a", "mm", "0.50", "Table 1"),
        ("b, c", "deg", "2", "Table 1"),
    ]
    with pytest.raises(KeyError, match="there is no row b, c"):
        told(tmp_path / "it.py", 2, {"first": {"a": 1.0}}, {}, {"n": 7})
