"""The pages of the window, in the order of the work."""

from __future__ import annotations

from typing import Final

from truearm.studio.pages.calibrate import CalibratePage
from truearm.studio.pages.cell import CellPage
from truearm.studio.pages.check import CheckPage
from truearm.studio.pages.jog import JogPage
from truearm.studio.pages.measure import MeasurePage
from truearm.studio.pages.performance import PerformancePage
from truearm.studio.pages.plan import PlanPage
from truearm.studio.pages.programs import ProgramsPage
from truearm.studio.pages.proof import ProofPage
from truearm.studio.window import Page

#: One tab each.
PAGES: Final[tuple[type[Page], ...]] = (
    CellPage,
    JogPage,
    PlanPage,
    MeasurePage,
    CheckPage,
    CalibratePage,
    ProofPage,
    ProgramsPage,
    PerformancePage,
)
