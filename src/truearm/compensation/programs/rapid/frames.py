"""The tools and work objects of a RAPID program: which a move names, and where the program says they are."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Final

from truearm.compensation.programs.rapid.data import RefusedPoseError, frame_of, load_of, tool_of
from truearm.compensation.programs.rapid.listing import Datum, Instruction, Listing
from truearm.modeling.parts import Payload
from truearm.modeling.transform import Transform

_IDENTIFIER: Final = re.compile(r"[^\W\d]\w*+")

Use = tuple[str, str]
Reader = Callable[[str, int, int], tuple[Transform | None, str | None]]


class _Kind:
    """Tools, or work objects."""

    def __init__(self, listing: Listing, type: str, plain: str, predefined: str, reader: Reader) -> None:
        self.listing, self.type, self.plain, self.predefined, self.reader = listing, type, plain, predefined, reader
        self.declared: dict[str, list[Datum]] = {}
        for datum in listing.data:
            if datum.type == type:
                self.declared.setdefault(datum.name.lower(), []).append(datum)
        self.spelling: dict[str, str] = {}

    def named(self, at: Instruction, text: str) -> tuple[str, str | None]:
        """Return the name that a move's word means, and why targets with it are left as they are."""
        if _IDENTIFIER.fullmatch(text) is None:
            return "", f"is used with a {self.plain} that is computed"
        datum = self.listing.find(text, at)
        folded = text.lower()
        if folded == self.predefined and (datum is None or (datum.type == self.type and not datum.parameter)):
            return "", None  # the module BASE of every controller declares it
        if datum is None:
            return self.spelling.setdefault(folded, text), None
        if datum.parameter:
            return "", f"is used with a {self.plain} that is a parameter of the routine: {text}"
        if datum.type != self.type:
            return "", f"is used with {text}, which is no {self.plain}"
        if len(self.declared[datum.name.lower()]) > 1:
            return "", f"is used with the {self.plain} {text}, which is declared more than once"
        try:
            _, against = self._read(datum)
        except RefusedPoseError as error:
            raise self.listing.refusal(datum.source, datum.place, error.what, error.came, error.allowed) from None
        return datum.name, against and f"is used with the {self.plain} {text}, which {against}"

    def _read(self, datum: Datum) -> tuple[Transform | None, str | None]:
        return self.reader(self.listing.codes[datum.source], datum.start, datum.stop)

    def unchanged(self) -> Iterator[Datum]:
        """Go through those that the program defines once and does not change."""
        return (data[0] for data in self.declared.values() if len(data) == 1 and not data[0].written)

    def defined(self) -> dict[str, Transform]:
        """Return those that the program defines and does not change, by name."""
        found: dict[str, Transform] = {}
        for datum in self.unchanged():
            try:
                transform, _ = self._read(datum)
            except RefusedPoseError:  # of one that no move uses: those that are used are refused before
                continue
            if transform is not None:
                found[datum.name] = transform
        return found


class Frames:
    """The tools and work objects of a program."""

    def __init__(self, listing: Listing) -> None:
        self._tools = _Kind(listing, "tooldata", "tool", "tool0", tool_of)
        self._frames = _Kind(listing, "wobjdata", "work object", "wobj0", frame_of)
        self._known: dict[tuple[str, str | None, int, int], tuple[Use, str | None]] = {}

    def use(self, at: Instruction, tool: str, frame: str | None) -> tuple[Use, str | None]:
        """Return the tool and work object that a move's words for them mean, and why its targets are left as they are.

        Args:
            frame: None for a move without one.
        """
        key = (tool, frame, id(at.routine), id(at.module))
        known = self._known.get(key)
        if known is None:
            named, against = self._tools.named(at, tool)
            framed, against_frame = ("", None) if frame is None else self._frames.named(at, frame)
            known = self._known[key] = ((named, framed), against or against_frame)
        return known

    def defined(self) -> tuple[dict[str, Transform], dict[str, Transform]]:
        """Return the tools and the frames that the program defines, by name."""
        return self._tools.defined(), self._frames.defined()

    def loads(self) -> dict[str, Payload]:
        """Return what the robot carries with each tool, by name, where the program says it."""
        codes = self._tools.listing.codes
        found = {datum.name: load_of(codes[datum.source], datum.start, datum.stop) for datum in self._tools.unchanged()}
        return {name: load for name, load in found.items() if load is not None}
