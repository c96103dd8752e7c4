"""What the loop of a watch knows of each stage that it runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from zfcal.online.arrivals import Signature
from zfcal.online.watch_events import StageStatus
from zfcal.online.watch_stages import NICENESS
from zfcal.online.worker import Job, Worker
from zfcal.stages import events as of


@dataclass(slots=True, kw_only=True)
class Running:
    """A stage as the loop knows it.

    Parameters
    ----------
    name, job, worker
        Which stage, what it does, and its process.
    asked_for, done_for
        What the trial looked like at its last order, and when it had nothing more to do.
    failures, retry_s, said
        Failures in a row, when it is tried again, and what it said.
    is_over
        Whether a tracker has come to the end.
    taken_s
        When it began with a window.
    left_out
        What its last order had to leave out.
    status
        For the status line.
    """

    name: str
    job: Job
    worker: Worker
    asked_for: Signature = frozenset()
    done_for: Signature | None = None
    failures: int = 0
    retry_s: float = 0.0
    said: str = ""
    is_over: bool = False
    taken_s: float = 0.0
    left_out: Mapping[str, of.LeftOut] = field(default_factory=dict)
    status: StageStatus = field(default_factory=StageStatus)


def begin(name: str, job: Job) -> Running:
    """Start the process of a stage."""
    return Running(name=name, job=job, worker=Worker(name, job, niceness=NICENESS[name]))
