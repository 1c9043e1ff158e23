"""Tables that stand beside the document's 2.5 to 2.11, figure by figure."""

from __future__ import annotations

from collections.abc import Sequence

from papers.irb120_devices.identified import UNITS, printed
from papers.irb120_devices.nests import TABLE_2_5
from papers.irb120_devices.run import Outcome
from papers.irb120_devices.setups import SETUPS
from papers.study import Row, Table

_TABLES = ("2.6 and 2.7", "2.8 and 2.9", "2.10 and 2.11")


def parameters_tables(outcomes: Sequence[Outcome]) -> tuple[Table, ...]:
    """Return what every set-up identified, parameter by parameter, beside what the document did."""
    return tuple(
        Table(
            f"Parameters that the {setup.name} identified (Tables {tables})",
            "Deviations from nominal. The twin has the printed ones and gears that run out, so where they come back"
            " that is by construction; where they differ, run-out is taken for something else. Compliances first: a"
            " sine in phase with gravity looks like compliance. theta_offset_6 and d_6 are held at nominal, because the"
            " nests on the tool are found; z holds d_1, and d_2 stands for d_2 and d_3.",
            tuple(
                Row(
                    name,
                    UNITS[name],
                    [one.setups[setup.name].identified[name] for one in outcomes],
                    figure,
                    f"Tables {tables}",
                    claim="construction",
                )
                for name, figure in printed(setup.truth).items()
            ),
        )
        for setup, tables in zip(SETUPS, _TABLES, strict=True)
    )


def nests_table(outcomes: Sequence[Outcome]) -> Table:
    """Return distance errors of nests against a measuring machine."""
    return Table(
        "Tracker and cameras against a coordinate measuring machine (Table 2.5)",
        "Distance of each nest from where the machine has it, in the frame of three nests on the granite. Ours have the"
        " noise of our instruments and nothing else: 0.010 mm a coordinate for the tracker, 0.025 mm (plate) and"
        " 0.030 mm (sphere) for the cameras. One reading of four nests is four draws, so most of these are undecided;"
        " the document's cameras err by more than noise of that size makes, by volume, as it says itself.",
        tuple(
            Row(
                f"{artefact} artefact, {instrument}, nest {nest + 1}",
                "mm",
                [1e3 * float(one.nests[artefact, instrument][nest]) for one in outcomes],
                figure,
                "Table 2.5",
            )
            for (artefact, instrument), figures in TABLE_2_5.items()
            for nest, figure in enumerate(figures)
        ),
    )
