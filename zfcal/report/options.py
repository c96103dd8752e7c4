"""What a report shows, and in which form its figures are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from zfcal.artifacts.lineage import JSON

FORMATS = ("png", "svg", "pdf")
FILMS = ("mp4", "gif")
WIDTHS_MM: Mapping[str, float] = MappingProxyType({"single": 85.0, "double": 174.0})
"""Columns of a journal by their names, in millimetres."""

NARROWEST_MM, WIDEST_MM = 60.0, 400.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Printing:
    """In which form pictures become files.

    Parameters
    ----------
    formats
        Of `FORMATS`, at least one.
    width_mm
        Width on paper, in millimetres; None for the screen.
    """

    formats: tuple[str, ...] = ("png",)
    width_mm: float | None = None

    def as_lineage(self) -> dict[str, JSON]:
        """Return what differs from the usual, as what is made holds it."""
        said: dict[str, JSON] = {}
        if self.formats != ("png",):
            said["format"] = list(self.formats)
        if self.width_mm is not None:
            said["width_mm"] = self.width_mm
        return said


def printing_of(said: Mapping[str, Any]) -> Printing:
    """Return the form that `Printing.as_lineage` gave.

    >>> printing_of({"format": ["pdf"]})
    Printing(formats=('pdf',), width_mm=None)
    """
    return Printing(formats=tuple(said.get("format", ("png",))), width_mm=said.get("width_mm"))


FOR_THE_SCREEN = Printing()


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportOptions:
    """How a report is made.

    Parameters
    ----------
    published
        Whether the published scores, which are of other fish, stand beside the trials' own.
    printing
        In which form the figures are files.
    film
        Of `FILMS`; None for none.
    """

    published: bool = False
    printing: Printing = FOR_THE_SCREEN
    film: str | None = None

    def as_lineage(self) -> dict[str, JSON]:
        """Return what differs from the usual, as a report's lineage holds it."""
        said: dict[str, JSON] = {}
        if self.published:
            said["published"] = True
        said |= self.printing.as_lineage()
        if self.film is not None:
            said["film"] = self.film
        return said


AS_USUAL = ReportOptions()


def report_options_of(said: Mapping[str, Any]) -> ReportOptions:
    """Return the options that `ReportOptions.as_lineage` gave.

    >>> report_options_of({"published": True, "format": ["pdf"]}).printing.formats
    ('pdf',)
    """
    return ReportOptions(
        published=said.get("published", False),
        printing=printing_of(said),
        film=said.get("film"),
    )
