"""Two hundred faults of real processes: `zfcal drive` at a virtual robot's terminal.

A long-lived drive takes many of them. For each it is measured when the robot heard STOP, by its own
clock, from the last pose that it could be driven by.
"""

import collections
import contextlib
import importlib.util
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from zfcal.artifacts.validation import check
from zfcal.drive.models import DriveModels
from zfcal.drive.pilot import Manner, Pilot
from zfcal.robot.fishbot import FishBot
from zfcal.robot.virtual_process import VirtualProcess
from zfcal.stages.trial_context import open_trial

_spec = importlib.util.spec_from_file_location("driven", Path(__file__).with_name("driven.py"))
driven = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(driven)

STOP, GO = "000000000100", "040000000b"
STANDS = "040000000b0000000000"
SECONDS = 900
LIMIT_S = 0.5 + 0.1
SLACK_S = 0.15
"""Of the bound. The helper, the robot and its terminal are processes among others on a machine
of two cores that tests share: a processor may be late by some 10 ms each, and seldom by more."""

FAULTS = {
    "driver SIGSTOP": 45,
    "driver SIGTSTP": 20,
    "driver SIGKILL": 20,
    "driver SIGSTOP, poses end": 15,
    "helper SIGKILL": 30,
    "helper SIGSTOP": 15,
    "poses end": 20,
    "robot not seen": 10,
    "robot outside": 10,
    "robot unsure": 5,
    "port lost": 10,
}
WRONG = {"robot outside": {"x_m": 5.6}, "robot unsure": {"confidence": 0.0}}


class Drive:
    """A drive, its robot and its poses; faults are done to it."""

    def __init__(self, root):
        self.root = root
        self.robot = VirtualProcess(["--noise", "0", "--lag-s", "0"])
        self.poses = driven.LivePoses(root, driven.frames_of(root, SECONDS))
        self.frames = []
        self.told = root.parent / "told.jsonl"
        # What the robot's clock shows when ours shows 0.
        began_s = time.monotonic()
        self.zero_s = self.robot.control.ask("pose")["time_s"] - (began_s + time.monotonic()) / 2
        self.start()

    def start(self):
        """Start a driver, in a group of its own: Ctrl-Z is for groups that a shell knows."""
        words = ["drive", str(self.root), "--port", str(self.robot.port), "--events", "-q"]
        with self.told.open("a") as told:
            self.driver = subprocess.Popen(
                [sys.executable, "-m", "zfcal_cli.main", *words], stdout=told, process_group=0
            )

    @property
    def helper(self):
        """The number of the helper's process."""
        return self.until(self._find_helper)

    def _find_helper(self):
        for entry in Path("/proc").glob("[0-9]*"):
            with contextlib.suppress(OSError):
                parent = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
                is_ours = parent == self.driver.pid
                if is_ours and b"stop_guard" in (entry / "cmdline").read_bytes():
                    return int(entry.name)
        return None

    def heard(self):
        """Return all that the robot has heard, at times of our clock."""
        found = self.robot.control.ask("heard")["heard"]
        self.frames += [(time_s - self.zero_s, frame) for time_s, frame in found]
        return self.frames

    def moved_s(self):
        """Return when the robot last heard wheel speeds."""
        moves = (t for t, frame in reversed(self.heard()) if is_motion(frame))
        return next(moves, 0.0)

    def until(self, holds, patience_s=30.0):
        """Wait until something holds."""
        end_s = time.monotonic() + patience_s
        while not (found := holds()):
            assert time.monotonic() < end_s, "it never came to that"
            time.sleep(0.01)
        return found

    def drives(self, since_s):
        """Wait until the robot is driven, since then."""
        self.until(lambda: self.moved_s() > since_s)

    def stands(self, since_s):
        """Wait until the robot has heard STOP as the last but stops; return when it first did."""
        self.until(lambda: self.stopped_s(since_s), 5.0)
        # That may have been on its way before. Who is late beyond the bound is heard by now.
        time.sleep(max(0.0, since_s + LIMIT_S + 2 * SLACK_S - time.monotonic()))
        frames = self.heard()
        last = max((k for k, (_, f) in enumerate(frames) if is_motion(f)), default=-1)
        assert len(frames) > last + 1
        return next(t for t, f in frames[last + 1 :] if f == STOP)

    def stopped_s(self, since_s):
        """Return when the robot first heard STOP, since then; None if it has not."""
        return next((t for t, f in self.heard() if t > since_s and f == STOP), None)

    def faults(self):
        """Return the faults that were told, and whether they began or ended."""
        told = map(json.loads, self.told.read_text().splitlines())
        return {(line["fault"], line["ended"]) for line in told if line["event"] == "fault"}

    def close(self):
        """End everything."""
        with contextlib.suppress(ProcessLookupError):
            self.driver.kill()
        self.driver.wait()
        for line in self.told.read_text().splitlines():
            check(json.loads(line), "drive-event", "a line")
        self.robot.control.close()
        self.robot.close()


def is_motion(frame):
    """Return whether a frame lets wheels turn."""
    return frame.startswith(GO) and frame != STANDS


@pytest.fixture
def drive(tmp_path):
    """Return a drive of a trial whose poses have begun."""
    root = driven.make_trial(tmp_path / "trial")
    Pilot(open_trial(root), Manner(), FishBot("F", None)).warm_up(
        DriveModels(open_trial(root)).first()
    )
    made = Drive(root)
    with made.poses:
        yield made
    made.close()


def do(drive, fault):
    """Do something to a drive that drives; return when the robot should and did stop, or None."""
    who, _, what = fault.partition(" ")
    began_s = time.monotonic()
    number = getattr(signal, what.split(",")[0], None)
    if fault == "port lost":
        drive.robot.control.ask("unplug")
        time.sleep(0.4)
        drive.robot.control.ask("plug")
        return None
    if fault.endswith("poses end"):
        drive.poses.freeze()
    if who == "helper":
        os.kill(drive.helper, number)
        # The driver is well: it stops the robot, and drives on when another helper is there.
        return began_s, drive.until(lambda: drive.stopped_s(began_s), 5.0)
    if fault == "driver SIGKILL":
        drive.driver.kill()
        drive.driver.wait()
        stopped_s = drive.stands(began_s)
        drive.start()
        return began_s, stopped_s
    if number is not None:
        drive.driver.send_signal(number)
        stopped_s = drive.stands(began_s)
        drive.driver.send_signal(signal.SIGCONT)
        resumed_s = time.monotonic()
        if fault.endswith("poses end"):
            time.sleep(0.3)
            # Nothing fresh has come: whoever goes on drives nobody, not for longer than a tick.
            late = [t for t, f in drive.heard() if is_motion(f) and t > resumed_s + 0.1 + SLACK_S]
            assert not late
        return min(began_s, drive.poses.fresh_s), stopped_s
    if fault == "robot not seen":
        drive.poses.without = {4}
    elif fault in WRONG:
        drive.poses.changes = WRONG[fault]
    time.sleep(0.1)
    return drive.poses.fresh_s, drive.stands(began_s)


def mend(drive):
    """Let poses come again, and the driver go on."""
    drive.poses.thaw()
    drive.poses.without, drive.poses.changes = set(), {}
    drive.drives(time.monotonic())


def suffer(drive, faults):
    """Do faults, one after the other; return for each kind how long STOP took."""
    took = collections.defaultdict(list)
    drive.drives(time.monotonic())
    for number, fault in enumerate(faults):
        print(f"{time.monotonic():.3f}: {number} {fault}")  # noqa: T201 - shown where it fails
        found = do(drive, fault)
        if found is not None:
            took[fault].append(found[1] - found[0])
        mend(drive)
    return took


def report(took, capsys):
    """Say how long STOP took."""
    with capsys.disabled():
        print("\nfrom the last pose, or the kill, to STOP at the robot (ms)")  # noqa: T201
        for fault, values in took.items():
            low, middle, most = (1000 * np.quantile(values, q) for q in (0.0, 0.5, 1.0))
            print(f"{fault:28} {len(values):4} {low:6.0f} {middle:6.0f} {most:6.0f}")  # noqa: T201


@pytest.mark.slow
def test_the_robot_of_a_real_drive_stops(drive, capsys):
    """A few of the faults; those that follow an expiry stop no sooner than half a second."""
    faults = ["driver SIGTSTP", "helper SIGKILL", "driver SIGSTOP, poses end", "robot outside"]
    took = suffer(drive, faults)
    report(took, capsys)
    assert max(map(max, took.values())) < LIMIT_S + SLACK_S
    names = ("helper-lost", "implausible-pose")
    wanted = {(name, ended) for name in names for ended in (False, True)}
    drive.until(lambda: wanted <= drive.faults())


@pytest.mark.slow
def test_two_hundred_faults_of_real_processes(drive, capsys):
    """In an order that a seed gives; the robot is driven on after each."""
    faults = [fault for fault, count in FAULTS.items() for _ in range(count)]
    assert len(faults) == 200
    took = suffer(drive, np.random.default_rng(11).permutation(faults).tolist())
    report(took, capsys)
    assert sum(map(len, took.values())) == 190
    # Nothing expires when the helper hangs: the driver is well, and stops the robot of itself.
    assert max(took.pop("helper SIGSTOP")) < 1.0 + SLACK_S
    for fault, values in took.items():
        assert max(values) < LIMIT_S + SLACK_S, fault
    assert np.quantile(np.concatenate(list(took.values())), 0.95) < LIMIT_S
    for fault in ("helper SIGKILL", "driver SIGKILL"):
        assert max(took[fault]) < 0.1 + SLACK_S
