"""What a drive is asked for."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from zfcal.drive.pilot import Manner

VIRTUAL = "virtual"
"""The port behind which a virtual robot is started."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveOptions:
    """What is asked of the driver.

    Parameters
    ----------
    port
        A serial port, or ``virtual``.
    manner
        How to drive.
    clock
        ``wall`` or ``poses``.
    duration_s
        Seconds of the trial after which to end; None for no end.
    verbose
        Whether to say what only bears on how quick it is.
    model
        The model file that drives throughout; None for the newest numbered one.
    """

    port: str
    manner: Manner = field(default_factory=Manner)
    clock: str = "wall"
    duration_s: float | None = None
    verbose: bool = False
    model: Path | None = None
