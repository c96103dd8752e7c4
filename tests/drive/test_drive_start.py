"""How a driver starts: warm, ahead of others, and not by what was before it."""

import contextlib
import importlib.util
import os
import threading
import time
from pathlib import Path

import pytest

from zfcal.drive.clock import WallClock
from zfcal.drive.drive import NICENESS, DriveOptions, _hurry, lineage_of
from zfcal.drive.driving import Crew, Driver
from zfcal.drive.log import DriveLog
from zfcal.drive.models import DriveModels
from zfcal.drive.pilot import Manner, Pilot
from zfcal.robot.fishbot import FishBot
from zfcal.stages.events import say_nothing
from zfcal.stages.trial_context import open_trial

_spec = importlib.util.spec_from_file_location("driven", Path(__file__).with_name("driven.py"))
driven = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(driven)


class Ear:
    """A line at whose end somebody notes what is said."""

    is_open, is_guarded, n_opened = True, True, 1

    def __init__(self):
        self.heard = []

    def write(self, data):
        """Note it."""
        self.heard.append(data.hex())
        return True

    def read(self):
        """Hear nothing."""
        return b""

    def beat(self, until_s):
        """Hear until when the robot may move."""


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Return a trial, and frames of 8 s."""
    root = driven.make_trial(tmp_path_factory.mktemp("start") / "trial")
    return root, driven.frames_of(root, 8)


@pytest.fixture
def driver(recorded):
    """Return a live driver of that trial, warm; what it decides goes into its log's queue."""
    opened = open_trial(recorded[0])
    log = DriveLog(opened.trial, lineage_of(opened, DriveOptions(port="none")), say_nothing)
    robot, models = FishBot("F", Ear()), DriveModels(opened)
    crew = Crew(robot=robot, clock=WallClock(), models=models, log=log, tell=say_nothing)
    made = Driver(opened, Manner(), crew)
    made.warm_up()
    made.ear, made.log, made.clock = robot.line, log, crew.clock
    return made


def tick_for(driver, seconds, *, frames=()):
    """Let a driver tick, with frames that come meanwhile."""
    end_s = time.monotonic() + seconds
    while time.monotonic() < end_s:
        driver.take(list(frames), age_s=0.01)
        frames = ()
        driver.tick()
        time.sleep(0.003)


def test_ticks_begin_when_history_has_been_gone_through(driver, recorded):
    """Two seconds of frames, then what came meanwhile, then one: no tick falls out."""
    _, frames = recorded
    for part in (frames[:30], frames[30:38]):
        driver.take(part, age_s=0.01)
        time.sleep(0.15)
        driver.tick()
        assert driver.n_commands == 0
    tick_for(driver, 0.45, frames=frames[38:39])
    assert driver.n_commands in {4, 5}
    assert driver.clock.n_skipped == driver.n_missed == 0
    assert driver.n_targets == 13
    assert {heard[:10] for heard in driver.ear.heard} == {"040000000b"}


def test_history_alone_is_not_driven_by(driver, recorded):
    """Frames of a tracker that has stopped: ticks begin, and the robot stands."""
    driver.take(recorded[1][:30], age_s=3.0)
    tick_for(driver, 0.25)
    assert driver.n_commands >= 2
    assert set(driver.ear.heard) == {"000000000100"}


def test_poses_that_come_in_lots_are_driven_by(driver, recorded):
    """Ten frames at a time are three steps; after five lots ticks begin none the less."""
    _, frames = recorded
    for k in range(4):
        driver.take(frames[10 * k : 10 * k + 10], age_s=0.01)
    assert driver.clock.now_s() == 0.0
    tick_for(driver, 0.25, frames=frames[40:50])
    assert driver.n_commands >= 2
    assert driver.clock.now_s() == pytest.approx(frames[49].time_s + 0.25, abs=0.2)


def test_warming_up_leaves_no_trace(recorded):
    """A pilot that was warmed up decides what one that was not does."""
    opened = open_trial(recorded[0])
    model = DriveModels(opened).first()
    pilots = [Pilot(opened, Manner(), FishBot("F", Ear())) for _ in range(2)]
    pilots[0].warm_up(model)
    for poses in recorded[1][:15]:
        warm, cold = (pilot.see(poses, model) for pilot in pilots)
        assert warm == cold
        assert pilots[0].tick(poses.time_s) == pilots[1].tick(poses.time_s)


def test_every_thread_goes_ahead_of_others(granted):
    """One that was there before as well: who has the interpreter and no processor stops all.

    Who lacks the right is told, and drives on.
    """
    wanted = granted(NICENESS)
    ends = threading.Event()
    other = threading.Thread(target=ends.wait)
    other.start()
    threads = [threading.get_native_id(), other.native_id]
    try:
        before = [os.getpriority(os.PRIO_PROCESS, thread) for thread in threads]
        with contextlib.ExitStack() as stack:
            told = []
            _hurry(DriveOptions(port="none", verbose=True), told.append, stack)
            assert len(told) == (wanted != NICENESS)
            asked = [os.getpriority(os.PRIO_PROCESS, thread) for thread in threads]
            assert asked == [wanted, wanted]
        assert [os.getpriority(os.PRIO_PROCESS, thread) for thread in threads] == before
    finally:
        ends.set()
        other.join()
