"""The pages of the window, in the order of the work."""

from __future__ import annotations

from typing import Final

from truearm.studio.page import Page
from truearm.studio.pages.cell import CellPage
from truearm.studio.pages.jog import JogPage

#: One tab each.
PAGES: Final[tuple[type[Page], ...]] = (CellPage, JogPage)
