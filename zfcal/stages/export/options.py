"""What an export is asked for."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportOptions:
    """What to export, and how.

    Parameters
    ----------
    formats
        Of `zfcal.writers.FORMATS` and `zfcal.writers.TABLES`.
    layout
        Whether to write a layout for Foxglove.
    folder
        Where the files go; None for ``export/FORMAT`` in the trial.
    m_per_px
        Metres per pixel of the files; None for that of the imported file, or 0.001.
    origin_px
        The pixel at which (0, 0) m lies; None for that of the imported file, or what puts the
        upper left corner of the tank into that of the image.
    """

    formats: tuple[str, ...] = ()
    layout: bool = False
    folder: Path | None = None
    m_per_px: float | None = None
    origin_px: tuple[float, float] | None = None

    @property
    def is_scaled(self) -> bool:
        """Whether a person asks for pixels."""
        return self.m_per_px is not None or self.origin_px is not None
