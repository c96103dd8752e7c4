"""What `zfcal drive` tells while it drives: its state, and lines for whoever reads JSON."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

from zfcal.stages.events import Event, Note, as_line

_EVENT = "zfcal.drive-event/1"


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveStatus:
    """The state of a driver, for the status line.

    Parameters
    ----------
    time_s
        Time of the last frame, in seconds of the trial; None before the first.
    total_s
        Seconds after which it is to end; None for no end.
    model
        Name of the model that drives.
    held
        Why the robot is held; empty if it is not.
    steps_missed
        Steps of the model that no command followed: no frame came in time, or the driver was late.
    pose_to_state_s, tick_to_byte_s
        95th percentiles of late, in seconds; None where there are none.
    """

    time_s: float | None
    total_s: float | None
    model: str
    held: str
    steps_missed: int
    pose_to_state_s: float | None = None
    tick_to_byte_s: float | None = None


DriveTell: TypeAlias = Callable[[Event | DriveStatus], None]


def line_of(event: Event, at_s: float) -> dict[str, Any] | None:
    """Return an event as a JSON line; None for what is not told in lines.

    Parameters
    ----------
    event
        What the driver told.
    at_s
        Seconds since the driver began, by a clock that nobody sets.
    """
    kind, values = as_line(event)
    if isinstance(event, Note) and event.kind:
        kind, values = event.kind, {**event.values, "text": event.text}
    return {"schema": _EVENT, "at_s": round(at_s, 3), "event": kind, **values} if kind else None
