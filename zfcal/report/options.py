"""What a report shows, and in which form its figures are."""

from __future__ import annotations

from dataclasses import dataclass

from zfcal.artifacts.lineage import JSON


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportOptions:
    """How a report is made.

    Parameters
    ----------
    published
        Whether the published scores, which are of other fish, stand beside the trials' own.
    """

    published: bool = False

    def as_lineage(self) -> dict[str, JSON]:
        """Return what differs from the usual, as a report's lineage holds it."""
        return {"published": True} if self.published else {}


AS_USUAL = ReportOptions()
