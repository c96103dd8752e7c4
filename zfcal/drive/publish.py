"""The calibrated parameters for a rig that drives its robot itself: ``zfcal drive --publish``."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from zfcal.drive.models import DriveModels
from zfcal.drive.pilot import InForce
from zfcal.errors import ZfcalError
from zfcal.robot.cats import Address, OlderRig
from zfcal.stages.events import Note, Progress, Result, Tell
from zfcal.stages.trial_context import OpenTrial, Task, at_work, open_trial

_LOOK_S = 0.05
_FOLDER_S = 0.2


class NotTakenError(ZfcalError):
    """The rig has not confirmed the last model when the time was over."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PublishOptions:
    """What is asked.

    Parameters
    ----------
    address
        ``cats2://host[:port]``.
    zones
        For each zone of the rig one of the trial's; empty for the trial's zones in their
        order.
    duration_s
        Seconds after which to end; None for no end.
    """

    address: str
    zones: tuple[str, ...] = ()
    duration_s: float | None = None


def publish(root: Path, options: PublishOptions, tell: Tell) -> None:
    """Send each model of a trial to a rig as it appears, the newest one first of all.

    Parameters
    ----------
    root
        The trial's directory.
    options
        What is asked.
    tell
        Hears of models, and of what the rig takes.

    Raises
    ------
    InputError
        There is no model, the address is none, or the package pyzmq is missing.
    NotTakenError
        At the end of ``duration_s`` the rig has not confirmed the newest model.
    """
    address = Address.parse(options.address)
    opened = open_trial(root)
    with at_work(root, "drive", Task()):
        models = DriveModels(opened)
        with _connected(address, options.zones or opened.arena.zone_names) as rig:
            sent = _Sending(opened, models, rig, tell)
            sent.take(models.first())
            try:
                sent.run(options.duration_s)
            finally:
                tell(Result(value={"published": sent.names, "not_taken": sorted(rig.missing)}))
            if rig.missing:
                raise NotTakenError(
                    f"{address}: {len(rig.missing)} settings of {sent.names[-1]} were not taken.",
                    hint="Does the older software run there, and does its settings file have "
                    "these zones?",
                )


@contextlib.contextmanager
def _connected(address: Address, zones: tuple[str, ...]) -> Iterator[OlderRig]:
    rig = OlderRig(address, zones)
    try:
        yield rig
    finally:
        rig.close()


class _Sending:
    """Looks for models and hands them on."""

    def __init__(self, opened: OpenTrial, models: DriveModels, rig: OlderRig, tell: Tell) -> None:
        self._opened, self._models, self._rig, self._tell = opened, models, rig, tell
        self.names: list[str] = []

    def take(self, model: InForce) -> None:
        self._rig.offer(model.parameters, time.monotonic())
        self.names.append(model.name)
        self._tell(Note(text=f"{model.name} is sent to {self._rig.address}."))
        if model.parameters.effects:
            names = ", ".join(model.parameters.effects)
            text = f"{model.name}: the rig has no such effects; {names} is not sent."
            self._tell(Note(text=text, warning=True))

    def run(self, duration_s: float | None) -> None:
        began_s = looked_s = time.monotonic()
        while True:
            now_s = time.monotonic()
            if now_s - looked_s >= _FOLDER_S:
                looked_s = now_s
                self._look()
            for text in self._rig.look(now_s):
                self._tell(Note(text=f"{self.names[-1]}: {text}", warning=bool(self._rig.missing)))
            if duration_s is not None:
                done = min(int(now_s - began_s), total := round(duration_s))
                self._tell(Progress(stage="publish", done=done, total=total))
                if now_s - began_s >= duration_s:
                    return
            time.sleep(_LOOK_S)

    def _look(self) -> None:
        found = self._models.look()
        if self._models.problem:
            text = f"{self._models.problem} The model before stays in force."
            self._tell(Note(text=text, warning=True))
        if found is not None:
            self.take(found)
