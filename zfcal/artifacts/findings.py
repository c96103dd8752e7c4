"""What a check of a trial finds, each thing by itself."""

from __future__ import annotations

from dataclasses import dataclass

OK, NOTE, WARNING, ERROR = "ok", "note", "warning", "error"


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One thing that a check found.

    Parameters
    ----------
    level
        ``ok``, ``note``, ``warning`` or ``error``.
    where
        The file, relative to the trial, or what else it is about.
    says
        What was found.
    hint
        What to do about it.
    """

    level: str
    where: str
    says: str
    hint: str = ""
