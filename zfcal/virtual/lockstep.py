"""A driver that is handed each frame in turn: no waiting, no watchdog, the poses' clock."""

from __future__ import annotations

from pathlib import Path
from typing import final

from zfcal.drive.clock import PoseClock
from zfcal.drive.drive import DriveOptions, lineage_of
from zfcal.drive.driving import Crew, Driver
from zfcal.drive.log import DriveLog
from zfcal.drive.models import DriveModels
from zfcal.errors import InputError
from zfcal.robot.fishbot import FishBot
from zfcal.robot.port import SerialLine
from zfcal.stages.events import Tell
from zfcal.stages.trial_context import OpenTrial
from zfcal.tracks import FramePoses

_OPENING_S = 5.0


@final
class LockstepDriver:
    """Does at each frame what ``zfcal drive --clock poses`` does, and logs it likewise.

    Parameters
    ----------
    opened
        The trial, whose newest model drives.
    port
        The robot's serial port.
    tell
        Hears of models and faults.
    after_s
        So many seconds after its window has ended a model drives.

    Raises
    ------
    InputError
        The port cannot be opened.
    """

    def __init__(self, opened: OpenTrial, port: Path, tell: Tell, *, after_s: float) -> None:
        options = DriveOptions(port=str(port), clock="poses")
        line = SerialLine(str(port), is_lossless=True)
        if not line.wait(_OPENING_S):
            line.close()
            raise InputError(f"{port}: the port cannot be opened ({line.problem or 'no answer'}).")
        self._robot = FishBot(options.manner.letter, line)
        self._log = DriveLog(opened.trial, lineage_of(opened, options), tell)
        crew = Crew(
            robot=self._robot,
            clock=PoseClock(opened.trial.fps),
            models=DriveModels(opened, after_s=after_s),
            log=self._log,
            tell=tell,
        )
        self._driver = Driver(opened, options.manner, crew)
        self._driver.warm_up()

    @property
    def n_sent(self) -> int:
        """Events that went to the robot until now."""
        return self._robot.n_sent

    def take(self, poses: FramePoses) -> None:
        """Do all that is due at a frame."""
        self._driver.listen()
        self._driver.take([poses])
        self._driver.tick()
        self._log.flush()

    def close(self) -> None:
        """Stop the robot and close the log."""
        self._robot.close()
        self._log.close()
