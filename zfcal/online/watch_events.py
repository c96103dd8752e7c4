"""What `zfcal watch` tells: what its stages tell, and what befalls the watch itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

from zfcal.stages import events as of

_EVENT = "zfcal.watch-event/1"


@dataclass(frozen=True, slots=True, kw_only=True)
class Takes:
    """A stage begins with a window.

    Parameters
    ----------
    end_s
        End of the window.
    budget_s
        What the round may take; None where generations are counted.
    """

    end_s: int
    budget_s: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Skipped:
    """A stage goes on without a window.

    Parameters
    ----------
    end_s, went_on_with_s
        End of the window, and of the one that is taken instead.
    because
        Why, in a sentence.
    path
        Where it is written down; None where an older model stays.
    """

    end_s: int
    went_on_with_s: int
    because: str
    path: Path | None


@dataclass(frozen=True, slots=True, kw_only=True)
class StageStatus:
    """What a stage is doing, for the status line.

    Parameters
    ----------
    last_s
        End of the last window that it made.
    now_s
        End of the window at work.
    done, total
        How far that is.
    """

    last_s: int | None = None
    now_s: int | None = None
    done: int = 0
    total: int = 0
    problem: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Status:
    """The state of a watch, for the status line.

    Parameters
    ----------
    stages
        By their names.
    score, ceiling
        S of the last model, and what a perfect one would reach.
    rule
        By which it was published.
    lag_s
        From the end of the last window's tracks to its model.
    n_skipped
        Windows that were passed over.
    is_gone
        Whether the trial's folder cannot be found.
    """

    stages: Mapping[str, StageStatus]
    score: float | None = None
    ceiling: float | None = None
    rule: str = ""
    lag_s: float | None = None
    n_skipped: int = 0
    is_gone: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Happened:
    """One line of the log.

    Parameters
    ----------
    at_s
        Seconds since the watch began.
    kind
        As in ``schemas/watch-event.schema.json``.
    stage
        Which stage tells it; None for the watch itself.
    values
        What else belongs to it, ready for JSON.
    event
        What the stage said.
    """

    at_s: float
    kind: str
    stage: str | None = None
    values: Mapping[str, Any] = field(default_factory=dict)
    event: of.Event | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return it for JSON."""
        head: dict[str, Any] = {"schema": _EVENT, "at_s": round(self.at_s, 3), "event": self.kind}
        return {**head, **({"stage": self.stage} if self.stage else {}), **self.values}


WatchTell: TypeAlias = Callable[[Happened | Status], None]


def told_by(stage: str, event: object, at_s: float) -> Happened | None:
    """Return what a stage's event is in the log; None for what is not logged."""
    kind, values = _line_of(event)
    if not kind:
        return None
    spoken = event if isinstance(event, of.Event) else None
    return Happened(at_s=at_s, kind=kind, stage=stage, values=values, event=spoken)


def _line_of(event: object) -> tuple[str, dict[str, Any]]:
    """Return an event's kind in a line of JSON, and its values; an empty kind for none."""
    match event:
        case Takes():
            return "takes", {"window_end_s": event.end_s, "budget_s": event.budget_s}
        case Skipped():
            return "skipped", {
                "window_end_s": event.end_s,
                "went_on_with_s": event.went_on_with_s,
                "because": event.because,
                "path": None if event.path is None else str(event.path),
            }
    return of.as_line(event)
